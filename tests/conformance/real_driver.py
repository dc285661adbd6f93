"""Runs launch files through the public sources of ros2/launch and ros2/launch_ros, starting nothing.

Run as a script with those sources (``launch``, ``launch_xml``, ``launch_yaml``, ``launch_ros``,
``ament_index_python``, ``osrf_pycommon``) on PYTHONPATH; it never imports our packages. It reads a JSON list of
``{"file", "arguments", "environment", "folder"}`` and answers one JSON object a line, in order.

What it stands in for: rclpy and the message packages (not needed to decide what is launched), the coroutine
that spawns a process (ends at once, so no process event ever happens), and the container's answer to a load
request (success). Everything else, timers and emitted events included, is launch's own code. Each file runs
in a forked child, so that nothing leaks from one to the next.
"""

from __future__ import annotations

import importlib
import json
import logging
import os
import pathlib
import re
import sys
import tempfile
import types
from enum import Enum
from typing import Any


class NameValidationException(ValueError):
    pass


class InvalidNodeNameException(NameValidationException):
    pass


class InvalidNamespaceException(NameValidationException):
    pass


def _validate_namespace(namespace: str) -> bool:
    if len(namespace) > 245 or not re.fullmatch(r"/|(/[A-Za-z_][A-Za-z0-9_]*)+", namespace):
        raise InvalidNamespaceException("")
    return True


def _validate_node_name(name: str) -> bool:
    if len(name) > 255 or not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
        raise InvalidNodeNameException("")
    return True


class _Parameter:
    class Type(Enum):
        BOOL = bool
        ANY = object

        def check(self, value: object) -> bool:
            return isinstance(value, self.value)

    def __init__(self, name: str, type_: Any = None, value: object = None):
        if type_ is self.Type.BOOL and not isinstance(value, bool):
            raise ValueError(f"Type '{type_}' and value '{value}' do not agree")
        self.name, self.value = name, value
        self.bool_value = value

    def to_parameter_msg(self) -> list[object]:
        return [self.name, self.value]

    def get_parameter_value(self) -> _Parameter:
        return self


class _Message:
    def __init__(self, **fields: object):
        self.__dict__.update(fields)


class _LoadRequest:
    def __init__(self) -> None:
        self.package_name = self.plugin_name = self.node_name = self.node_namespace = ""
        self.remap_rules: list[str] = []
        self.parameters: list[Any] = []
        self.extra_arguments: list[Any] = []


class _Done:
    """A finished future of a service call."""

    def __init__(self, result: object):
        self._result = result

    def add_done_callback(self, callback: Any) -> None:
        callback(self)

    def exception(self) -> None:
        return None

    def result(self) -> object:
        return self._result


class _Client:
    def __init__(self, service: str, record: list[dict[str, Any]]):
        self.srv_name, self._record = service, record

    def wait_for_service(self, **_: object) -> bool:
        return True

    def call_async(self, request: Any) -> _Done:
        if isinstance(request, _LoadRequest):
            self._record.append({"container": self.srv_name.rpartition("/_container/")[0], **vars(request)})
            name = f"{request.node_namespace.rstrip('/')}/{request.node_name}"
            return _Done(_Message(success=True, full_node_name=name, error_message=""))
        return _Done(_Message(success=True))


class _Node:
    """The few things that launch_ros asks of its own node."""

    def __init__(self, record: list[dict[str, Any]]):
        self._record = record
        self._parameters: dict[str, Any] = {}

    def create_client(self, _type: object, service: str) -> _Client:
        return _Client(service, self._record)

    def create_subscription(self, *_: object) -> None:
        return None

    def create_timer(self, period: float, callback: Any) -> None:
        import threading

        threading.Timer(period, callback).start()

    def set_parameters(self, parameters: list[Any]) -> None:
        self._parameters.update({item.name: item for item in parameters})

    def get_parameter(self, name: str) -> Any:
        return self._parameters[name]


def _module(name: str, **members: object) -> types.ModuleType:
    module = types.ModuleType(name)
    module.__dict__.update(members)
    sys.modules[name] = module
    parent, _, leaf = name.rpartition(".")
    if parent:
        setattr(sys.modules[parent], leaf, module)
    return module


def _constants(names: str) -> type:
    """``A=0 B C=10``: numbers count up."""
    members: dict[str, object] = {}
    value = -1
    for item in names.split():
        name, _, number = item.partition("=")
        value = int(number) if number else value + 1
        members[name] = value
    return type("Constants", (_Message,), members)


def stand_in_for_rclpy() -> None:
    _module("rclpy", Context=_Message, init=lambda **_: None)
    _module("rclpy.exceptions", InvalidNodeNameException=InvalidNodeNameException)
    _module("rclpy.validate_namespace", validate_namespace=_validate_namespace)
    _module("rclpy.validate_node_name", validate_node_name=_validate_node_name)
    _module("rclpy.parameter", Parameter=_Parameter)
    _module("rclpy.logging", get_logging_directory=lambda: pathlib.Path("/ros_log"))
    _module("rclpy.executors", SingleThreadedExecutor=_Message)
    _module("rclpy.utilities", get_rmw_implementation_identifier=lambda: "rmw_none")
    transition = _constants(
        "TRANSITION_CREATE TRANSITION_CONFIGURE TRANSITION_CLEANUP TRANSITION_ACTIVATE TRANSITION_DEACTIVATE "
        "TRANSITION_UNCONFIGURED_SHUTDOWN TRANSITION_INACTIVE_SHUTDOWN TRANSITION_ACTIVE_SHUTDOWN "
        "TRANSITION_DESTROY"
    )
    state = _constants(
        "PRIMARY_STATE_UNKNOWN PRIMARY_STATE_UNCONFIGURED PRIMARY_STATE_INACTIVE PRIMARY_STATE_ACTIVE "
        "PRIMARY_STATE_FINALIZED TRANSITION_STATE_CONFIGURING=10 TRANSITION_STATE_CLEANINGUP "
        "TRANSITION_STATE_SHUTTINGDOWN TRANSITION_STATE_ACTIVATING TRANSITION_STATE_DEACTIVATING "
        "TRANSITION_STATE_ERRORPROCESSING"
    )

    class ChangeState:
        class Request:
            def __init__(self) -> None:
                self.transition = _Message(id=0)

    _module("lifecycle_msgs")
    _module("lifecycle_msgs.msg", Transition=transition, State=state, TransitionEvent=_Message)
    _module("lifecycle_msgs.srv", ChangeState=ChangeState)
    _module("composition_interfaces")
    _module("composition_interfaces.srv", LoadNode=type("LoadNode", (), {"Request": _LoadRequest}))


class _Recorder(logging.Handler):
    """Collects what the user asked to log, warnings, and the exception that ended the launch."""

    def __init__(self) -> None:
        super().__init__(logging.DEBUG)
        self.logs: list[tuple[str, str]] = []
        self.error: BaseException | None = None

    def emit(self, record: logging.LogRecord) -> None:
        error = sys.exc_info()[1]
        text = record.getMessage()
        if record.levelno >= logging.ERROR and text.startswith("Caught exception in launch") and error:
            self.error = error
        elif record.name == "launch.user" or record.levelno == logging.WARNING:
            prefix = "" if record.name.startswith(("launch", "root")) else f"{record.name}: "
            self.logs.append((record.levelname, prefix + text))


def resolve(path: str, arguments: list[str]) -> dict[str, Any]:
    import launch
    import launch.actions
    import launch.substitutions  # registers them
    import launch_ros.actions
    import launch_ros.actions.lifecycle_node as lifecycle_node
    import launch_ros.actions.load_composable_nodes as load_composable_nodes
    import launch_xml
    import launch_yaml
    from launch.frontend import Parser
    from launch.launch_description_sources import AnyLaunchDescriptionSource

    Parser.extensions_loaded = True
    Parser.frontend_parsers = {"xml": launch_xml.Parser, "yaml": launch_yaml.Parser}
    before = dict(os.environ)
    processes: list[dict[str, Any]] = []
    loads: list[dict[str, Any]] = []
    local = launch.actions.ExecuteLocal

    async def start_nothing(self: Any, context: Any) -> None:
        self._ExecuteLocal__cleanup()

    execute = local.execute

    def record(self: Any, context: Any) -> Any:
        stopped = context.is_shutdown
        result = execute(self, context)
        if not stopped:
            description = self.process_description
            processes.append({
                "cmd": description.final_cmd,
                "fqn": self.node_name if isinstance(self, launch_ros.actions.Node) else None,
                "environment": {k: v for k, v in description.final_env.items() if before.get(k) != v},
                "cwd": description.final_cwd,
                "shell": self.shell is True,
            })  # fmt: skip
        return result

    local._ExecuteLocal__execute_process, local.execute = start_nothing, record
    node = _Node(loads)
    modules = [lifecycle_node, load_composable_nodes]
    for name in ("ros_timer", "set_use_sim_time"):
        modules.append(__import__(f"launch_ros.actions.{name}", fromlist=["x"]))
    for module in modules:
        module.get_ros_node = lambda context: node
    recorder = _Recorder()
    logging.root.setLevel(logging.DEBUG)
    setattr(logging.Logger, "callHandlers", lambda logger, entry: recorder.handle(entry))  # noqa: B010
    service = launch.LaunchService(argv=[], noninteractive=True)
    service.include_launch_description(
        launch.LaunchDescription([
            launch.actions.IncludeLaunchDescription(
                AnyLaunchDescriptionSource(path), launch_arguments=[a.split(":=", 1) for a in arguments]
            )
        ])
    )  # fmt: skip
    service.run(shutdown_when_idle=True)
    texts = {}
    for process in processes:
        for word in process["cmd"]:
            if os.path.basename(word).startswith("launch_params_") and os.path.isfile(word):
                texts[word] = pathlib.Path(word).read_text(encoding="utf-8")
    return {
        "processes": processes,
        "loads": [_load(item) for item in loads],
        "logs": recorder.logs,
        "error": None if recorder.error is None else _innermost(recorder.error),
        "parameter_files": texts,
    }


def _load(request: dict[str, Any]) -> dict[str, Any]:
    return {
        "container": request["container"],
        "package": request["package_name"],
        "plugin": request["plugin_name"],
        "name": request["node_name"],
        "namespace": request["node_namespace"],
        "remaps": request["remap_rules"],
        "parameters": request["parameters"],
        "extra_arguments": request["extra_arguments"],
    }


def _innermost(error: BaseException) -> tuple[str, str]:
    """Of an error that lists the complaint of each front end, the complaint of the one that the name suggests."""
    likely = getattr(error, "_likely_errors", None)
    while likely:
        error = likely[0]
        likely = getattr(error, "_likely_errors", None)
    return type(error).__name__, str(error.args[0] if isinstance(error, KeyError) else error)


def run_forked(job: dict[str, Any]) -> dict[str, Any]:
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reader)
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.environ.update(job["environment"])
        os.chdir(job["folder"])
        try:
            answer = resolve(job["file"], job["arguments"])
        except BaseException as error:  # whatever happens, the parent must hear of it
            answer = {"crash": f"{type(error).__name__}: {error}"}
        with os.fdopen(writer, "w") as pipe:
            json.dump(answer, pipe, default=list)
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader) as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    result: dict[str, Any] = json.loads(text) if text else {"crash": "no answer"}
    return result


def main() -> None:
    stand_in_for_rclpy()
    jobs = json.load(sys.stdin)
    with tempfile.TemporaryDirectory(prefix="launch_grammar_") as own:
        import launch.frontend

        root = pathlib.Path(own)
        (root / "share/ament_index/resource_index/packages").mkdir(parents=True)
        (root / "share/ament_index/resource_index/packages/launch").touch()
        grammar = pathlib.Path(launch.frontend.__file__).parents[2] / "share" / "launch"
        if grammar.is_dir():
            (root / "share/launch").symlink_to(grammar)
        paths = [*filter(None, [os.environ.get("AMENT_PREFIX_PATH")]), own]
        os.environ["AMENT_PREFIX_PATH"] = os.pathsep.join(paths)
        os.environ["ROS_LOG_DIR"] = f"{own}/log"
        for name in ("launch_ros.actions", "launch_xml", "launch_yaml"):
            importlib.import_module(name)  # once; every child inherits it
        importlib.import_module("launch.frontend.parse_substitution").parse_substitution("$(env X)")

        if jobs == "api":
            public_api = importlib.import_module("public_api")  # beside this script

            print(json.dumps(public_api.describe()))
            return
        for job in jobs:
            print(json.dumps(run_forked(job)), flush=True)


if __name__ == "__main__":
    main()
