"""Data that a program reads below the share directory of a known package decides on its names; other files do not."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from nodl.infer import InferredSystem, infer_executable, infer_paths
from nodl.infer.report.expanded import expand

HEAD = """#!/usr/bin/python3
import io
import json
import os
import sys
from pathlib import Path
import rclpy
import yaml
import ament_index_python
from ament_index_python.packages import get_package_prefix, get_package_share_directory, get_package_share_path
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node('n')
share = get_package_share_directory('demo')
def make(name):
    node.create_publisher(String, name, 10)
"""
YAML = "robots: [left, right]\ntopics:\n  - {name: scan, active: true}\n  - {name: odom, active: false}\n"

READ = {
    "with open(os.path.join(share, 'config', 'names.yaml')) as f:\n    for name in yaml.safe_load(f)['robots']:\n"
    "        make(name)": ["left", "right"],
    "found = yaml.load(open(share + '/config/names.yaml'), Loader=yaml.FullLoader)\n"
    "[make(t['name']) for t in found['topics'] if t['active']]": ["scan"],
    "make(json.load(open(f'{share}/config/names.json'))['cmd'])": ["cmd_vel"],
    "make(json.loads(open(f'{share}/config/names.json', 'rb').read())['cmd'])": ["cmd_vel"],
    "for line in open(share + '/config/names.txt', encoding='utf-8'):\n    make(line.strip())": ["one", "two"],
    "make(open(share + '/config/names.txt').readlines()[1].strip())": ["two"],
    "make((get_package_share_path('demo') / 'config' / 'names.txt').read_text().split()[0])": ["one"],
    "with (Path(share) / 'config/names.json').open() as f:\n    make(json.load(f)['cmd'])": ["cmd_vel"],
    "folder = os.path.join(get_package_prefix('demo'), 'share', 'demo', 'config')\n"
    "make(open(os.path.join(folder, '..', 'config', 'names.txt')).readline().strip())": ["one"],
    "there = os.path.exists(share + '/config/names.txt')\nmake('there' if there else 'absent')": ["there"],
    "make(ament_index_python.get_package_share_directory('demo').split('/')[-1])": ["demo"],
}  # fmt: skip

NOT_READ = {
    "a package that is not installed": "make(open(get_package_share_directory('other') + '/names.txt').read().strip())",
    "a package that a parameter names": (
        "package = node.declare_parameter('package', 'demo').value\n"
        "make(open(get_package_share_directory(package) + '/config/names.txt').readline().strip())"
    ),
    "a path that a parameter names": (
        "path = node.declare_parameter('path', share + '/config/names.txt').value\nmake(open(path).readline().strip())"
    ),
    "a path on the command line": "make(open(share + '/config/' + sys.argv[1]).readline().strip())",
    "a file that is not there": "make(open(share + '/config/missing.txt').read().strip())",
    "a file of another folder": "make(open(os.path.join(share, '..', '..', 'secret.txt')).read().strip())",
    "an absolute path": "make(open('/etc/hostname').read().strip())",
    "a pipe": "make(open(share + '/config/pipe').read().strip())",
    "another encoding": "make(open(share + '/config/names.txt', encoding='utf-16').read().strip())",
    "no UTF-8": "make(open(share + '/config/latin.txt').readline().strip())",
    "a file that the program writes": "open(share + '/config/names.txt', 'a').write('x')\n"
    "make(open(share + '/config/names.txt').readline().strip())",
    "a large file": "make(open(share + '/config/large.txt').readline().strip())",
    "YAML that grows": "make(yaml.safe_load(open(share + '/config/bomb.yaml'))['b'])",
    "broken JSON": "make(json.load(open(share + '/config/broken.json'))['cmd'])",
    "code": "exec(open(share + '/config/code.py').read())",
}  # fmt: skip


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """An install prefix with package ``demo`` and its data."""
    prefix = tmp_path / "install"
    (prefix / "share/ament_index/resource_index/packages").mkdir(parents=True)
    (prefix / "share/ament_index/resource_index/packages/demo").touch()
    config = prefix / "share/demo/config"
    config.mkdir(parents=True)
    (config / "names.yaml").write_text(YAML)
    (config / "names.json").write_text('{"cmd": "cmd_vel"}')
    (config / "names.txt").write_text("one\ntwo\n")
    (config / "latin.txt").write_bytes("gr\xfcn\n".encode("latin-1"))
    (config / "large.txt").write_text("x\n" * 200_000)
    (config / "bomb.yaml").write_text("a: &a [x, x]\nb: [*a, *a]\n")
    (config / "broken.json").write_text('{"cmd": ')
    (config / "code.py").write_text("make('from_code')\n")
    (prefix / "secret.txt").write_text("secret")
    os.mkfifo(config / "pipe")
    return prefix


Run = Callable[[str], InferredSystem]


@pytest.fixture
def run(tmp_path: Path, prefix: Path) -> Run:
    def infer(body: str) -> InferredSystem:
        file = tmp_path / "program.py"
        file.write_text(HEAD + body + "\n")
        return infer_paths([file], [str(prefix)])

    return infer


@pytest.mark.parametrize("body", READ)
def test_data_of_a_known_package_is_read(body: str, run: Run, prefix: Path) -> None:
    system = run(body)
    endpoints = system.nodes[0].endpoints
    assert [str(endpoint.name) for endpoint in endpoints] == READ[body]
    assert not expand(system).unresolved
    if "config" in body:  # the reader is told what the names depend on
        assert all(f"the program reads {prefix}/share/demo/config/names." in each.note for each in endpoints)


@pytest.mark.parametrize("what", NOT_READ)
def test_what_is_not_known_is_said(what: str, run: Run) -> None:
    system = run(NOT_READ[what])
    assert expand(system).unresolved


def test_without_prefixes_nothing_is_read(tmp_path: Path) -> None:
    file = tmp_path / "program.py"
    file.write_text(HEAD + "make(open(share + '/config/names.txt').readline().strip())\n")
    assert expand(infer_paths([file])).unresolved


def test_in_a_launch_the_packages_of_the_launch_are_known(prefix: Path) -> None:
    program = prefix / "lib/demo/program"
    program.parent.mkdir(parents=True)
    program.write_text(HEAD + "make(json.load(open(share + '/config/names.json'))['cmd'])\n")
    program.chmod(0o755)
    (node,) = infer_executable("demo", "program", prefixes=[str(prefix)]).interfaces
    assert [str(endpoint.name) for endpoint in node.endpoints] == ["cmd_vel"]
    assert not node.gaps
