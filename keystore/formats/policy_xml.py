"""SROS2 policy XML, version 0.2.0 <-> ``keystore.formats.policy.Policy``.

Reading accepts what the schema accepts (checked here, to report file and line also in included files),
merges profiles and enclaves that occur twice, and checks every name as permissions would need it.
Version 0.1.0 of Dashing and Eloquent is read as 0.2.0, with an enclave for each node. Of a snapshot of a running system
names that no other start has become patterns, each reported.
Writing is sorted and stable, so that a derived policy can be committed and reviewed.

SROS2 lets libxml2 include anything (``parse="text"`` of a private file ends up, signed and broadcast, in a topic name).
Here an XInclude names an XML file at or below the folder of the first policy file, links resolved, and takes elements
from it by a plain path. The tree is walked, not changed: every element comes with the file it was written in.
Format: ros2/design articles/ros2_access_control_policies.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from enclave_common.files import read_bytes
from enclave_common.terminal import quoted
from keystore.errors import InvalidEnclaveNameError, InvalidInputError
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.permissions_names import full_name
from keystore.formats.permissions_patterns import has_wildcard
from keystore.formats.policy import EnclavePolicy, Operation, Policy, PolicyError, Profile, Qualifier, Rule
from keystore.formats.safe_xml import parse_xml
from keystore.formats.snapshot_names import as_pattern, expression_as_pattern, has_number, is_of_a_tool

if TYPE_CHECKING:
    from lxml import etree


VERSION = "0.2.0"
VERSION_OF_ELOQUENT = "0.1.0"

# Group element -> its entries' element and the operations that are its attributes, in output order.
_GROUPS: dict[str, tuple[str, tuple[Operation, Operation]]] = {
    "topics": ("topic", (Operation.PUBLISH, Operation.SUBSCRIBE)),
    "services": ("service", (Operation.REPLY, Operation.REQUEST)),
    "actions": ("action", (Operation.EXECUTE, Operation.CALL)),
}

Rules = dict[Rule, str]  # rule -> "file:line" of its first mention
Profiles = dict[tuple[str, str], Rules]  # (ns, node) ->


@dataclass(frozen=True, slots=True)
class PolicyDocument:
    """A policy that was read. ``places``: (enclave, profile ns, profile node, rule) to ``file:line``.

    ``warnings``: what is valid but surely not meant. ``notes``: every wildcard and every DENY, which
    only a policy file can bring in and a person should review. ``file``: where it was read.
    """

    policy: Policy
    places: Mapping[tuple[str, str, str, Rule], str]
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    file: str = ""


def read_policy(path: str | Path) -> PolicyDocument:
    """Read the policy of a file, its includes restricted to the file's own folder.

    Raises ``PolicyError`` (an ``InvalidInputError``) with file:line.
    """
    file = Path(path)
    try:
        document = read_bytes(file)
    except OSError as error:
        raise PolicyError(f"cannot read policy {quoted(file)}: {error.strerror}") from None
    return replace(parse_policy(document, str(file), folder=file.parent), file=str(file))


def read_policies(path: str | Path) -> PolicyDocument:
    """Read a policy as ``read_policy`` does, or all of a folder as one. Other XML there is what policies include."""
    if not Path(path).is_dir():
        return read_policy(path)
    folder = Path(path).resolve()
    reader = _PolicyReader(folder)
    try:
        found = [(file, read_bytes(file)) for file in sorted(folder.glob("*.xml"))]
    except OSError as error:
        raise PolicyError(f"cannot read policy {quoted(error.filename)}: {error.strerror}") from None
    roots = [PolicyElement(parse_xml(document, str(file)), str(file)) for file, document in found]
    read = [reader.read(root) for root in roots if root.element.tag == "policy"]
    if not read:
        raise PolicyError(f"{quoted(path)} holds no policy: no *.xml in it begins with <policy>")
    return replace(read[-1], file=str(path))


def parse_policy(document: bytes, where: str = "policy.xml", folder: Path | None = None) -> PolicyDocument:
    """Parse bytes as ``read_policy`` does; includes are followed only with a ``folder`` and below it."""
    root = parse_xml(document, where)
    file = where if folder is None else str(Path(where).resolve())
    return _PolicyReader(folder).read(PolicyElement(root, file))


class _PolicyReader:
    def __init__(self, folder: Path | None):
        self._reader = IncludingReader(folder)
        self._enclaves: dict[str, Profiles] = {}
        self._warnings: list[str] = []
        self._notes: list[str] = []

    def read(self, root: PolicyElement) -> PolicyDocument:
        self._expect(root, "policy", required=("version",))
        version = root.element.get("version", "")
        if version == VERSION_OF_ELOQUENT:
            return self._read_nodes(root)
        if version != VERSION:
            raise PolicyError(
                f"{root.where}: policy version {quoted(version)} is not supported, only {VERSION}"
            )
        enclaves, *rest = list(self._reader.children(root)) or [root]
        if rest:
            raise PolicyError(f"{rest[0].where}: a policy has exactly one <enclaves>")
        self._expect(enclaves, "enclaves")
        for enclave in self._some_children(enclaves, "enclave"):
            self._enclave(enclave)
        return self._result()

    def _read_nodes(self, root: PolicyElement) -> PolicyDocument:
        """Read a policy of Dashing or Eloquent, where each node had files of its own."""
        self._warnings.append(
            f"{root.where}: policy version {VERSION_OF_ELOQUENT} of Dashing and Eloquent knows no enclaves: each node "
            f"gets the enclave of its name; give the nodes of one process one enclave in a policy of version {VERSION}"
        )
        for group in self._some_children(root, "profiles"):
            self._expect(group, "profiles", optional=("type",))
            for profile in self._some_children(group, "profile"):
                self._expect(profile, "profile", required=("ns", "node"))
                key = (profile.element.get("ns", ""), profile.element.get("node", ""))
                path = self._path(f"{key[0].rstrip('/')}/{key[1]}", profile.where)
                rules = self._enclaves.setdefault(path, {}).setdefault(key, {})
                self._profile(path, Profile(*key, ()), profile, rules)
        return self._result()

    def _path(self, path: str, where: str) -> str:
        try:
            return validate_enclave_name(path)
        except InvalidEnclaveNameError as error:
            raise PolicyError(f"{where}: {error}") from None

    def _enclave(self, enclave: PolicyElement) -> None:
        self._expect(enclave, "enclave", required=("path",))
        path = self._path(enclave.element.get("path", ""), enclave.where)
        if path in self._enclaves:
            self._warnings.append(f"{enclave.where}: enclave {path} is defined again; both are merged")
        profiles = self._enclaves.setdefault(path, {})
        for child in self._some_children(enclave, "profiles"):
            self._expect(child, "profiles", optional=("type",))
            self._profiles(path, child, profiles)

    def _profiles(self, path: str, group: PolicyElement, profiles: Profiles) -> None:
        found = 0
        for child in self._reader.children(group):
            if child.element.tag == "metadata" and found:
                continue
            self._expect(child, "profile", required=("ns", "node"))
            found += 1
            ns, node = child.element.get("ns", ""), child.element.get("node", "")
            if is_of_a_tool(node):
                self._warnings.append(
                    f"{child.where}: enclave {path}: left out: {node} is a node of ros2 or launch that was running; "
                    "secure-keystore tool-enclave makes an enclave for a tool"
                )
                continue
            key = (ns, self._fixed_name(node, path, child.where))
            self._profile(path, Profile(*key, ()), child, profiles.setdefault(key, {}))
        if not found:
            raise PolicyError(f"{group.where}: <profiles> needs at least one <profile>")

    def _fixed_name(self, node: str, path: str, where: str) -> str:
        pattern = as_pattern(node)
        if pattern != node:
            self._warnings.append(
                f"{where}: enclave {path}: {node} is a name that no other start has; granted to {pattern}"
            )
        elif has_number(node):
            self._warnings.append(
                f"{where}: enclave {path}: {node} ends in a number; if that is a process id, write "
                f"{node.rpartition('_')[0]}_*"
            )
        return pattern

    def _profile(self, path: str, profile: Profile, written: PolicyElement, rules: Rules) -> None:
        self._check_name("~/x", profile, written.where)  # checks ns and node
        for group in self._reader.children(written):
            tag = str(group.element.tag)
            if tag not in _GROUPS:
                raise PolicyError(f"{group.where}: <{tag}> is not allowed in a <profile>")
            entry, operations = _GROUPS[tag]
            self._expect(group, tag, optional=tuple(o.value for o in operations))
            qualifiers = self._qualifiers(group, operations)
            for expression in self._some_children(group, entry):
                self._expect(expression, entry)
                self._rules(path, profile, expression, qualifiers, rules)

    def _qualifiers(
        self, group: PolicyElement, operations: Iterable[Operation]
    ) -> dict[Operation, Qualifier]:
        found: dict[Operation, Qualifier] = {}
        for operation in operations:
            value = group.element.get(operation.value)
            if value is None:
                continue
            if value not in ("ALLOW", "DENY"):
                raise PolicyError(f"{group.where}: {operation.value}={quoted(value)} must be ALLOW or DENY")
            found[operation] = Qualifier(value)
        if not found:
            names = " or ".join(operation.value for operation in operations)
            self._warnings.append(f"{group.where}: <{group.element.tag}> without {names} has no effect")
        return found

    def _rules(
        self,
        path: str,
        profile: Profile,
        written: PolicyElement,
        granted: Mapping[Operation, Qualifier],
        rules: Rules,
    ) -> None:
        expression = written.element.text or ""
        if len(written.element):
            raise PolicyError(f"{written.where}: <{written.element.tag}> must hold a name only")
        recurring = expression_as_pattern(expression)
        if recurring is None:
            self._warnings.append(
                f"{written.where}: enclave {path}: left out: {expression} is of a tool's node"
            )
            return
        if recurring != expression:
            self._warnings.append(
                f"{written.where}: enclave {path}: {expression} is a name that no other start has; "
                f"granted is {recurring}"
            )
            expression = recurring
        name = self._check_name(expression, profile, written.where)
        is_wildcard = has_wildcard(name)
        shown = name if has_wildcard(profile.node) else expression
        for operation, qualifier in granted.items():
            rules.setdefault(Rule(operation, qualifier, expression), written.where)
            if qualifier is Qualifier.DENY or is_wildcard:
                kind = "wildcard" if is_wildcard else "denial"
                self._notes.append(
                    f"{written.where}: enclave {path}: {kind} {qualifier.value} {operation.value} {shown}"
                )

    def _check_name(self, expression: str, profile: Profile, where: str) -> str:
        try:
            return full_name(expression, profile)
        except PolicyError as error:
            raise PolicyError(f"{where}: {error}") from None

    def _some_children(self, parent: PolicyElement, tag: str) -> list[PolicyElement]:
        children = list(self._reader.children(parent))
        if not children:
            raise PolicyError(f"{parent.where}: <{parent.element.tag}> needs at least one <{tag}>")
        return children

    def _expect(
        self, written: PolicyElement, tag: str, required: tuple[str, ...] = (), optional: tuple[str, ...] = ()
    ) -> None:
        present = written.element.attrib
        if written.element.tag != tag:
            raise PolicyError(f"{written.where}: expected <{tag}>, found <{written.element.tag}>")
        missing = [name for name in required if name not in present]
        unknown = [str(name) for name in present if name not in (*required, *optional)]
        if missing or unknown:
            text = f"needs the attribute {missing[0]}" if missing else f"has no attribute {unknown[0]}"
            raise PolicyError(f"{written.where}: <{tag}> {text}")

    def _result(self) -> PolicyDocument:
        enclaves: list[EnclavePolicy] = []
        places: dict[tuple[str, str, str, Rule], str] = {}
        # An enclave of nothing but tools that were running is none of the robot's.
        for path, profiles in sorted((path, found) for path, found in self._enclaves.items() if found):
            for (ns, node), rules in profiles.items():
                places.update({(path, ns, node, rule): place for rule, place in rules.items()})
            found = (Profile(*key, tuple(sorted(rules))) for key, rules in sorted(profiles.items()))
            enclaves.append(EnclavePolicy(path, tuple(found)))
        return PolicyDocument(Policy(tuple(enclaves)), places, tuple(self._warnings), tuple(self._notes))


def policy_xml(policy: Policy) -> bytes:
    """Render the policy as UTF-8 text, valid against the schema, the same for the same policy.

    An enclave without profiles (its process may join and nothing else) gets one without rules, which the schema
    demands. Raises ``InvalidInputError`` for a policy without enclaves.
    """
    if not policy.enclaves:
        raise InvalidInputError("a policy needs at least one enclave")
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f'<policy version="{VERSION}">', "  <enclaves>"]
    for enclave in sorted(policy.enclaves):
        lines.append(f'    <enclave path="{escape(enclave.path)}">')
        lines.append("      <profiles>")
        placeholder = Profile("/", enclave.path.rpartition("/")[2] or "root", ())
        for profile in sorted(enclave.profiles) or [placeholder]:
            lines.extend(_profile_lines(profile))
        lines.extend(("      </profiles>", "    </enclave>"))
    lines.extend(("  </enclaves>", "</policy>", ""))
    return "\n".join(lines).encode()


def _profile_lines(profile: Profile) -> list[str]:
    head = f'        <profile ns="{escape(profile.ns)}" node="{escape(profile.node)}"'
    if not profile.rules:
        return [f"{head}/>"]
    lines = [f"{head}>"]
    for group, (entry, operations) in _GROUPS.items():
        for operation in operations:
            for qualifier in Qualifier:
                key = (operation, qualifier)
                names = sorted({r.expression for r in profile.rules if (r.operation, r.qualifier) == key})
                if names:
                    lines.append(f'          <{group} {operation.value}="{qualifier.value}">')
                    lines.extend(f"            <{entry}>{escape(name)}</{entry}>" for name in names)
                    lines.append(f"          </{group}>")
    return [*lines, "        </profile>"]


MAX_DEPTH = 16
MAX_FILES = 256
MAX_INCLUDES = 2_000  # followed in all: files that include each other twice multiply
MAX_TOTAL_BYTES = 4_000_000
_NAMESPACES = ("http://www.w3.org/2001/XInclude", "http://www.w3.org/2003/XInclude")
_INCLUDE_TAGS = frozenset(f"{{{namespace}}}include" for namespace in _NAMESPACES)
_XPOINTER = re.compile(r"xpointer\((/[A-Za-z_]+(?:/[A-Za-z_]+)*(?:/\*)?)\)\Z")
_XML_BASE = "{http://www.w3.org/XML/1998/namespace}base"


@dataclass(frozen=True, slots=True)
class PolicyElement:
    """An element, the file it is written in, and the files whose includes led there, outermost first."""

    element: etree._Element
    file: str
    chain: tuple[str, ...] = ()

    @property
    def where(self) -> str:
        included = "".join(f", included from {file}" for file in reversed(self.chain))
        return f"{self.file}:{self.element.sourceline}{included}"


class IncludingReader:
    """Children of elements with their includes followed. ``folder`` is the only place to read from."""

    def __init__(self, folder: Path | None):
        self._folder = None if folder is None else folder.resolve()
        self._roots: dict[Path, etree._Element] = {}
        self._bytes = 0
        self._followed = 0

    def children(self, parent: PolicyElement) -> Iterator[PolicyElement]:
        """Yield each child element; raises ``PolicyError`` for an unsafe include."""
        return self._found(parent.element, parent.file, parent.chain)

    def _found(
        self, elements: Iterable[etree._Element], file: str, chain: tuple[str, ...]
    ) -> Iterator[PolicyElement]:
        for element in elements:
            if element.tag in _INCLUDE_TAGS:
                yield from self._included(PolicyElement(element, file, chain))
            else:
                element.attrib.pop(_XML_BASE, "")
                yield PolicyElement(element, file, chain)

    def _included(self, include: PolicyElement) -> Iterator[PolicyElement]:
        where = include.where
        path = self._path(include)
        self._followed += 1
        if self._followed > MAX_INCLUDES:
            raise PolicyError(f"{where}: more than {MAX_INCLUDES} includes")
        chain = (*include.chain, f"{include.file}:{include.element.sourceline}")
        if len(chain) > MAX_DEPTH or str(path) in (include.file, *(c.rpartition(":")[0] for c in chain)):
            raise PolicyError(f"{where}: the include of {quoted(path)} goes round in a circle or too deep")
        found = _pointed(self._root(path, where), include.element, where)
        yield from self._found(found, str(path), chain)

    def _path(self, include: PolicyElement) -> Path:
        where, href = include.where, include.element.get("href", "")
        if include.element.get("parse", "xml") != "xml":
            raise PolicyError(f'{where}: an include may only read XML (parse="xml")')
        if len(include.element):
            raise PolicyError(f"{where}: an include with a fallback is not supported; every file must exist")
        if self._folder is None:
            raise PolicyError(f"{where}: includes are only followed in a policy file, not here")
        if not href or ":" in href or "\\" in href or not href.isprintable() or href.startswith("/"):
            raise PolicyError(f"{where}: {quoted(href)} is not a relative path of a file")
        path = (Path(include.file).parent / href).resolve()
        if not path.is_relative_to(self._folder):
            raise PolicyError(
                f"{where}: {quoted(href)} is outside the policy's folder {quoted(self._folder)}; "
                "copy the file there"
            )
        return path

    def _root(self, path: Path, where: str) -> etree._Element:
        if path not in self._roots:
            try:
                document = read_bytes(path, MAX_TOTAL_BYTES)
            except OSError as error:
                raise PolicyError(f"{where}: cannot include {quoted(path)}: {error.strerror}") from None
            self._bytes += len(document)
            if len(self._roots) >= MAX_FILES or self._bytes > MAX_TOTAL_BYTES:
                raise PolicyError(f"{where}: more than {MAX_FILES} files or {MAX_TOTAL_BYTES} bytes included")
            self._roots[path] = parse_xml(document, str(path))
        return self._roots[path]


def _pointed(root: etree._Element, include: etree._Element, where: str) -> list[etree._Element]:
    """Return the elements that ``xpointer`` selects: the root without one, else an absolute path of names."""
    pointer = include.get("xpointer")
    if pointer is None:
        return [root]
    match = _XPOINTER.match(pointer)
    if match is None:
        raise PolicyError(
            f"{where}: xpointer {quoted(pointer)} is not supported; write a plain path such as xpointer(/profile/*)"
        )
    first, *steps = match[1][1:].split("/")
    found = [root] if root.tag == first else []
    for step in steps:
        found = [
            child
            for element in found
            for child in element
            if step in ("*", child.tag) or child.tag in _INCLUDE_TAGS
        ]
    if not found:
        raise PolicyError(f"{where}: xpointer {quoted(pointer)} selects nothing")
    return found
