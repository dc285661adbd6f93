"""Refused endpoints explained under --secure, by processes that ask for more than they were granted.

The stand-in for rcl reads the permissions that were really signed for its enclave, and refuses as DDS does.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from enclave_addons.recording.reasons import cause_of
from enclave_addons.recording.record.requested import RequestedEndpoint
from enclave_addons.recording.remedies import manifest_patch, policy_patch
from keystore.verb import main as keystore_main
from nodl.document import read_document
from nodl.node_interface import EndpointKind
from tests.addons.recording.stand_in_launch import (
    LISTS,
    PACKAGE,
    TYPES,
    Program,
    Workspace,
    asks,
    build_dds,
    make_workspace,
    manifest_text,
)
from tests.addons.zenoh.kit import free_port
from tests.addons.zenoh.workspace import install_router

CATCHES = {"STAND_IN_CATCHES": "1"}
WORDS = {
    "publisher": "publish topic",
    "subscription": "subscribe to topic",
    "service_server": "serve service",
    "service_client": "call service",
    "action_server": "serve action",
    "action_client": "call action",
}
PROGRAMS = 34
GRANTED = tuple((kind, f"granted_{kind}") for kind in LISTS)


def secured(workspace: Workspace, *arguments: str, **variables: str) -> str:
    keystore = str(workspace.folder / "ks")
    ran = workspace.run(
        *("--secure", "--keystore", keystore, "--enclave-scope", "node", *arguments),
        variables={**CATCHES, **variables},
    )
    return ran.stdout + ran.stderr


def denied_program(number: int, times: int = 1) -> Program:
    """One that asks for six names that its manifest has and ``times`` six that it lacks; renamed, pushed, remapped;
    some as lifecycle nodes."""
    name = f"node_{number}"
    private = "~/" if number % 3 == 0 else ""
    wanted = tuple(
        (kind, f"{private}secret_{number}{_ending(time)}") for time in range(times) for kind in LISTS
    )
    begin = "lifecycle" if number % 4 == 0 else "node"
    lifecycle = ", lifecycle: true" if begin == "lifecycle" else ""
    attributes = f'name="renamed_{number}" namespace="/ns_{number % 5}"' if number % 2 else ""
    inside = f'<remap from="secret_{number}" to="moved_{number}"/>' if number % 5 == 0 else ""
    return Program(
        name,
        f"{begin} {name}\n{asks([*GRANTED, *wanted])}",
        GRANTED,
        attributes,
        inside,
        f"library: rclcpp{lifecycle}",
    )


def _ending(time: int) -> str:
    return f"_{time}" if time else ""


def expected(number: int, times: int = 1) -> set[tuple[str, str, str]]:
    """Node, words and final name of what is refused to it."""
    namespace = f"/ns_{number % 5}" if number % 2 else ""
    node = f"{namespace}/{'renamed' if number % 2 else 'node'}_{number}"
    private, moved = number % 3 == 0, number % 5 == 0
    found = set()
    for time in range(times):
        for kind, words in WORDS.items():
            is_action = kind.startswith(
                "action"
            )  # the stand-in is rcl of that day, which does not remap actions
            remapped = moved and not private and not is_action and time == 0
            name = f"moved_{number}" if remapped else f"secret_{number}{_ending(time)}"
            found.add((node, words, f"{node if private else namespace}/{name}"))
    return found


def told(output: str) -> set[tuple[str, str, str]]:
    pattern = r"refused: node (\S+) may not ((?:publish|subscribe|serve|call) (?:to )?\w+) (\S+) \(enclave"
    return {(node, words, name) for node, words, name in re.findall(pattern, output)}


def apply_patches(output: str) -> int:
    """Apply each patch in the output in turn, as ``patch --fuzz=0`` does; gives how many there are."""
    found = re.findall(r"^    --- (\S+)\n    \+\+\+ (\S+)\n((?:    .*\n)+)", output, re.MULTILINE)
    for before, after, hunks in found:
        old = "" if before == "/dev/null" else Path(after).read_text()
        lines = old.splitlines()
        shift = 0
        for start, hunk in re.findall(r"^    @@ -(\d+).*@@\n((?:    [-+ \\].*\n)+)", hunks, re.MULTILINE):
            changes = [line[4:] for line in hunk.splitlines()]
            gone = [line[1:] for line in changes if line[0] in " -"]
            come = [line[1:] for line in changes if line[0] in " +"]
            at = max(int(start) - 1, 0) + shift
            assert lines[at : at + len(gone)] == gone, (after, hunk)
            lines[at : at + len(gone)] = come
            shift += len(come) - len(gone)
        Path(after).write_text("\n".join([*lines, ""]))
    return len(found)


def test_two_hundred_denials_are_explained_and_their_patches_cure(stand_in: Path, tmp_path: Path) -> None:
    workspace = make_workspace(tmp_path, stand_in, map(denied_program, range(PROGRAMS)))
    all_explained_and_cured(workspace, {each for number in range(PROGRAMS) for each in expected(number)})


@pytest.mark.dds
@pytest.mark.parametrize("dds", ["cyclonedds", "fastdds"])
def test_two_hundred_denials_of_a_real_dds(dds: str, stand_in: Path, tmp_path: Path, domain_id: int) -> None:
    """Who refuses is DDS itself, by the permissions that were signed."""
    programs, times = range(5), 7
    workspace = make_workspace(tmp_path, stand_in, (denied_program(number, times) for number in programs))
    wanted = {each for number in programs for each in expected(number, times)}
    all_explained_and_cured(workspace, wanted, **on_dds(dds, domain_id))


def on_dds(dds: str, domain_id: int) -> dict[str, str]:
    return {"STAND_IN_DDS": str(build_dds(dds)), "ROS_DOMAIN_ID": str(domain_id)}


def all_explained_and_cured(
    workspace: Workspace, wanted: set[tuple[str, str, str]], **variables: str
) -> None:
    output = secured(workspace, **variables)
    assert len(wanted) > 200
    assert told(output) == wanted
    assert "could not join DDS" not in output
    assert apply_patches(output) == len(wanted)
    assert told(secured(workspace, **variables)) == set()


def test_what_a_zenoh_router_drops_without_a_word_is_explained_and_cured_too(
    stand_in: Path, tmp_path: Path
) -> None:
    workspace = make_workspace(tmp_path, stand_in, map(denied_program, range(6)))
    install_router(workspace.folder)
    for verb in (["create"], ["zenoh", "--router", f"localhost:{free_port()}"]):
        assert keystore_main([verb[0], str(workspace.folder / "ks"), *verb[1:]]) == 0
    variables = {"RMW_IMPLEMENTATION": "rmw_zenoh_cpp"}
    output = secured(workspace, **variables)
    assert told(output) == {each for number in range(6) for each in expected(number)}
    assert output.count("the router drops all of it without an error") == len(told(output))
    assert apply_patches(output) == len(told(output))
    assert told(secured(workspace, **variables)) == set()


def test_a_program_that_ends_at_its_first_refusal_is_explained_too(stand_in: Path, tmp_path: Path) -> None:
    program = Program("strict", "node strict\npublisher secret std_msgs/msg/String\n", ())
    workspace = make_workspace(tmp_path, stand_in, [program])
    output = secured(workspace, STAND_IN_CATCHES="") + secured(workspace)
    assert told(output) == {("/strict", "publish topic", "/secret")}


def test_output_of_the_process_decides_nothing(stand_in: Path, tmp_path: Path) -> None:
    """``output=log`` processes are explained on the screen all the same."""
    program = Program("quiet", "node quiet\nsubscription secret std_msgs/msg/String\n", (), 'output="log"')
    assert told(secured(make_workspace(tmp_path, stand_in, [program]))) == {
        ("/quiet", "subscribe to topic", "/secret")
    }


def test_what_is_granted_is_not_explained(stand_in: Path, tmp_path: Path) -> None:
    program = Program("good", f"node good\n{asks(GRANTED)}", GRANTED)
    output = secured(make_workspace(tmp_path, stand_in, [program]))
    assert "refused" not in output and "could not join" not in output


def test_explanations_can_be_switched_off(stand_in: Path, tmp_path: Path) -> None:
    program = Program("bad", "node bad\npublisher secret std_msgs/msg/String\n", ())
    assert "refused:" not in secured(make_workspace(tmp_path, stand_in, [program]), "--no-explain-denials")


def test_without_a_compiler_a_secured_launch_goes_on_and_says_so(stand_in: Path, tmp_path: Path) -> None:
    program = Program("good", f"node good\n{asks(GRANTED)}", GRANTED)
    workspace = make_workspace(tmp_path, stand_in, [program])
    empty = {"CC": "no-such-compiler", "XDG_CACHE_HOME": str(tmp_path / "cache")}
    output = secured(workspace, **empty)
    assert "a refusal of DDS will not be explained: recording needs a C compiler" in output
    assert "process has finished cleanly" in output


WORDS_OF_MIDDLEWARES = {
    "It is not allowed to create participant: Could not find domain 7 in governance(code: 141)": (
        "its permissions are not for DDS domain 7; provision with --domain-id 7"
    ),
    "Error occurred while validating local permission: Certificate not valid: error: unable to get local issuer "
    "certificate; subject: /CN=ros.a(code: 200)": "its certificate was issued by another CA",
    "Error occurred while validating local permission: Certificate not valid: error: certificate has expired; "
    "subject: /CN=ros.a(code: 200)": "its certificate has expired",
    "Error occurred while validating local permissions: Permissions validity period expired for CN=ros.a (expired: "
    "2026-11-21T20:06:54)(code: 147)": "its permissions have expired",
    "Error occurred while validating local permissions: Failed to parse PKCS7 SMIME document: digest failure(code: "
    "127)": "its signed permissions or governance are damaged",
    "Error occurred while validating local permissions: Subject name is invalid(code: 146)": (
        "its permissions are those of another subject"
    ),
    "[rmw_cyclonedds_cpp]: could not find all security files": "files of its enclave are missing",
}


def test_a_node_that_cannot_join_is_explained_by_what_the_middleware_says(
    stand_in: Path, tmp_path: Path
) -> None:
    programs = [
        Program(f"n{i}", f"node n{i}\n", (), inside=f'<env name="STAND_IN_NODE_FAILS" value="{said}"/>')
        for i, said in enumerate(WORDS_OF_MIDDLEWARES)
    ]
    output = secured(make_workspace(tmp_path, stand_in, programs))
    for i, explanation in enumerate(WORDS_OF_MIDDLEWARES.values()):
        assert f"node n{i} of n{i}-{i + 1} (enclave /n{i}) could not join DDS: {explanation}" in output
    assert output.count("could not join DDS") == len(programs)


DAMAGED, NOT_SAID = (
    "its signed permissions or governance are damaged",
    "Fast DDS does not accept the files of its enclave",
)
KEY = "its key or certificate cannot be read by this process"
BROKEN = {
    "cyclonedds": {
        "governance.p7s": DAMAGED,
        "permissions.p7s": DAMAGED,
        "key.pem": KEY,
        "identity_ca.cert.pem": "its certificate was issued by another CA",
    },
    "fastdds": {
        "governance.p7s": NOT_SAID,
        "permissions.p7s": NOT_SAID,
        "key.pem": KEY,
        "identity_ca.cert.pem": "its certificate was not accepted",
    },
}
OTHER_DOMAIN = {
    "cyclonedds": r"node domain of .* could not join DDS: its permissions are not for DDS domain {}",
    "fastdds": r"(?s)node /domain may not publish topic /rosout.*are for another DDS domain",
}


@pytest.mark.dds
@pytest.mark.parametrize("dds", ["cyclonedds", "fastdds"])
def test_a_real_dds_that_lets_a_node_not_join_is_explained(
    dds: str, stand_in: Path, tmp_path: Path, domain_id: int
) -> None:
    """Broken enclaves, each with one fault, and another domain, in which Fast DDS refuses endpoint by endpoint."""
    whole = make_workspace(tmp_path / "whole", stand_in, [Program("n", "node n\n", ())])
    secured(whole, **on_dds(dds, domain_id))
    enclave = whole.folder / "ks" / "enclaves" / "n"
    other = f'<env name="STAND_IN_DOMAIN" value="{domain_id + 100}"/>'
    programs = [Program("domain", "node domain\n", (), inside=other)]
    for file in BROKEN[dds]:
        name = file.partition(".")[0]
        folder = shutil.copytree(enclave, tmp_path / "broken" / name)
        (folder / file).unlink()
        (folder / file).write_bytes(broken(enclave, file))
        inside = f'<env name="STAND_IN_FOLDER" value="{folder}"/>'
        programs.append(Program(name, f"node {name}\n", (), inside=inside))
    output = secured(make_workspace(tmp_path / "ws", stand_in, programs), **on_dds(dds, domain_id))
    for file, explanation in BROKEN[dds].items():
        name = file.partition(".")[0]
        assert re.search(rf"node {name} of .* could not join DDS: {explanation}", output), output
    assert re.search(OTHER_DOMAIN[dds].format(domain_id + 100), output), output


def broken(enclave: Path, file: str) -> bytes:
    """The file with one fault: text that was signed is changed, a key is cut, a CA is another one."""
    data = (enclave / file).read_bytes()
    if file.endswith(".p7s"):
        return data.replace(b"<", b"< ", 1)
    if file == "key.pem":
        return data[: len(data) // 2]
    return (enclave / "permissions_ca.cert.pem").read_bytes()


def test_a_missing_enclave_is_explained_by_rcl_itself(stand_in: Path, tmp_path: Path) -> None:
    workspace = make_workspace(tmp_path, stand_in, [Program("lost", "node lost\n", ())])
    output = secured(workspace, STAND_IN_INIT_FAILS="/ks/enclaves/lost")
    assert (
        "lost-1 (enclave /lost) could not join DDS: its enclave /ks/enclaves/lost is not in the key" in output
    )


def test_harmless_lines_explain_nothing() -> None:
    assert cause_of(["Remote secure participant 1:2:3:4 not allowed"]) is None
    assert cause_of(["process has died"]) is None


def endpoint(kind: str, name: str, final: str = "/n") -> RequestedEndpoint:
    return RequestedEndpoint(EndpointKind(kind), name, name, final, TYPES[kind], 1)


@pytest.mark.parametrize("kind", sorted(LISTS))
def test_a_patch_adds_one_entry_to_a_manifest(kind: str, tmp_path: Path) -> None:
    for text in (manifest_text(GRANTED, "library: rclcpp"), manifest_text((), "library: rclcpp")):
        file = tmp_path / f"{PACKAGE}__x.nodl.yaml"
        file.write_text(text)
        patch = manifest_patch(str(file), text, 1, endpoint(kind, "~/new"))
        assert patch is not None
        plus = [line[1:] for line in patch.diff.splitlines() if line[:1] == "+" and line[:3] != "+++"]
        minus = [line for line in patch.diff.splitlines() if line[:1] == "-" and line[:3] != "---"]
        assert minus == [] and plus[-1].strip().startswith("- {name: '~/new', type: ")


def test_a_patch_of_a_v1_manifest_goes_into_the_right_node(tmp_path: Path) -> None:
    text = """<interface version="1">
  <node name="a" executable="a">
    <topic name="x" type="m/msg/A" role="publisher"/>
  </node>
  <node name="b" executable="b">
    <topic name="y" type="m/msg/A" role="publisher"/>
  </node>
</interface>
"""
    patch = manifest_patch("f.nodl.xml", text, 5, endpoint("subscription", "z"))
    assert patch is not None
    lines = text.splitlines()
    added = '    <topic name="z" type="std_msgs/msg/String" role="subscription"/>'
    file = tmp_path / "f.nodl.xml"
    file.write_text("\n".join([*lines[:6], added, *lines[6:], ""]))
    assert f"+{added}" in patch.diff.splitlines()
    assert [len(node.interface.endpoints) for node in read_document(file)] == [1, 2]


def test_a_patch_fills_an_empty_list() -> None:
    patch = manifest_patch("f", "nodl_version: 2\npublishers: []\n", 1, endpoint("publisher", "x"))
    assert patch is not None
    assert [line for line in patch.diff.splitlines() if line.startswith("-p")] == ["-publishers: []"]


@pytest.mark.parametrize("text", ["{nodl_version: 2}", "nodl_version: 2\npublishers: [{name: y}]\n"])
def test_a_manifest_of_another_shape_is_left_alone(text: str) -> None:
    assert manifest_patch("f", text, 1, endpoint("publisher", "x")) is None


def test_a_node_without_manifest_gets_exactly_the_refused_name_in_a_policy_file(tmp_path: Path) -> None:
    from keystore import read_policy

    patch = policy_patch("/e", "/ns/me", endpoint("action_client", "go", "/ns/go"), "p.xml")
    assert patch is not None
    text = "".join(line[1:] + "\n" for line in patch.diff.splitlines()[3:])
    assert text == patch.text
    (tmp_path / "p.xml").write_text(text)
    (enclave,) = read_policy(tmp_path / "p.xml").policy.enclaves
    (profile,) = enclave.profiles
    assert (enclave.path, profile.ns, profile.node) == ("/e", "/ns", "me")
    assert [(rule.operation.value, rule.expression) for rule in profile.rules] == [("call", "/ns/go")]


TWO_SECRETS = """node bad
publisher granted std_msgs/msg/String
publisher one std_msgs/msg/String
subscription two std_msgs/msg/String
"""
SECRETS = {("/bad", "publish topic", "/one"), ("/bad", "subscribe to topic", "/two")}


def as_json(workspace: Workspace) -> None:
    """A manifest in JSON, into which no line can be put safely."""
    import json

    import yaml

    file = workspace.manifest("bad")
    file.write_text(json.dumps(yaml.safe_load(file.read_text())))


def test_a_manifest_of_another_shape_is_cured_by_one_policy_file_that_grows(
    stand_in: Path, tmp_path: Path
) -> None:
    program = Program("bad", TWO_SECRETS, (("publisher", "granted"),))
    workspace = make_workspace(tmp_path, stand_in, [program])
    as_json(workspace)
    output = secured(workspace)
    assert told(output) == SECRETS
    policy = tmp_path / "allow.policy.xml"
    assert apply_patches(output.replace("allow.policy.xml", str(policy))) == 2
    assert told(secured(workspace, "--policy", str(policy))) == set()


def test_the_policy_file_in_use_is_the_one_that_is_changed(stand_in: Path, tmp_path: Path) -> None:
    program = Program("bad", TWO_SECRETS, (("publisher", "granted"),))
    workspace = make_workspace(tmp_path, stand_in, [program])
    as_json(workspace)
    policy = tmp_path / "mine.policy.xml"
    patch = policy_patch("/bad", "/bad", endpoint("publisher", "one", "/one"), str(policy))
    assert patch is not None
    policy.write_text(patch.text)
    output = secured(workspace, "--policy", str(policy))
    assert told(output) == SECRETS - {("/bad", "publish topic", "/one")}
    assert apply_patches(output) == 1
    assert told(secured(workspace, "--policy", str(policy))) == set()


def test_what_the_policy_file_denies_has_no_patch(stand_in: Path, tmp_path: Path) -> None:
    program = Program("bad", TWO_SECRETS, (("publisher", "one"), ("publisher", "granted")))
    workspace = make_workspace(tmp_path, stand_in, [program])
    policy = tmp_path / "mine.policy.xml"
    patch = policy_patch("/bad", "/bad", endpoint("publisher", "one", "/one"), str(policy))
    assert patch is not None
    policy.write_text(patch.text.replace("ALLOW", "DENY"))
    output = secured(workspace, "--policy", str(policy))
    assert told(output) == SECRETS
    assert output.count("a DENY of the policy file removes it") == 1
    assert apply_patches(output) == 1, "the other one"
    assert told(secured(workspace, "--policy", str(policy))) == {("/bad", "publish topic", "/one")}


LEARNT = (
    "library: rclcpp, runs: [{id: a}], endpoints: [{in: publishers, name: status, parameter: label, ROW}]"
)


@pytest.mark.parametrize("row", ["proof: another value was followed", "default: status, proof: one run"])
def test_a_name_that_a_record_takes_for_a_parameter_is_granted_or_cured(
    row: str, stand_in: Path, tmp_path: Path
) -> None:
    """The entry is in the manifest already, under a parameter: listed twice the manifest would be broken."""
    program = Program(
        "bad",
        "node bad\npublisher status std_msgs/msg/String\n",
        (("publisher", "status"),),
        inside='<param name="label" value="warehouse"/>',
        codegen=LEARNT.replace("ROW", row),
    )
    workspace = make_workspace(tmp_path, stand_in, [program])
    output = secured(workspace)
    if "one run" in row:
        assert told(output) == set()
        return
    assert told(output) == {("/bad", "publish topic", "/status")}
    policy = tmp_path / "allow.policy.xml"
    assert apply_patches(output.replace("allow.policy.xml", str(policy))) == 1
    assert told(secured(workspace, "--policy", str(policy))) == set()


def test_what_other_descriptions_of_a_recorded_node_have_is_named_at_once(
    stand_in: Path, tmp_path: Path
) -> None:
    """Not one name at each restart."""
    program = Program(
        "bad", TWO_SECRETS, (("publisher", "granted"),), codegen="library: rclcpp, runs: [{id: a}]"
    )
    workspace = make_workspace(tmp_path, stand_in, [program])
    library = tmp_path / "library" / PACKAGE / "bad.nodl.yaml"
    library.parent.mkdir(parents=True)
    library.write_text(manifest_text((("publisher", "one"), ("subscription", "two")), "library: rclcpp"))
    given = ("--library", str(tmp_path / "library"))
    output = secured(workspace, *given)
    assert told(output) == SECRETS
    assert output.count("--also unseen grants publish /one, subscribe /two") == 2
    assert told(secured(workspace, *given, "--also", "unseen")) == set()


def test_the_security_log_of_a_process_explains_what_its_output_does_not(
    stand_in: Path, tmp_path: Path
) -> None:
    program = Program("n", "node n\n", (), inside='<env name="STAND_IN_NODE_FAILS" value="refused"/>')
    workspace = make_workspace(tmp_path, stand_in, [program])
    logs = tmp_path / "logs"
    without = secured(workspace, "--log-security", str(logs))
    assert logs.is_dir() and "could not join DDS: " in without, without
    (logs / "n-1.log").write_text("[ERROR] Permissions validity period expired for CN=ros.n\n")
    assert "could not join DDS: its permissions have expired" in secured(
        workspace, "--log-security", str(logs)
    )
