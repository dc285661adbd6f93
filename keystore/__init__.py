"""SROS2 keystores: certificates, governance, permissions, and the policy they follow.

The public functions are loaded when first used: ``provision`` of a keystore in which nothing changed imports no XML
parser. The verbs of ``secure-keystore`` call the same functions.
"""

from __future__ import annotations

from enclave_common.lazy_names import lazy_names

_MODULES = {
    "keystore.disk.share_files": ("LaunchHold",),
    "keystore.errors": (
        "DamagedKeystoreError",
        "InvalidEnclaveNameError",
        "InvalidInputError",
        "KeystoreBusyError",
        "KeystoreError",
        "NotAKeystoreError",
        "SigningUnavailableError",
        "StorageError",
        "UnsafeKeystoreError",
    ),
    "keystore.formats.domains": ("Domains",),
    "keystore.formats.governance": ("DomainRule", "Governance", "Protection", "TopicRule"),
    "keystore.formats.policy": ("EnclavePolicy", "Operation", "Policy", "Profile", "Qualifier", "Rule"),
    "keystore.formats.policy_xml": ("read_policy",),
    "keystore.formats.role": ("Role",),
    "keystore.formats.subject": ("SubjectScheme",),
    "keystore.formats.validity": ("Validity",),
    "keystore.signing.ca_access": ("CaAccess", "Secret"),
    "keystore.steps.creation": ("CreateOptions", "CreateReport", "ImportedCa", "create_keystore"),
    "keystore.steps.expiry": ("Expiry", "StatusReport", "expires_soon", "status"),
    "keystore.steps.governance": ("set_governance",),
    "keystore.steps.opening": ("ChangeOptions",),
    "keystore.steps.options": ("EnclaveReport", "ProvisionOptions", "ProvisionReport"),
    "keystore.steps.provisioning": (
        "apply_policy",
        "create_enclave",
        "create_enclaves",
        "drop_shares",
        "list_enclaves",
        "provision",
    ),
    "keystore.steps.removal": ("RemoveOptions", "RemoveReport", "remove"),
    "keystore.steps.renewal": ("RenewOptions", "renew"),
    "keystore.steps.rollover": ("Step", "roll_over"),
    "keystore.steps.sharing": ("LaunchShares", "list_shares"),
    "keystore.steps.tool_enclaves": ("ToolEnclave", "create_tool_enclave"),
    "keystore.verification": ("Finding", "Requirements", "Severity", "VerifyReport", "verify"),
}
"""The public names of each module. ``__init__.pyi`` says the same to type checkers; a test compares the two."""
__all__, __getattr__, __dir__ = lazy_names(__name__, _MODULES)
