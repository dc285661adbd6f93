"""The rules of ARCHITECTURE.md that a program can check."""

from __future__ import annotations

import ast
import importlib
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
CORE = ("enclave_launch", "nodl", "keystore", "enclave_common")
PACKAGES = (*CORE, "enclave_addons")

# Which of our packages a package may import; arrows point one way.
SHARED = "enclave_common"
ALLOWED = {
    "enclave_launch": {"nodl", "keystore", SHARED},
    "nodl": {SHARED},
    "keystore": {SHARED},
    SHARED: set[str](),
    "enclave_addons": {*CORE},
}

# The floors of each package, lowest first: a room imports its own modules and those of the floors below it.
FLOORS: dict[str, tuple[set[str], ...]] = {
    "enclave_launch": (
        {"diagnostics"},
        {"ros_rules"},
        {"errors", "process"},
        {"dry_run"},
        {"frontend", "host"},
        {"description"},
        {"evaluation"},
        {"enclave", "policy", "admission"},
        {"plan"},
        {"plan_diagnostics", "add_ons"},
        {"planner"},
        {"options", "prefixes", "security_environment"},
        {"interfaces"},
        {"report", "runtime"},
        {"secured"},
        {"expiry_watch"},
        {"running"},
        {"flow"},
        {"verb"},
        {"__init__", "__main__"},
    ),
    "nodl": (
        {"types", "names", "endpoint_kind"},
        {"errors", "remap", "name_template"},
        {"node_interface", "ros_arguments", "yaml_text", "xml_text"},
        {"package_xml"},
        {"ament_index"},
        {"builtin_interfaces"},
        {"dependence"},
        {"document"},
        {"lookup", "v1_api"},
        {"verb"},
        {"__init__"},
    ),
    "keystore": (
        {"errors"},
        {"formats"},
        {"signing"},
        {"disk"},
        {"add_ons"},
        {"verification"},
        {"steps"},
        {"verb"},
        {"__init__"},
    ),
    # An add-on works alone for what it does itself; it imports a lower one for what that one adds.
    "enclave_addons": (
        {"entry"},
        {"inference"},
        {"library"},
        {"zenoh"},
        {"review"},
        {"recording"},
        {"observation"},
        {"deployment"},
        {"ros2"},
        {"__init__"},
    ),
}

# Arrows that point up all the same: what a class of upstream's does only when it is used on its own, loaded then.
UPWARD = {
    ("enclave_launch", "description", "runtime"),
    ("enclave_launch", "host", "description"),
}

# Arrows that point up for the type checker alone: a value that a higher room makes is only handed on.
UPWARD_TYPES = {
    ("enclave_launch", "options", "runtime"),
    ("keystore", "add_ons", "steps"),
    ("keystore", "add_ons", "verification"),
    ("nodl", "node_interface", "dependence"),
}

# What decides only may not import what acts.
ACTS = ("enclave_launch.runtime", "enclave_launch.verb", "subprocess", "asyncio")
PURE = (
    "enclave_launch/enclave.py",
    "enclave_launch/policy",
    "enclave_launch/report",
    "enclave_addons/deployment/compose.py",
    "enclave_addons/deployment/kubernetes.py",
    "enclave_addons/deployment/placement.py",
    "enclave_addons/deployment/semantics.py",
    "enclave_addons/deployment/systemd.py",
    "enclave_addons/observation/drift",
    "enclave_addons/review/html",
    "enclave_addons/review/evidence",
)


@cache
def import_statements(path: Path) -> list[tuple[ast.Import | ast.ImportFrom, bool]]:
    """Each import of a module, with True if only the type checker reads it."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    checked = [
        inner
        for node in nodes
        if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        for inner in node.body
    ]
    return [(node, node in checked) for node in nodes if isinstance(node, (ast.Import, ast.ImportFrom))]


def imports_of(path: Path) -> Iterator[str]:
    for node, _ in import_statements(path):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif node.module and not node.level:
            yield node.module


def sources(folder: str) -> list[Path]:
    path = ROOT / folder
    return [path] if path.is_file() else sorted(path.rglob("*.py"))


@pytest.mark.parametrize("package", PACKAGES)
def test_arrows_between_the_packages_point_one_way(package: str) -> None:
    forbidden = set(PACKAGES) - {package} - ALLOWED[package]
    wrong = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in sources(package)
        for name in imports_of(path)
        if name.split(".")[0] in forbidden
    ]
    assert wrong == []


def _imports_from(path: Path, *, types: bool) -> Iterator[tuple[str, list[str]]]:
    """Yield module and names of each ``from`` import; ``types``: also of what only the type checker reads."""
    for node, only_checked in import_statements(path):
        if isinstance(node, ast.ImportFrom) and node.module and (types or not only_checked):
            assert not node.level, f"{path}: a relative import"
            yield node.module, [alias.name for alias in node.names]


def _named_imports(path: Path, *, types: bool) -> Iterator[str]:
    """Yield the module of each ``from`` import, of our packages themselves with the name."""
    for name, members in _imports_from(path, types=types):
        if name in PACKAGES:
            yield from (f"{name}.{each}" for each in members)
        else:
            yield name


@pytest.mark.parametrize("package", sorted(FLOORS))
def test_each_room_stands_on_the_rooms_below_it(package: str) -> None:
    floor = {room: number for number, rooms in enumerate(FLOORS[package]) for room in rooms}
    wrong, upward_types = [], set()
    for path in sources(package):
        room = path.relative_to(ROOT / package).with_suffix("").parts[0]
        assert room in floor, f"{path} stands on no floor: name its room in FLOORS"
        runs = set(_named_imports(path, types=False))
        for name in _named_imports(path, types=True):
            owner, _, inside = name.partition(".")
            target = inside.split(".")[0]
            if owner != package or target == room or name == "enclave_launch.__version__":
                continue
            arrow = (package, room, target)
            if floor[target] >= floor[room] and arrow not in UPWARD:
                if name not in runs:
                    upward_types.add(arrow)
                else:
                    wrong.append(f"{path.relative_to(ROOT)} imports {name}")
    assert wrong == []
    assert upward_types == {arrow for arrow in UPWARD_TYPES if arrow[0] == package}


# Inference of C++, whose modules may know each other's types in a circle; they import in none when they run.
WITH_CIRCLES_OF_TYPES = ROOT / "enclave_addons" / "inference" / "cpp"


def test_no_modules_need_each_other_in_a_circle_not_even_as_types_or_inside_of_functions() -> None:
    files = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
        for package in PACKAGES
        for path in sources(package)
    }
    graph = {
        name: {each for each in _modules_imported_by(path) if each in files and each != name}
        for name, path in files.items()
    }
    TopologicalSorter(graph).prepare()  # raises CycleError with the circle


def _modules_imported_by(path: Path) -> Iterator[str]:
    """Yield the modules that ``path`` imports; a name of a package's is its module if it is one."""
    for name, members in _imports_from(path, types=WITH_CIRCLES_OF_TYPES not in path.parents):
        modules = [f"{name}.{each}" for each in members if _is_module(f"{name}.{each}")]
        yield from modules
        if len(modules) < len(members):
            yield name


def _is_module(name: str) -> bool:
    path = ROOT / name.replace(".", "/")
    return path.with_suffix(".py").is_file() or path.is_dir()


@pytest.mark.parametrize("folder", PURE)
def test_deciding_stages_do_not_import_what_acts(folder: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)} imports {name}"
        for path in sources(folder)
        for name in imports_of(path)
        if name.startswith(ACTS)
    ]
    assert wrong == []


def test_only_the_disk_room_of_the_keystore_makes_files_that_may_hold_a_key() -> None:
    makers = {
        path.relative_to(ROOT).parts[1] for path in sources("keystore") if "O_CREAT" in path.read_text()
    }
    assert makers == {"disk"}


def test_every_module_can_be_imported() -> None:
    """No module depends on names that only a type checker has, or on another having been imported first."""
    files = [path.relative_to(ROOT).with_suffix("") for package in PACKAGES for path in sources(package)]
    needs_upstream = ROOT / "enclave_addons" / "ros2"
    modules = [
        ".".join(file.parts)
        for file in files
        if file.name != "__main__" and needs_upstream not in (ROOT / file).parents
    ]
    code = "import importlib, sys\nfor name in sys.argv[1:]: importlib.import_module(name)"
    subprocess.run([sys.executable, "-c", code, *modules], check=True, cwd=ROOT)


def modules_loaded_by(arguments: list[str], **environment: str) -> set[str]:
    """What a whole run of ``secure-launch`` imports; without ``site``, where an editable installation imports more."""
    code = (
        "import sys\n"
        "from enclave_launch.verb.secure_launch import main\n"
        f"status = main({arguments!r})\n"
        "print('\\n'.join(sys.modules), file=sys.stderr)\n"
        "sys.exit(status)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, check=True, cwd=ROOT, env={**os.environ, **environment},
    )  # fmt: skip
    return set(run.stderr.split())


@pytest.mark.parametrize("form", ["tree", "json"])
def test_a_dry_run_imports_no_heavy_package(form: str) -> None:
    loaded = modules_loaded_by(
        [
            "--dry-run",
            "--format",
            form,
            "--prefix",
            "fixtures/demo_ws",
            "demo_nodes",
            "talker_listener.launch.xml",
        ]
    )
    assert {"nodl.document.v1", "enclave_launch.plan"} <= loaded
    heavy = {"cryptography", "pydantic", "lxml", "cyclonedds", "tree_sitter"}
    assert loaded.isdisjoint(heavy)


def named_in_architecture() -> list[str]:
    """Every module and folder that the table "Where a rule lives" and the decisions name."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8").partition("## Where a rule lives")[2]
    return sorted(set(re.findall(r"`((?:[a-z_]+/)*[a-z_]+(?:\.py|/))`", text)))


@pytest.mark.parametrize("named", named_in_architecture())
def test_what_architecture_md_names_exists(named: str) -> None:
    assert (ROOT / "enclave_launch" / named).exists() or (ROOT / named).exists()


# Public class names that stand twice on purpose. What is not here has a name of its own.
AS_UPSTREAM_HAS_IT = {  # launch, launch_ros and the NoDL v1 API name both so, and launch files import them
    "Action", "Entity", "IncludeLaunchDescription", "Node", "Parameter", "Parser", "PushRosEnclave", "Shutdown",
    "ProcessExited", "ProcessStarted",  # the events of launch, and what a library user hears of them
}  # fmt: skip
# dry_run.py: their JSON
AS_THE_PLAN_HAS_IT = {"Diagnostic", "LauncherCall", "Node", "Reaction", "Release", "Respawn"}
# of Python in enclave_addons/inference/kernel/ and python/, of C++ in enclave_addons/inference/cpp/
IN_BOTH_KINDS_OF_INFERENCE = {
    "Bound", "Call", "Class", "Frame", "Function", "Machine", "Obj", "StepLimitExceeded", "Text", "Unknown",
}  # fmt: skip


def test_a_public_class_has_its_name_alone() -> None:
    homes: dict[str, list[str]] = {}
    for path in (path for package in PACKAGES for path in sources(package)):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(str(path.relative_to(ROOT)))
    twice = {name for name, places in homes.items() if len(places) > 1}
    assert twice == AS_UPSTREAM_HAS_IT | AS_THE_PLAN_HAS_IT | IN_BOTH_KINDS_OF_INFERENCE


@pytest.mark.parametrize("package", ["enclave_launch", "keystore"])
def test_the_stub_of_a_package_lists_its_public_names(package: str) -> None:
    stub = (ROOT / package / "__init__.pyi").read_text(encoding="utf-8")
    listed = re.findall(r"^from (\S+) import (\w+) as \2$", stub, re.MULTILINE)
    module = importlib.import_module(package)
    assert sorted(name for _, name in listed) == module.__all__
    for home, name in listed:
        assert getattr(module, name) is getattr(importlib.import_module(home), name)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = module.nothing
