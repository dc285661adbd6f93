"""Compare a keystore with what a launch requires, or one enclave with what a process requires. Writes nothing."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timedelta
from functools import partial
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from enclave_common.terminal import quoted
from keystore.disk import layout
from keystore.disk.crl_file import crl_problem, crl_validity
from keystore.disk.deployed import deployment_problem, refuse_changed_deployment
from keystore.disk.register_file import needs_register, read_register, refuse_foreign_authorities
from keystore.disk.safe_files import refuse_foreign_owner, resolve_root
from keystore.disk.signed_documents import governance_domains, governance_stands
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, KeystoreError, SigningUnavailableError
from keystore.formats.compact import (
    PATTERN,
    compact_nodes,
    compacted,
    compacted_like,
    expanded,
    is_overtaken,
    topics_of,
    written_out,
)
from keystore.formats.domains import Domains
from keystore.formats.permissions import Permissions, permissions_document
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.permissions_patterns import Expressions
from keystore.formats.policy import EnclavePolicy
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.shares import Share
from keystore.formats.subject import subject_name
from keystore.formats.validity import Validity, iso, later, utc_now
from keystore.signing import smime
from keystore.steps.enclave_state import (
    OTHER_PERMISSIONS,
    EnclaveState,
    PermissionsSource,
    Reissue,
    beyond_and_missing,
    inspect,
)
from keystore.steps.options import EnclaveReport, ProvisionOptions, ProvisionReport
from keystore.steps.sharing import EnclaveShare, shares_in_use


class WantedEnclave(NamedTuple):
    """The permissions that one enclave should have, and the least that must be issued again of its identity."""

    permissions: PermissionsSource
    reissue: Reissue = Reissue.NOTHING
    share: EnclaveShare | None = None
    """Set if ``permissions`` are those of several launches together."""
    ends_by: datetime | None = None
    """The requested end of its certificate; one that expires later is issued again."""


def with_domains(root: Path, options: ProvisionOptions) -> ProvisionOptions:
    """Return the same options with the domains decided."""
    if options.domains is not None:
        return options
    view = KeystoreView(root)
    return options._replace(domains=governance_domains(view) if view.is_complete else Domains.single(0))


def permissions_source(policy: EnclavePolicy, options: ProvisionOptions) -> PermissionsSource:
    """Return what makes the document of exactly this policy."""
    domains = options.domains_of(policy.path)
    return lambda subject, validity: permissions_document(subject, policy, validity=validity, domains=domains)


def wanted_enclave(root: Path, policy: EnclavePolicy, options: ProvisionOptions) -> WantedEnclave:
    """Return the enclave with exactly this policy; of a launch, its share beside those of others."""
    ends_by = options.requested_end()
    if options.launch is None:
        return WantedEnclave(permissions_source(policy, options), ends_by=ends_by)
    domains, types = options.domains_of(policy.path), options.types.get(policy.path, ())
    mine = Share(options.launch.owner, domains, policy.profiles, types)
    share = EnclaveShare(root, policy.path, mine.owner, mine, options.launch)
    return WantedEnclave(share.document, share=share, ends_by=ends_by)


def wanted_enclaves(
    root: Path, policies: Iterable[EnclavePolicy], options: ProvisionOptions
) -> dict[str, WantedEnclave]:
    """Return the enclaves with exactly these policies, and with compact permissions those that must change with them.

    Where the CA keys are, the keystore's settings decide. A host takes the form that was signed for it.
    """
    given = {policy.path: policy for policy in policies}
    wanted = {path: wanted_enclave(root, policy, options) for path, policy in given.items()}
    view = KeystoreView(root)
    if not view.is_complete:
        return wanted
    if view.key_file(Role.PERMISSIONS) is None:
        return _as_signed(view, wanted, given, options)
    if not _is_compact(view):
        return wanted
    whole = {path: _whole(one, given[path]) for path, one in wanted.items()}
    signed = {path: _signed_topics(view, path) for path in view.enclaves() if path not in wanted}
    named = (*map(written_out, signed.values()), *map(topics_of, whole.values()))
    known = Expressions(chain(*named))
    for path, policy in whole.items():
        wanted[path] = _shortened(wanted[path], policy, options, partial(compacted, known=known))
    for path in signed:
        if is_overtaken(signed[path], known):
            wanted[path] = WantedEnclave(_written_out(view, path, known))
    return wanted


def _as_signed(
    view: KeystoreView,
    wanted: Mapping[str, WantedEnclave],
    given: Mapping[str, EnclavePolicy],
    options: ProvisionOptions,
) -> dict[str, WantedEnclave]:
    found = dict(wanted)
    for path, one in wanted.items():
        present = _signed_topics(view, path) if _may_be_compact(view, path) else frozenset[str]()
        if compact_nodes(present):
            found[path] = _shortened(
                one, _whole(one, given[path]), options, partial(compacted_like, present=present)
            )
    return found


def _is_compact(view: KeystoreView) -> bool:
    with suppress(DamagedKeystoreError):  # whoever writes next restores the settings
        return view.settings.compact
    return False


def _whole(wanted: WantedEnclave, policy: EnclavePolicy) -> EnclavePolicy:
    return policy if wanted.share is None else wanted.share.policy


def _may_be_compact(view: KeystoreView, enclave: str) -> bool:
    """Return whether the text of signed permissions has such an expression; they are parsed only if it has."""
    return PATTERN.encode() in (view.enclave_file(enclave, layout.PERMISSIONS) or b"")


def _shortened(
    wanted: WantedEnclave,
    policy: EnclavePolicy,
    options: ProvisionOptions,
    shortened: Callable[[EnclavePolicy], EnclavePolicy],
) -> WantedEnclave:
    if wanted.share is not None:
        share = replace(wanted.share, shortened=shortened)
        return wanted._replace(permissions=share.document, share=share)
    return wanted._replace(permissions=permissions_source(shortened(policy), options))


def _signed_topics(view: KeystoreView, enclave: str) -> frozenset[str]:
    """Return the topics that signed permissions allow; none for what cannot be read, which is signed again."""
    with suppress(KeystoreError):
        allow = _signed(view, enclave).rules.allow
        return frozenset((*allow.publish, *allow.subscribe))
    return frozenset()


def _signed(view: KeystoreView, enclave: str) -> Permissions:
    place = layout.enclave_file(enclave, layout.PERMISSIONS)
    return parse_permissions(
        smime.read(view.enclave_file(enclave, layout.PERMISSIONS) or b"", place).document, place
    )


def _written_out(view: KeystoreView, enclave: str, known: Expressions) -> PermissionsSource:
    """Return what makes the document of an enclave again, without expressions that cover other known topics."""
    found = _signed(view, enclave)
    rules = expanded(found.rules, known)
    return lambda subject, validity: found._replace(
        subject=subject, validity=validity, rules=rules
    ).document()


def compare(
    root: Path, wanted: Mapping[str, WantedEnclave], options: ProvisionOptions, now: datetime
) -> ProvisionReport | None:
    """Return the report of a run in which nothing is to be done; None if something is. Raises NotAKeystoreError."""
    view = KeystoreView(root)
    if not view.is_complete:
        if not options.create:
            view.require_complete()
        view.refuse_foreign()
        return None
    if any(os.path.lexists(f"{root}/{name}") for name in (layout.INCOMING, layout.CRL_UNLINKED)):
        return None  # a run was interrupted: of changing a CA, or of giving the CRL to all
    if needs_register(view):
        return None
    if options.now is None:
        view.refuse_clock(now)
    register = read_register(root)
    refuse_foreign_authorities(view, register)
    refuse_changed_deployment(view, wanted)
    if not governance_stands(view, options.domains, register) or crl_problem(view, register, now):
        return None
    states = []
    for name, one in wanted.items():
        states.append(inspect_wanted(view, register, name, one, options, now))
        if not states[-1].is_good or (one.share is not None and not one.share.is_recorded()):
            return None
    ends = _first_end(view, (state.validity for state in states))
    more = [state.reasons[0] for state in states if state.reasons]
    more += shares_in_use(one.share for one in wanted.values() if one.share is not None)
    return ProvisionReport(root, (), tuple(as_found(state) for state in states), tuple(more), ends)


def _first_end(view: KeystoreView, enclaves: Iterable[Validity | None]) -> datetime:
    ends = [ca.validity.not_after for role in Role for ca in view.ca_bundle(role)]
    ends += [validity.not_after for validity in enclaves if validity is not None]
    if view.has_crl:
        ends.append(crl_validity(view).not_after)
    return min(ends)


def differences(
    keystore: Path | str, policy: EnclavePolicy, *, options: ProvisionOptions | None = None
) -> tuple[str, ...]:
    """Return why an enclave is not what ``provision`` with the same options left; empty if it is. Reads only.

    Raises ``KeystoreError`` for a keystore that cannot be read.
    """
    root = resolve_root(keystore)
    # What ends soon is renewed by a start, and good until then.
    chosen = with_domains(root, options or ProvisionOptions())._replace(renew_within=timedelta(0))
    view = KeystoreView(root)
    view.require_complete()
    now = chosen.now or utc_now()
    view.refuse_clock(now)
    refuse_foreign_owner(root, [policy.path])
    register = read_register(root)
    refuse_foreign_authorities(view, register)
    wanted = wanted_enclaves(root, [policy], chosen)[policy.path]
    state = inspect_wanted(view, register, policy.path, wanted, chosen, now)
    reasons = [] if state.is_good else [*state.reasons]
    if not governance_stands(view, chosen.domains, register):
        reasons.append("the governance is not what it was")
    if problem := crl_problem(view, register, now) or deployment_problem(view, [policy.path]):
        reasons.append(problem)
    return tuple(reasons)


def _with_shares_of_others(view: KeystoreView, state: EnclaveState, wanted: WantedEnclave) -> EnclaveState:
    """Take permissions that hold all of ours as a union: a bundle does not say whose share is whose."""
    beyond, missing = beyond_and_missing(view, state, wanted.permissions)
    if missing or not beyond:
        return state
    some = f"{', '.join(beyond[:4])}{' ...' if len(beyond) > 4 else ''}"
    said = f"enclave {state.enclave} may do more in this bundle than this launch needs ({some})"
    return state._replace(permissions=False, reasons=(said,))


def _outlives(state: EnclaveState, wanted: WantedEnclave) -> bool:
    """Return whether a good certificate lasts longer than requested, by an hour: seconds pass between two runs."""
    if wanted.ends_by is None or state.reissue is not Reissue.NOTHING or state.facts is None:
        return False
    return state.facts.validity.not_after > later(wanted.ends_by, timedelta(hours=1))


def as_found(state: EnclaveState) -> EnclaveReport:
    """Return the result of an enclave to which nothing was done."""
    return EnclaveReport(state.enclave, (), (), state.validity)


def inspect_wanted(
    view: KeystoreView,
    register: Register | None,
    enclave: str,
    wanted: WantedEnclave,
    options: ProvisionOptions,
    now: datetime,
) -> EnclaveState:
    """Compare the enclave with what is wanted; what is requested to be issued again counts as a difference."""
    # A certificate that ends with its CA cannot be renewed for longer.
    due = min(later(now, options.renew_within), *(view.ca(role).validity.not_after for role in Role))
    state = inspect(view, register, enclave, wanted.permissions, now, due)
    if _outlives(state, wanted):
        longer = (
            f"valid until {iso(state.facts.validity.not_after) if state.facts else ''}, longer than requested"
        )
        state = state._replace(
            reissue=Reissue.CERTIFICATE, permissions=True, reasons=(*state.reasons, longer)
        )
    if wanted.share is not None and register is None and state.reasons == (OTHER_PERMISSIONS,):
        state = _with_shares_of_others(view, state, wanted)
    if wanted.reissue is Reissue.NOTHING or state.reissue is Reissue.KEY_PAIR:
        return state
    return state._replace(reissue=wanted.reissue, permissions=True, reasons=(*state.reasons, "requested"))


def _other_domains(
    view: KeystoreView, state: EnclaveState, wanted: PermissionsSource
) -> tuple[Domains, Domains] | None:
    """Return the domains that are signed and those that are wanted, if the first lack some of the second."""
    if state.facts is None or state.facts.common_name is None:
        return None
    with suppress(KeystoreError):
        present = _signed(view, state.enclave).domains
        document = wanted(subject_name(state.facts.common_name), state.facts.validity)
        requested = parse_permissions(document).domains if document is not None else present
        return None if present.covers(requested) else (present, requested)
    return None


_SHOWN = 10


def refuse_without_keys(
    view: KeystoreView, states: list[EnclaveState], wanted: Mapping[str, PermissionsSource]
) -> None:
    """Raise SigningUnavailableError with every enclave that differs, and how, if the key it needs is not here."""
    lines = []
    for state in states:
        needs = {Role.IDENTITY: state.reissue is not Reissue.NOTHING, Role.PERMISSIONS: state.permissions}
        if any(needed and view.key_file(role) is None for role, needed in needs.items()):
            lines.append(f"{state.enclave}: {'; '.join(_reasons(view, state, wanted[state.enclave]))}")
    if not lines:
        return
    more = f"\n  and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
    listed = "".join(f"\n  {line}" for line in lines[:_SHOWN]) + more
    if view.key_file(Role.PERMISSIONS) is not None:
        place = shlex.quote(str(view.root))
        raise SigningUnavailableError(
            f"the identity CA of {quoted(view.root)} is not here, so no certificate can be issued, but these "
            f"enclaves need one:{listed}\nRequest them on their hosts: secure-keystore request HOST_KEYSTORE ENCLAVE "
            f"-o requests.pem; take what the CA issued: secure-keystore sign {place} requests.pem --issued issued.pem"
        )
    raise SigningUnavailableError(
        f"{quoted(view.root)} has no CA keys, so nothing can be signed here, but these enclaves differ from what "
        f"is needed:{listed}\nBring them up to date where the CA keys are (start or apply-policy there), "
        "then export again"
    )


def _reasons(view: KeystoreView, state: EnclaveState, wanted: PermissionsSource) -> Iterator[str]:
    for reason in state.reasons:
        yield reason
        if reason == OTHER_PERMISSIONS:
            yield from _permission_differences(view, state, wanted)


def _permission_differences(
    view: KeystoreView, state: EnclaveState, wanted: PermissionsSource
) -> Iterator[str]:
    if domains := _other_domains(view, state, wanted):
        present, requested = domains
        yield (
            f"it is for domain {present}, and domain {requested} is asked for: start it in its domain "
            f"(ROS_DOMAIN_ID={present.ranges[0][0]}), or start once in domain {requested} where the CA keys are"
        )
        return
    beyond, missing = beyond_and_missing(view, state, wanted)
    for words, found in (("lacks", missing), ("has beyond it", beyond)):
        if found:
            yield f"{words} {', '.join(found[:4])}{' ...' if len(found) > 4 else ''}"
