"""Each way to install that the README names: after it, the commands work, and C++ is read where it brings ``[cpp]``."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import pytest

ROOT = Path(__file__).parents[2]
DEMO = ROOT / "fixtures" / "demo_ws"
README = (ROOT / "README.md").read_text(encoding="utf-8")
SYSTEM_PYTHON = "/usr/bin/python3"
PYTHON = SYSTEM_PYTHON if os.access(SYSTEM_PYTHON, os.X_OK) else "python3"
CPP = """#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/string.hpp>
class Talker : public rclcpp::Node {
 public:
  Talker() : Node("talker") { publisher_ = create_publisher<std_msgs::msg::String>("chatter", 10); }
 private:
  rclcpp::Publisher<std_msgs::msg::String>::SharedPtr publisher_;
};
int main(int argc, char ** argv) { rclcpp::init(argc, argv); rclcpp::spin(std::make_shared<Talker>()); }
"""


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of the repository, as a fresh clone has them; in a path with a blank."""
    folder = tmp_path_factory.mktemp("a reader") / "enclave-launch"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def tools(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """``bin`` of an environment with pipx and colcon."""
    folder = tmp_path_factory.mktemp("tools")
    do("python3", "-m", "venv", str(folder), cwd=folder)
    pip = str(folder / "bin" / "pip")
    # Debian 12's pip takes the newest coverage for pytest-cov's ``coverage[toml]``, although another one is locked.
    do(pip, "install", "-q", "--upgrade", "pip", cwd=folder)
    do(pip, "install", "-q", "--require-hashes", "-r", str(ROOT / "requirements" / "routes.txt"), cwd=folder)
    return folder / "bin"


def do(*words: str, cwd: Path, status: int = 0, more: Mapping[str, str] = MappingProxyType({})) -> str:
    kept = {
        name: text for name, text in os.environ.items() if not name.startswith(("PYTHON", "ROS_", "AMENT_"))
    }
    done = subprocess.run(
        words, cwd=cwd, env={**kept, **more}, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == status, f"{words}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout + done.stderr


def check(
    folder: Path, work: Path, *, reads_cpp: bool, more: Mapping[str, str] = MappingProxyType({})
) -> None:
    """The commands in ``folder`` plan the demo, make a keystore and read a source in C++."""
    plan = do(str(folder / "secure-launch"), "--dry-run", "--prefix", str(DEMO), "demo_nodes",
              "talker_listener.launch.xml", cwd=work, more=more)  # fmt: skip
    assert "publish: /chatter" in plan
    do(str(folder / "secure-keystore"), "create", "ks", cwd=work, more=more)
    assert "0 findings: good" in do(str(folder / "secure-keystore"), "verify", "ks", cwd=work, more=more)
    assert "usage:" in do(str(folder / "secure-plan"), "--help", cwd=work, more=more)
    (work / "talker.cpp").write_text(CPP)
    inferred = do(
        str(folder / "secure-nodl"), "infer", "talker.cpp", cwd=work, status=not reads_cpp, more=more
    )
    assert ("/chatter" if reads_cpp else "pip install tree-sitter tree-sitter-cpp") in inferred


def test_pip_into_a_virtual_environment(clone: Path, tmp_path: Path) -> None:
    assert "`pip install '.[cpp]'`" in README
    do("python3", "-m", "venv", str(tmp_path / "venv"), cwd=tmp_path)
    do(str(tmp_path / "venv" / "bin" / "pip"), "install", "-q", ".[cpp]", cwd=clone)
    check(tmp_path / "venv" / "bin", tmp_path, reads_cpp=True)


def test_pipx(clone: Path, tools: Path, tmp_path: Path) -> None:
    assert "`pipx install '.[cpp]'`" in README
    places = {"PIPX_HOME": str(tmp_path / "pipx"), "PIPX_BIN_DIR": str(tmp_path / "bin")}
    do(str(tools / "pipx"), "install", ".[cpp]", cwd=clone, more=places)
    check(tmp_path / "bin", tmp_path, reads_cpp=True)


def test_packages_of_apt_alone(clone: Path, tmp_path: Path) -> None:
    for words in ("-m venv --system-site-packages", "install --no-deps --no-build-isolation ."):
        assert words in README
    do(PYTHON, "-m", "venv", "--system-site-packages", str(tmp_path / "venv"), cwd=tmp_path)
    pip = str(tmp_path / "venv" / "bin" / "pip")
    do(pip, "install", "-q", "--no-deps", "--no-build-isolation", ".", cwd=clone)
    check(tmp_path / "venv" / "bin", tmp_path, reads_cpp=False)


@pytest.mark.parametrize("option", [[], ["--symlink-install"]], ids=["install", "symlink-install"])
def test_colcon_build(clone: Path, tools: Path, tmp_path: Path, option: list[str]) -> None:
    assert "put the clone into `src/` and `colcon build`" in README
    shutil.copytree(clone, tmp_path / "ws" / "src" / "enclave-launch")
    workspace = tmp_path / "ws"
    more = {"PATH": f"{tools}{os.pathsep}{os.environ['PATH']}"}
    do(str(tools / "colcon"), "build", *option, cwd=workspace, more=more)
    sourced = do(
        "bash",
        "-c",
        '. install/setup.bash && echo "$AMENT_PREFIX_PATH|$PATH|$PYTHONPATH"',
        cwd=workspace,
        more=more,
    )
    prefixes, path, modules = sourced.strip().splitlines()[-1].split("|")
    assert str(workspace / "install" / "enclave_launch") in prefixes
    check(
        workspace / "install" / "enclave_launch" / "bin",
        tmp_path,
        reads_cpp=False,
        more={"PATH": path, "PYTHONPATH": modules},
    )


def test_the_core_without_its_add_ons(clone: Path, tmp_path: Path) -> None:
    """A wheel without ``enclave_addons`` plans, provisions and verifies. The verb of an add-on says what is absent."""
    core = tmp_path / "core"
    shutil.copytree(clone, core, ignore=shutil.ignore_patterns("enclave_addons", "build", "*.egg-info"))
    do("python3", "-m", "venv", str(tmp_path / "venv"), cwd=tmp_path)
    do(str(tmp_path / "venv" / "bin" / "pip"), "install", "-q", ".", cwd=core)
    commands = tmp_path / "venv" / "bin"
    demo = ("--prefix", str(DEMO), "demo_nodes", "talker_listener.launch.xml")
    assert "publish: /chatter" in do(str(commands / "secure-launch"), "--dry-run", *demo, cwd=tmp_path)
    secured = ("--secure", "--keystore", "ks", "--provision-only", *demo)
    assert "/ks created" in do(str(commands / "secure-launch"), *secured, cwd=tmp_path)
    assert "0 findings: good" in do(str(commands / "secure-keystore"), "verify", "ks", cwd=tmp_path)
    absent = do(str(commands / "secure-nodl"), "infer", ".", cwd=tmp_path, status=1)
    assert "enclave_addons is not part of this installation" in absent
