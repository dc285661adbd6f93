"""Creating enclaves by name and applying whole policies: thin callers of ``keystore.steps.provisioning``."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import timedelta
from pathlib import Path

from keystore.disk.safe_files import resolve_root
from keystore.disk.view import keystore_at
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.policy import EnclavePolicy, Operation, Policy, Profile, Qualifier, Rule
from keystore.formats.validity import Validity, utc_now
from keystore.steps.comparison import WantedEnclave, asked_end, permissions_source, with_domains
from keystore.steps.enclave_state import PermissionsSource
from keystore.steps.options import ProvisionOptions, ProvisionReport
from keystore.steps.provisioning import bring_about, provision
from keystore.steps.sharing import given_up


def create_enclaves(
    keystore: Path | str,
    names: Iterable[str],
    *,
    allow_all: bool = False,
    options: ProvisionOptions | None = None,
) -> ProvisionReport:
    """Enclaves with a valid identity. New ones may do nothing, existing ones keep their permissions, unless
    ``allow_all`` asks for every topic, service and action. The keystore must exist.
    """
    root = resolve_root(keystore)
    chosen = with_domains(root, _as_long_as_asked(options or ProvisionOptions()))
    ordered = sorted({validate_enclave_name(name) for name in names})
    wanted = {
        name: WantedEnclave(_allow_all(name, chosen) if allow_all else keep, ends_by=asked_end(chosen))
        for name in ordered
    }
    return bring_about(root, wanted, chosen)


def create_enclave(
    keystore: Path | str, name: str, *, allow_all: bool = False, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """``create_enclaves`` for one."""
    return create_enclaves(keystore, [name], allow_all=allow_all, options=options)


def keep(_subject: str, _validity: Validity) -> None:
    """The permissions source of those who do not want to change permissions."""


def _allow_all(name: str, options: ProvisionOptions) -> PermissionsSource:
    """SROS2's default policy of create_enclave: everything on ``/*``, asked for by name here."""
    everything = tuple(Rule(operation, Qualifier.ALLOW, "/*") for operation in Operation)
    return permissions_source(EnclavePolicy(name, (Profile("/", "all", everything),)), options)


def apply_policy(
    keystore: Path | str, policy: Policy, *, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Exactly the policy's permissions for the policy's enclaves, created where missing, in a keystore that
    exists."""
    chosen = _as_long_as_asked(options or ProvisionOptions())
    return provision(keystore, policy.enclaves, options=chosen)


def _as_long_as_asked(options: ProvisionOptions) -> ProvisionOptions:
    """A life that is asked for is given to existing enclaves too: what ends an hour sooner or later is issued anew."""
    end = asked_end(options)
    within = options.renew_within if end is None else end - (options.now or utc_now()) - timedelta(hours=1)
    return options._replace(create=False, renew_within=max(options.renew_within, within))


def list_enclaves(keystore: Path | str) -> list[str]:
    """Names of all enclaves, sorted; the root is ``/``. Raises NotAKeystoreError."""
    view = keystore_at(keystore)
    return view.enclaves()


def drop_shares(
    keystore: Path | str, owner: str, *, options: ProvisionOptions | None = None
) -> ProvisionReport:
    """Take the shares of a launch out of every enclave; what no other launch asks for is taken away for good.

    Raises InvalidInputError when it has none, or while a launch runs on one of these enclaves.
    """
    root = keystore_at(keystore).root
    chosen = with_domains(root, (options or ProvisionOptions())._replace(create=False))
    wanted = {one.enclave: WantedEnclave(one.document, share=one) for one in given_up(root, owner)}
    return bring_about(root, wanted, chosen)
