"""Programs of several files: what one module takes from another, beside the truth."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_addons.inference import infer_paths
from tests.addons.inference.recorder import record
from tests.addons.inference.truth import claim

_MAIN = """\
import rclpy
from std_msgs.msg import String
TOPIC, _HIDDEN = 'own', 'own_hidden'
def run():
    import {imported}
    node = rclpy.create_node('n')
    for name in (TOPIC, _HIDDEN):
        node.create_publisher(String, name, 10)
if __name__ == '__main__':
    run()
"""
_STAR = _MAIN.replace("def run", "from names import *\ndef run").format(imported="rclpy.node")
_NAMES = "TOPIC, _HIDDEN = 'star', 'star_hidden'\n"
CASES = {
    "no __all__": (_STAR, {"names.py": _NAMES}),
    "__all__ leaves a name out": (_STAR, {"names.py": _NAMES + "__all__ = []\n"}),
    "__all__ has a hidden name": (_STAR, {"names.py": _NAMES + "__all__ = ['_HIDDEN']\n"}),
    "__all__ that is made of others": (
        _STAR,
        {"names.py": "from more import *\nimport more\n__all__ = ['TOPIC'] + more.__all__\nTOPIC = 'star'\n",
         "more.py": "_HIDDEN = 'more'\n__all__ = ['_HIDDEN']\n"},
    ),
    "a module changes the script that imports it": (
        _MAIN.format(imported="helper"), {"helper.py": "import main\nmain.TOPIC = 'changed'\n"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("title", CASES)
def test_names_of_modules_are_exact(title: str, tmp_path: Path) -> None:
    main, others = CASES[title]
    for name, text in {"main.py": main, **others}.items():
        (tmp_path / name).write_text(text)
    claimed = claim(infer_paths([tmp_path / "main.py"]), {})
    assert claimed.exact
    assert claimed.facts == record(tmp_path / "main.py", {})


def test_an_all_that_is_not_known_is_a_gap(tmp_path: Path) -> None:
    (tmp_path / "main.py").write_text(_STAR)
    (tmp_path / "names.py").write_text(f"{_NAMES}__all__ = [name for name in dir() if len(name) < 6]\n")
    assert claim(infer_paths([tmp_path / "main.py"]), {}).gaps
