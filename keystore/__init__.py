"""SROS2 keystores: certificates, governance, permissions, and the policy they follow.

    policy.py ── permissions.py ─┐                            status, verify, export   look
    governance.py ───────────────┼─ smime ── provisioning ──> store                    writes, alone
    authority.py ── identity.py ─┘            ^ creation, renewal, rollover, revocation

The public functions below are loaded when first used, so that a launch imports only what its path needs:
``provision`` of a keystore in which nothing changed imports neither ``cryptography`` nor lxml, and where nothing was
touched since it last looked (``standing``) it opens none of the keystore's files. The verbs of
``secure-keystore`` call the same functions.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from keystore.bundle import PublicFiles as PublicFiles
    from keystore.bundle import export as export
    from keystore.ca_access import CaAccess as CaAccess
    from keystore.ca_access import Secret as Secret
    from keystore.creation import CreateOptions as CreateOptions
    from keystore.creation import CreateReport as CreateReport
    from keystore.creation import ImportedCa as ImportedCa
    from keystore.creation import create_keystore as create_keystore
    from keystore.enclaves import apply_policy as apply_policy
    from keystore.enclaves import create_enclave as create_enclave
    from keystore.enclaves import create_enclaves as create_enclaves
    from keystore.enclaves import list_enclaves as list_enclaves
    from keystore.errors import KeystoreError as KeystoreError
    from keystore.expiry import Expiry as Expiry
    from keystore.expiry import StatusReport as StatusReport
    from keystore.expiry import expires_soon as expires_soon
    from keystore.expiry import status as status
    from keystore.governance_setting import GovernanceOptions as GovernanceOptions
    from keystore.governance_setting import set_governance as set_governance
    from keystore.provisioning import EnclaveReport as EnclaveReport
    from keystore.provisioning import ProvisionOptions as ProvisionOptions
    from keystore.provisioning import ProvisionReport as ProvisionReport
    from keystore.provisioning import provision as provision
    from keystore.renewal import RenewOptions as RenewOptions
    from keystore.renewal import renew as renew
    from keystore.revocation import RemoveOptions as RemoveOptions
    from keystore.revocation import RemoveReport as RemoveReport
    from keystore.revocation import remove as remove
    from keystore.rollover import Step as Step
    from keystore.rollover import roll_over as roll_over
    from keystore.subject import SubjectScheme as SubjectScheme
    from keystore.verification import Finding as Finding
    from keystore.verification import Severity as Severity
    from keystore.verification import VerifyReport as VerifyReport
    from keystore.verification import verify as verify

_HOMES = {
    "CreateOptions": "creation",
    "CreateReport": "creation",
    "ImportedCa": "creation",
    "create_keystore": "creation",
    "apply_policy": "enclaves",
    "create_enclave": "enclaves",
    "create_enclaves": "enclaves",
    "list_enclaves": "enclaves",
    "KeystoreError": "errors",
    "PublicFiles": "bundle",
    "export": "bundle",
    "GovernanceOptions": "governance_setting",
    "set_governance": "governance_setting",
    "EnclaveReport": "provisioning",
    "ProvisionOptions": "provisioning",
    "ProvisionReport": "provisioning",
    "provision": "provisioning",
    "RenewOptions": "renewal",
    "renew": "renewal",
    "RemoveOptions": "revocation",
    "RemoveReport": "revocation",
    "remove": "revocation",
    "Step": "rollover",
    "roll_over": "rollover",
    "CaAccess": "ca_access",
    "Secret": "ca_access",
    "Expiry": "expiry",
    "StatusReport": "expiry",
    "expires_soon": "expiry",
    "status": "expiry",
    "SubjectScheme": "subject",
    "Finding": "verification",
    "Severity": "verification",
    "VerifyReport": "verification",
    "verify": "verification",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
