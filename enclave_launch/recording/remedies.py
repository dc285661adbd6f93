"""The change that allows one refused endpoint, tried on a copy first; each is made on top of the earlier ones."""

from __future__ import annotations

import os
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from enclave_common.files import read_text
from enclave_launch.interfaces.descriptions import names_of
from enclave_launch.plan import InterfaceOrigin, LaunchPlan
from enclave_launch.policy.derivation import merge_policy_file
from enclave_launch.recording.grants import Description, Need, PlannedGrants, permits
from enclave_launch.recording.patches import Patch, manifest_patch, policy_patch
from keystore.errors import KeystoreError
from keystore.formats.permissions import dds_rules
from keystore.formats.policy_xml import parse_policy
from nodl.ament_index import search_prefixes
from nodl.document import RESOURCE_TYPE, V1_SUFFIX, V2_SUFFIXES, parse_document
from nodl.errors import NoDLError
from nodl.library import SHIPPED
from nodl.record.requested import RequestedEndpoint


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
        if first.origin is not InterfaceOrigin.RECORDED or not (first.used and first.complete):
            return ()
        found = {named for each in others if not each.doubt for named in each.names} - first.names.keys()
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
            return (need.operation, need.name) in names_of(node, self._plan.distro)[0]
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
