"""The NoDL v1 Python API (``nodl_python``) on top of our reader: same names, arguments and errors."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import IO

from enclave_common.files import read_bytes
from enclave_common.source_location import SourceLocation
from nodl.ament_index import package_share_directory, search_prefixes
from nodl.document import V1_SUFFIX
from nodl.document.v1 import parse_v1
from nodl.errors import DuplicateNodeError, ExecutableNotFoundError, InvalidNoDLError, NoNoDLFilesError
from nodl.node_interface import Endpoint, ManifestNode
from nodl.types import Action, Node, Parameter, PubSubRole, ServerClientRole, Service, Topic


def get_node_by_executable(*, package_name: str, executable_name: str) -> Node:
    """Return the node that an installed package's NoDL files describe for ``executable_name``; raises NoDL errors."""
    for node in _nodes_of_package(package_name):
        if node.executable == executable_name:
            return node
    raise ExecutableNotFoundError(package_name=package_name, executable_name=executable_name)


def parse(path: str | Path | IO[bytes] | IO[str]) -> list[Node]:
    """Parse the nodes of one v1 document: a path or an open file; raises ``InvalidNoDLError``."""
    if isinstance(path, (str, Path)):
        file = str(Path(path).resolve())
        try:
            content: bytes | str = read_bytes(file)
        except OSError as error:
            raise InvalidNoDLError.at(SourceLocation(file), f"cannot be read: {error.strerror}") from None
    else:
        file = str(getattr(path, "name", "<stream>"))
        content = path.read()
    text = content.encode() if isinstance(content, str) else content
    return [node_of(manifest) for manifest in parse_v1(text, file)]


def node_of(manifest: ManifestNode) -> Node:
    """Return a manifest node in the values of the v1 API; an endpoint in both roles becomes role ``both``."""
    interface = manifest.interface
    kinds: dict[str, list[Endpoint]] = {"topic": [], "service": [], "action": []}
    for endpoint in interface.endpoints:
        kinds[endpoint.kind.family].append(endpoint)
    return Node(
        name=_v1_name(manifest),
        executable=interface.executable or interface.plugin or "",
        topics=[
            Topic(name=_name(e), message_type=e.type, role=PubSubRole(e.kind.role)) for e in kinds["topic"]
        ],
        services=[Service(name=_name(e), service_type=e.type, role=_role(e)) for e in kinds["service"]],
        actions=[Action(name=_name(e), action_type=e.type, role=_role(e)) for e in kinds["action"]],
        parameters=[Parameter(name=n, parameter_type=t) for n, t in manifest.parameter_types.items()],
    )


def _name(endpoint: Endpoint) -> str:
    return endpoint.written or endpoint.name.text


def _role(endpoint: Endpoint) -> ServerClientRole:
    return ServerClientRole(endpoint.kind.role)


def _v1_name(manifest: ManifestNode) -> str:
    interface = manifest.interface
    namespace = (interface.namespace or "").rstrip("/")
    return f"{namespace}/{interface.name}" if namespace else interface.name or ""


def _nodes_of_package(package_name: str) -> list[Node]:
    share = Path(package_share_directory(package_name, search_prefixes()))
    files = sorted(path for path in share.glob("*" + V1_SUFFIX) if path.is_file())
    if not files:
        raise NoNoDLFilesError(package_name)
    return _merged(node for file in files for node in parse(file))


def _merged(nodes: Iterable[Node]) -> list[Node]:
    by_executable: dict[str, Node] = {}
    for node in nodes:
        if node.executable in by_executable:
            raise DuplicateNodeError(node=node)
        by_executable[node.executable] = node
    return list(by_executable.values())
