"""The types of what an enclave talks about, as far as its launches know them. Performs no I/O.

DDS permissions name no types; a key expression can. A name is bound to its types only where everybody who asks for it
knows them: whoever does not may be right with another one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from enclave_addons.zenoh.grants import PLAIN_USES, Types, Use, grants_of_policy
from enclave_addons.zenoh.key_expressions import type_chunk
from keystore.formats.permissions_patterns import has_wildcard
from keystore.formats.policy import EnclavePolicy, Operation
from keystore.formats.shares import Share


def types_of_interface(
    operation: Operation, name: str, ros_type: str
) -> Iterator[tuple[Use, str, str | None]]:
    """Return what an interface of this type means for each of its topics and services: use, name, type chunk.

    Source for actions: rosidl (``Fibonacci_SendGoal``, ``Fibonacci_FeedbackMessage``), rcl_action's names.
    """
    if operation not in (Operation.CALL, Operation.EXECUTE):
        part = "msg" if operation in (Operation.PUBLISH, Operation.SUBSCRIBE) else "srv"
        yield PLAIN_USES[operation], name, type_chunk(ros_type) if f"/{part}/" in ros_type else None
        return
    service, topic = (Use.CALL, Use.SUBSCRIBE) if operation is Operation.CALL else (Use.SERVE, Use.PUBLISH)
    own = type_chunk(ros_type) if "/action/" in ros_type else None
    for part, suffix in (("send_goal", "_SendGoal_"), ("get_result", "_GetResult_")):
        yield service, f"{name}/_action/{part}", own and own[:-1] + suffix
    yield service, f"{name}/_action/cancel_goal", type_chunk("action_msgs/srv/CancelGoal")
    yield topic, f"{name}/_action/feedback", own and own[:-1] + "_FeedbackMessage_"
    yield topic, f"{name}/_action/status", type_chunk("action_msgs/msg/GoalStatusArray")


def united_types(known: Iterable[tuple[Use, str, str | None]]) -> Types:
    """Unite by use and name; a name is left out as soon as one of its types is not known, or it holds a wildcard."""
    found: dict[tuple[Use, str], set[str | None]] = {}
    for use, name, chunk in known:
        found.setdefault((use, name), set()).add(chunk)
    return {
        key: tuple(sorted(one for one in chunks if one is not None))
        for key, chunks in sorted(found.items())
        if None not in chunks and not has_wildcard(key[1])
    }


def types_text(types: Types) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Write as a share keeps them: ``publish /chatter`` and its type chunks."""
    return tuple((f"{use.value} {name}", chunks) for (use, name), chunks in sorted(types.items()))


def types_of_shares(enclave: str, shares: Iterable[Share]) -> Types:
    """Return the types of all launches that share an enclave; raises ``PolicyError`` for a name that no ROS node can
    have.
    """
    known: list[tuple[Use, str, str | None]] = []
    for share in shares:
        own = dict(share.types)
        grants = grants_of_policy(EnclavePolicy(enclave, share.profiles))
        for use in Use:
            for name in grants.of(use):
                known += [(use, name, chunk) for chunk in own.get(f"{use.value} {name}", (None,))]
    return united_types(known)
