"""A made-up driving stack: an ament workspace with the shape of a large simulator launch.

Areas include subsystems, subsystems include leaves; every level forwards arguments, looks packages up, reads
variables and conditions. 55 processes, 53 components, some 350 includes; no content from any real stack.
"""

from __future__ import annotations

from pathlib import Path

AREAS = (
    "sensing",
    "localization",
    "perception",
    "planning",
    "control",
    "system",
    "map",
    "vehicle",
    "api",
    "rviz",
)
SUBSYSTEMS = 6
LEAVES = 5
PROCESSES = 55
COMPONENTS = 53
FORWARDED = (
    "use_sim_time",
    "vehicle_model",
    "sensor_model",
    "map_path",
    "data_path",
    "launch_mode",
    "log_level",
)


def write_stack(prefix: Path) -> Path:
    """Write the workspace below ``prefix`` and give its top launch file."""
    nodes = _Budget(PROCESSES, len(AREAS) * SUBSYSTEMS * LEAVES)
    components = _Budget(COMPONENTS, len(AREAS) * SUBSYSTEMS * LEAVES)
    for area in AREAS:
        _write_area(prefix, area, nodes, components)
    includes = "".join(_include(f"{area}_launch", f"{area}.launch.xml") for area in AREAS)
    top = install_package(prefix, "stack_launch") / "launch" / "stack.launch.xml"
    top.write_text(f"<launch>\n{_arguments()}{includes}</launch>\n", encoding="utf-8")
    return top


def write_nodes(prefix: Path, count: int) -> Path:
    """One file with ``count`` nodes, each with a parameter, a remap and a namespace."""
    share = install_package(prefix, "many", "node")
    node = (
        '  <node pkg="many" exec="node" name="n{0}" namespace="area_$(var x)">\n'
        '    <param name="rate" value="{0}"/><remap from="in" to="/topic{0}"/>\n  </node>\n'
    )
    text = "".join(node.format(number) for number in range(count))
    file = share / "launch" / f"many_{count}.launch.xml"
    file.write_text(f'<launch>\n  <arg name="x" default="1"/>\n{text}</launch>\n', encoding="utf-8")
    return file


class _Budget:
    """Spreads ``total`` evenly over ``places``."""

    def __init__(self, total: int, places: int) -> None:
        self._total, self._places, self._place, self._given = total, places, 0, 0

    def next(self) -> int:
        self._place += 1
        due = self._total * self._place // self._places - self._given
        self._given += due
        return due


def _write_area(prefix: Path, area: str, nodes: _Budget, components: _Budget) -> None:
    package = f"{area}_launch"
    share = install_package(prefix, package)
    install_package(prefix, f"{area}_nodes", "node", "container")
    subsystems = [f"{area}_{number}" for number in range(SUBSYSTEMS)]
    includes = "".join(_include(package, f"{name}.launch.xml") for name in subsystems)
    body = (
        f'  <let name="{area}_config" value="$(find-pkg-share {package})/config/$(var launch_mode)"/>\n'
        f'  <group>\n  <push_ros_namespace namespace="{area}"/>\n{includes}  </group>\n'
    )
    (share / "launch" / f"{area}.launch.xml").write_text(f"<launch>\n{_arguments()}{body}</launch>\n")
    for subsystem in subsystems:
        _write_subsystem(share, area, subsystem, nodes, components)


def _write_subsystem(share: Path, area: str, name: str, nodes: _Budget, components: _Budget) -> None:
    leaves = [f"{name}_leaf_{number}" for number in range(LEAVES)]
    includes = "".join(_include(f"{area}_launch", f"{leaf}.launch.xml") for leaf in leaves)
    switch = '  <arg name="enable" default="true"/>\n'
    body = f'  <group if="$(var enable)">\n  <push_ros_namespace namespace="{name}"/>\n{includes}  </group>\n'
    (share / "launch" / f"{name}.launch.xml").write_text(f"<launch>\n{_arguments()}{switch}{body}</launch>\n")
    for leaf in leaves:
        _write_leaf(share, area, leaf, nodes.next(), components.next())


def _write_leaf(share: Path, area: str, name: str, nodes: int, components: int) -> None:
    own = "".join(
        f'  <arg name="{name}_{number}" default="$(var data_path)/$(env USER nobody)/{name}/{number}.yaml" '
        f'description="file {number}"/>\n'
        for number in range(12)
    )
    config = f"$(find-pkg-share {area}_launch)/config/{name}.param.yaml"
    body = f'  <arg name="param_path" default="{config}"/>\n'
    body += "".join(_node(area, f"{name}_node_{number}") for number in range(nodes))
    if components:
        body += _container(area, name, components)
    (share / "launch" / f"{name}.launch.xml").write_text(f"<launch>\n{_arguments()}{own}{body}</launch>\n")
    _write_parameters(share / "config" / f"{name}.param.yaml")


def _write_parameters(path: Path) -> None:
    values = "".join(
        f"    value_{number}: {number}.5\n    name_{number}: text {number}\n" for number in range(25)
    )
    path.write_text(f"/**:\n  ros__parameters:\n{values}", encoding="utf-8")


def _node(area: str, name: str) -> str:
    return (
        f'  <node pkg="{area}_nodes" exec="node" name="{name}" output="screen"\n'
        f'    args="--ros-args --log-level $(var log_level)">\n'
        f'    <param from="$(var param_path)"/>\n'
        f'    <param name="use_sim_time" value="$(var use_sim_time)"/>\n'
        f'    <param name="model"\n'
        f"      value=\"$(eval &quot;'$(var vehicle_model)' + '_$(var sensor_model)'&quot;)\"/>\n"
        f'    <remap from="~/input/state" to="/{area}/state"/>\n'
        f'    <remap from="~/output" to="$(var launch_mode)/out"/>\n'
        f"  </node>\n"
    )


def _container(area: str, name: str, components: int) -> str:
    nodes = "".join(
        f'    <composable_node pkg="{area}_nodes" plugin="{area}::Part" name="{name}_part_{number}">\n'
        f'      <param from="$(var param_path)"/><param name="use_sim_time" value="$(var use_sim_time)"/>\n'
        f'      <remap from="input" to="points_{number}"/>\n'
        f'      <extra_arg name="use_intra_process_comms" value="true"/>\n    </composable_node>\n'
        for number in range(components)
    )
    return f'  <load_composable_node target="/{area}/container">\n{nodes}  </load_composable_node>\n'


def _arguments() -> str:
    lines = [
        f'  <arg name="{name}" default="{_default(name)}" description="{name}"/>\n' for name in FORWARDED
    ]
    return "".join(lines)


def _default(name: str) -> str:
    return {"use_sim_time": "true", "map_path": "$(env HOME)/map", "log_level": "info"}.get(
        name, f"the_{name}"
    )


def _include(package: str, file: str) -> str:
    arguments = "".join(f'    <arg name="{name}" value="$(var {name})"/>\n' for name in FORWARDED)
    return f'  <include file="$(find-pkg-share {package})/launch/{file}">\n{arguments}  </include>\n'


def install_package(prefix: Path, name: str, *executables: str) -> Path:
    """Install a package that holds ``executables`` and nothing else; returns its share folder."""
    index = prefix / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True, exist_ok=True)
    (index / name).touch()
    for executable in executables:
        path = prefix / "lib" / name / executable
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("#!/bin/sh\n", encoding="utf-8")
        path.chmod(0o755)
    share = prefix / "share" / name
    for folder in ("launch", "config"):
        (share / folder).mkdir(parents=True, exist_ok=True)
    return share
