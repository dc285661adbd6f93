"""The smallest change that allows one refused endpoint, as a patch (unified diff). Pure: text in, text out.

Where the node's manifest is a file, one entry is added to it, under the name as the source writes it, so that it holds
for every launch of the node. Else a policy file for ``--policy`` grants exactly the refused name to exactly this node.
"""

from __future__ import annotations

import difflib
import re
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from enclave_launch.policy.derivation import LIST_NAMES
from enclave_launch.policy.node_permissions import OPERATIONS
from enclave_launch.review.document import KIND_OF
from nodl.document.v2_schema import NAME_PATTERN, TYPE_PATTERN
from nodl.names import split_fqn
from nodl.node_interface import EndpointKind
from nodl.record.requested import RequestedEndpoint

_HISTORY = {1: "KEEP_LAST", 2: "KEEP_ALL"}


class Patch(NamedTuple):
    """``file`` is what it changes or makes, ``text`` what stands there then; ``use``: how it takes effect."""

    file: str
    diff: str
    use: str
    text: str


def manifest_patch(file: str, text: str, line: int, endpoint: RequestedEndpoint) -> Patch | None:
    """Add one entry for the node at ``line``; None if no line can be added safely."""
    if not re.search(NAME_PATTERN, endpoint.name) or not re.search(TYPE_PATTERN, endpoint.type):
        return None
    added = _into_v1(text, line, endpoint) if text.lstrip()[:1] == "<" else _into_v2(text, endpoint)
    if added is None:
        return None
    return Patch(file, _diff(file, text, added), "start the launch again", added)


def policy_patch(
    enclave: str, node: str, endpoint: RequestedEndpoint, file: str, text: str = ""
) -> Patch | None:
    """Return the change of a policy file that adds the one permission; None if its shape does not allow it."""
    operation = OPERATIONS[endpoint.kind]
    element = KIND_OF[LIST_NAMES[operation]]
    namespace, name = split_fqn(node)
    profile = (
        f"        <profile ns={quoteattr(namespace)} node={quoteattr(name)}>\n"
        f'          <{element}s {operation.value}="ALLOW">\n'
        f"            <{element}>{endpoint.final}</{element}>\n"
        f"          </{element}s>\n"
        "        </profile>\n"
    )
    begin, end = (
        f"    <enclave path={quoteattr(enclave)}>\n      <profiles>\n",
        "      </profiles>\n    </enclave>\n",
    )
    before = text or '<policy version="0.2.0">\n  <enclaves>\n  </enclaves>\n</policy>\n'
    head, same, rest = before.partition(begin)
    if same:
        after = f"{head}{begin}{profile}{rest}"
    else:
        head, last, rest = before.rpartition("  </enclaves>\n")
        if not last:
            return None
        after = f"{head}{begin}{profile}{end}{last}{rest}"
    return Patch(file, _diff(file, text, after), f"start the launch again with --policy {file}", after)


def _diff(file: str, before: str, after: str) -> str:
    lines = difflib.unified_diff(
        before.splitlines(keepends=True),
        after.splitlines(keepends=True),
        file if before else "/dev/null",
        file,
        n=2,
    )
    return "".join(
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n" for line in lines
    )


def _into_v2(text: str, endpoint: RequestedEndpoint) -> str | None:
    category = endpoint.kind.category
    head = re.search(rf"^{category}:[ \t]*(#.*)?$", text, re.MULTILINE)
    empty = re.search(rf"^{category}:[ \t]*\[[ \t]*\][ \t]*$", text, re.MULTILINE)
    if empty is not None:
        return f"{text[: empty.start()]}{category}:\n  - {_v2_entry(endpoint)}{text[empty.end() :]}"
    if head is None:
        if re.search(rf"^[\"']?{category}[\"']?[ \t]*:", text, re.MULTILINE) or text.lstrip()[:1] == "{":
            return None  # written inline, or JSON
        end = "" if text.endswith("\n") else "\n"
        return f"{text}{end}{category}:\n  - {_v2_entry(endpoint)}\n"
    first = re.match(r"(?:[ \t]*(?:#.*)?\n)*([ \t]*)- ", text[head.end() :] + "\n")
    if first is None:
        return None
    return f"{text[: head.end()]}\n{first[1]}- {_v2_entry(endpoint)}{text[head.end() :]}"


def _v2_entry(endpoint: RequestedEndpoint) -> str:
    fields = f"name: '{endpoint.name}', type: {endpoint.type}"  # ~, y or no are something else without quotes
    if endpoint.kind not in (EndpointKind.PUBLISHER, EndpointKind.SUBSCRIPTION):
        return f"{{{fields}}}"
    history, depth, reliability, durability = endpoint.qos if len(endpoint.qos) == 4 else (1, 10, 1, 2)
    qos = f"history: {_HISTORY.get(history, 'SYSTEM_DEFAULT')}"
    qos += f", depth: {max(depth, 1)}" if history == 1 else ""
    qos += f", reliability: {'BEST_EFFORT' if reliability == 2 else 'RELIABLE'}"
    qos += f", durability: {'TRANSIENT_LOCAL' if durability == 1 else 'VOLATILE'}"
    return f"{{{fields}, qos: {{{qos}}}}}"


def _into_v1(text: str, line: int, endpoint: RequestedEndpoint) -> str | None:
    lines = text.splitlines(keepends=True)
    for number in range(max(line - 1, 0), len(lines)):
        if "</node>" in lines[number]:
            kind = endpoint.kind
            entry = f'<{kind.family} name="{endpoint.name}" type="{endpoint.type}" role="{kind.role}"/>'
            before, end, after = lines[number].partition("</node>")
            blank = before if not before.strip() else ""
            rest = "" if not before.strip() else before
            lines[number] = f"{rest}{blank}  {entry}\n{blank}{end}{after}"
            return "".join(lines)
        if number > line - 1 and "<node" in lines[number]:
            return None
    return None
