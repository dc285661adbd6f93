"""The shares of an enclave's permissions: what each launch requests, and all of it together. Performs no I/O.

Launches may meet in an enclave (with the default scope all use ``/``). Each launch file, with its arguments, owns a
share."""

from __future__ import annotations

import json
from collections.abc import Iterable
from functools import lru_cache
from itertools import groupby
from typing import Any, NamedTuple

from enclave_common.terminal import quoted
from keystore.errors import DamagedKeystoreError, InvalidInputError
from keystore.formats.domains import Domains
from keystore.formats.permissions import TopicSets, dds_rules
from keystore.formats.permissions_patterns import Expressions
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule

_VERSION = 1


class Share(NamedTuple):
    """The request of ``owner`` for one enclave, with its domains. ``types``: as ``zenoh.types`` keeps them; only of
    enclaves that are on Zenoh."""

    owner: str
    domains: Domains
    profiles: tuple[Profile, ...]
    types: tuple[tuple[str, tuple[str, ...]], ...] = ()


def united(enclave: str, shares: Iterable[Share]) -> EnclavePolicy:
    """Unite all shares; raises InvalidInputError if a denial of one takes away what another allows."""
    found = tuple(shares)
    profiles = sorted({profile for share in found for profile in share.profiles})
    together = EnclavePolicy(enclave, merged_profiles(profiles))
    if any(rule.qualifier is Qualifier.DENY for profile in profiles for rule in profile.rules):
        _refuse_losses(enclave, found, together)
    return together


def merged_profiles(profiles: Iterable[Profile]) -> tuple[Profile, ...]:
    """Merge to one profile for each node, its rules in order and once."""
    ordered = sorted(profiles, key=lambda profile: (profile.ns, profile.node))
    return tuple(
        Profile(*name, tuple(sorted({rule for profile in group for rule in profile.rules})))
        for name, group in groupby(ordered, key=lambda profile: (profile.ns, profile.node))
    )


def is_part_of(profiles: Iterable[Profile], whole: Iterable[Profile]) -> bool:
    """Return whether every rule of ``profiles`` is among those of ``whole`` for the same node."""
    rules = {(profile.ns, profile.node): set(profile.rules) for profile in whole}
    return all(set(profile.rules) <= rules.get((profile.ns, profile.node), set()) for profile in profiles)


def united_domains(shares: Iterable[Share]) -> Domains:
    """Unite the domains of all shares: a document is for one set, so each share gets those of the others too."""
    return Domains(span for share in shares for span in share.domains.ranges)


def _refuse_losses(enclave: str, shares: tuple[Share, ...], together: EnclavePolicy) -> None:
    whole = dds_rules(together)
    for share in shares:
        alone = dds_rules(EnclavePolicy(enclave, share.profiles))
        pairs = zip(_directions(alone.allow), _directions(alone.deny), _directions(whole.allow), strict=True)
        for (own, denied, granted), refused in zip(pairs, _directions(whole.deny), strict=True):
            present, had = Expressions(granted), Expressions(own)
            lost = [topic for topic in own if not present.cover(topic)]
            lost += [topic for one in refused if one not in denied for topic in had.meeting(one)]
            if lost:
                others = ", ".join(quoted(other.owner) for other in shares if other is not share)
                raise InvalidInputError(
                    f"enclave {enclave} is shared by {quoted(share.owner)} and {others}, and what one of them "
                    f"denies the other needs ({lost[0]}): give them enclaves of their own"
                )


def _directions(topics: TopicSets) -> tuple[tuple[str, ...], tuple[str, ...]]:
    return topics.publish, topics.subscribe


def shares_json(shares: Iterable[Share]) -> bytes:
    """Write shares readable in a diff: one line for each rule."""
    content = {
        "version": _VERSION,
        "shares": [
            {
                "owner": share.owner,
                "domains": str(share.domains),
                "profiles": [
                    {"ns": ns, "node": node, "rules": [" ".join(rule) for rule in rules]}
                    for ns, node, rules in share.profiles
                ],
                **({"types": dict(share.types)} if share.types else {}),
            }
            for share in sorted(shares)
        ],
    }
    return json.dumps(content, indent=1).encode() + b"\n"


def parse_shares(text: bytes, place: str) -> tuple[Share, ...]:
    """Parse what ``shares_json`` writes; raises DamagedKeystoreError for anything else."""
    try:
        content: Any = json.loads(text)
        if content["version"] != _VERSION:
            raise DamagedKeystoreError(f"{place} was written by a newer version; update secure-keystore")
        return tuple(
            Share(
                str(share["owner"]),
                Domains.parse(share["domains"]),
                tuple(map(_profile, share["profiles"])),
                tuple((str(what), tuple(map(str, found))) for what, found in share.get("types", {}).items()),
            )
            for share in content["shares"]
        )
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise DamagedKeystoreError(
            f"{place} does not hold the shares of an enclave; restore it from a backup, or remove it: the next start "
            "of each launch records its own again"
        ) from None


def _profile(entry: dict[str, Any]) -> Profile:
    return Profile(str(entry["ns"]), str(entry["node"]), tuple(map(_rule, entry["rules"])))


@lru_cache(maxsize=4096)  # nodes have most of their rules in common
def _rule(text: str) -> Rule:
    operation, qualifier, expression = text.split(" ", 2)
    return Rule(Operation(operation), Qualifier(qualifier), expression)
