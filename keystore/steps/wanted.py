"""Work out what each enclave should have, from its policy and the options of provisioning."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from keystore.disk.signed_documents import governance_domains
from keystore.disk.view import KeystoreView
from keystore.formats.domains import Domains
from keystore.formats.permissions import permissions_document
from keystore.formats.policy import EnclavePolicy
from keystore.formats.shares import Share
from keystore.formats.validity import Validity, later, utc_now
from keystore.steps.enclave_state import PermissionsSource, Reissue
from keystore.steps.options import ProvisionOptions
from keystore.steps.sharing import EnclaveShare


class WantedEnclave(NamedTuple):
    """The permissions that one enclave should have, and the least that must be issued again of its identity."""

    permissions: PermissionsSource
    reissue: Reissue = Reissue.NOTHING
    share: EnclaveShare | None = None
    """Where ``permissions`` are those of several launches."""
    ends_by: datetime | None = None
    """The requested end of its certificate; one that expires later is issued again."""


def with_domains(root: Path, options: ProvisionOptions) -> ProvisionOptions:
    """Return the same options with the domains decided."""
    if options.domains is not None:
        return options
    view = KeystoreView(root)
    return options._replace(domains=governance_domains(view) if view.is_complete else Domains.single(0))


def domains_of(enclave: str, options: ProvisionOptions) -> Domains:
    """Return the domains that the permissions of one enclave are for."""
    return options.enclave_domains.get(enclave) or options.domains or Domains.single(0)


def permissions_source(policy: EnclavePolicy, options: ProvisionOptions) -> PermissionsSource:
    """Return what makes the document of exactly this policy."""
    domains = domains_of(policy.path, options)

    def document(subject: str, validity: Validity) -> bytes:
        return permissions_document(subject, policy, validity=validity, domains=domains, rmw=options.rmw)

    return document


def wanted_enclave(root: Path, policy: EnclavePolicy, options: ProvisionOptions) -> WantedEnclave:
    """Return the enclave with exactly this policy; of a launch, its share beside those of others."""
    ends_by = requested_end(options)
    if options.launch is None:
        return WantedEnclave(permissions_source(policy, options), ends_by=ends_by)
    owner, domains = options.launch.owner, domains_of(policy.path, options)
    mine = Share(owner, domains, policy.profiles, options.types.get(policy.path, ()))
    share = EnclaveShare(root, policy.path, owner, mine, options.rmw, options.launch)
    return WantedEnclave(share.document, share=share, ends_by=ends_by)


def requested_end(options: ProvisionOptions) -> datetime | None:
    """Return when new certificates are to expire, if the caller said so."""
    if options.valid_until is not None or options.lifetime is None:
        return options.valid_until
    return later(options.now or utc_now(), options.lifetime)
