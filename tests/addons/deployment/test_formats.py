"""What is written is valid for those who judge it: systemd-analyze, Compose's schema, Kubernetes' schemas."""

from __future__ import annotations

import base64
import json
import os
import re
import subprocess
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
import yaml

from enclave_addons.deployment import (
    ImportOptions,
    export_hosts,
    import_bundle,
    pinned,
    request,
    sign_requests,
)
from keystore import RemoveOptions, RenewOptions, remove, renew
from keystore.disk import layout
from tests.addons.deployment.kit import (
    DEMO_WS,
    TALK,
    export,
    fleet_of_fifty,
    launch_file,
    made,
    provisioned,
    tool,
)
from tests.addons.deployment.systemd_stand_in import Unit, words
from tests.keystore.kit import mode, options

ENGINES = ("systemd", "compose", "kubernetes")
DEMO = (DEMO_WS / "share/demo_nodes/launch/services_actions.launch.xml").read_text()
ODD = """<launch>
  <set_env name="GREETING" value="50% of &quot;$HOME&quot; %n"/>
  <node pkg="demo_nodes" exec="talker" name="Speaker_1" namespace="front" args="a;b '#c' ;" respawn="true"
        respawn_delay="2.5" respawn_max_retries="3" cwd="/tmp">
    <param name="text" value="100% $x&#10;second: 'line'"/>
  </node>
  <node pkg="demo_nodes" exec="listener"/>
  <node pkg="demo_nodes" exec="listener" name="ear" enclave="/"/>
  <executable cmd="echo $HOME | cat" shell="true"/>
  <executable cmd="true" enclave="/other"/>
</launch>"""
NEEDS = """version: 1
needs:
  - {nodes: [/front/*], devices: [/dev/video0], groups: [video], realtime: true, writable_code: true, memory: 1Gi}
"""
LAUNCHES = {"talk": TALK, "demo": DEMO, "odd": ODD, "fifty": fleet_of_fifty()}


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(word) for word in command], capture_output=True, text=True)


# systemd


@pytest.mark.parametrize("name", LAUNCHES)
def test_systemd_analyze_verifies_every_unit(tmp_path: Path, name: str) -> None:
    analyze = tool("systemd-analyze", "apt-get install systemd")
    out = made("systemd", tmp_path, LAUNCHES[name])
    judged = run(analyze, "verify", *sorted(out.glob("ros-*")))
    assert (judged.returncode, judged.stdout + judged.stderr) == (0, "")


def exposure(units: list[Path]) -> dict[str, float]:
    analyze = tool("systemd-analyze", "apt-get install systemd")
    judged = run(analyze, "security", "--offline=true", "--no-pager", *units)
    found = re.findall(r"exposure level for (\S+): ([0-9.]+) ", judged.stdout)
    return {name: float(level) for name, level in found}


def test_every_unit_is_closed_as_far_as_its_needs_allow(tmp_path: Path) -> None:
    """1.5 is "OK" by systemd's scale; a unit without any of it has 9.6, "UNSAFE"."""
    out = made("systemd", tmp_path, LAUNCHES["fifty"])
    levels = exposure(sorted(out.glob("*.service")))
    assert len(levels) == 51, "and the one that looks what expires"
    assert set(levels.values()) - {1.5} <= {levels["ros-robot-expiry.service"]}
    assert levels["ros-robot-expiry.service"] < 2.5


def test_needs_open_what_they_name_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "hosts.yaml").write_text(NEEDS)
    out = made("systemd", tmp_path, TALK, "--hosts", str(tmp_path / "hosts.yaml"))
    open_one = (out / "ros-robot-front-speaker.service").read_text().splitlines()
    closed = (out / "ros-robot-ear.service").read_text().splitlines()
    opened = {
        line
        for line in open_one
        if line not in closed and "speaker" not in line and not line.startswith("# /")
    }
    assert opened == {
        "PrivateDevices=no", "DevicePolicy=closed", "DeviceAllow=/dev/video0 rw",
        "SupplementaryGroups=video", "MemoryDenyWriteExecute=no",
        "RestrictRealtime=no", "SystemCallFilter=~@privileged", "LimitRTPRIO=99", "LimitMEMLOCK=infinity",
        "MemoryMax=1G",
    }  # fmt: skip
    analyze = tool("systemd-analyze", "apt-get install systemd")
    judged = run(analyze, "verify", *out.glob("ros-*"))
    assert (judged.returncode, judged.stderr) == (0, "")
    assert 1.5 < exposure([out / "ros-robot-front-speaker.service"])["ros-robot-front-speaker.service"] < 3


def test_a_unit_loads_exactly_the_files_of_its_enclave_and_a_crl_as_soon_as_there_is_one(
    tmp_path: Path,
) -> None:
    unit = Unit(made("systemd", tmp_path) / "ros-robot-front-speaker.service")
    loaded = dict(line.split(":", 1) for line in unit.all("LoadCredential"))
    assert set(loaded) == {*layout.RUNTIME_FILES, "crl.pem"}
    assert unit.all("SetCredential") == ["crl.pem:none"], "it starts without one, too"
    assert not [source for source in loaded.values() if "private" in source or "/ear" in source]
    assert loaded["key.pem"] == "/etc/ros/keystore/enclaves/front/speaker/key.pem"


@pytest.mark.parametrize("engine", ENGINES)
def test_neither_dates_nor_other_nodes_nor_a_revocation_change_what_runs_a_process(
    tmp_path: Path, engine: str
) -> None:
    more = TALK.replace("<launch>", '<launch>\n  <node pkg="demo_nodes" exec="talker" name="first"/>')
    out = made(engine, tmp_path, more)
    before = workloads(out)
    launch, ks = tmp_path / "robot.launch.xml", tmp_path / "ks"
    renew(ks, ["/ear"], options=RenewOptions(provisioning=options(lifetime=timedelta(days=9))))
    remove(ks, ["/first"], options=RemoveOptions(durable=False))
    launch.write_text(TALK)
    assert export(engine, launch, ks, out) == 0
    after = workloads(out)
    assert set(after) < set(before)
    assert after == {name: before[name] for name in after}


def workloads(out: Path) -> dict[str, Any]:
    """Name -> what runs a process: a unit, a service of Compose, a Deployment."""
    if (out / "compose.yaml").exists():
        return dict(yaml.safe_load((out / "compose.yaml").read_text())["services"])
    units = {path.name: path.read_text() for path in out.glob("*.service")}
    return units or objects(out, "Deployment")


def test_renewing_one_enclave_changes_its_secret_and_nothing_else(tmp_path: Path) -> None:
    out = made("kubernetes", tmp_path)
    launched, before = (out / "launch.yaml").read_text(), objects(out, "Secret")
    renew(tmp_path / "ks", ["/ear"], options=RenewOptions(provisioning=options()))
    export("kubernetes", tmp_path / "robot.launch.xml", tmp_path / "ks", out)
    after = objects(out, "Secret")
    assert [name for name in after if after[name] != before[name]] == ["enclave-ear"]
    assert (out / "launch.yaml").read_text() == launched


def test_a_workspace_below_home_can_be_read_and_no_other_folder_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made("systemd", tmp_path / "a", TALK)
    closed = Unit(tmp_path / "a/out/ros-robot-ear.service")
    assert closed.one("ProtectHome") == "yes" and closed.all("BindReadOnlyPaths") == []
    capsys.readouterr()
    made("systemd", tmp_path / "b", TALK, "--setup", "/home/me/ws/install/setup.sh")
    opened = Unit(tmp_path / "b/out/ros-robot-ear.service")
    assert opened.one("ProtectHome") == "tmpfs" and opened.all("BindReadOnlyPaths") == ["/home/me/ws"]
    assert "/ear reads below a home directory: /home/me/ws is left readable" in capsys.readouterr().err


@pytest.mark.parametrize(
    "place", ["/k;>hit;", "/k$(>hit)", "/k`>hit`", "/k';>hit;'", '/k";>hit;"', "/k&&>hit&&"]
)
def test_the_place_of_the_keystore_is_no_command(tmp_path: Path, place: str) -> None:
    """The scripts before a unit run as root; here they are run by a shell, in a folder that they could change."""
    out = made("systemd", tmp_path, TALK, "--host-keystore", place)
    scripts = [
        words(line.lstrip("+"))[2].replace("$$", "$").replace("%%", "%")
        for path in out.glob("*.service")
        for line in Unit(path).all("ExecStartPre")
    ]
    assert len(scripts) >= 4 and all(">hit" in script for script in scripts)
    runs = tmp_path / "runs"
    (runs / "credentials").mkdir(parents=True)
    environment = {
        **os.environ,
        "RUNTIME_DIRECTORY": str(runs / "run"),
        "CREDENTIALS_DIRECTORY": str(runs / "credentials"),
    }
    for script in scripts:
        subprocess.run(
            ["/bin/sh", "-c", script], cwd=runs, env=environment, capture_output=True, timeout=60, check=False
        )
    assert not list(runs.rglob("hit"))


def test_words_and_values_come_through_systemds_syntax(tmp_path: Path) -> None:
    out = made("systemd", tmp_path, ODD)
    (path,) = out.glob("*speaker-1*.service")
    unit = Unit(path)
    command = words(unit.one("ExecStart"))
    assert "a;b" in command and "#c" in command and ";" in command
    environment = dict(word.split("=", 1) for line in unit.all("Environment") for word in words(line))
    assert environment["GREETING"] == '50%% of "$HOME" %%n'
    assert unit.one("WorkingDirectory") == "/tmp"
    assert (unit.one("Restart"), unit.one("RestartSec")) == ("always", "2.5")
    assert unit.all("StartLimitBurst") == [], "it would count manual starts"
    (shell,) = out.glob("*echo*.service")
    assert words(Unit(shell).one("ExecStart"))[-3:] == ["/bin/sh", "-c", "echo $$HOME | cat"]
    (parameters,) = out.glob("parameters/*")
    assert yaml.safe_load(parameters.read_text())["/front/Speaker_1"]["ros__parameters"]["text"] == (
        "100% $x\nsecond: 'line'"
    )


# Compose


@pytest.mark.parametrize("name", LAUNCHES)
def test_compose_fits_its_schema(tmp_path: Path, name: str) -> None:
    check = tool("check-jsonschema", "pip install check-jsonschema")
    out = made("compose", tmp_path, LAUNCHES[name])
    judged = run(check, "--builtin-schema", "vendor.compose-spec", out / "compose.yaml")
    assert judged.returncode == 0, judged.stdout


def compose(tmp_path: Path, text: str = TALK, *more: str) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(
        (made("compose", tmp_path, text, *more) / "compose.yaml").read_text()
    )
    return content


def test_a_service_mounts_the_directory_of_its_enclave_and_no_other_file_of_anyone(tmp_path: Path) -> None:
    content = compose(tmp_path)
    (volume,) = content["services"]["front-speaker"]["volumes"]
    assert volume == {
        "type": "bind", "source": "/etc/ros/keystore/containers/e.front.speaker",
        "target": "/keystore/enclaves/front/speaker", "read_only": True, "bind": {"create_host_path": False},
    }  # fmt: skip
    assert not {"configs", "secrets"} & set(content), "podman-compose ignores configs"


def test_several_hosts_share_their_network_with_the_containers_or_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    launch = launch_file(tmp_path)
    ks = provisioned(launch, tmp_path / "ks")
    hosts = tmp_path / "hosts.yaml"
    hosts.write_text("version: 1\nhosts:\n  arm: {nodes: [/ear]}\n  base: {enclaves: ['/front/*']}\n")
    words = ("compose", launch, ks, tmp_path / "out", "--hosts", str(hosts))
    assert export(*words) == 2
    assert "would not reach each other" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert export(*words, "--host-network") == 0
    content = yaml.safe_load((tmp_path / "out/arm/compose.yaml").read_text())
    assert content["services"]["ear"]["network_mode"] == "host" and "networks" not in content


def test_compose_expands_nothing_of_ours(tmp_path: Path) -> None:
    content = compose(tmp_path, ODD)
    (speaker,) = (one for name, one in content["services"].items() if name.startswith("front-speaker"))
    assert speaker["environment"]["GREETING"] == '50% of "$$HOME" %n'
    (shell,) = (one for name, one in content["services"].items() if name.startswith("echo"))
    assert shell["command"] == ["/bin/sh", "-c", "echo $$HOME | cat"]
    assert (speaker["restart"], shell["restart"]) == ("always", "no")


# Kubernetes


@pytest.mark.parametrize("name", LAUNCHES)
def test_kubernetes_validates_every_object(tmp_path: Path, name: str) -> None:
    validate = tool("kubernetes-validate", "pip install kubernetes-validate")
    (tmp_path / "hosts.yaml").write_text(NEEDS)
    out = made("kubernetes", tmp_path, LAUNCHES[name])
    judged = run(validate, "--strict", *sorted(out.glob("*.yaml")))
    assert judged.returncode == 0, judged.stderr[-2000:]
    objects = [one for path in out.glob("*.yaml") for one in yaml.safe_load_all(path.read_text())]
    assert (judged.stdout + judged.stderr).count(" passed ") == len(objects)


def objects(out: Path, kind: str) -> dict[str, dict[str, Any]]:
    listed = [one for path in out.glob("*.yaml") for one in yaml.safe_load_all(path.read_text())]
    return {one["metadata"]["name"]: one for one in listed if one["kind"] == kind}


def test_keys_are_in_secrets_and_nowhere_else(tmp_path: Path) -> None:
    out = made("kubernetes", tmp_path)
    assert len(objects(out, "Secret")) == 2
    assert mode(out / "secrets.yaml") == 0o600
    assert "PRIVATE KEY" not in (out / "launch.yaml").read_text()
    for enclave in ("ear", "front/speaker"):
        data = objects(out, "Secret")[f"enclave-{enclave.replace('/', '-')}"]["data"]
        assert set(data) == set(layout.RUNTIME_FILES)
        assert base64.b64decode(data["key.pem"]) == (tmp_path / f"ks/enclaves/{enclave}/key.pem").read_bytes()


def test_a_pod_sees_its_enclave(tmp_path: Path) -> None:
    pod = objects(made("kubernetes", tmp_path), "Deployment")["ear"]["spec"]["template"]["spec"]
    assert pod["volumes"][0] == {
        "name": "enclave",
        "secret": {"secretName": "enclave-ear", "defaultMode": 0o440, "optional": False},
    }
    assert pod["containers"][0]["volumeMounts"][0]["mountPath"] == "/keystore/enclaves/ear"


def test_peers_are_those_of_all_hosts_and_stand_in_one_place(tmp_path: Path) -> None:
    hosts = tmp_path / "hosts.yaml"
    hosts.write_text("version: 1\nhosts:\n  arm: {nodes: [/ear]}\n  base: {enclaves: ['/front/*']}\n")
    out = made("kubernetes", tmp_path, TALK, "--hosts", str(hosts))
    arm, base = objects(out / "arm", "ConfigMap"), objects(out / "base", "ConfigMap")
    assert arm == base
    assert arm["ros-robot-peers-0"]["data"] == {"ROS_STATIC_PEERS": "ear;front-speaker"}
    (ear,) = objects(out / "arm", "Deployment")["ear"]["spec"]["template"]["spec"]["containers"]
    assert ear["env"][-1] == {
        "name": "ROS_STATIC_PEERS",
        "valueFrom": {"configMapKeyRef": {"name": "ros-robot-peers-0", "key": "ROS_STATIC_PEERS"}},
    }
    assert set(objects(out / "arm", "Service")) == {"ear"}, "a name for each peer, on the host that has it"


def test_objects_have_labels_and_no_namespace_and_reserve_little(tmp_path: Path) -> None:
    out = made("kubernetes", tmp_path, ODD)
    listed = [one for path in out.glob("*.yaml") for one in yaml.safe_load_all(path.read_text())]
    assert {one["metadata"]["labels"]["app.kubernetes.io/part-of"] for one in listed} == {"ros-robot"}
    assert not [one for one in listed if "namespace" in one["metadata"] or one["kind"] == "Namespace"]
    for one in objects(out, "Deployment").values():
        (container,) = one["spec"]["template"]["spec"]["containers"]
        assert container["resources"]["requests"] == {"memory": "64Mi", "cpu": "50m"}
    renamed = [{**one, "metadata": {**one["metadata"], "namespace": "other"}} for one in listed]
    (tmp_path / "renamed.yaml").write_text(yaml.safe_dump_all(renamed))
    validate = tool("kubernetes-validate", "pip install kubernetes-validate")
    assert run(validate, "--strict", tmp_path / "renamed.yaml").returncode == 0


def test_only_members_of_the_domain_talk(tmp_path: Path) -> None:
    out = made("kubernetes", tmp_path, ODD)
    (policy,) = objects(out, "NetworkPolicy").values()
    own = {"matchLabels": {"app.kubernetes.io/part-of": "ros-robot", "ros-domain": "0"}}
    assert policy["spec"]["podSelector"] == own
    assert policy["spec"]["ingress"] == [{"from": [{"podSelector": own}], "ports": [{"protocol": "UDP"}]}]
    outside = [one for name, one in objects(out, "Deployment").items() if name.startswith("echo")]
    assert outside[0]["spec"]["template"]["metadata"]["labels"]["ros-domain"] == "none"


def test_a_key_that_is_only_on_its_host_is_not_written(tmp_path: Path) -> None:
    launch = launch_file(tmp_path)
    ks = provisioned(launch, tmp_path / "ks")
    sign_requests(ks, request(tmp_path / "host", ["/ear"]), options=options())
    assert export("kubernetes", launch, ks, tmp_path / "out") == 0
    secrets = objects(tmp_path / "out", "Secret")
    assert "key.pem" not in secrets["enclave-ear"]["data"]
    assert "key.pem" in secrets["enclave-front-speaker"]["data"]


# All of them


@pytest.mark.parametrize("engine", ENGINES)
def test_generating_again_changes_nothing_and_a_change_shows_as_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], engine: str
) -> None:
    out = made(engine, tmp_path, TALK)
    before = {path: (path.read_text(), path.stat().st_mtime_ns) for path in out.rglob("*") if path.is_file()}
    launch = tmp_path / "robot.launch.xml"
    capsys.readouterr()
    assert export(engine, launch, tmp_path / "ks", out) == 0
    assert capsys.readouterr().out == "nothing changed\n"
    assert {path: (path.read_text(), path.stat().st_mtime_ns) for path in before} == before
    launch.write_text(
        TALK.replace("</launch>", '<node pkg="demo_nodes" exec="listener" name="third"/></launch>')
    )
    provisioned(launch, tmp_path / "ks")
    assert export(engine, launch, tmp_path / "ks", out) == 0
    if engine == "systemd":
        unchanged = {"ros-robot-ear.service", "ros-robot-front-speaker.service"}
        assert all((out / name).read_text() == before[out / name][0] for name in unchanged)


def test_what_is_no_longer_in_the_launch_goes_and_what_others_wrote_stays(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = made("systemd", tmp_path)
    (out / "notes.txt").write_text("mine")
    launch = tmp_path / "robot.launch.xml"
    launch.write_text("\n".join(line for line in TALK.splitlines() if "ear" not in line))
    assert export("systemd", launch, tmp_path / "ks", out) == 0
    assert not (out / "ros-robot-ear.service").exists()
    assert (out / "notes.txt").read_text() == "mine"
    (out / "ros-robot.target").write_text("mine")
    assert export("systemd", launch, tmp_path / "ks", out) == 2
    assert "was not generated by secure-plan export" in capsys.readouterr().err
    assert (out / "ros-robot.target").read_text() == "mine"


@pytest.mark.parametrize("engine", ENGINES)
def test_a_saved_plan_and_an_imported_bundle_do_as_well(tmp_path: Path, engine: str) -> None:
    from tests.addons.deployment.kit import secure_plan

    out = made(engine, tmp_path)
    launch, ks = tmp_path / "robot.launch.xml", tmp_path / "ks"
    bundle = export_hosts(ks, tmp_path / "bundles", {"robot": ["*"]})[0]
    import_bundle(tmp_path / "host", bundle.path, options=ImportOptions("robot", pinned(bundle.manifest)))
    saved = tmp_path / "robot.json"
    with saved.open("w") as stream, pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", stream)
        assert secure_plan("show", launch, "--format", "json") == 0
    assert json.loads(saved.read_text())["version"] == 1
    assert export(engine, saved, tmp_path / "host", tmp_path / "again") == 0
    for path in (path for path in out.rglob("*") if path.is_file()):
        again = tmp_path / "again" / path.relative_to(out)
        assert path.read_text() == again.read_text().replace(str(saved), str(launch))
