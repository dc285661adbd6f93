"""Which process belongs on which host, what flows between hosts, what would be on two."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from enclave_addons.deployment import export_hosts, load_hosts
from enclave_addons.deployment.placement import restart_order
from enclave_addons.deployment.processes import engine_names, label
from keystore.verb import main as secure_keystore
from tests.addons.deployment.kit import TALK, export, launch_file, provisioned, secure_plan

HOSTS = "version: 1\nhosts:\n  arm: {nodes: [/ear]}\n  base: {enclaves: ['/front/*']}\n"


def hosts_file(folder: Path, text: str = HOSTS) -> str:
    (folder / "hosts.yaml").write_text(text)
    return str(folder / "hosts.yaml")


def test_the_plan_shows_hosts_and_the_flows_between_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert secure_plan("hosts", launch_file(tmp_path), "--hosts", hosts_file(tmp_path)) == 0
    assert capsys.readouterr().out == (
        "host arm\n  /ear  (enclave /ear)\nhost base\n  /front/speaker  (enclave /front/speaker)\n"
        "from base to arm\n  /front/speaker -> /ear by topic /talk\n"
    )


MACHINES = TALK.replace('name="ear"', 'name="ear" machine="$(eval \'str(1)\')-arm"').replace(
    'name="speaker"', 'name="speaker" machine="base"'
)


def test_the_machine_of_the_launch_file_places_a_process_and_the_hosts_file_has_the_last_word(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = launch_file(tmp_path, MACHINES)
    assert secure_plan("hosts", launch, "--format", "json") == 0
    found = json.loads(capsys.readouterr().out)["hosts"]
    assert {host: one["enclaves"] for host, one in found.items()} == {
        "base": ["/front/speaker"],
        "1-arm": ["/ear"],
    }
    assert secure_plan("hosts", launch, "--hosts", hosts_file(tmp_path), "--format", "json") == 0
    assert list(json.loads(capsys.readouterr().out)["hosts"]) == ["arm", "base"]


def test_a_plain_launch_says_that_it_starts_everything_here(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    secure_plan("check", launch_file(tmp_path, MACHINES))
    assert "speaker" not in (told := capsys.readouterr().out) or "meant for machine 'base'" in told
    assert "a launch starts everything on this host" in told


def test_an_enclave_on_two_hosts_is_told_and_its_bundles_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shared = TALK.replace('name="ear"', 'name="ear" enclave="/front/speaker"')
    hosts = hosts_file(
        tmp_path, "version: 1\nhosts:\n  arm: {nodes: [/ear]}\n  base: {nodes: [/front/speaker]}\n"
    )
    launch = launch_file(tmp_path, shared)
    written = tmp_path / "enclaves.yaml"
    assert secure_plan("hosts", launch, "--hosts", hosts, "--write-enclaves", str(written)) == 1
    assert "enclave /front/speaker would have to live on arm, base" in capsys.readouterr().out
    ks = provisioned(launch, tmp_path / "ks")
    assert secure_keystore(["export", str(ks), "-o", str(tmp_path / "out"), "--hosts", str(written)]) == 2
    assert "/front/speaker belongs to several hosts: arm, base" in capsys.readouterr().err


def test_a_node_that_two_patterns_place_on_two_hosts_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts = hosts_file(tmp_path, "version: 1\nhosts:\n  arm: {nodes: [/f*]}\n  base: {nodes: [/front*]}\n")
    assert secure_plan("hosts", launch_file(tmp_path), "--hosts", hosts) == 2
    assert "node /front/speaker belongs to several hosts: arm, base" in capsys.readouterr().err


def test_hosts_with_their_enclaves_go_on_to_the_keystore(tmp_path: Path) -> None:
    launch = launch_file(tmp_path)
    written = tmp_path / "enclaves.yaml"
    secure_plan("hosts", launch, "--hosts", hosts_file(tmp_path), "--write-enclaves", str(written))
    hosts = load_hosts(written)
    assert {name: one.enclaves for name, one in hosts.hosts.items()} == {
        "arm": ["/ear"],
        "base": ["/front/speaker"],
    }
    ks = provisioned(launch, tmp_path / "ks")
    made = export_hosts(ks, tmp_path / "out", {name: one.enclaves for name, one in hosts.hosts.items()})
    assert [one.manifest.names for one in made] == [("/ear",), ("/front/speaker",)]


def test_a_process_on_no_host_is_told_and_nothing_is_exported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    hosts = hosts_file(tmp_path, "version: 1\nhosts: {arm: {nodes: [/ear]}}\n")
    launch = launch_file(tmp_path)
    assert secure_plan("hosts", launch, "--hosts", hosts) == 1
    assert "/front/speaker is on no host" in capsys.readouterr().out
    ks = provisioned(launch, tmp_path / "ks")
    assert export("systemd", launch, ks, tmp_path / "out", "--hosts", hosts) == 2
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("engine", ["systemd", "compose", "kubernetes"])
def test_each_host_gets_a_folder_with_its_own_processes(tmp_path: Path, engine: str) -> None:
    launch = launch_file(tmp_path)
    ks = provisioned(launch, tmp_path / "ks")
    more = ("--host-network",) if engine == "compose" else ()
    assert export(engine, launch, ks, tmp_path / "out", "--hosts", hosts_file(tmp_path), *more) == 0
    arm, base = ("".join(path.read_text() for path in (tmp_path / "out" / host).rglob("*") if path.is_file())
                 for host in ("arm", "base"))  # fmt: skip
    assert "--enclave /front/speaker" not in arm and "- /front/speaker" not in arm and "enclaves/ear" in arm
    assert "--enclave /ear" not in base and "- /ear" not in base and "/front/speaker" in base


def test_names_are_dns_labels_and_do_not_change_when_others_come() -> None:
    subjects = [
        "/front/speaker",
        "/front_left",
        "/front/left",
        "/Front/left",
        "/a" * 60,
        "/x",
        "/x",
        "<odd name>",
    ]
    names = engine_names(subjects)
    assert names[:1] == ["front-speaker"]
    assert len(set(names)) == len(names)
    assert all(len(name) <= 63 and name.strip("-") == name and set(name) <= set(ALPHABET) for name in names)
    assert engine_names(["/new", *subjects])[1:] == names
    assert label("/front/left") == "front-left" != label("/front_left")


ALPHABET = "abcdefghijklmnopqrstuvwxyz0123456789-"


def test_restarts_go_from_sources_to_what_they_influence() -> None:
    graph = {"/camera": {"/plan": ()}, "/plan": {"/base": (), "/map": ()}, "/map": {"/plan": ()}, "/base": {}}
    assert restart_order(graph, graph) == ["/camera", "/map", "/plan", "/base"]
