"""From a launch file to the permission: nodes without a manifest, installed as colcon installs them.

The launch file sets the parameter that names the topic, the namespace and the remap rules; nothing is executed.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_launch import LaunchPlan, ManifestError, ResolveOptions, provision, resolve
from enclave_launch.diagnostics import Code
from enclave_launch.report.explained import explain
from enclave_launch.verb.secure_launch import params_yaml

REPEATER = Path(__file__).parents[3] / "fixtures" / "programs" / "repeater.py"
SITE = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"
PYTHON = "#!/usr/bin/python3\n"
ENTRY_POINTS = "[console_scripts]\nrepeater = demo.repeater:main\n"
LAUNCH = """
<launch>
  <group>
    <push-ros-namespace namespace="robot1"/>
    <node pkg="demo" exec="repeater" name="echo">
      <param name="input" value="speech"/>
      <remap from="speech_again" to="/loud/speech"/>
    </node>
  </group>
</launch>
"""
SETUPTOOLS = """
# EASY-INSTALL-ENTRY-SCRIPT: 'demo','console_scripts','repeater'
import re
import sys
from importlib.metadata import distribution

def importlib_load_entry_point(spec, group, name):
    dist_name, _, _ = spec.partition('==')
    matches = (e for e in distribution(dist_name).entry_points if e.group == group and e.name == name)
    return next(matches).load()

globals().setdefault('load_entry_point', importlib_load_entry_point)
if __name__ == '__main__':
    sys.argv[0] = re.sub(r'(-script\\.pyw?|\\.exe)?$', '', sys.argv[0])
    sys.exit(load_entry_point('demo==0.0.0', 'console_scripts', 'repeater')())
"""

Launch = Callable[..., LaunchPlan]


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """An install prefix with an empty package ``demo``."""
    prefix = tmp_path / "install"
    index = prefix / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "demo").touch()
    (prefix / "lib/demo").mkdir(parents=True)
    (prefix / SITE).mkdir(parents=True)
    return prefix


def install_program(prefix: Path, content: str | bytes, name: str = "repeater") -> None:
    program = prefix / "lib/demo" / name
    program.write_bytes(content.encode() if isinstance(content, str) else content)
    program.chmod(0o755)


def install_module(folder: Path, metadata: str) -> Path:
    """The package ``demo`` with module ``repeater``, and what names its entry point."""
    (folder / "demo").mkdir(parents=True)
    (folder / "demo/__init__.py").touch()
    shutil.copy(REPEATER, folder / "demo/repeater.py")
    (folder / metadata).mkdir()
    (folder / metadata / "entry_points.txt").write_text(ENTRY_POINTS)
    return folder / "demo/repeater.py"


def as_console_script(prefix: Path, build: Path) -> Path:
    install_program(prefix, PYTHON + SETUPTOOLS)
    return install_module(prefix / SITE, "demo-0.0.0-py3.11.egg-info")


def as_plain_script(prefix: Path, build: Path) -> Path:
    install_program(prefix, PYTHON + REPEATER.read_text())
    return prefix / "lib/demo/repeater"


def as_linked_script(prefix: Path, build: Path) -> Path:
    """``install(PROGRAMS ...)`` of ament_cmake under ``--symlink-install``."""
    source = build / "repeater.py"
    source.parent.mkdir(parents=True)
    source.write_text(PYTHON + REPEATER.read_text())
    source.chmod(0o755)
    (prefix / "lib/demo/repeater").symlink_to(source)
    return source


def as_egg_link(prefix: Path, build: Path) -> Path:
    """``--symlink-install`` of ament_python: ``setup.py develop`` into the build folder."""
    install_program(prefix, PYTHON + SETUPTOOLS)
    (prefix / SITE / "demo.egg-link").write_text(f"{build}\n.\n")
    return install_module(build, "demo.egg-info")


INSTALLED = [as_console_script, as_plain_script, as_linked_script, as_egg_link]


@pytest.fixture
def launch(tmp_path: Path, prefix: Path, monkeypatch: pytest.MonkeyPatch) -> Launch:
    """The plan of a launch file, the prefix being all that is installed."""
    for name in ("AMENT_PREFIX_PATH", "ROS_DISTRO", "ROS_DOMAIN_ID"):
        monkeypatch.delenv(name, raising=False)

    def plan(text: str = LAUNCH, **options: object) -> LaunchPlan:
        file = tmp_path / "test.launch.xml"
        file.write_text(text)
        return resolve(file, options=ResolveOptions(prefixes=(prefix,), **options))  # type: ignore[arg-type]

    return plan


@pytest.mark.parametrize("install", INSTALLED)
def test_the_permission_has_the_launch_files_value(
    install: Callable[[Path, Path], Path], launch: Launch, prefix: Path, tmp_path: Path
) -> None:
    source = install(prefix, tmp_path / "build/demo")
    plan = launch()
    assert not plan.problems
    granted = permissions(plan)
    assert {("subscribe", "/robot1/speech"), ("publish", "/loud/speech")} <= granted
    assert not [name for _, name in granted if "chatter" in name or "speech_again" in name]
    explained = explain(plan.derived, "/loud/speech")
    line = 1 + source.read_text().splitlines().index(
        '        self.publisher = self.create_publisher(String, f"{heard}_again", 10)'
    )
    assert f"    node /robot1/echo: {source}:{line}: 'param:input_again'" in explained
    assert any("remapped by speech_again:=/loud/speech" in each for each in explained)


def test_a_parameter_file_that_names_the_node_as_its_source_does_decides_its_topics(
    launch: Launch, prefix: Path, tmp_path: Path
) -> None:
    """The launch file gives no name: that of the source selects the section, and ``--dump-params`` shows it."""
    as_console_script(prefix, tmp_path / "build/demo")
    own, others = tmp_path / "own.yaml", tmp_path / "others.yaml"
    own.write_text("repeater: {ros__parameters: {input: speech}}\n")
    others.write_text("somebody: {ros__parameters: {input: speech}}\n")
    text = '<launch><node pkg="demo" exec="repeater"><param from="{}"/></node></launch>'
    plan = launch(text.format(own))
    assert ("subscribe", "/speech") in permissions(plan)
    assert ("subscribe", "/chatter") not in permissions(plan)
    assert "input: speech" in params_yaml(plan)
    plan = launch(text.format(others))
    assert ("subscribe", "/chatter") in permissions(plan)
    assert ("subscribe", "/speech") not in permissions(plan)
    assert params_yaml(plan) == ""


def permissions(plan: LaunchPlan) -> set[tuple[str, str]]:
    (enclave,) = plan.derived.reasons.values()
    return {(rule.operation.value, rule.expression) for rule in enclave}


def test_without_inference_a_secure_start_is_refused(launch: Launch, prefix: Path, tmp_path: Path) -> None:
    as_console_script(prefix, tmp_path / "build")
    plan = launch(infer=False)
    (problem,) = plan.problems
    assert problem.subject == "demo/repeater"
    with pytest.raises(ManifestError, match="nothing was started or written"):
        provision(plan, tmp_path / "keystore")
    assert not (tmp_path / "keystore").exists()


def test_a_compiled_node_without_a_manifest_says_how_to_write_one(launch: Launch, prefix: Path) -> None:
    install_program(prefix, b"\x7fELF\x02\x01\x01", "compiled")
    (problem,) = launch('<launch><node pkg="demo" exec="compiled"/></launch>').problems
    assert "compiled program" in problem.text
    assert f"{prefix}/share/demo/*.nodl.xml" in problem.text
    assert "--learn" in problem.remedy


COMPUTED = """
import sys
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("computed")
node.create_publisher(String, "sensors/" + sys.argv[1], 10)
rclpy.spin(node)
"""


def test_a_name_known_in_part_is_an_error_unless_accepted(launch: Launch, prefix: Path) -> None:
    install_program(prefix, PYTHON + COMPUTED, "computed")
    text = '<launch><node pkg="demo" exec="computed" namespace="robot1"/></launch>'
    (problem,) = launch(text).problems
    assert f"{prefix}/lib/demo/computed:8" in str(problem)
    accepted = launch(text, accept_patterns=True)
    assert not accepted.problems
    assert ("publish", "/robot1/sensors/*") in permissions(accepted)
    assert any("sensors/*" in warning.text for warning in accepted.warnings)


def test_a_name_not_known_at_all_is_an_error_always(launch: Launch, prefix: Path) -> None:
    install_program(prefix, PYTHON + COMPUTED.replace('"sensors/" + ', ""), "computed")
    text = '<launch><node pkg="demo" exec="computed"/></launch>'
    assert launch(text).problems
    assert launch(text, accept_patterns=True).problems


def test_the_command_line_says_the_same(prefix: Path, tmp_path: Path, launch: Launch) -> None:
    as_egg_link(prefix, tmp_path / "build")
    file = tmp_path / "test.launch.xml"
    file.write_text(LAUNCH)

    def secure_launch(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "enclave_launch", "--prefix", str(prefix), *words, str(file)]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=60, check=False)

    explained = secure_launch("--explain", "/robot1/speech")
    assert explained.returncode == 0
    assert "demo/repeater.py:13" in explained.stdout
    refused = secure_launch("--secure", "--keystore", str(tmp_path / "ks"), "--missing-nodl", "error")
    assert refused.returncode != 0
    assert "demo/repeater" in refused.stderr
    assert "Traceback" not in refused.stderr
    assert not (tmp_path / "ks").exists()


TALKER = """{python}import sys
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

def main(args=None):
    rclpy.init({init})
    node = Node('talker'{node})
    node.create_publisher(String, 'chatter', 10)
    rclpy.spin(node)

main()
"""
RENAMED = """<launch><node pkg="demo" exec="repeater" name="other" namespace="r1">
  <remap from="chatter" to="news"/></node></launch>"""


@pytest.mark.parametrize(
    ("init", "node", "published", "name"),
    [
        ("", "", "/r1/news", "/r1/other"),
        ("args=None", "", "/r1/news", "/r1/other"),
        ("args=args", "", "/r1/news", "/r1/other"),
        ("args=sys.argv", "", "/r1/news", "/r1/other"),
        ("args=[]", "", "/chatter", "/talker"),
        ("args=['--ros-args', '--log-level', 'debug']", "", "/chatter", "/talker"),
        ("", ", use_global_arguments=False", "/chatter", "/talker"),
        ("", ", use_global_arguments=True", "/r1/news", "/r1/other"),
    ],
)
def test_a_launchs_rules_reach_a_node_that_listens_to_them_and_no_other(
    init: str, node: str, published: str, name: str, launch: Launch, prefix: Path
) -> None:
    """rclpy.init with arguments does not read the command line; ``use_global_arguments`` as in rcl_node_options_t."""
    install_program(prefix, TALKER.format(python=PYTHON, init=init, node=node))
    plan = launch(RENAMED)
    assert [str(problem) for problem in plan.problems] == []
    (running,) = plan.nodes
    published_here = [
        rule.expression
        for rules in plan.derived.reasons.values()
        for rule, why in rules.items()
        if rule.operation.value == "publish" and any(reason.origin == "declared" for reason in why)
    ]
    assert (running.fqn, published_here) == (name, [published])


def test_whether_a_node_listens_must_be_known_where_the_launch_gives_it_something(
    launch: Launch, prefix: Path
) -> None:
    undecided = ", use_global_arguments=bool(sys.argv[3:])"
    install_program(prefix, TALKER.format(python=PYTHON, init="", node=undecided))
    assert any("use_global_arguments" in str(problem) for problem in launch(RENAMED).problems)
    assert not launch('<launch><node pkg="demo" exec="repeater"/></launch>').problems


OPTIONS = """
import argparse
import rclpy
from std_msgs.msg import String
parser = argparse.ArgumentParser()
parser.add_argument("--raw", action="store_true")
parser.add_argument("--no-status", action="store_false", dest="status")
parser.add_argument("--mode", default="slow")
given, _ = parser.parse_known_args()
rclpy.init()
node = rclpy.create_node("flags")
if given.raw:
    node.create_publisher(String, "raw", 10)
if given.status:
    node.create_publisher(String, "status", 10)
if given.mode == "fast":
    node.create_publisher(String, "fast", 10)
rclpy.spin(node)
"""


@pytest.mark.parametrize(
    ("words", "published"),
    [
        ("", {"/status"}),
        ("--raw", {"/raw", "/status"}),
        ("--raw --no-status", {"/raw"}),
        ("--mode fast", {"/status", "/fast"}),
        ("--mode=medium", {"/status"}),
    ],
)
def test_options_of_the_command_line_decide_which_interfaces_there_are(
    words: str, published: set[str], launch: Launch, prefix: Path
) -> None:
    install_program(prefix, PYTHON + OPTIONS, "flags")
    plan = launch(f'<launch><node pkg="demo" exec="flags" args="{words}"/></launch>')
    assert not plan.problems
    names = {name for operation, name in permissions(plan) if operation == "publish"}
    assert names & {"/raw", "/status", "/fast"} == published


DECIDED = """
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String

JOINTS = {"arm": 2, "hand": 1}

class Decided(Node):
    def __init__(self):
        super().__init__("decided")
        kind = self.declare_parameter("kind", "arm").value
        if self.declare_parameter("rate", 10.0).value > 20.0:
            self.publish("fast")
        if kind == "hand":
            self.publish("grip")
        for i in range(JOINTS[kind]):
            self.publish(f"{kind}/joint_{i + 1}")
        me = self.get_namespace().strip("/")
        for robot in self.declare_parameter("robots", ["r1", "r2"]).value:
            if robot != me:
                self.publish(f"/{robot}/inbox")
        if not self.declare_parameter("listen", True).value:
            self.create_timer(1.0, lambda: self.publish("polled"))
        if self.declare_parameter("mode", "idle").value == "auto":
            self.set_parameters([Parameter("mode", value="manual")])
        if self.get_parameter("mode").value == "manual":
            self.publish("manual")
        match self.declare_parameter("gait", "stand").value:
            case "walk" | "trot":
                self.publish("steps")
            case "wheel":
                self.publish("wheels")

    def publish(self, topic):
        self.create_publisher(String, topic, 10)

rclpy.init()
rclpy.spin(Decided())
"""


def published_with(parameters: dict[str, str], launch: Launch, program: str) -> set[str]:
    """Return what ``program`` may publish in a launch that sets ``parameters``, without what every node publishes."""
    params = "".join(f'<param name="{name}" value="{value}"/>' for name, value in parameters.items())
    plan = launch(f'<launch><node pkg="demo" exec="{program}">{params}</node></launch>')
    assert [str(problem) for problem in plan.problems] == []
    own = {name for operation, name in permissions(plan) if operation == "publish"}
    return own - {"/rosout", "/parameter_events"}


@pytest.mark.parametrize(
    ("given", "published"),
    [
        ({}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox"}),
        ({"rate": "20.0"}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox"}),
        ({"rate": "20.5"}, {"/r1/fast", "/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox"}),
        ({"kind": "hand"}, {"/r1/grip", "/r1/hand/joint_1", "/r2/inbox"}),
        ({"robots": "[r3, r1]"}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r3/inbox"}),
        ({"listen": "false"}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox", "/r1/polled"}),
        ({"mode": "manual"}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox", "/r1/manual"}),
        ({"mode": "auto"}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox", "/r1/manual"}),
        ({"gait": "trot"}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox", "/r1/steps"}),
        ({"gait": "wheel"}, {"/r1/arm/joint_1", "/r1/arm/joint_2", "/r2/inbox", "/r1/wheels"}),
    ],
)
def test_parameters_of_the_launch_decide_what_a_program_makes(
    given: dict[str, str], published: set[str], launch: Launch, prefix: Path
) -> None:
    """Comparisons of numbers, look-ups in tables, elements of lists, callbacks under a condition."""
    install_program(prefix, PYTHON + DECIDED, "decided")
    params = "".join(f'<param name="{name}" value="{value}"/>' for name, value in given.items())
    plan = launch(
        f'<launch><node pkg="demo" exec="decided" namespace="r1">{params}</node></launch>',
        accept_patterns=False,
    )
    assert not plan.problems
    own = {name for operation, name in permissions(plan) if operation == "publish"}
    assert own - {"/rosout", "/parameter_events"} == published


def test_each_start_of_a_program_has_the_interfaces_of_its_own_parameters(
    launch: Launch, prefix: Path
) -> None:
    install_program(prefix, PYTHON + DECIDED, "decided")
    plan = launch(
        '<launch><node pkg="demo" exec="decided" name="one" namespace="a"><param name="kind" value="hand"/></node>'
        '<node pkg="demo" exec="decided" name="two" namespace="b"/></launch>',
        enclave_scope="node",
    )
    granted = {
        enclave: {rule.expression for rule in rules} for enclave, rules in plan.derived.reasons.items()
    }
    hands = {enclave for enclave, names in granted.items() if any("grip" in name for name in names)}
    arms = {enclave for enclave, names in granted.items() if any("joint_2" in name for name in names)}
    assert len(granted) == 2 and len(hands) == 1 and len(arms) == 1 and not hands & arms


@pytest.mark.parametrize(
    ("node", "fast"),
    [("", True), (", use_global_arguments=False", False), (", cli_args=['--ros-args']", None)],
)
def test_parameters_of_the_launch_decide_for_a_node_that_listens_to_it(
    node: str, fast: bool | None, launch: Launch, prefix: Path
) -> None:
    """What arguments in code do to the launch's parameters is not followed: nothing is decided then."""
    install_program(prefix, PYTHON + DECIDED.replace('"decided")', f'"decided"{node})'), "decided")
    plan = launch('<launch><node pkg="demo" exec="decided"><param name="rate" value="30.0"/></node></launch>')
    assert bool(plan.problems) is (fast is None)
    assert (("publish", "/fast") in permissions(plan)) is (fast is not False)


BELOW = """
import rclpy
from std_msgs.msg import String
node = rclpy.create_node("below", automatically_declare_parameters_from_overrides=True)
node.declare_parameter("topics.scan", "scan")
for name, parameter in node.get_parameters_by_prefix("topics").items():
    node.create_publisher(String, f"{name}/{parameter.value.strip('/')}", 10)
for pair in node.declare_parameter("pairs", ["a:b"]).value:
    robot, topic = pair.split(":")
    node.create_publisher(String, f"{robot}/{topic}", 10)
rclpy.spin(node)
"""


@pytest.mark.parametrize(
    ("given", "published"),
    [
        ({}, {"/scan/scan", "/a/b"}),
        ({"topics.scan": "/laser/", "topics.image": "camera"}, {"/scan/laser", "/image/camera", "/a/b"}),
        ({"pairs": "[c:d, e:f]"}, {"/scan/scan", "/c/d", "/e/f"}),
    ],
)
def test_parameters_below_a_prefix_and_parts_of_elements_are_the_launchs(
    given: dict[str, str], published: set[str], launch: Launch, prefix: Path
) -> None:
    install_program(prefix, PYTHON + BELOW, "below")
    assert published_with(given, launch, "below") == published


CHOSEN = """
from enum import Enum
import rclpy
from std_msgs.msg import String

class Gait(Enum):
    WALK = "walk"
    TROT = "trot"

STEPS = {Gait.WALK: ["slow"], Gait.TROT: ["quick", "light"]}
node = rclpy.create_node("chosen")

def whisper():
    node.create_publisher(String, "whisper", 10)

def shout():
    node.create_publisher(String, "shout", 10)

loud = node.declare_parameter("loud", False).value
count = node.declare_parameter("count", 2).value
(shout if loud else whisper)()
node.create_publisher(String, ["low", "high"][loud], 10)
if count % 2 == 0:
    node.create_publisher(String, f"pair_{count // 2}", 10)
for topic in {1: ["one"], 2: ["one", "two"]}.get(count, []):
    node.create_publisher(String, topic, 10)
for topic in STEPS[Gait(node.declare_parameter("gait", "walk").value)]:
    node.create_publisher(String, topic, 10)
rclpy.spin(node)
"""


@pytest.mark.parametrize(
    ("given", "published"),
    [
        ({}, {"/whisper", "/low", "/pair_1", "/one", "/two", "/slow"}),
        ({"loud": "true", "count": "1"}, {"/shout", "/high", "/one", "/slow"}),
        ({"count": "4", "gait": "trot"}, {"/whisper", "/low", "/pair_2", "/quick", "/light"}),
    ],
)
def test_functions_lists_members_and_remainders_that_a_parameter_chooses_are_decided(
    given: dict[str, str], published: set[str], launch: Launch, prefix: Path
) -> None:
    install_program(prefix, PYTHON + CHOSEN, "chosen")
    assert published_with(given, launch, "chosen") == published


MEMBERS = """
import argparse
import enum
import os
import rclpy
from std_msgs.msg import String
Kind = {kind}
LEVELS = ("ok", "warn", "error")
parser = argparse.ArgumentParser()
parser.add_argument("--port", default="/dev/usb0")
parser.add_argument("--only-errors", action="store_true")
given, _ = parser.parse_known_args()
rclpy.init()
node = rclpy.create_node("members")

def make(port, only_errors):
    node.create_publisher(String, os.path.basename(port), 10)
    for level in LEVELS[LEVELS.index("error" if only_errors else "warn"):]:
        node.create_publisher(String, level, 10)

make(**vars(given))
kind = Kind(node.declare_parameter("kind", 0).value)
if kind > Kind.GRID:
    node.create_publisher(String, "edges", 10)
node.create_publisher(String, Kind[node.declare_parameter("name", "GRAPH").value].name.lower(), 10)
rclpy.spin(node)
"""


@pytest.mark.parametrize(
    ("words", "inside", "published"),
    [
        ("--port /dev/usb1", "", {"/usb1", "/warn", "/error", "/graph"}),
        ("--only-errors", '<param name="kind" value="1"/>', {"/usb0", "/error", "/edges", "/graph"}),
        ("--port x", '<param name="name" value="GRID"/>', {"/x", "/warn", "/error", "/grid"}),
    ],
)
def test_members_by_name_and_number_options_as_keywords_and_parts_of_paths_are_decided(
    words: str, inside: str, published: set[str], launch: Launch, prefix: Path
) -> None:
    class_of = "None\nclass Kind(enum.IntEnum):\n    GRID = 0\n    GRAPH = 1"
    install_program(prefix, PYTHON + MEMBERS.format(kind=class_of), "members")
    plan = launch(f'<launch><node pkg="demo" exec="members" args="{words}">{inside}</node></launch>')
    assert [str(problem) for problem in plan.problems] == []
    own = {name for operation, name in permissions(plan) if operation == "publish"}
    assert own - {"/rosout", "/parameter_events"} == published


NUMBERS = """
import argparse
import os
import rclpy
from std_msgs.msg import String
parser = argparse.ArgumentParser()
parser.add_argument("--fps", type=float, default=30.0)
parser.add_argument("--device", type=int, default=0)
given, _ = parser.parse_known_args()
rclpy.init()
node = rclpy.create_node("numbers")

def make(name, twice=False):
    if twice:
        return [node.create_publisher(String, name + "/" + side, 10) for side in ("left", "right")]
    return node.create_publisher(String, name, 10)

if given.fps > 20:
    make("fast")
make(f"camera{given.device}", twice=True)
if int(os.environ.get("ARMS", "1")) > 1:
    make("second_arm")
if os.environ.get("DEBUG"):
    make("debug")
names = node.declare_parameter("names", ["one"]).value
if len(names) > 1:
    make("several")
rclpy.spin(node)
"""


@pytest.mark.parametrize(
    ("words", "inside", "published"),
    [
        ("", "", {"/fast", "/camera0/left", "/camera0/right"}),
        ("--fps 5 --device=2", "", {"/camera2/left", "/camera2/right"}),
        (
            "--fps 20.5",
            '<env name="ARMS" value="2"/>',
            {"/fast", "/camera0/left", "/camera0/right", "/second_arm"},
        ),
        (
            "--fps 20.5",
            '<env name="DEBUG" value="0"/>',
            {"/fast", "/camera0/left", "/camera0/right", "/debug"},
        ),
        ("--fps 1", '<param name="names" value="[a, b]"/>', {"/camera0/left", "/camera0/right", "/several"}),
    ],
)
def test_numbers_of_the_command_line_variables_and_lengths_decide(
    words: str, inside: str, published: set[str], launch: Launch, prefix: Path
) -> None:
    install_program(prefix, PYTHON + NUMBERS, "numbers")
    plan = launch(f'<launch><node pkg="demo" exec="numbers" args="{words}">{inside}</node></launch>')
    assert [str(problem) for problem in plan.problems] == []
    own = {name for operation, name in permissions(plan) if operation == "publish"}
    assert own - {"/rosout", "/parameter_events"} == published


@pytest.mark.parametrize(("words", "fast"), [("-f 5", True), ("--fp 5", False), ("stray", True)])
def test_an_option_is_read_as_argparse_reads_it(words: str, fast: bool, launch: Launch, prefix: Path) -> None:
    """``-f`` is not declared, ``--fp`` is short for ``--fps``; a bare word is no option."""
    install_program(prefix, PYTHON + NUMBERS, "numbers")
    plan = launch(f'<launch><node pkg="demo" exec="numbers" args="{words}"/></launch>')
    assert not plan.problems
    assert (("publish", "/fast") in permissions(plan)) is fast


LISTS = """
import argparse
import sys
import rclpy
from rclpy.utilities import remove_ros_args
from std_msgs.msg import String
parser = argparse.ArgumentParser({parser})
parser.add_argument("topics", nargs="*")
parser.add_argument("--robots", nargs="+", default=["base"], choices=["base", "arm", "head"])
parser.add_argument("-s", "--sensor", action="append", dest="sensors", default=[])
parser.add_argument("--rear", nargs="?", const="rear", default="front")
given, _ = parser.{read}
rclpy.init()
node = rclpy.create_node("lists")
for name in given.topics + given.robots + given.sensors + [given.rear]:
    node.create_publisher(String, name, 10)
rclpy.spin(node)
"""


@pytest.mark.parametrize(
    ("words", "published"),
    [
        ("", {"/base", "/front"}),
        ("a b", {"/a", "/b", "/base", "/front"}),
        ("--robots arm head", {"/arm", "/head", "/front"}),
        ("a -s gps --sensor=imu --rear", {"/a", "/base", "/gps", "/imu", "/rear"}),
        ("--rear back -- --odd", {"/base", "/back", "/_odd"}),
    ],
)
def test_lists_of_words_of_the_command_line_are_names(
    words: str, published: set[str], launch: Launch, prefix: Path
) -> None:
    program = LISTS.format(parser="", read="parse_known_args(remove_ros_args()[1:])")
    install_program(
        prefix, PYTHON + program.replace("String, name", "String, name.replace('--', '_')"), "lists"
    )
    given = f'args="{words}"' if words else ""
    plan = launch(f'<launch><node pkg="demo" exec="lists" {given}/></launch>')
    assert [str(problem) for problem in plan.problems] == []
    own = {name for operation, name in permissions(plan) if operation == "publish"}
    assert own - {"/rosout", "/parameter_events"} == published


@pytest.mark.parametrize(
    ("argument", "words", "published"),
    [
        ("'topic'", "", "/chatter"),
        ("'topic'", "speech", "/speech"),
        ("'--topic'", "", "/chatter"),
        ("'--topic'", "--topic speech", "/speech"),
        ("'--topic'", "--topic", "/constant"),
    ],
)
def test_a_word_that_may_be_left_out_has_its_default_or_constant(
    argument: str, words: str, published: str, launch: Launch, prefix: Path
) -> None:
    program = f"""
import argparse
import rclpy
from std_msgs.msg import String
parser = argparse.ArgumentParser()
parser.add_argument({argument}, nargs="?", const="constant", default="chatter")
given, _ = parser.parse_known_args()
rclpy.init()
rclpy.create_node("one").create_publisher(String, given.topic, 10)
"""
    install_program(prefix, PYTHON + program, "one")
    given = f'args="{words}"' if words else ""
    plan = launch(f'<launch><node pkg="demo" exec="one" {given}/></launch>')
    assert [str(problem) for problem in plan.problems] == []
    own = {name for operation, name in permissions(plan) if operation == "publish"}
    assert own - {"/rosout", "/parameter_events"} == {published}


@pytest.mark.parametrize("words", ["sys.argv[1:]", "sys.argv[:][1:]", "remove_ros_args(sys.argv)[1:]"])
def test_the_command_line_without_the_name_of_the_program_is_the_launchs(
    words: str, launch: Launch, prefix: Path
) -> None:
    install_program(prefix, PYTHON + LISTS.format(parser="", read=f"parse_known_args({words})"), "lists")
    plan = launch('<launch><node pkg="demo" exec="lists" args="a"/></launch>')
    assert ("publish", "/a") in permissions(plan)
    assert not plan.problems


@pytest.mark.parametrize(
    ("parser", "read"),
    [
        ("fromfile_prefix_chars='@'", "parse_known_args()"),
        ("", "parse_known_args(['a', 'b'])"),
        ("", "parse_known_args(sys.argv[2:])"),
        ("", "parse_known_args(sys.argv)"),  # the first word of ``topics`` would be the program's own name
        ("", "parse_known_args(remove_ros_args())"),
        ("", "parse_known_args(remove_ros_args()[1:][1:])"),
    ],
)
def test_words_that_are_not_only_the_launchs_are_gaps(
    parser: str, read: str, launch: Launch, prefix: Path
) -> None:
    install_program(prefix, PYTHON + LISTS.format(parser=parser, read=read), "lists")
    assert launch('<launch><node pkg="demo" exec="lists" args="@file"/></launch>').problems


CONFIGURED = """
import os
import rclpy
import yaml
from ament_index_python.packages import get_package_share_directory
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("configured")
path = os.path.join(get_package_share_directory("demo"), "config", "pins.yaml")
with open(path) as file:
    config = yaml.safe_load(file)
for pin in config["pins"]:
    node.create_publisher(String, f"pins/{pin['name']}", 10)
rclpy.spin(node)
"""


def test_what_a_file_names_is_open(launch: Launch, prefix: Path) -> None:
    install_program(prefix, PYTHON + CONFIGURED, "configured")
    file = prefix / "share/demo/config/pins.yaml"
    file.parent.mkdir(parents=True)
    file.write_text("pins: [{name: a}]\n")
    plan = launch('<launch><node pkg="demo" exec="configured"/></launch>')
    assert any("pins/" in str(problem) for problem in plan.problems)


TWO_NODES = """#!/usr/bin/python3
import rclpy
from rclpy.node import Node

rclpy.init()
left, right = Node("left"), Node("right")
"""


@pytest.mark.parametrize(("attributes", "is_told"), [('name="arms"', True), ("", False)])
def test_one_name_for_several_nodes_of_a_program_is_told(
    attributes: str, is_told: bool, launch: Launch, prefix: Path
) -> None:
    install_program(prefix, TWO_NODES, "duo")
    plan = launch(f'<launch><node pkg="demo" exec="duo" {attributes}/></launch>')
    told = [each.text for each in plan.warnings if each.code is Code.NODE_NAME_REPEATED]
    assert told == (["2 nodes of demo/duo (left, right) all get the name /arms"] if is_told else [])


DECLARING = """#!/usr/bin/python3
import rclpy
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

rclpy.init()
node = Node("n")
node.declare_parameter("text", "x")
node.declare_parameter("rate", 1.0)
node.declare_parameter("any", "x", ParameterDescriptor(dynamic_typing=True))
node.declare_parameter("unset")
node.get_parameter_or("asked", "x")
"""


@pytest.mark.parametrize(
    ("parameter", "value", "told"),
    [
        ("text", "on", "declares parameter text as string, and rcl reads its value as bool"),
        ("text", "7", "declares parameter text as string, and rcl reads its value as int"),
        ("rate", "2", "declares parameter rate as double, and rcl reads its value as int"),
        ("text", "'on'", ""),
        ("rate", "2.0", ""),
        ("any", "on", ""),
        ("unset", "on", ""),
        ("asked", "on", ""),
    ],
)
def test_a_value_of_another_type_than_the_declared_one_is_told(
    parameter: str, value: str, told: str, launch: Launch, prefix: Path
) -> None:
    install_program(prefix, DECLARING, "typed")
    given = f'<param name="{parameter}" value="{value}"/>'
    plan = launch(f'<launch><node pkg="demo" exec="typed" name="n">{given}</node></launch>')
    found = [each for each in plan.warnings if each.code is Code.PARAMETER_TYPE]
    assert [each.text for each in found] == ([f"node /n {told}"] if told else [])
    assert all(each.location is not None and each.location.line == 1 for each in found)


def test_the_types_of_a_manifest_count_too(launch: Launch, prefix: Path, tmp_path: Path) -> None:
    install_program(prefix, "#!/bin/sh", "typed")
    manifest = tmp_path / "n.nodl.xml"
    manifest.write_text(
        '<interface version="1"><node name="n" executable="typed">'
        '<parameter name="p" type="integer"/></node></interface>'
    )
    for value, count in (("1.5", 1), ("1", 0)):
        text = f'<launch><node pkg="demo" exec="typed"><param name="p" value="{value}"/></node></launch>'
        plan = launch(text, manifests=(manifest,))
        assert sum(each.code is Code.PARAMETER_TYPE for each in plan.warnings) == count
