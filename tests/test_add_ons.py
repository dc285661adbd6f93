"""The main job works without the add-ons, alone or all removed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("enclave_addons", "enclave_common", "enclave_launch", "keystore", "nodl")

ADD_ONS: dict[str, tuple[str, ...]] = {
    room: (f"enclave_addons/{room}",)
    for room in ("inference", "library", "recording", "observation", "review", "deployment", "zenoh")
}
REMOVALS = {**ADD_ONS, "all": tuple(path for paths in ADD_ONS.values() for path in paths)}

DRY_RUN = ("enclave_launch", "--dry-run", "--prefix", str(ROOT / "fixtures/demo_ws"), "demo_nodes")
OF_ZENOH = "--ignore=tests/admission/test_zenoh.py"
CORE_TESTS = (
    OF_ZENOH,
    "tests/admission",
    "tests/policy/test_derivation.py",
    "tests/test_enclave_assignment.py",
)
TALKER = "talker_listener.launch.xml"

# add-on -> a command line that needs it
NEEDS: dict[str, tuple[str, ...]] = {
    "inference": ("nodl.verb", "infer", "."),
    "recording": ("nodl.verb", "check-record", "learnt"),
    "observation": ("nodl.verb", "observe", "--for", "1s"),
    "library": ("nodl.verb", "library", "list"),
    "review": ("secure-plan", "check", "demo_nodes", "talker_listener.launch.xml"),
    "deployment": ("secure-plan", "export", "demo_nodes", "talker_listener.launch.xml"),
    "zenoh": ("keystore.verb", "zenoh", "ks"),
}


SECURE_PLAN = "import sys; from enclave_addons.entry import secure_plan; sys.exit(secure_plan())"


def copy_without(removed: tuple[str, ...], folder: Path) -> Path:
    for package in PACKAGES:
        # Without half-written byte code: another test may be about to rename it.
        ignore = shutil.ignore_patterns("*.pyc.*")
        shutil.copytree(ROOT / package, folder / package, ignore=ignore)
    for path in removed:
        found = folder / path
        assert found.exists(), f"{path} has moved: name what the add-on is now"
        if found.is_dir():
            shutil.rmtree(found)
        else:
            found.unlink()
    return folder


def python(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Run ``python -m``, or ``secure-plan`` as it is installed. Without ``site``, where this checkout is installed."""
    program = ["-c", SECURE_PLAN, *words[1:]] if words[0] == "secure-plan" else ["-m", *words]
    path = os.pathsep.join([str(folder), sysconfig.get_path("purelib")])
    return subprocess.run(
        [sys.executable, "-S", *program],
        env={**os.environ, "PYTHONPATH": path},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_without((), tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def plans(whole: Path) -> dict[str, str]:
    """The dry run of the whole installation, by its form."""
    return {
        form: python(whole, *DRY_RUN, TALKER, "--format", form).stdout for form in ("tree", "json", "policy")
    }


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_without(REMOVALS["all"], tmp_path_factory.mktemp("core"))


@pytest.mark.parametrize("add_on", REMOVALS)
def test_the_main_job_works_without_an_add_on(add_on: str, plans: dict[str, str], tmp_path: Path) -> None:
    folder = copy_without(REMOVALS[add_on], tmp_path / "part")
    for form, expected in plans.items():
        found = python(folder, *DRY_RUN, TALKER, "--format", form)
        assert (found.returncode, found.stdout) == (0, expected), found.stderr
    made = python(folder, "keystore.verb", "create", "ks")
    assert made.returncode == 0, made.stderr
    policy = folder / "policy.xml"
    policy.write_text(plans["policy"])
    applied = python(folder, "keystore.verb", "apply-policy", "ks", str(policy))
    assert applied.returncode == 0, applied.stderr
    assert (folder / "ks/enclaves/permissions.p7s").is_file()


@pytest.mark.parametrize("add_on", ADD_ONS)
def test_a_verb_of_an_add_on_that_is_not_installed_says_so(add_on: str, core: Path, tmp_path: Path) -> None:
    for folder in (copy_without(ADD_ONS[add_on], tmp_path), core):
        ran = python(folder, *NEEDS[add_on])
        assert ran.returncode == 1
        assert "is not part of this installation" in ran.stderr
        assert ran.stderr.count("\n") == 1, ran.stderr


@pytest.mark.parametrize(("add_on", "option"), [("recording", "--audit"), ("observation", "--watch")])
def test_an_option_of_an_add_on_that_is_not_installed_starts_nothing(
    add_on: str, option: str, whole: Path, tmp_path: Path
) -> None:
    words = ("enclave_launch", option, "--provision-only", *DRY_RUN[2:], TALKER)
    assert "--provision-only writes the keystore" in python(whole, *words).stderr
    ran = python(copy_without(ADD_ONS[add_on], tmp_path), *words)
    assert ran.returncode == 2 and f"unrecognized arguments: {option}" in ran.stderr, ran.stderr


def test_a_process_on_zenoh_is_refused_without_that_add_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")
    folder = copy_without(ADD_ONS["zenoh"], tmp_path)
    shown = python(folder, *DRY_RUN, TALKER)
    assert shown.returncode == 0 and "enclave_addons.zenoh is not part of this installation" in shown.stdout
    ran = python(folder, "enclave_launch", "--secure", "--keystore", "ks", *DRY_RUN[2:], TALKER)
    assert ran.returncode == 1 and "nothing was started or written" in ran.stderr, ran.stderr
    assert "Traceback" not in ran.stderr and not (folder / "ks").exists()


def test_a_keystore_with_a_zenoh_router_says_that_its_rules_do_not_follow_without_that_add_on(
    whole: Path, tmp_path: Path
) -> None:
    folder = copy_without(ADD_ONS["zenoh"], tmp_path / "part")
    keystore = str(tmp_path / "ks")
    for words in (("create", keystore), ("create-enclave", keystore, "/a"), ("zenoh", keystore)):
        assert python(whole, "keystore.verb", *words).returncode == 0
    rules = (tmp_path / "ks/zenoh/router.json5").read_bytes()
    added = python(folder, "keystore.verb", "create-enclave", keystore, "/b")
    assert added.returncode == 0 and "the Zenoh router enforces what it was before" in added.stderr
    verified = python(folder, "keystore.verb", "verify", keystore)
    assert (
        verified.returncode == 1
        and "'zenoh/router.json5': not checked: enclave_addons.zenoh is not" in verified.stdout
    )
    assert (tmp_path / "ks/zenoh/router.json5").read_bytes() == rules
    assert python(whole, "keystore.verb", "zenoh", keystore).returncode == 0
    assert python(whole, "keystore.verb", "verify", keystore).returncode == 0


def test_the_tests_of_the_core_pass_without_all_add_ons(tmp_path: Path) -> None:
    folder = copy_without(REMOVALS["all"], tmp_path)
    for shared in ("tests", "fixtures", "pyproject.toml", "bench"):
        copy = shutil.copytree if (ROOT / shared).is_dir() else shutil.copy
        copy(ROOT / shared, folder / shared)
    ran = python(folder, "pytest", "-q", "-p", "no:cacheprovider", *CORE_TESTS)
    assert ran.returncode == 0, ran.stdout[-3000:]
    assert " passed" in ran.stdout
