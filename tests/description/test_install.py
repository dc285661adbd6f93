"""Our packages under their public names: only inside the block, and everything is back afterwards."""

from __future__ import annotations

import importlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from enclave_launch.description.install import installed


@pytest.fixture
def real_launch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Stand-ins for an installed ``launch`` and a helper package that uses whatever ``launch`` there is."""
    (tmp_path / "launch").mkdir()
    (tmp_path / "launch" / "__init__.py").write_text("class LaunchDescription:\n    who = 'installed'\n")
    (tmp_path / "launch_helper").mkdir()
    (tmp_path / "launch_helper" / "__init__.py").write_text("from launch import LaunchDescription\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield tmp_path
    for name in [name for name in sys.modules if name.partition(".")[0] in ("launch", "launch_helper")]:
        del sys.modules[name]


def helper_class() -> type:
    cls: type = importlib.import_module("launch_helper").LaunchDescription
    return cls


def test_the_public_names_are_our_very_classes() -> None:
    with installed():
        module = importlib.import_module("launch.actions.group_action")
        from enclave_launch.description.actions.flow import GroupAction

        assert module.GroupAction is GroupAction
        assert module.__name__ == "launch.actions.group_action"
    assert "launch.actions.group_action" not in sys.modules


def test_an_installed_launch_is_hidden_and_comes_back_untouched(real_launch: Path) -> None:
    real = importlib.import_module("launch")
    real_helper = helper_class()
    with installed():
        assert importlib.import_module("launch") is not real
        ours = helper_class()
        assert ours.__module__.startswith("enclave_launch.")
    assert sys.modules["launch"] is real
    assert helper_class() is real_helper
    with installed():
        assert helper_class() is ours


def test_helpers_imported_with_ours_do_not_stay(real_launch: Path) -> None:
    with installed():
        assert helper_class().__module__.startswith("enclave_launch.")
    assert "launch_helper" not in sys.modules
    assert helper_class().__module__ == "launch"


def test_blocks_nest() -> None:
    with installed():
        with installed():
            importlib.import_module("launch")
        assert "launch" in sys.modules
    assert "launch" not in sys.modules


def test_the_import_system_is_restored_after_an_error() -> None:
    finders, path = list(sys.meta_path), list(sys.path)
    with pytest.raises(ValueError, match="stop"), installed():
        raise ValueError("stop")
    assert (sys.meta_path, sys.path) == (finders, path)


def test_children_see_the_installed_package(real_launch: Path) -> None:
    script = "import launch; print(launch.LaunchDescription.who)"
    with installed():
        result = subprocess.run(
            [sys.executable, "-c", script], cwd=real_launch, capture_output=True, text=True, check=True
        )
    assert result.stdout == "installed\n"


def test_a_name_that_does_not_exist_is_no_module() -> None:
    with installed(), pytest.raises(ModuleNotFoundError, match=r"launch\.nowhere"):
        importlib.import_module("launch.nowhere")


def test_python_packages_of_a_prefix_can_be_imported(tmp_path: Path) -> None:
    folder = tmp_path / "lib" / "python3.99" / "site-packages"
    folder.mkdir(parents=True)
    (folder / "only_in_this_prefix.py").write_text("value = 1\n")
    with installed([str(tmp_path)]):
        assert importlib.import_module("only_in_this_prefix").value == 1
    assert str(folder) not in sys.path
    sys.modules.pop("only_in_this_prefix", None)
