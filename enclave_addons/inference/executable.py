"""What makes the interfaces of ``lib/<package>/<executable>`` or of a component: Python, or compiled code with sources.

Takes what launch starts and the install prefixes, gives interfaces or the reason why there are none. The analyses are
imported when there is something to analyse: most programs of a launch are compiled and without sources. Reads files;
runs nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from enclave_addons.inference.start import LaunchKey
from enclave_common.files import check_regular
from nodl.ament_index import ExecutableNotInstalledError, PackageNotFoundError, executable_path
from nodl.dependence import COMPONENT, CONTROLLER, HOST, Dependence
from nodl.node_interface import NodeInterface

if TYPE_CHECKING:
    from enclave_addons.inference.reach import SourcesInReach
    from enclave_addons.inference.start import Start


class InferredExecutable(NamedTuple):
    """The interfaces of one executable or component by its sources.

    Attributes:
        interfaces: Empty if nothing could be inferred.
        why: What was found instead.
        of_this_start: Another start may have other interfaces: parameters decide what is made.
        not_made: It is not installed, and the build of its package makes no such program.
    """

    interfaces: tuple[NodeInterface, ...]
    why: str = ""
    of_this_start: bool = False
    not_made: bool = False

    def __bool__(self) -> bool:
        return bool(self.interfaces)


def infer_executable(
    package: str,
    executable: str | None = None,
    plugin: str | None = None,
    *,
    prefixes: Sequence[str],
    sources: SourcesInReach | None = None,
    start_of: Start | None = None,
    compiled_only: bool = False,
) -> InferredExecutable:
    """Return the nodes that ``executable`` of a package creates; gaps are attached to them.

    Compiled programs, components and what is not installed are read from ``sources``, all under what launch gives
    them (``start_of``).
    ``compiled_only``: programs in Python, which are read again each time, are left alone.
    """
    if executable is None:
        found = _compiled(package, None, plugin, sources, start_of, f"component {plugin} is compiled code")
        return found._replace(not_made=False)  # whether another package has it, is not looked up
    script = None
    try:
        path = executable_path(package, executable, prefixes)
        what, in_python = f"{path} is a compiled program", _is_python(path)
    except (PackageNotFoundError, ExecutableNotInstalledError, ValueError) as error:
        missing = isinstance(error, PackageNotFoundError)
        what = f"package '{package}' is not installed" if missing else str(error)
        script = sources.script(package, executable) if sources is not None else None
        path = script.file if script is not None else ""
        in_python = script is not None and (script.module is not None or _is_python(path))
    if not in_python:
        found = _compiled(package, executable, None, sources, start_of, what)
        return found._replace(not_made=found.not_made and not path)
    if compiled_only:
        return InferredExecutable((), f"{path} is a Python program")
    from enclave_addons.inference.python_executable import infer_python, infer_script

    if script is None or sources is None:
        return InferredExecutable(*infer_python(path, package, executable, prefixes, start_of))
    key = LaunchKey(package, executable)
    return InferredExecutable(*infer_script(script, key, prefixes, sources.module_folders, start_of))


def infer_plugin(
    name: str, instance: str, sources: SourcesInReach, start_of: Start
) -> tuple[NodeInterface, ...]:
    """Return a plugin whose sources are in reach, which a host loads as ``instance``, and the nodes that it makes.

    A controller of ros2_control is a node of its own; what another plugin makes on a node that it is given is named
    ``HOST`` or ``COMPONENT``. Nothing if there is no such plugin.
    """
    from enclave_addons.inference.cpp.entry import CppSupportMissing

    try:
        interfaces = sources.infer_plugin(name, instance, start_of).interfaces
    except CppSupportMissing:
        return ()
    if interfaces and interfaces[0].name == CONTROLLER:
        return (interfaces[0]._replace(depends=Dependence(own_node=True)), *interfaces[1:])
    return interfaces if interfaces and interfaces[0].name in (HOST, COMPONENT) else ()


def _compiled(
    package: str,
    executable: str | None,
    plugin: str | None,
    sources: SourcesInReach | None,
    start_of: Start | None,
    what: str,
) -> InferredExecutable:
    if sources is None:
        return InferredExecutable((), f"{what}, whose sources were not looked for")
    from enclave_addons.inference.cpp.entry import CppSupportMissing

    try:
        answer = sources.infer(package, executable, plugin, start_of)
    except CppSupportMissing as error:
        return InferredExecutable((), f"{what}: {error}")
    why = answer.why  # of a build in reach: what is installed of it beside that explains nothing
    if why and not sources.hold(package):
        why = f"{what}: {why}"
    return InferredExecutable(answer.interfaces, why, answer.consulted, answer.not_made)


def _is_python(path: str) -> bool:
    """Decide by the first line, or the suffix of a script without one."""
    try:
        check_regular(path)
        with open(path, "rb") as stream:
            start_of_file = stream.read(256)
    except OSError:
        return False
    if start_of_file.startswith(b"#!"):
        return b"python" in start_of_file.partition(b"\n")[0] or b"exec" in start_of_file
    return path.endswith(".py") and b"\0" not in start_of_file
