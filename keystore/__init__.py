"""SROS2 keystores: certificates, governance, permissions, and the policy they follow.

    verb/           the commands of secure-keystore
    steps/          create, provision, renew, roll over, remove, export
    verification/   what a reviewer would find
    disk/           which file lies where, safe reading, and store.py: the only writer
    signing/        CAs and their keys; certificates and signed documents
    formats/        names, policy, permissions, governance, certificates as values. Pure

Each room imports those below it, none above.
The public functions below are loaded when first used, so that a launch imports only what its path needs:
``provision`` of a keystore in which nothing changed imports neither ``cryptography`` nor lxml. The verbs of
``secure-keystore`` call the same functions.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from keystore.disk.share_files import LaunchHold as LaunchHold
    from keystore.errors import KeystoreError as KeystoreError
    from keystore.formats.hosts import Hosts as Hosts
    from keystore.formats.hosts import load_hosts as load_hosts
    from keystore.formats.subject import SubjectScheme as SubjectScheme
    from keystore.signing.ca_access import CaAccess as CaAccess
    from keystore.signing.ca_access import Secret as Secret
    from keystore.steps.bundle import PublicFiles as PublicFiles
    from keystore.steps.bundle import export as export
    from keystore.steps.creation import CreateOptions as CreateOptions
    from keystore.steps.creation import CreateReport as CreateReport
    from keystore.steps.creation import ImportedCa as ImportedCa
    from keystore.steps.creation import create_keystore as create_keystore
    from keystore.steps.enclaves import apply_policy as apply_policy
    from keystore.steps.enclaves import create_enclave as create_enclave
    from keystore.steps.enclaves import create_enclaves as create_enclaves
    from keystore.steps.enclaves import drop_shares as drop_shares
    from keystore.steps.enclaves import list_enclaves as list_enclaves
    from keystore.steps.expiry import Expiry as Expiry
    from keystore.steps.expiry import StatusReport as StatusReport
    from keystore.steps.expiry import expires_soon as expires_soon
    from keystore.steps.expiry import status as status
    from keystore.steps.fleet import FleetReport as FleetReport
    from keystore.steps.fleet import fleet_status as fleet_status
    from keystore.steps.governance_setting import GovernanceOptions as GovernanceOptions
    from keystore.steps.governance_setting import set_governance as set_governance
    from keystore.steps.host_bundles import BundleOptions as BundleOptions
    from keystore.steps.host_bundles import HostBundle as HostBundle
    from keystore.steps.host_bundles import export_hosts as export_hosts
    from keystore.steps.host_keys import RequestOptions as RequestOptions
    from keystore.steps.host_keys import request as request
    from keystore.steps.importing import ImportOptions as ImportOptions
    from keystore.steps.importing import ImportReport as ImportReport
    from keystore.steps.importing import import_bundle as import_bundle
    from keystore.steps.options import ProvisionOptions as ProvisionOptions
    from keystore.steps.provisioning import provision as provision
    from keystore.steps.removal import RemoveOptions as RemoveOptions
    from keystore.steps.removal import RemoveReport as RemoveReport
    from keystore.steps.removal import remove as remove
    from keystore.steps.renewal import RenewOptions as RenewOptions
    from keystore.steps.renewal import renew as renew
    from keystore.steps.report import EnclaveReport as EnclaveReport
    from keystore.steps.report import ProvisionReport as ProvisionReport
    from keystore.steps.request_signing import SigningOptions as SigningOptions
    from keystore.steps.request_signing import accept_certificates as accept_certificates
    from keystore.steps.request_signing import sign_requests as sign_requests
    from keystore.steps.rollover import Step as Step
    from keystore.steps.rollover import roll_over as roll_over
    from keystore.steps.sharing import LaunchShares as LaunchShares
    from keystore.steps.sharing import list_shares as list_shares
    from keystore.steps.tool_enclaves import ToolEnclave as ToolEnclave
    from keystore.steps.tool_enclaves import create_tool_enclave as create_tool_enclave
    from keystore.verification import Finding as Finding
    from keystore.verification import Requirements as Requirements
    from keystore.verification import Severity as Severity
    from keystore.verification import VerifyReport as VerifyReport
    from keystore.verification import verify as verify

_HOMES = {
    "CreateOptions": "steps.creation",
    "CreateReport": "steps.creation",
    "ImportedCa": "steps.creation",
    "create_keystore": "steps.creation",
    "apply_policy": "steps.enclaves",
    "create_enclave": "steps.enclaves",
    "create_enclaves": "steps.enclaves",
    "drop_shares": "steps.enclaves",
    "LaunchHold": "disk.share_files",
    "LaunchShares": "steps.sharing",
    "list_shares": "steps.sharing",
    "ToolEnclave": "steps.tool_enclaves",
    "create_tool_enclave": "steps.tool_enclaves",
    "list_enclaves": "steps.enclaves",
    "KeystoreError": "errors",
    "PublicFiles": "steps.bundle",
    "export": "steps.bundle",
    "GovernanceOptions": "steps.governance_setting",
    "set_governance": "steps.governance_setting",
    "EnclaveReport": "steps.report",
    "ProvisionOptions": "steps.options",
    "ProvisionReport": "steps.report",
    "provision": "steps.provisioning",
    "RenewOptions": "steps.renewal",
    "renew": "steps.renewal",
    "RemoveOptions": "steps.removal",
    "RemoveReport": "steps.removal",
    "remove": "steps.removal",
    "Step": "steps.rollover",
    "roll_over": "steps.rollover",
    "CaAccess": "signing.ca_access",
    "Secret": "signing.ca_access",
    "Expiry": "steps.expiry",
    "StatusReport": "steps.expiry",
    "expires_soon": "steps.expiry",
    "status": "steps.expiry",
    "SubjectScheme": "formats.subject",
    "BundleOptions": "steps.host_bundles",
    "HostBundle": "steps.host_bundles",
    "export_hosts": "steps.host_bundles",
    "ImportOptions": "steps.importing",
    "ImportReport": "steps.importing",
    "import_bundle": "steps.importing",
    "RequestOptions": "steps.host_keys",
    "request": "steps.host_keys",
    "SigningOptions": "steps.request_signing",
    "accept_certificates": "steps.request_signing",
    "sign_requests": "steps.request_signing",
    "FleetReport": "steps.fleet",
    "fleet_status": "steps.fleet",
    "Hosts": "formats.hosts",
    "load_hosts": "formats.hosts",
    "Finding": "verification",
    "Severity": "verification",
    "Requirements": "verification",
    "VerifyReport": "verification",
    "verify": "verification",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
