"""Diagnostics of evaluation: of a launch file and the world it is read in. Performs no I/O."""

from __future__ import annotations

from collections.abc import Sequence

from enclave_common.source_location import SourceLocation
from enclave_common.terminal import quoted
from enclave_common.words import did_you_mean
from enclave_launch.diagnostics import Code, Diagnostic

_LONGEST_PATH = 500  # characters


def argument_unknown(name: str, alike: str) -> Diagnostic:
    text = f"no launch file declares or reads the argument {name!r}{alike}"
    return Diagnostic(Code.ARGUMENT_UNKNOWN, name, text, None, "secure-launch --show-args lists them")


def command_stderr(message: str, command: str) -> Diagnostic:
    return Diagnostic(Code.COMMAND_STDERR, command, message)


def function_called_again(function: str, event: str, location: SourceLocation) -> Diagnostic:
    """Report a function of the launch file that planning called and ``event`` will call again."""
    text = f"{function} is called for the plan, to know what it starts, and again at {event}"
    remedy = "make sure that calling it earlier does no harm"
    return Diagnostic(Code.FUNCTION_CALLED_AGAIN, function, text, location, remedy)


def scope_ended(node: str, namespace: str, location: SourceLocation) -> Diagnostic:
    """Report a node that an event starts outside of the namespace in which its handler is written."""
    text = (
        f"{node} is not in {namespace}: this is written in that group, and happens after the group has ended"
    )
    remedy = "give the node its namespace, or put the group inside the handler"
    return Diagnostic(Code.SCOPE_ENDED, node, text, location, remedy)


def include_left_out(path: str) -> Diagnostic:
    return Diagnostic(
        Code.INCLUDE_LEFT_OUT, path, f"not included, because its package is not installed or lacks it: {path}"
    )


def launch_file_deprecated(file: str | None, reason: str) -> Diagnostic:
    what = "deprecated launch description" if file is None else f"launch file [{file}] is deprecated"
    return Diagnostic(Code.LAUNCH_FILE_DEPRECATED, file or "", f"{what}: {reason}")


def log_level_missing() -> Diagnostic:
    """Report a ``log`` without a level, as launch does since the release that added levels."""
    return Diagnostic(
        Code.LOG_LEVEL_MISSING, "log", "the action log now expects a level; log_info is the one without"
    )


def ros_timer_on_wall_time(seconds: float, location: SourceLocation | None) -> Diagnostic:
    text = (
        f"set_use_sim_time is in effect: real launch waits {seconds:g} s of the simulated time on /clock, "
        f"here the timer fires after {seconds:g} s of wall time"
    )
    remedy = "use an event instead (on_exit, on_output), or a period that is right on wall time"
    return Diagnostic(Code.ROS_TIMER_ON_WALL_TIME, "ros_timer", text, location, remedy)


def node_name_repeated(node: str, count: int, started_by: str) -> Diagnostic:
    """Report a repeated node name in the words of launch_ros."""
    text = (
        f"{started_by}: there are now at least {count} nodes with the name {node} "
        "created within this launch context"
    )
    return Diagnostic(Code.NODE_NAME_REPEATED, node, text)


def parameter_type(node: str, name: str, declared: str, given: str, place: SourceLocation) -> Diagnostic:
    """Warn that a node would end at the declaration of a parameter, as its value is of another type."""
    text = f"node {node} declares parameter {name} as {declared}, and rcl reads its value as {given}"
    remedy = "the client library ends the node with an exception of the parameter's type"
    if declared == "string":
        remedy += "; quote the value once more, as in value=\"'on'\""
    elif (declared, given) == ("double", "int"):
        remedy += "; write it with a point, as in 1.0"
    return Diagnostic(Code.PARAMETER_TYPE, node, text, place, remedy)


def nodes_renamed_alike(
    program: str, node: str, originals: Sequence[str], place: SourceLocation
) -> Diagnostic:
    """Warn that one name for a process is the name of several nodes in it."""
    text = f"{len(originals)} nodes of {program} ({', '.join(originals)}) all get the name {node}"
    remedy = f'leave name= out, or rename one of them: ros_args="-r {originals[0]}:__node:=NAME"'
    return Diagnostic(Code.NODE_NAME_REPEATED, node, text, place, remedy)


def not_foreseeable(what: str, location: SourceLocation) -> Diagnostic:
    return Diagnostic(Code.NOT_FORESEEABLE, what, f"not foreseeable: {what}", location)


def executable_not_built(package: str, executable: str, placeholder: str) -> Diagnostic:
    """Warn, with ``--allow-missing-packages``; ``placeholder`` is the path that stands for it."""
    text = f"package '{package}' has no executable '{executable}' yet; using {placeholder} in its place"
    return Diagnostic(Code.EXECUTABLE_NOT_BUILT, f"{package}/{executable}", text)


def package_not_installed(package: str, placeholder: str) -> Diagnostic:
    """Warn, with ``--allow-missing-packages``; ``placeholder`` is the path that stands for it."""
    text = f"package '{package}' is not installed; using {placeholder} in its place"
    return Diagnostic(Code.PACKAGE_NOT_INSTALLED, package, text)


def module_not_installed(module: str) -> Diagnostic:
    """Warn, with ``--allow-missing-packages``, about a Python module that a launch file imports."""
    text = f"Python module '{module}' is not installed; what it would give is not known"
    return Diagnostic(Code.PACKAGE_NOT_INSTALLED, module, text)


def parameters_opaque(node: str, value: str, module: str, place: SourceLocation) -> Diagnostic:
    """Report parameters that a Python module which is not installed would have given."""
    text = f"the parameters that {node} would get from {value} are not known"
    remedy = f"install the Python module '{module}', or the package that brings it"
    return Diagnostic(Code.PARAMETERS_UNKNOWN, node, text, place, remedy)


def parameter_file_missing(path: str) -> Diagnostic:
    """Warn. The message has the beginning of a long ``path``, which may be a whole URDF by mistake."""
    named = path if len(path) <= _LONGEST_PATH else f"{path[:_LONGEST_PATH]} ..."
    return Diagnostic(Code.PARAMETER_FILE_MISSING, path, f"Parameter file path is not a file: {named}")


def parameters_unknown(process: str, path: str, why: str, place: SourceLocation) -> Diagnostic:
    text = f"the parameters that {process} would read from {path} are not known: {why}"
    return Diagnostic(
        Code.PARAMETERS_UNKNOWN,
        process,
        text,
        place,
        "rcl would not start the node with it: correct the file, or the value in the launch file",
    )


def program_not_installed(program: str) -> Diagnostic:
    text = f"program '{program}' is not installed; a placeholder replaces its output"
    return Diagnostic(Code.PROGRAM_NOT_INSTALLED, program, text)


def command_without_its_file(program: str, path: str) -> Diagnostic:
    text = f"'{program}' failed, as {path} is not installed; a placeholder replaces its output"
    return Diagnostic(Code.PROGRAM_NOT_INSTALLED, program, text)


def program_not_executable(program: str, text: str, location: SourceLocation | None) -> Diagnostic:
    return Diagnostic(Code.PROGRAM_NOT_EXECUTABLE, program, text, location)


def include_argument_unknown(
    name: str, file: str, question: str, location: SourceLocation | None
) -> Diagnostic:
    text = f"the include gives the argument {quoted(name)}, which {file} does not declare{question}"
    return Diagnostic(Code.INCLUDE_ARGUMENT_UNKNOWN, name, text, location)


def ros_distro_unknown(name: str, known: Sequence[str], taken: str) -> Diagnostic:
    text = f"ROS_DISTRO={quoted(name)} is not a known distribution: the rules of {taken} are followed"
    remedy = f"set it, or give --distro{did_you_mean(name, known)}"
    return Diagnostic(Code.ROS_DISTRO_UNKNOWN, name, text, None, remedy)
