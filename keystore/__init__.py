"""SROS2 keystores: certificates, governance, permissions, and the policy they follow.

The public functions, loaded when first used so that a launch imports only what its path needs:
``provision`` and ``create_keystore`` write; ``status`` and ``verify`` look; the verbs of ``secure-keystore``
call the same functions.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from keystore.creation import CreateOptions as CreateOptions
    from keystore.creation import create_keystore as create_keystore
    from keystore.provisioning import ProvisionOptions as ProvisionOptions
    from keystore.provisioning import ProvisionReport as ProvisionReport
    from keystore.provisioning import provision as provision

_HOMES = {
    "CreateOptions": "creation",
    "create_keystore": "creation",
    "ProvisionOptions": "provisioning",
    "ProvisionReport": "provisioning",
    "provision": "provisioning",
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
