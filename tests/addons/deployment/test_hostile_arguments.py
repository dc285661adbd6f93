"""A value on the command line of an export is either refused or read back unchanged: it never becomes syntax."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from tests.addons.deployment.kit import export, launch_file, provisioned
from tests.addons.deployment.systemd_stand_in import Unit

HOSTILE = [
    "x;touch hit",
    "x$(touch hit)`touch hit`",
    "x\nExecStartPre=+touch hit\n  privileged: true",
    "x\"\n- y' #",
    "x%n${HOME}\\n\\",
    "../../x: {y: z}",
    "x\u202e\u0000",
    "",
]
OPTIONS = {
    "systemd": ("--name", "--setup", "--host-keystore"),
    "compose": ("--name", "--image", "--user", "--host-keystore"),
    "kubernetes": ("--name", "--image", "--host-keystore"),
}
GIVEN = [
    (engine, option, value) for engine, options in OPTIONS.items() for option in options for value in HOSTILE
]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("robot")
    launch = launch_file(folder)
    return launch, provisioned(launch, folder / "ks")


def keys(value: object) -> Iterator[str]:
    """Yield every path of keys in a document, without its values."""
    if isinstance(value, dict):
        for key, one in value.items():
            yield str(key)
            yield from (f"{key}.{below}" for below in keys(one))
    elif isinstance(value, list):
        for one in value:
            yield from (f"[].{below}" for below in keys(one))


@pytest.mark.parametrize(("engine", "option", "value"), GIVEN)
def test_a_value_is_refused_or_stays_a_value(
    engine: str, option: str, value: str, place: tuple[Path, Path], tmp_path: Path
) -> None:
    launch, keystore = place
    image = () if engine == "systemd" else ("--image", "robot:1")
    given = value if option not in ("--setup", "--host-keystore") else f"/{value}"
    if status := export(engine, launch, keystore, tmp_path / "out", *image, option, given):
        assert status == 2 and not (tmp_path / "out").exists()
        return
    harmless = "/opt/k" if given.startswith("/") else "1000:1000" if option == "--user" else "robot"
    assert export(engine, launch, keystore, tmp_path / "plain", *image, option, harmless) == 0
    assert shape(tmp_path / "out", engine) == shape(tmp_path / "plain", engine)


def shape(out: Path, engine: str) -> list[object]:
    """Return the names of everything an engine reads in a folder, without values."""
    assert not [path for path in out.rglob("*") if not path.resolve().is_relative_to(out.resolve())]
    if engine == "systemd":
        names = [
            re.sub("=.*", "", line)
            for path in sorted(out.glob("*.service"))
            for line in path.read_text().splitlines()
            if line and not line.startswith("#")
        ]
        assert all(Unit(path).one("ExecStart") for path in out.glob("*.service"))
        return [sorted(names)]
    documents = [one for path in sorted(out.rglob("*.yaml")) for one in yaml.safe_load_all(path.read_text())]
    return [sorted(set(keys(one))) for one in documents]
