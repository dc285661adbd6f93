"""Generated systemd units on the host that runs them, known by the files themselves: installed, removed, restarted."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from enclave_addons.deployment.units import Unit, in_restart_order, parse_unit
from enclave_common.terminal import printable as printable_line
from enclave_common.terminal import quoted
from keystore.disk.store import write_new
from keystore.disk.versions import written_aside
from keystore.errors import InvalidInputError, StorageError, storage_errors
from keystore.formats.bundle import Manifest

UNITS = Path("/etc/systemd/system")
PARAMETERS = Path("/etc/ros")
_PUBLIC = 0o644
_SUFFIXES = (".service", ".target", ".timer")
_POLL_SECONDS = 0.2
_SHOWN = ("ActiveState", "SubState", "Result", "NRestarts", "AssertResult")


@dataclass(frozen=True, slots=True)
class UnitOptions:
    """Where units are, and how long one is watched.

    Attributes:
        units: Where systemd reads them.
        parameters: Where their parameter files are, in NAME/parameters.
        settle: Seconds that a restarted process must run before the next is restarted.
        start_limit: Seconds that systemd may take to start one.
    """

    units: Path = UNITS
    parameters: Path = PARAMETERS
    settle: float = 5.0
    start_limit: float = 60.0


class Installed(NamedTuple):
    """What an installation changed: names of unit files."""

    target: str
    changed: tuple[str, ...]
    removed: tuple[str, ...]


class Restarted(NamedTuple):
    """How far a restart came. ``failed``: why it stopped at the first of ``left``; None if it did not."""

    left: tuple[str, ...] = ()
    failed: str | None = None


def installed_units(options: UnitOptions | None = None) -> list[Unit]:
    """Return the generated units of this host, by name."""
    folder = (options or UnitOptions()).units
    return [unit for unit, _ in _generated(folder)] if folder.is_dir() else []


def chosen_units(units: Sequence[Unit], names: Iterable[str]) -> list[Unit]:
    """Return the services of these units, targets, nodes or enclaves, in restart order; all without names.

    Raises ``InvalidInputError`` for a name that matches none.
    """
    processes = in_restart_order(units)
    wanted = list(names)
    for name in wanted:
        if not any(unit.is_called(name) for unit in processes):
            known = ", ".join(unit.name.removesuffix(".service") for unit in processes) or "none"
            raise InvalidInputError(
                f"no installed unit, node or enclave is called {quoted(name)}; there are {known}"
            )
    return [unit for unit in processes if not wanted or any(map(unit.is_called, wanted))]


def install(folder: Path, options: UnitOptions | None = None) -> Installed:
    """Install what ``secure-plan export --format systemd`` wrote to ``folder``, and remove what it no longer has.

    Units that go are stopped; nothing is started. The target is enabled.

    Raises:
        InvalidInputError: ``folder`` is not such a folder, or a unit of that name is not ours.
        StorageError: A file cannot be written; systemd is then not reloaded.
    """
    chosen = options or UnitOptions()
    brought = {unit.name: text for unit, text in _generated(folder)}
    targets = [name for name in brought if name.endswith(".target")]
    if len(targets) != 1:
        raise InvalidInputError(
            f"{quoted(folder)} is not the folder of one host that secure-plan export --format systemd wrote"
        )
    (target,) = targets
    present = {unit.name: text for unit, text in _generated(chosen.units) if unit.target == target}
    changed = [name for name, text in brought.items() if present.get(name) != text]
    removed = sorted(set(present) - set(brought))
    for name in changed:
        if name not in present and os.path.lexists(chosen.units / name):
            raise InvalidInputError(f"{quoted(chosen.units / name)} was not generated; it is left alone")
    if removed:
        _systemctl("stop", *removed)
    parameters = chosen.parameters / target.removesuffix(".target") / "parameters"
    with storage_errors("installing units"):
        stale = _install_parameters(folder / "parameters", parameters)
        for name in changed:
            _replace(chosen.units / name, brought[name])
        for path in (*(chosen.units / name for name in removed), *stale):
            path.unlink()
    _systemctl("daemon-reload")
    _systemctl("enable", target)
    return Installed(target, tuple(changed), tuple(removed))


def uninstall(name: str, options: UnitOptions | None = None) -> Installed:
    """Stop and remove all units of the target ``name``; raises InvalidInputError if there is none."""
    chosen = options or UnitOptions()
    target = f"{name.removesuffix('.target')}.target"
    names = [unit.name for unit in installed_units(chosen) if unit.target == target]
    if target not in names:
        raise InvalidInputError(f"no target {quoted(target)} of ours is installed in {chosen.units}")
    _systemctl("disable", target)
    _systemctl("stop", *names)
    with storage_errors("removing units"):
        for one in names:
            (chosen.units / one).unlink()
        shutil.rmtree(chosen.parameters / target.removesuffix(".target") / "parameters", ignore_errors=True)
    _systemctl("daemon-reload")
    return Installed(target, (), tuple(names))


def stop(units: Sequence[Unit]) -> None:
    """Stop ``units``."""
    if units:
        _systemctl("stop", *(unit.name for unit in units))


def restart(
    units: Sequence[Unit],
    options: UnitOptions | None = None,
    *,
    together: bool = False,
    report: Callable[[str], object] = lambda name: None,
) -> Restarted:
    """Restart or start ``units`` one after the other, and stop at the first that does not stay up.

    A process counts as up if it ran for ``settle`` seconds without being restarted, or ended with success.

    Args:
        together: Restart all at once, then watch them.
        report: Called with the name of each that is up.
    """
    chosen = options or UnitOptions()
    names = [unit.name for unit in units]
    left = list(names)
    for group in [names] if together else [[name] for name in names]:
        problem = _restart(group, chosen)
        for name in group:
            problem = problem or _watch(name, chosen.settle if name == group[0] else 0)
            if problem is not None:
                return Restarted(tuple(left), problem)
            left.remove(name)
            report(name)
    return Restarted()


def unit_problems(units: Iterable[Unit]) -> Iterator[tuple[Unit, str | None]]:
    """Yield each service of a process and what is wrong with it, None if it runs."""
    for unit in in_restart_order(units):
        state = _state(unit.name)
        yield unit, None if _runs(state) else _described(unit.name, state)


def differences(units: Iterable[Unit], manifest: Manifest) -> Iterator[str]:
    """Yield what does not fit between the units of this host and the bundle that was imported."""
    processes = [unit for unit in units if unit.is_process and unit.enclave is not None]
    for unit in processes:
        if not unit.reads_crl:
            yield (
                f"{unit.name} does not load crl.pem, so that no revocation reaches it: export it again and install it "
                "with secure-keystore units install"
            )
        if unit.enclave not in manifest.names:
            yield (
                f"{unit.name} runs enclave {unit.enclave}, which this bundle does not have: export the units of this "
                "host again and install them with secure-keystore units install"
            )
    served = {unit.enclave for unit in processes}
    for enclave in manifest.names if processes else ():
        if enclave not in served:
            yield f"no unit of this host runs enclave {enclave}"


def _generated(folder: Path) -> Iterator[tuple[Unit, str]]:
    with storage_errors("looking for units in"):
        for path in sorted(folder.iterdir()):
            if path.suffix in _SUFFIXES and path.is_file() and not path.is_symlink():
                text = path.read_text(encoding="utf-8", errors="replace")
                if (unit := parse_unit(path.name, text)) is not None:
                    yield unit, text


def _install_parameters(source: Path, target: Path) -> list[Path]:
    brought = {path.name: path.read_text(encoding="utf-8") for path in source.glob("*.yaml")}
    if brought:
        target.mkdir(parents=True, exist_ok=True)
    for name, text in brought.items():
        _replace(target / name, text)
    return [path for path in target.glob("*.yaml") if path.name not in brought]


def _replace(path: Path, text: str) -> None:
    with written_aside(path) as aside:
        write_new(aside, text.encode(), _PUBLIC, durable=True)


def _restart(names: list[str], options: UnitOptions) -> str | None:
    _systemctl("reset-failed", *names, may_fail=True)
    try:
        done = _systemctl("restart", *names, may_fail=True, timeout=options.start_limit)
    except subprocess.TimeoutExpired:
        return f"{', '.join(names)} did not start within {options.start_limit:g} s"
    if done.returncode != 0:
        name = next((one for one in names if not _runs(_state(one))), names[0])
        return _described(name, _state(name))
    return None


def _watch(name: str, settle: float) -> str | None:
    end = time.monotonic() + settle
    while True:
        state = _state(name)
        if not _runs(state) or state.get("NRestarts", "0") != "0":
            return _described(name, state)
        if state["ActiveState"] == "inactive" or time.monotonic() >= end:
            return None
        time.sleep(_POLL_SECONDS)


def _runs(state: dict[str, str]) -> bool:
    """Return True if the process runs, or ended with success and is not to be restarted."""
    if state.get("ActiveState") == "active":
        return True
    if state.get("AssertResult") == "no":
        return False
    return state.get("ActiveState") == "inactive" and state.get("Result") == "success"


def _state(name: str) -> dict[str, str]:
    shown = _systemctl("show", f"--property={','.join(_SHOWN)}", name)
    return dict(line.partition("=")[::2] for line in shown.stdout.splitlines())


def _described(name: str, state: dict[str, str]) -> str:
    what = f"{state.get('ActiveState', 'unknown')} ({state.get('SubState', 'unknown')})"
    if what == "inactive (dead)" and state.get("AssertResult") == "no":
        return f"{name} was not started, or its enclave is not in the keystore; see systemctl status {name}"
    return (
        f"{name} is {what}, result {state.get('Result', 'unknown')}, restarted by itself "
        f"{state.get('NRestarts', '0')} times; see journalctl -u {name}"
    )


def _systemctl(
    *words: str, may_fail: bool = False, timeout: float | None = None
) -> subprocess.CompletedProcess[str]:
    with storage_errors("running systemctl"):
        done = subprocess.run(["systemctl", *words], capture_output=True, text=True, timeout=timeout)
    if done.returncode != 0 and not may_fail:
        raise StorageError(f"systemctl {' '.join(words)} failed: {printable_line(done.stderr.strip())}")
    return done
