"""Compact permissions: one expression for the parameter services of a node, only where nothing else matches it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import keystore
from keystore import (
    EnclavePolicy,
    Operation,
    Profile,
    Qualifier,
    Rule,
    create_keystore,
    provision,
)
from keystore.formats.compact import PARAMETER_SERVICES, compact_nodes
from keystore.formats.permissions import dds_rules
from keystore.steps.comparison import differences
from keystore.verb import main
from tests.keystore.kit import actions, created, granted, options


def node(ns: str, name: str, *more: str) -> Profile:
    names = (*(f"~/{service}" for service in PARAMETER_SERVICES), *more)
    rules = tuple(sorted(Rule(Operation.REPLY, Qualifier.ALLOW, each) for each in names))
    return Profile(ns, name, rules)


def policy(path: str, *profiles: Profile) -> EnclavePolicy:
    return EnclavePolicy(path, profiles)


CAM = policy("/cam", node("/", "cam"))
INNER = policy("/inner", node("/cam", "inner"))


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return created(tmp_path / "ks", compact=True)


def nodes(root: Path, enclave: str) -> tuple[str, ...]:
    return compact_nodes(granted(root, enclave))


def as_provisioned(root: Path, *policies: EnclavePolicy) -> bool:
    return not any(differences(root, each, options=options()) for each in policies)


def test_the_services_of_a_node_are_one_expression_which_verify_names(root: Path) -> None:
    provision(root, [CAM], options=options())
    assert granted(root, "/cam") == {"ros_discovery_info", "rr/cam/*_parameter*Reply"}
    assert as_provisioned(root, CAM) and actions(provision(root, [CAM], options=options())) == {}
    (note,) = keystore.verify(root).findings
    assert note.code == "wildcard" and "parameter services of /cam" in note.message


def test_without_the_option_every_name_is_written_out(tmp_path: Path) -> None:
    root = created(tmp_path / "plain")
    provision(root, [CAM], options=options())
    assert len(granted(root, "/cam")) == 7


@pytest.mark.parametrize(
    "neighbour",
    [
        policy("/inner", node("/cam", "inner")),
        policy("/inner", node("/cam/deep", "er")),
        policy(
            "/cam2",
            Profile("/", "x", (Rule(Operation.REQUEST, Qualifier.ALLOW, "/cam/my_parameter_server"),)),
        ),
    ],
)
def test_where_something_else_matches_the_names_are_written_out(root: Path, neighbour: EnclavePolicy) -> None:
    provision(root, [CAM, neighbour], options=options())
    assert nodes(root, "/cam") == () and as_provisioned(root, CAM, neighbour)


def test_a_denial_counts_in_its_own_enclave_and_not_in_another(root: Path) -> None:
    denial = Profile("/", "x", (Rule(Operation.REPLY, Qualifier.DENY, "/cam/x_parameters"),))
    for where, expected in (("/cam", ()), ("/other", ("/cam",))):
        wanted = {"/cam": CAM, where: policy(where, *(CAM.profiles if where == "/cam" else ()), denial)}
        provision(root, wanted.values(), options=options())
        assert nodes(root, "/cam") == expected
        assert as_provisioned(root, *wanted.values())


@pytest.mark.parametrize(
    "neighbour",
    [
        policy("/cam2", node("/", "cam2")),
        policy("/ns/cam", node("/ns", "cam")),
        policy(
            "/user", Profile("/", "x", (Rule(Operation.REQUEST, Qualifier.ALLOW, "/cam/get_parameters"),))
        ),
        policy("/user", Profile("/", "x", (Rule(Operation.REPLY, Qualifier.ALLOW, "/cam/reset"),))),
    ],
)
def test_a_neighbour_that_does_not_match_leaves_it_compact(root: Path, neighbour: EnclavePolicy) -> None:
    provision(root, [CAM, neighbour], options=options())
    assert nodes(root, "/cam") == ("/cam",) and as_provisioned(root, CAM, neighbour)
    rules = dds_rules(
        policy("/cam", Profile("/", "cam", (Rule(Operation.REPLY, Qualifier.ALLOW, "/cam/*_parameter*"),)))
    )
    assert rules.permits("publish", "rr/cam/get_parametersReply")
    assert not rules.permits("publish", "rr/cam2/get_parametersReply")
    assert not rules.permits("publish", "rr/ns/cam/get_parametersReply")


def test_a_node_that_appears_below_brings_the_list_back_in_the_other_enclave(root: Path) -> None:
    provision(root, [CAM], options=options())
    report = provision(root, [INNER], options=options())
    assert "permissions" in actions(report)["/cam"], "what it could do to the new node is taken away"
    assert nodes(root, "/cam") == () and nodes(root, "/inner") == ("/cam/inner",)
    assert as_provisioned(root, CAM, INNER)
    assert actions(provision(root, [CAM, INNER], options=options())) == {}


def test_only_a_node_that_serves_all_six_is_compact(root: Path) -> None:
    profile = node("/", "cam")
    some = policy("/cam", profile._replace(rules=profile.rules[:5]))
    provision(root, [some], options=options())
    assert nodes(root, "/cam") == ()


def test_it_is_switched_on_and_off_for_a_keystore_that_exists(tmp_path: Path) -> None:
    root = created(tmp_path / "ks")
    provision(root, [CAM], options=options())
    for flag, expected in (("--compact", ("/cam",)), ("--no-compact", ())):
        assert main(["create", str(root), flag]) == 0
        provision(root, [CAM], options=options())
        assert nodes(root, "/cam") == expected
        assert main(["create", str(root)]) == 0, "without either it stays"
        assert actions(provision(root, [CAM], options=options())) == {}
        assert keystore.verify(root).is_good
    assert main(["create", str(root), "--compact", "--no-compact"]) == 2


def test_a_host_takes_what_was_signed_for_it(root: Path, tmp_path: Path) -> None:
    provision(root, [CAM, INNER, policy("/base", node("/", "base"))], options=options())
    host = tmp_path / "host"
    shutil.copytree(root, host, symlinks=True)
    shutil.rmtree(host / "private")
    shutil.rmtree(host / "enclaves/inner")  # it is on another host, and counts all the same
    (host / "secure-keystore.json").unlink()
    assert as_provisioned(host, CAM, policy("/base", node("/", "base")))
    assert differences(host, policy("/base", node("/", "base", "~/more")), options=options()), (
        "and nothing beyond"
    )


def test_the_largest_part_of_a_document_goes(tmp_path: Path) -> None:
    many = policy("/all", *(node("/", f"node_number_{number}") for number in range(40)))
    sizes = []
    for compact in (False, True):
        root = created(tmp_path / str(compact), compact=compact)
        provision(root, [many], options=options())
        sizes.append((root / "enclaves/all/permissions.p7s").stat().st_size)
    assert sizes[1] < sizes[0] / 3


def test_the_keystore_can_be_made_compact_at_once(tmp_path: Path) -> None:
    report = create_keystore(tmp_path / "ks", keystore.CreateOptions(durable=False, compact=True))
    assert report.actions[0] == "settings written"
    assert keystore.verify(tmp_path / "ks").is_good
