"""``ros2 launch --secure`` with upstream's own command and engine, and the same for a description in a program."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.addons.recording.stand_in_launch import PACKAGE, Program, build_stand_in, make_workspace
from tests.addons.ros2.conftest import Workspace
from tests.addons.ros2.upstream import install_metadata
from tests.install.test_foreign_nodl import write_foreign_nodl

pytestmark = pytest.mark.real_launch

# A node that says how it was started, and looks whether its enclave is complete by then.
NODE = """#!/bin/sh
enclave=none
for word in "$@"; do
    [ "$previous" = --enclave ] && enclave=$word
    previous=$word
done
enclave=${ROS_SECURITY_ENCLAVE_OVERRIDE:-$enclave}
count=0
for file in cert.pem key.pem governance.p7s permissions.p7s identity_ca.cert.pem permissions_ca.cert.pem; do
    [ -f "$ROS_SECURITY_KEYSTORE/enclaves$enclave/$file" ] && count=$((count + 1))
done
echo "enclave=$enclave files=$count enable=$ROS_SECURITY_ENABLE strategy=$ROS_SECURITY_STRATEGY secret=<$CA_WORD>"
"""

MANIFEST = """<interface version="1">
  <node name="talker" executable="talker">
    <topic name="chatter" type="std_msgs/msg/String" role="publisher"/>
  </node>
  <node name="listener" executable="listener">
    <topic name="chatter" type="std_msgs/msg/String" role="subscription"/>
  </node>
</interface>
"""

LAUNCH = """<launch>
  <arg name="where" default="robot"/>
  <node pkg="demo" exec="talker"/>
  <group>
    <push_ros_namespace namespace="$(var where)"/>
    <node pkg="demo" exec="listener" name="ears"><remap from="chatter" to="news"/></node>
  </group>
  <node pkg="demo" exec="talker" name="own" enclave="/mine"/>
  <executable cmd="sh -c 'exec talker'" enclave="/tool" name="tool" output="screen">
    <env name="PATH" value="$(env PATH):$(find-pkg-prefix demo)/lib/demo"/>
  </executable>
</launch>
"""


@pytest.fixture
def demo(workspace: Workspace) -> Workspace:
    share = workspace.prefix / "share/demo"
    programs = workspace.prefix / "lib/demo"
    (share / "launch").mkdir(parents=True)
    programs.mkdir(parents=True)
    (workspace.prefix / "share/ament_index/resource_index/packages/demo").touch()
    (share / "demo.nodl.xml").write_text(MANIFEST)
    (share / "launch/demo.launch.xml").write_text(LAUNCH)
    for name in ("talker", "listener"):
        (programs / name).write_text(NODE)
        (programs / name).chmod(0o755)
    return workspace


def launch(workspace: Workspace, *words: str) -> tuple[int, str]:
    result = workspace.ros2_launch("-a", *words)
    return result.returncode, result.stdout


def test_every_process_finds_its_enclave_complete(demo: Workspace) -> None:
    keystore = demo.directory / "ks"
    status, screen = launch(demo, "--secure", "--keystore", str(keystore), "demo", "demo.launch.xml")
    assert status == 0, screen
    told = {line for line in screen.splitlines() if " enclave=" in line}
    names = {line.partition("]")[0].strip("[").rpartition("-")[0]: line for line in told}
    assert len(told) == 4, screen
    for enclave in ("/", "/robot", "/mine", "/tool"):
        (line,) = [line for line in told if f"enclave={enclave} " in line]
        assert "files=6 enable=true strategy=Enforce" in line
    assert names["tool"].startswith("[tool-4] enclave=/tool ")


def test_permissions_are_least_and_under_final_names(demo: Workspace) -> None:
    keystore = demo.directory / "ks"
    status, screen = launch(
        demo, "--secure", "--keystore", str(keystore), "demo", "demo.launch.xml", "where:=arm"
    )
    assert status == 0, screen
    ears = (keystore / "enclaves/arm/permissions.xml").read_text()
    assert "<topic>rt/arm/news</topic>" in ears
    assert "chatter" not in ears
    assert "*" not in ears.split("<allow_rule>")[1]


def test_strategy_is_passed_on(demo: Workspace) -> None:
    _, screen = launch(
        demo,
        "--secure",
        "--keystore",
        str(demo.directory / "ks"),
        "--strategy",
        "Permissive",
        "demo",
        "demo.launch.xml",
    )
    assert screen.count("strategy=Permissive") == 4
    assert screen.count("then runs unsecured instead of exiting") == 1


@pytest.mark.parametrize("words", [("--keystore", "ks"), ("--strategy", "Enforce"), ("--nodl", "x.nodl.xml")])
def test_options_of_a_secured_launch_need_secure(words: tuple[str, str], demo: Workspace) -> None:
    status, screen = launch(demo, *words, "demo", "demo.launch.xml")
    assert status != 0 and f"{words[0]} has no effect without --secure" in screen
    assert "enclave=" not in screen


def test_without_secure_nothing_changes_and_the_attribute_is_accepted(demo: Workspace) -> None:
    status, screen = launch(demo, "demo", "demo.launch.xml")
    assert status == 0, screen
    assert screen.count("enclave=none files=0 enable= strategy=") == 4
    assert not (demo.directory / "ks").exists()


@pytest.mark.parametrize("secured", [True, False])
def test_no_process_sees_the_passphrase_of_the_ca(
    secured: bool, demo: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CA_WORD", "open sesame")
    options = ["--secure", "--keystore", str(demo.directory / "ks"), "--ca-passphrase-env", "CA_WORD"]
    status, screen = launch(demo, *(options if secured else []), "demo", "demo.launch.xml")
    assert status == 0, screen
    assert screen.count("secret=<>" if secured else "secret=<open sesame>") == 4


def test_a_keystore_is_needed(demo: Workspace) -> None:
    status, screen = launch(demo, "--secure", "demo", "demo.launch.xml")
    assert status != 0
    assert "--secure needs a keystore" in screen
    assert "process started" not in screen


def test_a_node_without_manifest_starts_nothing(demo: Workspace) -> None:
    (demo.prefix / "share/demo/demo.nodl.xml").unlink()
    status, screen = launch(
        demo,
        "--secure",
        "--keystore",
        str(demo.directory / "ks"),
        "--missing-nodl",
        "error",
        "demo",
        "demo.launch.xml",
    )
    assert status != 0
    assert "no NoDL manifest for demo/talker" in screen
    assert "process started" not in screen


ONCE = """
import os, random, socket
from launch import Action, LaunchDescription, Substitution
from launch.actions import ExecuteProcess, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.substitutions import Command, LaunchConfiguration
from launch_ros.actions import Node

HERE = os.path.dirname(os.path.abspath(__file__))
os.makedirs(os.path.join(HERE, "by_the_module"))  # fails the second time
WORD = input("which word? ")  # the second time there is nothing to read


class Mine(Substitution):
    def perform(self, context):
        os.mkdir(os.path.join(HERE, "by_a_substitution"))
        return "mine"


class MyAction(Action):
    def execute(self, context):
        os.mkdir(os.path.join(HERE, "by_an_action"))


def decide(context):
    os.mkdir(os.path.join(HERE, "by_a_function"))
    listener = socket.create_server(("127.0.0.1", 0))
    context.launch_configurations["port"] = str(listener.getsockname()[1])
    return [Node(package="demo", executable="talker", name=f"run{random.randrange(10**9)}", output="screen")]


def generate_launch_description():
    words = ["echo", "word", WORD, Mine(), Command(["mkdir -v ", os.path.join(HERE, "by_a_command")])]
    first = ExecuteProcess(cmd=words, output="screen")
    return LaunchDescription([
        MyAction(),
        OpaqueFunction(function=decide),
        first,
        RegisterEventHandler(OnProcessExit(target_action=first, on_exit=lambda event, context: [
            ExecuteProcess(cmd=["echo", "after", LaunchConfiguration("port")], output="screen")])),
    ])
"""


def test_the_code_of_a_launch_file_runs_once(demo: Workspace) -> None:
    file = demo.add("once.launch.py", ONCE)
    words = "-a", "--secure", "--keystore", str(demo.directory / "ks"), str(file)
    ran = demo.ros2_launch(*words, stdin="hello\n")
    assert ran.returncode == 0, ran.stdout
    assert ran.stdout.count("which word?") == 1
    assert "word hello mine mkdir: created directory" in ran.stdout
    assert "enclave=/ files=6" in ran.stdout
    assert re.search(r"after \d+", ran.stdout)


def test_commands_and_random_names_of_an_xml_file_are_asked_once(demo: Workspace) -> None:
    count = demo.directory / "count"
    counter = demo.add("counted.sh", f"#!/bin/sh\necho x >> {count}\nprintf n%s $(wc -l < {count})\n")
    counter.chmod(0o755)
    file = demo.add(
        "once.launch.xml",
        f"""<launch>
  <let name="n" value="$(command {counter})"/>
  <node pkg="demo" exec="talker" name="$(var n)"/>
  <node pkg="demo" exec="listener" name="$(anon ears)"/>
</launch>""",
    )
    status, screen = launch(demo, "--secure", "--keystore", str(demo.directory / "ks"), str(file))
    assert status == 0, screen
    assert screen.count("enclave=/ files=6") == 2
    assert count.read_text() == "x\n"


LATE = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch_ros.actions import Node

def generate_launch_description():
    first = ExecuteProcess(cmd=["true"])
    late = Node(package="demo", executable="talker", name="late", output="screen")
    return LaunchDescription([first, RegisterEventHandler(OnProcessExit(
        target_action=first, on_exit=lambda event, context: [late] if event.returncode == 0 else []))])
"""


@pytest.mark.parametrize("allowed", [False, True])
def test_a_node_that_the_plan_did_not_foresee(allowed: bool, demo: Workspace) -> None:
    file = demo.add("late.launch.py", LATE)
    options = ["--allow-late"] if allowed else []
    status, screen = launch(demo, "--secure", "--keystore", str(demo.directory / "ks"), *options, str(file))
    assert ("refused: demo/talker" in screen) is not allowed, screen
    assert ("was not foreseen: provisioned now" in screen) is allowed
    assert ("enclave=/ files=6" in screen) is allowed
    assert (status == 0) is allowed


OTHER = '''
"""ros2launch_security as it meets ours: same option, same extension points, and a package nodl that is not ours."""

import nodl
from launch_ros.actions.node import NodeActionExtension
from ros2launch.option import OptionExtension


class SecurityOption(OptionExtension):
    def add_arguments(self, parser, cli_name, *, argv=None):
        group = parser.add_argument_group(title="security")
        group.add_argument("--secure", metavar="keystore", nargs="?", const="")
        group.add_argument("--no-create-keystore", dest="create_keystore", action="store_false")

    def prelaunch(self, launch_description, args):
        if args.secure is None:
            return (launch_description,)
        raise AssertionError("the other extension was asked to secure the launch, too")


class SecurityNodeAction(NodeActionExtension):
    def prepare_for_execute(self, context, ros_specific_arguments, node_action):
        assert context.launch_configurations.get("__secure") is None
        return [], ros_specific_arguments
'''


ADDING = """
from launch import LaunchDescription
from launch.actions import LogInfo
from ros2launch.option import OptionExtension


class AddingOption(OptionExtension):
    def add_arguments(self, parser, cli_name, *, argv=None):
        pass

    def prelaunch(self, launch_description, args):
        return (LaunchDescription([LogInfo(msg="added"), *launch_description.entities]),)
"""


def test_what_another_extension_adds_is_refused_and_launched_without_secure(demo: Workspace) -> None:
    (demo.site / "adding_option.py").write_text(ADDING)
    install_metadata(demo.site, "adding", {"ros2launch.option": ["adding = adding_option:AddingOption"]})
    status, screen = launch(demo, "demo", "demo.launch.xml")
    assert status == 0 and "added" in screen
    words = "--secure", "--keystore", str(demo.directory / "ks"), "demo", "demo.launch.xml"
    status, screen = launch(demo, *words)
    assert status != 0
    assert "another extension of ros2 launch added to this launch (LogInfo)" in screen
    assert "enclave=" not in screen and not (demo.directory / "ks").exists()


def test_a_process_that_ends_badly_shows_in_the_exit_status(demo: Workspace) -> None:
    file = demo.add("bad.launch.xml", "<launch><executable cmd='false'/></launch>")
    status, _ = launch(demo, "--secure", "--keystore", str(demo.directory / "ks"), str(file))
    assert status == 1


@pytest.mark.parametrize("is_first", [True, False])
def test_beside_ros2launch_security_ours_wins(
    demo: Workspace, is_first: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if is_first:
        write_foreign_nodl(demo.site)
    else:
        late = write_foreign_nodl(demo.directory / "late")
        monkeypatch.setenv(
            "PYTHONPATH", os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), str(late)]))
        )
    (demo.site / "other_security.py").write_text(OTHER)
    install_metadata(
        demo.site,
        "ros2launch_security",
        {
            "ros2launch.option": ["security = other_security:SecurityOption"],
            "launch_ros.node_action": ["security = other_security:SecurityNodeAction"],
        },
    )
    status, screen = launch(
        demo, "--secure", "--keystore", str(demo.directory / "ks"), "demo", "demo.launch.xml"
    )
    assert status == 0, screen
    assert screen.count("enable=true strategy=Enforce") == 4


def test_the_keystore_passes_openssl(demo: Workspace) -> None:
    if shutil.which("openssl") is None:
        pytest.fail("openssl is not installed")
    keystore = demo.directory / "ks"
    launch(demo, "--secure", "--keystore", str(keystore), "demo", "demo.launch.xml")
    enclave = keystore / "enclaves/mine"
    verified = subprocess.run(
        ["openssl", "verify", "-CAfile", enclave / "identity_ca.cert.pem", enclave / "cert.pem"],
        capture_output=True,
        check=False,
    )
    assert verified.returncode == 0, verified.stderr


PROGRAM = """
import os, sys
import stand_ins
stand_ins.install()
from launch import LaunchDescription, LaunchService
from launch.actions import OpaqueFunction
from launch_ros.actions import ComposableNodeContainer, Node, PushRosNamespace
from launch_ros.descriptions import ComposableNode
from enclave_addons.ros2.secured import secured

def node(**options):
    return Node(package="demo", output="screen", **options)

def tamper(context):
    with open(sys.argv[2] + "/enclaves/permissions.p7s", "ab") as file:
        file.write(b"x")
    os.remove(sys.argv[2] + "/enclaves/key.pem")

cases = {
    "shared": [node(executable="talker"), node(executable="listener", remappings=[("chatter", "news")])],
    "tampered": [node(executable="talker"), OpaqueFunction(function=tamper), node(executable="listener")],
    "plain": [node(executable="talker"), PushRosNamespace("robot"), node(executable="listener", name="ears"),
              node(executable="talker", enclave="sub")],
    "components": [ComposableNodeContainer(package="rclcpp_components", executable="component_container", name="box",
                   namespace="/", composable_node_descriptions=[
                       ComposableNode(package="demo", plugin="demo::X", name="x")])],
    "unknown": [Node(package="demo", executable="unknown", output="screen")],
}
service = LaunchService(noninteractive=True)
service.include_launch_description(secured(LaunchDescription(cases[sys.argv[1]]), sys.argv[2]))
sys.exit(service.run())
"""


def program(workspace: Workspace, case: str, keystore: Path) -> tuple[int, str]:
    result = workspace.python(PROGRAM, case, str(keystore))
    return result.returncode, result.stdout


def test_a_description_in_a_program_is_secured(demo: Workspace) -> None:
    keystore = demo.directory / "ks"
    status, screen = program(demo, "plain", keystore)
    assert status == 0, screen
    for enclave in ("/", "/robot", "/robot/sub"):
        assert f"enclave={enclave} " in screen
        assert (keystore / "enclaves" / enclave.lstrip("/") / "permissions.p7s").is_file()


def test_each_node_extends_the_permissions_of_an_enclave_that_they_share(demo: Workspace) -> None:
    status, screen = program(demo, "shared", demo.directory / "ks")
    assert status == 0, screen
    permissions = (demo.directory / "ks/enclaves/permissions.xml").read_text()
    assert "<topic>rt/chatter</topic>" in permissions and "<topic>rt/news</topic>" in permissions


def test_an_enclave_that_somebody_changed_is_not_extended(demo: Workspace) -> None:
    status, screen = program(demo, "tampered", demo.directory / "ks")
    assert status == 1
    assert "is no longer what was provisioned for this launch" in screen
    assert "[listener-2]: process started" not in screen


def test_what_only_a_plan_could_permit_is_refused_there(demo: Workspace) -> None:
    (demo.prefix / "share/ament_index/resource_index/packages/rclcpp_components").touch()
    programs = demo.prefix / "lib/rclcpp_components"
    programs.mkdir()
    shutil.copy(demo.prefix / "lib/demo/talker", programs / "component_container")
    status, screen = program(demo, "components", demo.directory / "ks")
    assert status == 1
    assert "/box loads components" in screen
    assert "process started" not in screen


def test_a_node_without_interface_ends_that_launch(demo: Workspace) -> None:
    shutil.copy(demo.prefix / "lib/demo/talker", demo.prefix / "lib/demo/unknown")
    status, screen = program(demo, "unknown", demo.directory / "ks")
    assert status == 1
    assert "no NoDL manifest for demo/unknown" in screen
    assert "process started" not in screen


TAKEN_AWAY = """
from launch import LaunchDescription
from launch.actions import ExecuteProcess, SetEnvironmentVariable, UnsetEnvironmentVariable
from launch_ros.actions import Node
def generate_launch_description():
    return LaunchDescription([
        UnsetEnvironmentVariable("ROS_SECURITY_KEYSTORE"),
        SetEnvironmentVariable("ROS_SECURITY_ENABLE", "false"),
        SetEnvironmentVariable("ROS_SECURITY_ENCLAVE_OVERRIDE", "/other"),
        Node(package="demo", executable="talker", name="own", env={"PATH": "/usr/bin:/bin"}),
        Node(package="demo", executable="talker", name="set", additional_env={"ROS_SECURITY_STRATEGY": "Permissive"}),
        ExecuteProcess(cmd=["%s/lib/demo/talker"], name="tool", output="screen"),
    ])
"""


def test_what_a_launch_file_sets_takes_no_enclave_away(demo: Workspace) -> None:
    demo.add("prefix/share/demo/launch/taken.launch.py", TAKEN_AWAY % demo.prefix)
    keystore = demo.directory / "ks"
    _, screen = launch(demo, "--secure", "--keystore", str(keystore), "demo", "taken.launch.py")
    lines = {line.partition("]")[0]: line for line in screen.splitlines() if "enclave=" in line}
    assert len(lines) == 3
    for label, line in lines.items():
        expected = "files=0" if "tool" in label else "enclave=/ files=6"
        assert expected in line and "enable=true strategy=Enforce" in line


def test_looking_first_as_with_secure_launch(demo: Workspace) -> None:
    status, screen = launch(demo, "--dry-run", "demo", "demo.launch.xml", "where:=rover")
    assert status == 0, screen
    assert "subscribe: /rover/news" in screen
    assert "enclave=" not in screen, "no process was started"
    status, screen = launch(demo, "--dry-run", "--format", "json", "demo", "demo.launch.xml")
    assert (status, json.loads(screen)["version"]) == (0, 1)
    status, screen = launch(demo, "--explain", "/robot/news", "demo", "demo.launch.xml")
    assert status == 0 and "remapped by chatter:=news" in screen
    status, screen = launch(demo, "--dump-params", "demo", "demo.launch.xml")
    assert status == 0, screen


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--format", "json"), "--format has no effect: it is for --dry-run"),
        (("--explain", "/robot/news", "--format", "json"), "--format has no effect beside --explain"),
        (("--explain", "/robot/news", "--dump-params"), "each print something of their own"),
        (("--explain", ""), "--explain needs the name of an enclave, node or topic"),
        (("--dry-run", "--keystore", "ks"), "--keystore has no effect without --secure"),
    ],
)
def test_what_would_have_no_effect_starts_nothing(
    demo: Workspace, words: tuple[str, ...], complaint: str
) -> None:
    status, screen = launch(demo, *words, "demo", "demo.launch.xml")
    assert status != 0 and complaint in screen
    assert "process started" not in screen and "enclave=" not in screen


@pytest.mark.parametrize(
    "words",
    [("--secure", "{ks}", "demo", "demo.launch.xml"), ("demo", "demo.launch.xml", "--secure", "{ks}")],
)
def test_the_syntax_of_ros2launch_security_works(demo: Workspace, words: tuple[str, ...]) -> None:
    keystore = demo.directory / "ks"
    status, screen = launch(demo, *(word.format(ks=keystore) for word in words))
    assert status == 0, screen
    assert (keystore / "enclaves" / "mine" / "permissions.p7s").is_file()


def test_without_a_keystore_its_other_form_is_explained(demo: Workspace) -> None:
    status, screen = launch(demo, "--secure", "demo", "demo.launch.xml")
    assert status != 0
    assert '--keystore "$(mktemp -d)/ks"' in screen


STRING = "std_msgs/msg/String"


def test_a_refusal_is_explained_as_by_secure_launch(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process, and its neighbour that asks for no more than it may; the launch ends as without explanations."""
    granted = (("publisher", "granted"),)
    programs = [
        Program(
            "bold",
            f"node bold\npublisher granted {STRING}\nsubscription secret {STRING}\n",
            granted,
            'name="b"',
        ),
        Program("good", f"node good\npublisher granted {STRING}\n", granted),
    ]
    stand_in = build_stand_in(workspace.directory)
    made = make_workspace(tmp_path / "ws", stand_in, programs)
    monkeypatch.setenv("STAND_IN_CATCHES", "1")
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    secured = ("-a", "--secure", "--keystore", str(tmp_path / "ks"), "--enclave-scope", "node")
    for more in ([], ["--no-explain-denials"]):
        ran = workspace.ros2_launch(*secured, *more, PACKAGE, "all.launch.xml", prefixes=(made.folder,))
        said = ran.stdout
        assert ran.returncode == 0, said
        assert ("refused: node /b may not subscribe to topic /secret (enclave /b)" in said) is not bool(
            more
        ), said
        assert said.count("refused: node") == (0 if more else 1)
        assert "+  - {name: 'secret'" in said or more
