"""The contents of a launch that its nodes depend on: the robot description, and the controllers that spawners load.

Takes the evaluation, gives ``nodl.dependence.Launched``. Reads the parameter files that spawners name.

Source: ros-controls/ros2_control jazzy, controller_manager/spawner.py: the type and the parameters of a controller come
from its section in the files of ``--param-file`` and in the spawner's own parameter files, remap rules from
``--controller-ros-args``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from enclave_common.shell_words import split_words
from enclave_launch.policy.program_inputs import own_words
from enclave_launch.policy.running_node import parameters_of_node
from enclave_launch.process import Evaluation, ResolvedProcess
from enclave_launch.ros_rules.rcl_parameters import resolve_parameters
from nodl.dependence import Launched, Spawned
from nodl.ros_arguments import ParameterFileArgument, parse_ros_arguments

_MANAGER = ("-c", "--controller-manager")
_FILES = ("-p", "--param-file")
_TYPE = ("-t", "--controller-type")
_ROS_ARGUMENTS = ("--controller-ros-args",)
_NAME = ("--controller",)
_TAKE_A_VALUE = frozenset(
    (
        *(*_MANAGER, *_FILES, *_TYPE, *_ROS_ARGUMENTS, *_NAME, "-n", "--namespace"),
        *("--controller-manager-timeout", "--switch-timeout", "--service-call-timeout"),
    )
)


def launched(evaluation: Evaluation) -> Launched:
    """Return what ``evaluation`` starts, as far as other nodes depend on it."""
    of_manager = (item for item in evaluation.processes if item.package == "controller_manager")
    spawners = (item for item in of_manager if item.executable in ("spawner", "spawner.py"))
    return Launched(
        robot_description=_robot_description(evaluation),
        spawned=tuple(spawned for process in spawners for spawned in _spawned(process)),
    )


def _robot_description(evaluation: Evaluation) -> str:
    """Return the URDF that some node has as its parameter: robot_state_publisher, mostly."""
    given = [item.parameters for item in evaluation.processes]
    given += [item.parameters for item in evaluation.components]
    texts = (parameters.get("robot_description") for parameters in given)
    return next((text for text in texts if isinstance(text, str) and text), "")


def _spawned(process: ResolvedProcess) -> Iterator[Spawned]:
    options, names = _options(own_words(process))
    namespace = (process.namespace or "/").rstrip("/")
    if not namespace.startswith("/"):
        namespace = ""
    manager = ([*_values(options, _MANAGER), "controller_manager"])[0]
    files = [ParameterFileArgument(file) for file in _values(options, _FILES)]
    given = (word for text in _values(options, _ROS_ARGUMENTS) for word in split_words(text))
    rules = parse_ros_arguments(["--ros-args", *given]).remaps
    for name in (*names, *_values(options, _NAME)):
        tokens = [token for token in (*namespace.split("/"), name) if token]
        of_its_own = parameters_of_node(process, namespace or "/", name)
        parameters = {**of_its_own, **resolve_parameters(tokens, files).values}
        types = _values(options, _TYPE)
        yield Spawned(
            controller=name,
            manager=manager if manager.startswith("/") else f"{namespace}/{manager}",
            type=types[0] if types else str(parameters.get("type") or ""),
            parameters=parameters,
            rules=rules,
        )


def _options(words: Sequence[str]) -> tuple[list[tuple[str, str]], list[str]]:
    """Return pairs of option and value in their order, and the words that belong to none."""
    options: list[tuple[str, str]] = []
    names: list[str] = []
    rest = iter(words)
    for word in rest:
        option, equals, value = word.partition("=")
        if option in _TAKE_A_VALUE:
            options.append((option, value if equals else next(rest, "")))
        elif not word.startswith("-"):
            names.append(word)
    return options, names


def _values(options: Sequence[tuple[str, str]], spellings: Sequence[str]) -> list[str]:
    return [value for option, value in options if option in spellings]
