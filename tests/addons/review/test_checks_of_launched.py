"""Checks of what a launch file gives to its programs, from real launch files and manifests."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.review.checks import check_plan
from enclave_launch import DryRun, ResolveOptions, resolve
from enclave_launch.dry_run import Diagnostic
from enclave_launch.report.plan_json import plan_document

MANIFEST = """\
nodl_version: 2
codegen: {{enclave_launch: {{package: demo, executable: {name}, all_parameters: {all_parameters}}}}}
{parameters}publishers:
  - {{name: {publishes}, type: std_msgs/msg/String, qos: {{history: KEEP_LAST, depth: 1, {offers}}}}}
subscriptions:
  - {{name: {subscribes}, type: std_msgs/msg/String, qos: {{history: KEEP_LAST, depth: 1, {asks}}}}}
"""
RELIABLE, BEST_EFFORT = "reliability: RELIABLE", "reliability: BEST_EFFORT"
Check = Callable[..., list[Diagnostic]]


@pytest.fixture
def check(tmp_path: Path) -> Check:
    """Findings of a launch file with the nodes ``demo/one`` and ``demo/two``, of which the second hears the first."""
    bin_folder = tmp_path / "ws" / "lib" / "demo"
    bin_folder.mkdir(parents=True)
    index = tmp_path / "ws" / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    (index / "demo").write_text("")
    (tmp_path / "ws" / "share" / "demo").mkdir()

    def run(
        launch: str,
        *,
        offers: str = RELIABLE,
        asks: str = RELIABLE,
        parameters: str = "",
        all_parameters: str = "false",
        **given: str,
    ) -> list[Diagnostic]:
        manifests = []
        for name, publishes, subscribes in (("one", "x", "y"), ("two", "y", "x")):
            program = bin_folder / name
            program.write_text("#!/bin/sh\n")
            program.chmod(0o755)
            file = tmp_path / f"demo__{name}.nodl.yaml"
            text = MANIFEST.format(
                name=name,
                publishes=publishes,
                subscribes=subscribes,
                offers=offers,
                asks=asks,
                parameters=parameters,
                all_parameters=all_parameters,
            )
            file.write_text(text)
            manifests.append(file)
        launch_file = tmp_path / "f.launch.xml"
        launch_file.write_text(f"<launch>\n{launch}\n</launch>\n")
        options = ResolveOptions(
            prefixes=(tmp_path / "ws",), manifests=tuple(manifests), enclave_scope=_node_scope()
        )
        return check_plan(
            DryRun(**plan_document(resolve(launch_file, tuple(given.items()), options=options)))
        )

    return run


def _node_scope() -> Any:
    from enclave_launch import EnclaveScope

    return EnclaveScope.NODE


def codes(found: list[Diagnostic]) -> set[str]:
    return {told.code for told in found}


ONE, TWO = '<node pkg="demo" exec="one" name="one"/>', '<node pkg="demo" exec="two" name="two"/>'


@pytest.mark.parametrize(
    ("offers", "asks", "meet"),
    [
        (RELIABLE, BEST_EFFORT, True),
        (BEST_EFFORT, RELIABLE, False),
        ("reliability: SYSTEM_DEFAULT", RELIABLE, True),
        (f"{RELIABLE}, durability: VOLATILE", f"{RELIABLE}, durability: TRANSIENT_LOCAL", False),
        (f"{RELIABLE}, durability: TRANSIENT_LOCAL", f"{RELIABLE}, durability: VOLATILE", True),
        (RELIABLE, f"{RELIABLE}, durability: TRANSIENT_LOCAL", True),  # not said: not judged
        (f"{RELIABLE}, deadline_ns: 200", f"{RELIABLE}, deadline_ns: 100", False),
        (f"{RELIABLE}, deadline_ns: 0", f"{RELIABLE}, deadline_ns: 100", False),
        (f"{RELIABLE}, deadline_ns: 100", f"{RELIABLE}, deadline_ns: 200", True),
        (f"{RELIABLE}, liveliness: AUTOMATIC", f"{RELIABLE}, liveliness: MANUAL_BY_TOPIC", False),
    ],
)
def test_a_publisher_that_offers_less_than_is_asked_for(
    check: Check, offers: str, asks: str, meet: bool
) -> None:
    found = check(ONE + TWO, offers=offers, asks=asks)
    assert ("qos-differs" in codes(found)) is not meet
    if not meet:
        told = next(told for told in found if told.code == "qos-differs" and told.subject == "/x")
        assert told.text.startswith("/two gets nothing of /x from /one: ")
        assert told.file and told.file.endswith("demo__two.nodl.yaml") and told.line == 6


@pytest.mark.parametrize(
    ("rules", "dead"),
    [
        ('<remap from="x" to="z"/>', []),
        ('<remap from="/x" to="z"/>', []),
        ('<remap from="X" to="z"/>', ["X"]),
        ('<remap from="/x" to="z"/><remap from="x" to="z"/>', []),
        ('<remap from="/x" to="z"/><remap from="x" to="y"/>', ["x"]),
        ('<remap from="x" to="z"/><remap from="image" to="z"/>', ["image"]),
        ('<remap from="/rosout" to="/log"/>', []),
        ('<remap from="~/get_parameters" to="/p"/>', []),
    ],
)
def test_a_remap_rule_that_changes_no_name(check: Check, rules: str, dead: list[str]) -> None:
    found = [
        told
        for told in check(f'<node pkg="demo" exec="one" name="one">{rules}</node>')
        if told.code == "remap-dead"
    ]
    assert [told.text.split()[2] for told in found] == dead
    assert all((told.subject, told.line) == ("/one", 2) for told in found)


def test_a_rule_for_a_group_is_alive_when_one_node_of_it_uses_it(check: Check) -> None:
    assert "remap-dead" not in codes(check(f'<group><set_remap from="y" to="z"/>{ONE}{TWO}</group>'))
    assert "remap-dead" in codes(check(f'<group><set_remap from="w" to="z"/>{ONE}{TWO}</group>'))


def test_a_rule_of_a_program_that_nobody_describes_may_be_of_use(check: Check, tmp_path: Path) -> None:
    other = tmp_path / "ws" / "lib" / "demo" / "other"
    other.write_text("#!/bin/sh\n")
    other.chmod(0o755)
    rule = '<remap from="anything" to="z"/>'
    assert "remap-dead" not in codes(check(f'<node pkg="demo" exec="other" name="o">{rule}</node>'))


@pytest.mark.parametrize(
    ("parameter", "known"),
    [("speed", True), ("sped", False), ("use_sim_time", True), ("qos_overrides./x.publisher.depth", True)],
)
def test_a_parameter_that_the_node_does_not_declare(check: Check, parameter: str, known: bool) -> None:
    node = f'<node pkg="demo" exec="one" name="one"><param name="{parameter}" value="1"/></node>'
    declared = "parameters: {speed: {type: int}}\n"
    assert (
        "parameter-unknown" in codes(check(node, parameters=declared, all_parameters="true"))
    ) is not known
    some = codes(check(node, parameters=declared))
    assert "parameter-unknown" not in some, (
        "a manifest that does not say that it lists all says nothing of others"
    )


def test_an_argument_that_no_file_looks_at(check: Check) -> None:
    file = '<arg name="speed" default="1"/>' + ONE
    (told,) = [told for told in check(file, sped="2") if told.code == "argument-unknown"]
    assert told.text == "no launch file declares or reads the argument 'sped'; did you mean 'speed'?"
    assert "argument-unknown" not in codes(check(file, speed="2"))
    read_only = '<node pkg="demo" exec="one" name="$(var speed)"/>'
    assert "argument-unknown" not in codes(check(read_only, speed="two")), "read, though nobody declares it"


@pytest.mark.parametrize(
    ("name", "is_secret"),
    [
        ("password", True), ("mqtt.password", True), ("db_password", True), ("accessToken", True), ("api_key", True),
        ("private-key", True), ("auth.token", True), ("wifi_passphrase", True),
        ("password_file", False), ("token_count", False), ("keyboard", False), ("bypass", False), ("tokens", False),
    ],
)  # fmt: skip
def test_a_parameter_that_looks_like_a_secret(check: Check, name: str, is_secret: bool) -> None:
    node = f'<node pkg="demo" exec="one" name="one"><param name="{name}" value="hunter2"/></node>'
    assert ("secret-in-parameters" in codes(check(node))) is is_secret


def test_a_remap_of_tf_is_a_convention_and_any_other_dead_rule_is_reported(check: Check) -> None:
    assert "remap-dead" not in codes(check(f'<group><set_remap from="/tf" to="tf"/>{ONE}</group>'))
    assert "remap-dead" in codes(check(f'<group><set_remap from="/tg" to="tg"/>{ONE}</group>'))
