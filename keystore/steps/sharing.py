"""The permissions of an enclave that several launches share: each replaces its own share, all get the union.

While another process runs on one of the shares nothing is taken from the enclave: a launch that asks for less than
before keeps what it had until it starts without anyone beside it. Then what it gave up ends for good, as any right
that is taken away.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from enclave_common.terminal import quoted
from keystore.disk import layout
from keystore.disk.safe_files import resolve_root
from keystore.disk.share_files import LaunchHold, enclaves_with_shares, is_running, read_shares
from keystore.disk.signed_documents import governance_domains
from keystore.disk.store import PRIVATE_MODE, Batch, Store
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import InvalidInputError
from keystore.formats.permissions import permissions_document
from keystore.formats.permissions_names import full_name
from keystore.formats.policy import EnclavePolicy, Profile, Qualifier
from keystore.formats.shares import Share, is_part_of, merged_profiles, shares_json, united, united_domains
from keystore.formats.validity import Validity


def _as_it_is(policy: EnclavePolicy) -> EnclavePolicy:
    return policy


@dataclass(frozen=True)
class EnclaveShare:
    """The share of ``owner`` in one enclave, with those of others as they stand when they are first read.

    ``mine`` None: the owner gives its share up.
    """

    root: Path
    enclave: str
    owner: str
    mine: Share | None
    hold: LaunchHold | None = None
    shortened: Callable[[EnclavePolicy], EnclavePolicy] = _as_it_is
    """What is signed in the place of all shares together: the same, or with compact permissions."""

    @property
    def policy(self) -> EnclavePolicy:
        """Return all shares together; raises InvalidInputError if they cannot be united."""
        return united(self.enclave, self.shares)

    def document(self, subject: str, validity: Validity) -> bytes:
        """Unite the permissions of all shares; raises InvalidInputError if they cannot be united."""
        domains = united_domains(self.shares) if self.shares else governance_domains(KeystoreView(self.root))
        return permissions_document(subject, self.shortened(self.policy), validity=validity, domains=domains)

    @cached_property
    def present(self) -> tuple[Share, ...]:
        return read_shares(self.root, self.enclave)

    @cached_property
    def shares(self) -> tuple[Share, ...]:
        """Return all shares as they are to be: ours replaced, or only extended while others run on the enclave."""
        others = tuple(share for share in self.present if share.owner != self.owner)
        if self.mine is None:
            return others
        before = _own(self.present, self.owner)
        # The same launch runs in other domains, too: a domain stays until its owner gives the share up.
        domains = self.mine.domains if before is None else united_domains((before, self.mine))
        mine = Share(self.owner, domains, merged_profiles(self.mine.profiles), self.mine.types)
        if before is not None and _loses(before, mine) and self._is_in_use(others):
            profiles = merged_profiles((*before.profiles, *mine.profiles))
            types = tuple(sorted({**dict(before.types), **dict(mine.types)}.items()))
            mine = Share(self.owner, domains, profiles, types)
        return tuple(sorted((*others, mine)))

    def _is_in_use(self, others: Iterable[Share]) -> bool:
        if self.hold is not None and (self.enclave in self.hold.enclaves or not self.hold.is_alone()):
            return True
        return any(is_running(self.root, share.owner) for share in others)

    def is_recorded(self) -> bool:
        """Return whether the keystore has exactly these shares; one without ``private/`` records none."""
        return self.present == self.shares or not (self.root / layout.PRIVATE).is_dir()

    def record(self, opened: Store, batch: Batch) -> None:
        """Write the shares before the document that follows from them."""
        opened.ensure_directory(layout.SHARES)
        if self.shares:
            batch.file(layout.shares(self.enclave), shares_json(self.shares), PRIVATE_MODE)
        else:
            opened.remove(layout.shares(self.enclave))

    def retained(self) -> tuple[str, ...]:
        """Return, for a person, what stays of our own share though it is not requested any more."""
        mine = _own(self.shares, self.owner)
        if mine is None or self.mine is None or is_part_of(mine.profiles, self.mine.profiles):
            return ()
        return tuple(sorted(_words(mine.profiles) - _words(self.mine.profiles)))


def _own(shares: Iterable[Share], owner: str) -> Share | None:
    return next((share for share in shares if share.owner == owner), None)


def _loses(before: Share, mine: Share) -> bool:
    return not is_part_of(before.profiles, mine.profiles)


def shares_in_use(shares: Iterable[EnclaveShare]) -> list[str]:
    """Return what could not be taken away of each share yet, one sentence an enclave."""
    retained = [(share.enclave, share.retained()) for share in shares]
    return [
        f"enclave {enclave} is in use by another running launch, or another run of this one: it keeps what this launch "
        f"no longer needs ({', '.join(rules[:3])}{' ...' if len(rules) > 3 else ''}) until it starts alone"
        for enclave, rules in retained
        if rules
    ]


def _words(profiles: Iterable[Profile]) -> set[str]:
    return {
        f"{operation.verb} {full_name(expression, profile)}"
        for profile in profiles
        for operation, qualifier, expression in profile.rules
        if qualifier is Qualifier.ALLOW
    }


class SharedEnclave(NamedTuple):
    """An enclave that several launches use. ``others``: launches that have shares of it too; ``added``: what their
    shares let it do beyond ours."""

    enclave: str
    others: tuple[str, ...]
    added: tuple[str, ...]


def shared_enclaves(
    keystore: Path | str, owner: str, policies: Iterable[EnclavePolicy]
) -> Iterator[SharedEnclave]:
    """Return which enclaves of a launch other launches use as well, and what that costs. Reads only."""
    root = resolve_root(keystore)
    for policy in policies:
        others = [share for share in read_shares(root, policy.path) if share.owner != owner]
        if others:
            added = set().union(*(_words(share.profiles) for share in others)) - _words(policy.profiles)
            if len({share.domains for share in others}) > 1:
                added.add(f"do all of it in each of the domains {united_domains(others)}")
            yield SharedEnclave(policy.path, tuple(share.owner for share in others), tuple(sorted(added)))


class LaunchShares(NamedTuple):
    """The shares of one launch. ``running``: a process of this launch holds the keystore now."""

    owner: str
    running: bool
    enclaves: tuple[str, ...]


def list_shares(keystore: Path | str) -> tuple[LaunchShares, ...]:
    """List every launch with shares, by owner; raises NotAKeystoreError."""
    view = keystore_at(keystore)
    found: dict[str, list[str]] = {}
    for enclave in enclaves_with_shares(view.root):
        for share in read_shares(view.root, enclave):
            found.setdefault(share.owner, []).append(enclave)
    return tuple(
        LaunchShares(owner, is_running(view.root, owner), tuple(enclaves))
        for owner, enclaves in sorted(found.items())
    )


def given_up(root: Path, owner: str) -> list[EnclaveShare]:
    """Return the shares of ``owner``, to be dropped; raises InvalidInputError for none, or while they are in use."""
    mine = [
        EnclaveShare(root, enclave, owner, None)
        for enclave in enclaves_with_shares(root)
        if _own(read_shares(root, enclave), owner)
    ]
    if not mine:
        raise InvalidInputError(
            f"no launch {quoted(owner)} has a share in {quoted(root)}\n"
            f"try: secure-keystore shares {shlex.quote(str(root))}"
        )
    refuse_running(root, (one.enclave for one in mine))
    return mine


def left_over(root: Path, owner: str, enclaves: Iterable[str]) -> dict[str, bool]:
    """Return the enclaves beyond ``enclaves`` in which ``owner`` has a share, and whether others use them too."""
    present = set(enclaves)
    shares = {name: read_shares(root, name) for name in enclaves_with_shares(root) if name not in present}
    return {name: len(found) > 1 for name, found in shares.items() if _own(found, owner)}


def refuse_running(root: Path, enclaves: Iterable[str]) -> None:
    """Raise InvalidInputError if a running launch has a share of one of them: it would lose what it is using."""
    for enclave in enclaves:
        for share in read_shares(root, enclave):
            if is_running(root, share.owner):
                raise InvalidInputError(
                    f"{quoted(share.owner)} is running and uses enclave {enclave}; stop it first"
                )
