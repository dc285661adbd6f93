"""Every command of the documentation is run, in the workspace that the tutorial makes."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

import enclave_launch
from enclave_launch import RunSettings, endpoint_seen, find_launch_file, launch_source, start_unsecured
from tests.addons.observation.graph.nodes import LOOPBACK
from tests.addons.recording.conftest import rclpy_python
from tests.dds import sros2_style
from tests.dds.conftest import domain_id as domain_id
from tests.docs.my_robot import DEMO_NODES, RCLPY_NODES, make_my_robot
from tests.docs.pages import Command, parts, read_aloud, reader_environment, write_files

ROOT = Path(__file__).parent.parent.parent
DOCS = ROOT / "docs"
TUTORIAL = DOCS / "tutorial.md"
HOW_TO = sorted((DOCS / "how-to").glob("*.md"))
OTHERS = sorted(page for page in DOCS.glob("*.md") if page != TUTORIAL)
SHOWN = [page for page in (*HOW_TO, *OTHERS) if any(isinstance(part, Command) for part in parts(page))]
"""With commands; the tutorial has a test of its own."""
WITH_NODES = ("asyncio", "learn-from-a-run", "observe-a-running-system", "sros2-keystore", "watch-for-drift")
"""Their commands start nodes, or look at nodes that run: each has its test below."""
ELSEWHERE = {
    "docker compose -f compose/compose.yaml up": "addons/deployment/test_podman.py",
    "faketime '1970-01-01 00:10:00' secure-keystore ": "keystore/test_time.py",
    "kubectl apply -f k8s/": "addons/deployment/test_podman.py",
    "echo 'pkcs11:": "keystore/test_pkcs11.py",
    "ros2 launch ": "addons/ros2/test_ros2_launch.py",
    "secure-keystore create ks --external-identity-ca ": "addons/deployment/test_recipes.py",
    "secure-keystore create ks --identity-ca ": "keystore/test_pkcs11.py",
    "secure-keystore import /etc/ros/keystore ": "addons/deployment/test_booted.py",
    "secure-keystore request host-ks ": "addons/deployment/test_recipes.py",
    "secure-keystore sign ks ": "addons/deployment/test_recipes.py",
    "secure-keystore units ": "addons/deployment/test_booted.py",
    "secure-launch --learn nodl robot ": "addons/recording/test_learning.py",
    "secure-launch --secure --keystore ks ": "dds/test_secure_launch.py",
    "RMW_IMPLEMENTATION=rmw_zenoh_cpp ": "addons/zenoh/test_secure_launch.py",
    "ZENOH_ROUTER_CONFIG_URI=": "addons/zenoh/test_router_process.py",
    "ZENOH_SESSION_CONFIG_URI=": "addons/zenoh/test_planned_traffic.py",
}
"""How commands begin that need what a page cannot have (ROS 2, root, another CA): the test that does the same."""
DEMO = ROOT / "fixtures" / "demo_ws"
PROVISION = ["secure-launch", "--secure", "--provision-only", "--keystore", "ks", "--enclave-scope", "node"]


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """An empty folder, beside a ``bin`` with real colcon, whose Python has real rclpy."""
    (tmp_path / "bin").mkdir()
    colcon = rclpy_python("jazzy").with_name("colcon")
    assert colcon.exists(), "./dev test installs it"
    (tmp_path / "bin" / "colcon").symlink_to(colcon)
    folder = tmp_path / "robot_ws"
    folder.mkdir()
    return folder


@pytest.fixture
def robot(workspace: Path) -> Path:
    """The workspace of the tutorial, built."""
    write_files(TUTORIAL, workspace)
    (workspace / "enclaves.review.yaml").unlink()
    environment = reader_environment(workspace.parent, workspace.parent / "bin")
    subprocess.run(["colcon", "build"], cwd=workspace, env=environment, check=True, capture_output=True)
    return workspace


def test_the_tutorial_does_what_it_says(workspace: Path) -> None:
    read_aloud(TUTORIAL, workspace, reader_environment(workspace.parent, workspace.parent / "bin"))


@pytest.mark.dds
def test_the_nodes_of_the_tutorial_run_and_use_the_names_of_its_plan(
    robot: Path, domain_id: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    prefix = robot / "install" / "robot"
    (modules,) = prefix.glob("lib/python3*/site-packages")
    for name, text in {
        "AMENT_PREFIX_PATH": str(prefix),
        "PYTHONPATH": str(modules),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DISTRO": "jazzy",
        "ROS_DOMAIN_ID": str(domain_id),
        "ROS_LOG_DIR": str(robot / "log"),
    }.items():
        monkeypatch.setenv(name, text)
    names = {"camera-1": ["/image"], "planner-2": ["/image", "/cmd_vel"], "base-3": ["/cmd_vel"]}
    launch_file = find_launch_file("robot", "robot.launch.xml")
    with start_unsecured(launch_source(launch_file), options=RunSettings(record=True)) as launch:
        for process, topics in names.items():
            for topic in topics:
                launch.wait_until(endpoint_seen(process, topic), timeout=120)


@pytest.mark.parametrize(
    "page", [page for page in SHOWN if page.stem not in WITH_NODES], ids=lambda page: page.stem
)
def test_a_page_does_what_it_says(robot: Path, page: Path) -> None:
    environment = reader_environment(robot.parent, robot.parent / "bin")
    make_my_robot(robot.parent / "my_robot", DEMO_NODES)
    environment["AMENT_PREFIX_PATH"] = f"{robot / 'install' / 'robot'}:{robot.parent / 'my_robot'}:{DEMO}"
    if page.name not in ("fix-a-refused-node.md", "second-robot.md"):
        provision = [*PROVISION, "robot", "robot.launch.xml"]
        subprocess.run(provision, cwd=robot, env=environment, check=True, capture_output=True)
    read_aloud(page, robot, environment)


@pytest.mark.dds
def test_the_asyncio_launcher_runs_the_demo(workspace: Path) -> None:
    environment = reader_environment(workspace.parent, workspace.parent / "bin")
    environment["AMENT_PREFIX_PATH"] = str(DEMO)
    read_aloud(DOCS / "how-to" / "asyncio.md", workspace, environment)


@pytest.mark.dds
@pytest.mark.parametrize("page", ["observe-a-running-system", "sros2-keystore", "watch-for-drift"])
def test_a_page_about_running_nodes_does_what_it_says(workspace: Path, domain_id: int, page: str) -> None:
    make_my_robot(workspace.parent / "my_robot", DEMO_NODES)
    environment = reader_environment(workspace.parent, workspace.parent / "bin") | {
        "AMENT_PREFIX_PATH": f"{workspace.parent / 'my_robot'}:{DEMO}",
        "MY_ROBOT_SECONDS": "0" if page.startswith("observe") else "8",
        "ROS_DOMAIN_ID": str(domain_id),
        **LOOPBACK,
    }
    sros2_style.create(workspace / "sros2_keystore", domain_id, {"/r1": sros2_style.Grant()})
    provision = ["secure-launch", "--secure", "--provision-only", "--keystore", "ks"]
    subprocess.run(
        [*provision, "my_robot", "bringup.launch.xml"],
        cwd=workspace, env=environment, check=True, capture_output=True,
    )  # fmt: skip
    read_aloud(DOCS / "how-to" / f"{page}.md", workspace, environment)


@pytest.mark.dds
def test_the_page_about_learning_does_what_it_says(workspace: Path, domain_id: int) -> None:
    make_my_robot(workspace.parent / "my_robot", RCLPY_NODES)
    environment = reader_environment(workspace.parent, workspace.parent / "bin") | {
        "AMENT_PREFIX_PATH": f"{workspace.parent / 'my_robot'}:{ROOT / 'fixtures' / 'rclpy_ws'}",
        "RCLPY_PYTHON": str(rclpy_python("jazzy")),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DISTRO": "jazzy",
        "ROS_DOMAIN_ID": str(domain_id),
    }
    read_aloud(DOCS / "how-to" / "learn-from-a-run.md", workspace, environment)


@pytest.mark.parametrize("page", [TUTORIAL, *HOW_TO, *OTHERS], ids=lambda page: page.stem)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\((?!http)([^)#]*)(?:#([^)]+))?\)", page.read_text(encoding="utf-8"))
    for target, heading in links:
        found = page.parent / target if target else page
        assert found.exists(), target
        if heading:
            assert heading in headings(found), f"{target}#{heading}"


def headings(page: Path) -> list[str]:
    """The anchors that GitHub makes of a page's headings."""
    titles = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.M)
    return [re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles]


def test_every_page_is_in_the_index() -> None:
    index = (DOCS / "README.md").read_text(encoding="utf-8")
    pages = [path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md") if path.name != "README.md"]
    assert [page for page in pages if f"({page}" not in index] == []


def test_the_page_of_the_library_has_every_public_name() -> None:
    text = (DOCS / "python-library.md").read_text(encoding="utf-8")
    assert [name for name in dir(enclave_launch) if not name.startswith("_") and f"`{name}" not in text] == []


def test_there_is_something_to_run() -> None:
    for page in (TUTORIAL, *HOW_TO):
        assert page in (TUTORIAL, *SHOWN), page


def test_a_command_that_no_page_runs_is_run_by_another_test() -> None:
    unrun = {
        command: page.name
        for page in (TUTORIAL, *HOW_TO, *OTHERS)
        for block in re.findall(r"^ *```text\n(.*?)^ *```$", page.read_text(encoding="utf-8"), re.S | re.M)
        for command in re.findall(r"^ *[$#] (.*)$", block, re.M)
    }
    assert [each for each in unrun if not each.startswith(tuple(ELSEWHERE))] == []
    assert [test for test in ELSEWHERE.values() if not (ROOT / "tests" / test).is_file()] == []
    assert [start for start in ELSEWHERE if not any(each.startswith(start) for each in unrun)] == []
