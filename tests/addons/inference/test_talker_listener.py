"""The running example of the paper behind this analysis (LiSA4ROS2): a publisher that only sometimes exists.

An own program in the manner of its talker and listener; the listener publishes ``chatter2`` once it has heard a
certain message, which no look at the running system would show.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from enclave_addons.inference import InferredSystem, infer_executable
from enclave_addons.inference.report.v2_report import to_v2
from enclave_addons.inference.report.written import expand, to_json

Infer = Callable[..., InferredSystem]

LISTENER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Hearer(Node):
    def __init__(self):
        super().__init__('listener')
        self.heard = self.create_subscription(String, 'chatter', self.on_chatter, 10)

    def on_chatter(self, message):
        if message.data == 'the hundredth':
            answer = self.create_publisher(String, 'chatter2', 10)
            answer.publish(String(data='heard it'))


def main():
    rclpy.init()
    rclpy.spin(Hearer())


if __name__ == '__main__':
    main()
"""


def test_json_is_the_contract(infer: Infer, tmp_path: Path) -> None:
    document = json.loads(to_json(expand(infer(LISTENER))))
    file = str(tmp_path / "main.py")
    assert document == {
        "nodes": [
            {
                "name": "listener",
                "namespace": "/",
                "file": file,
                "line": 9,
                "interfaces": [
                    {
                        "kind": kind,
                        "name": name,
                        "type": "std_msgs/msg/String",
                        "certainty": "exact",
                        "file": file,
                        "line": line,
                    }
                    for kind, name, line in (("subscription", "/chatter", 10), ("publisher", "/chatter2", 14))
                ],
            }
        ],
        "unresolved": [],
    }


def test_unknown_names_are_listed(infer: Infer) -> None:
    system = infer("import rclpy, sys\nn = rclpy.create_node('n')\nn.create_client(object, sys.argv[1])\n")
    document = json.loads(to_json(expand(system)))
    assert document["nodes"][0]["interfaces"][0]["certainty"] == "unknown"
    assert [entry["line"] for entry in document["unresolved"]] == [3]


def test_manifests_read_back_as_what_was_inferred(infer: Infer, tmp_path: Path) -> None:
    from nodl.document import read_document

    system = infer(LISTENER)
    for name, text in to_v2(system.nodes).items():
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        (node,) = read_document(path)
        found = {(e.kind, str(e.name), e.type) for e in node.interface.endpoints}
        assert found == {(e.kind, str(e.name), e.type) for e in system.nodes[0].endpoints}


# --- what launch starts -------------------------------------------------------------------------------------

WRAPPERS = {
    "a plain script": LISTENER,
    "pip": "import re\nimport sys\nfrom demo.listener import main\n"
    "if __name__ == '__main__':\n    sys.argv[0] = re.sub('x', '', sys.argv[0])\n    sys.exit(main())\n",
    "setuptools": "import re, sys\nglobals().setdefault('load_entry_point', None)\nif __name__ == '__main__':\n"
    "    sys.exit(load_entry_point('demo==0.0.0', 'console_scripts', 'listener')())\n",
    "setuptools in development": "__requires__ = 'demo==0.0.0'\n"
    "__import__('pkg_resources').require('demo==0.0.0')\n__file__ = '{source}'\n"
    "with open(__file__) as f:\n    exec(compile(f.read(), __file__, 'exec'))\n",
}


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    site = tmp_path / "lib/python3.12/site-packages"
    (site / "demo").mkdir(parents=True)
    (site / "demo/__init__.py").touch()
    (site / "demo/listener.py").write_text(LISTENER, encoding="utf-8")
    (site / "demo-0.0.0-py3.12.egg-info").mkdir()
    entries = "[console_scripts]\nlistener = demo.listener:main\n"
    (site / "demo-0.0.0-py3.12.egg-info/entry_points.txt").write_text(entries, encoding="utf-8")
    index = tmp_path / "share/ament_index/resource_index/packages"
    index.mkdir(parents=True)
    (index / "demo").touch()
    (tmp_path / "lib/demo").mkdir()
    return tmp_path


@pytest.mark.parametrize("wrapper", WRAPPERS)
def test_the_source_behind_an_executable(wrapper: str, prefix: Path) -> None:
    source = prefix / "lib/python3.12/site-packages/demo/listener.py"
    script = prefix / "lib/demo/listener"
    script.write_text(
        "#!/usr/bin/python3\n" + WRAPPERS[wrapper].replace("{source}", str(source)), encoding="utf-8"
    )
    script.chmod(0o755)
    inferred = infer_executable("demo", "listener", prefixes=[str(prefix)])
    (node,) = inferred.interfaces
    assert (node.package, node.executable, node.name) == ("demo", "listener", "listener")
    assert [str(e.name) for e in node.endpoints] == ["chatter", "chatter2"]
    assert not node.gaps


def test_symlink_install(prefix: Path, tmp_path: Path) -> None:
    """``colcon build --symlink-install``: an egg-link to the build folder."""
    site = prefix / "lib/python3.12/site-packages"
    build = tmp_path / "build/demo"
    build.mkdir(parents=True)
    (site / "demo").rename(build / "demo")
    (site / "demo-0.0.0-py3.12.egg-info").rename(build / "demo.egg-info")
    (site / "demo.egg-link").write_text(f"{build}\n.\n", encoding="utf-8")
    script = prefix / "lib/demo/listener"
    script.write_text("#!/usr/bin/python3\n" + WRAPPERS["setuptools"], encoding="utf-8")
    script.chmod(0o755)
    assert infer_executable("demo", "listener", prefixes=[str(prefix)]).interfaces[0].name == "listener"


def test_compiled_program_is_not_analysed(prefix: Path) -> None:
    program = prefix / "lib/demo/compiled"
    program.write_bytes(b"\x7fELF\x02\x01\x01")
    program.chmod(0o755)
    inferred = infer_executable("demo", "compiled", prefixes=[str(prefix)])
    assert not inferred
    assert "is a compiled program" in inferred.why


def test_missing_executable(prefix: Path) -> None:
    assert "not found" in infer_executable("demo", "nothing", prefixes=[str(prefix)]).why
