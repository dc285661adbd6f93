"""The smallest change that allows one refused endpoint, as a patch, tried on a copy first; each on top of earlier ones.

Where the node's manifest is a file, one entry is added to it, under the name as the source writes it, so that it holds
for every launch of the node. Else a policy file for ``--policy`` grants exactly the refused name to exactly this node.
"""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from enclave_addons.library import SHIPPED
from enclave_addons.recording.grants import Description, Need, PlannedGrants, permits
from enclave_addons.recording.record.requested import RequestedEndpoint
from enclave_addons.review.document import KIND_OF
from enclave_common.files import read_text
from enclave_launch.interfaces.descriptions import names_of
from enclave_launch.plan import InterfaceOrigin, LaunchPlan
from enclave_launch.policy.derivation import LIST_NAMES, merge_policy_file
from enclave_launch.policy.node_permissions import OPERATIONS
from keystore.errors import KeystoreError
from keystore.formats.permissions import dds_rules
from keystore.formats.policy_xml import parse_policy
from nodl.ament_index import search_prefixes
from nodl.document import RESOURCE_TYPE, V1_SUFFIX, V2_SUFFIXES, parse_document
from nodl.document.v2_schema import NAME_PATTERN, TYPE_PATTERN
from nodl.errors import NoDLError
from nodl.names import split_fqn
from nodl.node_interface import EndpointKind


class Remedies:
    """Finds patches for the refusals of one launch."""

    def __init__(self, plan: LaunchPlan, grants: PlannedGrants) -> None:
        self._plan = plan
        self._grants = grants
        self._texts: dict[str, str] = {}
        """Files as the patches so far leave them."""

    def patch(self, need: Need, endpoint: RequestedEndpoint, described: Description) -> Patch | None:
        """Return the first change that grants ``need``: of the node's manifest, else of a policy file."""
        if self._grants.denied(need):
            return None
        for patch, cures in self._candidates(need, endpoint, described):
            if cures:
                self._texts[patch.file] = patch.text
                return patch
        return None

    def unseen(self, need: Need, described: Description) -> tuple[str, ...]:
        """Return all that ``--also unseen`` grants, if ``need`` is among it."""
        if not described.descriptions:
            return ()
        first, *others = described.descriptions
        if first.found.origin is not InterfaceOrigin.RECORDED or not (first.used and first.complete):
            return ()
        found = {
            named for each in others if not each.found.doubt for named in each.names
        } - first.names.keys()
        if (need.operation, need.name) not in found:
            return ()
        return tuple(f"{operation.verb} {name}" for operation, name in sorted(found))

    def _candidates(
        self, need: Need, endpoint: RequestedEndpoint, described: Description
    ) -> Iterator[tuple[Patch, bool]]:
        source = described.node.interface.source if described.node is not None else None
        if source is not None and _is_manifest(source.file):
            text = self._text(source.file)
            patch = manifest_patch(source.file, text, source.line, endpoint) if text else None
            if patch is not None:
                yield patch, self._manifest_cures(patch, need, described)
        file = self._policy_file()
        changed = policy_patch(need.enclave, need.node, endpoint, file, self._text(file))
        if changed is not None:
            yield changed, self._policy_cures(changed, need)

    def _policy_file(self) -> str:
        given = self._plan.inputs.options.policy.policy_file
        if given is not None and given.file:
            return given.file
        names = (f"allow{f'-{number}' if number else ''}.policy.xml" for number in count())
        return next(each for each in names if each in self._texts or not os.path.exists(each))

    def _text(self, file: str) -> str:
        if file not in self._texts:
            try:
                self._texts[file] = read_text(file)
            except (OSError, UnicodeDecodeError):
                return ""
        return self._texts[file]

    def _manifest_cures(self, patch: Patch, need: Need, described: Description) -> bool:
        assert described.node is not None
        before = described.node.interface
        prefixes = search_prefixes(self._plan.inputs.source.prefixes)
        try:
            nodes = parse_document(patch.text.encode(), patch.file, package=before.package, prefixes=prefixes)
        except NoDLError:
            return False
        for after in (node.interface for node in nodes):
            if (after.executable, after.plugin, after.namespace) != (
                before.executable,
                before.plugin,
                before.namespace,
            ):
                continue
            if len(nodes) > 1 and after.name != before.name:
                continue
            node = described.node._replace(interface=after._replace(name=before.name, depends=None))
            return (need.operation, need.name) in names_of(
                node, self._plan.distro, self._plan.evaluation.release.rcl
            )[0]
        return False

    def _policy_cures(self, patch: Patch, need: Need) -> bool:
        try:
            document = parse_policy(patch.text.encode(), patch.file, Path(patch.file).absolute().parent)
        except KeystoreError:
            return False
        merged = merge_policy_file(self._plan.derived, document).policy
        return any(permits(dds_rules(each), need) for each in merged.enclaves if each.path == need.enclave)


def _is_manifest(file: str) -> bool:
    """Return True for a manifest that a user may edit: the shipped library is not theirs."""
    if os.path.dirname(os.path.dirname(file)) == SHIPPED:
        return False
    suffixes = (V1_SUFFIX, *(each for each in V2_SUFFIXES if each.startswith(".nodl.")))
    return file.endswith(suffixes) or f"/resource_index/{RESOURCE_TYPE}/" in file


_HISTORY = {1: "KEEP_LAST", 2: "KEEP_ALL"}


class Patch(NamedTuple):
    """A change of one file. ``file`` is what it changes or makes, ``text`` what stands there then; ``use``: how it
    takes effect."""

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
