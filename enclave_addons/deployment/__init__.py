"""From a plan to what runs processes on robots: systemd units, Compose, Kubernetes, and signed bundles."""

from enclave_addons.deployment.fleet import FleetReport, fleet_status
from enclave_addons.deployment.host_bundles import BundleOptions, HostBundle, export_hosts, pinned
from enclave_addons.deployment.host_keys import RequestOptions, request
from enclave_addons.deployment.hosts import Hosts, load_hosts
from enclave_addons.deployment.importing import ImportOptions, ImportReport, import_bundle
from enclave_addons.deployment.public_files import PublicFiles, export
from enclave_addons.deployment.request_signing import accept_certificates, sign_requests

__all__ = [
    "BundleOptions",
    "FleetReport",
    "HostBundle",
    "Hosts",
    "ImportOptions",
    "ImportReport",
    "PublicFiles",
    "RequestOptions",
    "accept_certificates",
    "export",
    "export_hosts",
    "fleet_status",
    "import_bundle",
    "load_hosts",
    "pinned",
    "request",
    "sign_requests",
]
