"""The truth about a program: what it creates when it runs, recorded by a stand-in for rclpy.

``record`` executes a program (one of ours; inference never does that) in this process. The stand-in keeps what rclpy
would hand to rcl: nodes and endpoints under their final names. Callbacks are called a few times when the program
spins. ``choose`` of the module ``tosses`` is a coin; each seed is another run.
"""

from __future__ import annotations

import os
import random
import sys
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import yaml

from nodl.names import expand_name
from nodl.remap import NodeNames, RemapRules, parse_rule

Fact = tuple[str, str]  # kind of endpoint (or "node") and final name
ROUNDS = 3  # how often a spin calls every callback
_STATE_SERVICES = ("get_logger_levels", "set_logger_levels")


class InvalidParameterTypeError(Exception):
    """rclpy's ``InvalidParameterTypeException``: a parameter keeps the type that it is declared with."""


class EndOfRun(BaseException):
    """The program would go on for ever."""


class Anything:
    """An object that takes whatever is asked of it: a logger, a clock, a message."""

    def __init__(self, *_: object, **fields: object) -> None:
        self.__dict__.update(fields)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Anything()

    def __call__(self, *_: object, **__: object) -> Any:
        return Anything()

    def __iter__(self) -> Iterator[object]:
        return iter(())

    def __getitem__(self, _: object) -> Any:
        return Anything()


class Recorder:
    """What happened in one run."""

    def __init__(self, parameters: dict[str, object], seed: int = 0) -> None:
        self.parameters = parameters
        self.facts: set[Fact] = set()
        self.callbacks: list[Callable[[], object]] = []
        self.words: list[str] | None = None  # arguments in the code instead of the launch's
        self._random = random.Random(seed)
        self._tosses = 400

    def choose(self) -> bool:
        self._tosses -= 1
        if self._tosses < 0:
            raise EndOfRun
        return self._random.random() < 0.5

    def spin(self, *_: object, **__: object) -> None:
        for _round in range(ROUNDS):
            for callback in list(self.callbacks):
                callback()


def _given(words: list[str] | None, *flags: str) -> list[str]:
    """What follows the flags among ROS arguments."""
    given, found, reading = words or [], [], False
    for index, word in enumerate(given):
        reading = word == "--ros-args" or (reading and word != "--")
        if reading and word in flags:
            found.append(given[index + 1])
        elif not reading and ":=" in word and "-r" in flags:
            found.append(word)  # deprecated, and obeyed
    return found


def _rules_in(words: list[str] | None) -> list[str]:
    return _given(words, "-r", "--remap")


def _parameters_in(words: list[str] | None, node: str) -> dict[str, object]:
    found: dict[str, object] = {}
    for text in _given(words, "-p", "--param"):
        left, _, value = text.partition(":=")
        meant, _, name = left.rpartition(":")
        if meant in ("", "/**", node):
            found[name] = yaml.safe_load(value)
    return found


class Parameter:
    def __init__(self, name: str, type_: object = None, value: object = None) -> None:
        self.name, self.value = name, value

    def get_parameter_value(self) -> Any:
        zeros = {"string": "", "integer": 0, "double": 0.0, "bool": False, "string_array": []}
        return types.SimpleNamespace(
            **{
                f"{kind}_value": self.value if type(self.value) is type(zero) else zero
                for kind, zero in zeros.items()
            }
        )


def _node_class(recorder: Recorder) -> type:
    class Node:
        def __init__(
            self, node_name: str, *, namespace: str | None = None, cli_args: Any = None,
            use_global_arguments: bool = True, enable_logger_service: bool = False, parameter_overrides: Any = None,
            allow_undeclared_parameters: bool = False, automatically_declare_parameters_from_overrides: bool = False,
            **_: object,
        ) -> None:  # fmt: skip
            rules = [*_rules_in(cli_args), *(_rules_in(recorder.words) if use_global_arguments else ())]
            remap = RemapRules(tuple(parse_rule(rule) for rule in rules))
            self._name = remap.node_name(node_name).name
            written = namespace or "/"
            space = written if written.startswith("/") else f"/{written}"
            self._namespace = remap.namespace(space, self._name).name
            self._resolver = NodeNames(self._name, self._namespace, remap)
            self._parameters: dict[str, Parameter] = {}
            self._declared: dict[str, tuple[type, object]] = {}
            self._on_set: list[Any] = []
            self._pre_set: list[Any] = []
            self._allow_undeclared_parameters = allow_undeclared_parameters
            everywhere = recorder.words if use_global_arguments else None
            launched = recorder.parameters if use_global_arguments and recorder.words is None else {}
            self._overrides = {
                **launched, **_parameters_in(everywhere, self._name), **_parameters_in(cli_args, self._name),
                **{p.name: p.value for p in parameter_overrides or ()},
            }  # fmt: skip
            if automatically_declare_parameters_from_overrides:
                for name, value in self._overrides.items():
                    self._parameters[name] = Parameter(name, None, value)
            recorder.facts.add(("node", self.get_fully_qualified_name()))
            own = getattr(self.create_publisher, "__func__", None)
            if own is not Node.create_publisher:  # else it is left out: every node has it
                self.create_publisher(Anything, "/parameter_events", 10)
            if enable_logger_service:
                for service in _STATE_SERVICES:
                    recorder.facts.add(("service_server", f"{self.get_fully_qualified_name()}/{service}"))

        def _made(self, kind: str, name: str) -> Any:
            if not isinstance(name, str):
                raise TypeError("a name is a str")
            resolve = (
                self._resolver.topic if kind in ("publisher", "subscription") else self._resolver.service
            )
            full = resolve(name).name
            recorder.facts.add((kind, full))

            def introspect(*_: object) -> None:
                recorder.facts.add(("publisher", f"{full}/_service_event"))

            return Anything(topic_name=full, srv_name=full, configure_introspection=introspect)

        def create_publisher(self, msg_type: object, topic: str, qos_profile: object, **_: object) -> Any:
            return self._made("publisher", topic)

        def create_subscription(
            self, msg_type: object, topic: str, callback: Any, qos_profile: object, **_: object
        ) -> Any:
            recorder.callbacks.append(lambda: callback(Anything(data="heard")))
            return self._made("subscription", topic)

        def create_service(self, srv_type: object, srv_name: str, callback: Any, **_: object) -> Any:
            recorder.callbacks.append(lambda: callback(Anything(), Anything()))
            return self._made("service_server", srv_name)

        def create_client(self, srv_type: object, srv_name: str, **_: object) -> Any:
            return self._made("service_client", srv_name)

        def create_timer(self, timer_period_sec: float, callback: Any, **_: object) -> Any:
            recorder.callbacks.append(callback)
            return Anything()

        def create_guard_condition(self, callback: Any, **_: object) -> Any:
            return Anything()

        def add_on_set_parameters_callback(self, callback: Any) -> None:
            self._on_set.append(callback)
            recorder.callbacks.append(lambda: callback([]))

        def add_pre_set_parameters_callback(self, callback: Any) -> None:
            self._pre_set.append(callback)

        def declare_parameter(
            self, name: str, value: object = None, descriptor: Any = None, ignore_override: bool = False
        ) -> Any:
            return self.declare_parameters("", [(name, value, descriptor)], ignore_override)[0]

        def declare_parameters(
            self, namespace: str, parameters: Any, ignore_override: bool = False
        ) -> list[Parameter]:
            prefix = f"{namespace}." if namespace else ""
            return [self._declare(ignore_override, prefix + entry[0], *entry[1:]) for entry in parameters]

        def _declare(
            self, ignored: bool, name: str, value: object = None, descriptor: object = None
        ) -> Parameter:
            given = value if ignored else self._overrides.get(name, value)
            typed = type(value) in (bool, int, float, str, list) and descriptor is None
            if typed and type(given) is not type(value):
                raise InvalidParameterTypeError
            self._parameters[name] = Parameter(name, None, given)
            self._declared[name] = type(value), descriptor
            return self._parameters[name]

        def undeclare_parameter(self, name: str) -> None:
            del self._parameters[name]

        def get_parameter(self, name: str) -> Any:
            if self.has_parameter(name) or not self._allow_undeclared_parameters:
                return self._parameters[name]
            return Parameter(name)

        def get_parameter_or(self, name: str, alternative: Parameter) -> Parameter:
            return self._parameters[name] if self.has_parameter(name) else alternative

        def get_parameters(self, names: list[str]) -> list[Any]:
            return [self.get_parameter(name) for name in names]

        def get_parameters_by_prefix(self, prefix: str) -> dict[str, Parameter]:
            start = f"{prefix}." if prefix else ""
            return {n.removeprefix(start): p for n, p in self._parameters.items() if n.startswith(start)}

        def has_parameter(self, name: str) -> bool:
            return name in self._parameters

        def set_parameters(self, parameter_list: list[Parameter]) -> None:
            for parameter in parameter_list:
                self.set_parameters_atomically([parameter])

        def set_parameters_atomically(self, parameter_list: list[Parameter]) -> None:
            for before in self._pre_set:
                parameter_list = before(parameter_list)
            if not self._allow_undeclared_parameters:
                assert all(p.name in self._parameters for p in parameter_list), "not declared"
            known = [(p, *self._declared[p.name]) for p in parameter_list if p.name in self._declared]
            refused = any(
                getattr(descriptor, "read_only", False) is True
                or (kind is not type(p.value) and not descriptor)
                for p, kind, descriptor in known
            )
            if not refused and all(callback(parameter_list).successful for callback in self._on_set):
                self._parameters.update({p.name: p for p in parameter_list})

        def get_name(self) -> str:
            return str(self._name)

        def get_namespace(self) -> str:
            return str(self._namespace)

        def get_fully_qualified_name(self) -> str:
            return expand_name("~", namespace=self._namespace, node=self._name)

        def resolve_topic_name(self, topic: str) -> str:
            return str(self._resolver.topic(topic).name)

        def get_logger(self) -> Any:
            return Anything()

        def get_clock(self) -> Any:
            return Anything()

        def destroy_node(self) -> None:
            pass

    return Node


def stand_in(recorder: Recorder) -> dict[str, types.ModuleType]:
    """The modules that a program imports."""
    node_class: Any = _node_class(recorder)

    def init(args: list[str] | None = None, **_: object) -> None:
        recorder.words = args

    def create_node(node_name: str, **more: Any) -> Any:
        return node_class(node_name, **more)

    class Executor(Anything):
        def spin(self) -> None:
            recorder.spin()

    def action(kind: str) -> type:
        class Action(Anything):
            def __init__(self, node: Any, action_type: object, action_name: str, *_: Any, **__: Any) -> None:
                full = expand_name(action_name, namespace=node.get_namespace(), node=node.get_name())
                recorder.facts.add((kind, full))

        return Action

    contents: dict[str, dict[str, object]] = {
        "rclpy": {
            "init": init, "spin": recorder.spin, "spin_once": recorder.spin, "shutdown": lambda *_: None,
            "try_shutdown": lambda *_: None, "create_node": create_node, "ok": recorder.choose, "Parameter": Parameter,
        },
        "rclpy.node": {"Node": node_class},
        "rclpy.action": {"ActionServer": action("action_server"), "ActionClient": action("action_client")},
        "rclpy.parameter": {"Parameter": Parameter},
        "rclpy.utilities": {"remove_ros_args": lambda args=None: list(sys.argv if args is None else args)},
        "rclpy.executors": {"SingleThreadedExecutor": Executor, "MultiThreadedExecutor": Executor},
        "rclpy.qos": {"QoSProfile": Anything, "qos_profile_sensor_data": None},
        "rclpy.service_introspection": {"ServiceIntrospectionState": Anything()},
        "rcl_interfaces": {},
        "rcl_interfaces.msg": {"ParameterDescriptor": Anything, "SetParametersResult": Anything},
        "std_msgs": {}, "std_msgs.msg": {name: type(name, (Anything,), {}) for name in ("String", "Bool", "Int32")},
        "std_srvs": {}, "std_srvs.srv": {name: type(name, (Anything,), {}) for name in ("Empty", "Trigger", "SetBool")},
        "example_interfaces": {}, "example_interfaces.action": {"Fibonacci": Anything},
        "tosses": {"choose": recorder.choose},
    }  # fmt: skip
    modules = {name: types.ModuleType(name) for name in contents}
    for name, members in contents.items():
        vars(modules[name]).update(members)
        parent, _, last = name.rpartition(".")
        if parent:
            setattr(modules[parent], last, modules[name])
    return modules


@contextmanager
def _installed(modules: dict[str, types.ModuleType], folder: Path) -> Iterator[None]:
    before, path, argv, environment = dict(sys.modules), list(sys.path), list(sys.argv), dict(os.environ)
    sys.modules.update(modules)
    sys.path.insert(0, str(folder))
    sys.argv = ["program"]
    try:
        yield
    finally:
        for name in set(sys.modules) - set(before):
            if name in modules or str(getattr(sys.modules[name], "__file__", "")).startswith(str(folder)):
                del sys.modules[name]
        sys.modules.update({name: module for name, module in before.items() if name in modules})
        sys.path[:], sys.argv = path, argv
        os.environ.clear()
        os.environ.update(environment)


def record(program: Path, parameters: dict[str, object], seed: int = 0) -> set[Fact]:
    """What the program in this file makes under these parameters and coin tosses."""
    recorder = Recorder(parameters, seed)
    main = types.ModuleType("__main__")
    main.__file__ = str(program)
    before = sys.modules["__main__"]
    with (
        _installed(stand_in(recorder), program.parent),
        redirect_stdout(StringIO()),
        redirect_stderr(StringIO()),
    ):
        sys.modules["__main__"] = main
        try:
            exec(compile(program.read_text(), str(program), "exec"), vars(main))
        except (EndOfRun, SystemExit, InvalidParameterTypeError):
            pass
        finally:
            sys.modules["__main__"] = before
    return recorder.facts
