"""The folder of evidence: complete, the same each time, true to the keystore, signed so that others can check it."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from enclave_addons.review.evidence.documents import PAYLOAD_TYPE, csv_text, matrix_rows, surface_document
from enclave_addons.review.evidence.requirements import DISCLAIMER, PARTS
from enclave_addons.review.graph import plan_graph
from enclave_addons.review.verb import main
from enclave_addons.review.verb.evidence import signed_bytes
from enclave_launch import ResolveOptions, provision, resolve
from tests.addons.review.report.conftest import hostile, robot

PREFIX = Path(__file__).parents[3] / "fixtures" / "demo_ws"
WORDS = ("--prefix", str(PREFIX), "demo_nodes", "services_actions.launch.xml")
AT = ("--at", "2030-01-01T00:00:00Z")


@pytest.fixture(scope="module")
def keystore(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ks") / "ks"
    launch_file = PREFIX / "share" / "demo_nodes" / "launch" / "services_actions.launch.xml"
    provision(resolve(launch_file, options=ResolveOptions(prefixes=(PREFIX,))), folder)
    return folder


@pytest.fixture(scope="module")
def evidence(keystore: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evidence") / "e"
    assert (
        main(["evidence", *WORDS, *AT, "-o", str(folder), "--keystore", str(keystore), "--within", "1d"]) == 0
    )
    return folder


def read(folder: Path, name: str) -> Any:
    return json.loads((folder / name).read_text(encoding="utf-8"))


def test_every_part_has_its_files_and_nothing_else_is_there(evidence: Path) -> None:
    named = {file for part in PARTS for file in part.files}
    assert {path.name for path in evidence.iterdir()} == named | {
        "README.md",
        "requirements.json",
        "statement.json",
    }


def test_the_same_input_and_time_give_the_same_bytes(
    keystore: Path, evidence: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1893456000")  # the time of AT
    again = tmp_path / "again"
    assert main(["evidence", *WORDS, "-o", str(again), "--keystore", str(keystore), "--within", "1d"]) == 0
    assert {path.name: path.read_bytes() for path in again.iterdir()} == {
        path.name: path.read_bytes() for path in evidence.iterdir()
    }


def test_the_matrix_has_each_permission_with_its_reason(evidence: Path) -> None:
    found = list(csv.DictReader(io.StringIO((evidence / "access-control.csv").read_text())))
    own = [row for row in found if row["built_in"] == "no"]
    assert [(row["enclave"], row["node"], row["operation"], row["name"]) for row in own] == [
        ("/operator", "/add_two_ints_client", "call_services", "/robot1/add_two_ints"),
        ("/robot1/adder", "/robot1/add_two_ints_server", "serve_services", "/robot1/add_two_ints"),
        ("/robot1/arm/counter", "/robot1/arm/fibonacci_server", "serve_actions", "/robot1/arm/count_up"),
        ("/robot1/arm/planner", "/robot1/arm/fibonacci_client", "call_actions", "/robot1/arm/count_up"),
    ]
    assert all("demo_nodes.nodl.xml:" in row["evidence"] for row in own)
    assert len(found) == len(read(evidence, "access-control.json")["permissions"])


def test_no_cell_of_the_matrix_is_a_formula() -> None:
    plan = hostile([f"{start}cmd|'/C calc'!A0" for start in "=+-@"])
    cells = [cell for row in csv.reader(io.StringIO(csv_text(matrix_rows(plan_graph(plan))))) for cell in row]
    assert not [cell for cell in cells if cell.startswith(("=", "+", "-", "@"))]


def test_the_surface_tells_what_comes_in_and_from_whom() -> None:
    surface = surface_document(robot())
    assert surface["enclaves"]["/planner"] == {
        "accepts": [
            {"operation": "subscribe", "name": "/image", "types": [], "sent_by": ["/camera"]},
            {"operation": "subscribe", "name": "/map/*", "types": [], "sent_by": []},
        ],
        "wildcards": ["/map/*"],
    }
    assert surface["influences"]["/camera"] == ["/base", "/logger", "/planner"]
    assert [each["program"] for each in surface["without_an_enclave"]] == ["/tool"]
    assert [each["program"] for each in surface["interfaces_unknown"]] == ["/camera/helper"]


def test_the_inventory_is_what_openssl_says_of_the_certificates(evidence: Path, keystore: Path) -> None:
    keys = read(evidence, "keys.json")["keys"]
    assert [(key["use"], key["name"]) for key in keys] == [
        ("identity CA", "in use"), ("permissions CA", "in use"), ("enclave", "/operator"), ("enclave", "/robot1/adder"),
        ("enclave", "/robot1/arm/counter"), ("enclave", "/robot1/arm/planner"),
    ]  # fmt: skip
    key = next(key for key in keys if key["name"] == "/operator")
    cert = keystore / "enclaves" / "operator" / "cert.pem"
    said = subprocess.run(
        ["openssl", "x509", "-in", cert, "-noout", "-fingerprint", "-sha256", "-serial", "-text"],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert key["certificate_sha256"] in said.replace(":", "").lower()
    assert f"serial={key['serial'].upper()}" in said.replace("serial=0", "serial=")
    assert key["key"] == "P-256" and "prime256v1" in said
    assert key["signature"] == "ECDSA, sha256" and "ecdsa-with-SHA256" in said
    assert key["private_key"] == "file of the enclave"


def test_defaults_are_those_of_the_governance_in_force(evidence: Path) -> None:
    defaults = read(evidence, "secure-defaults.json")["defaults"]
    (rule,) = defaults["governance"]
    assert rule["allow_unauthenticated_participants"] is False and rule["rtps_protection_kind"] == "SIGN"
    assert rule["topic_rules"][0]["data_protection_kind"] == "ENCRYPT"
    assert defaults["weaker_than_default"] == []


def test_what_was_not_given_is_told_to_be_missing(tmp_path: Path) -> None:
    assert main(["evidence", *WORDS, *AT, "-o", str(tmp_path / "e")]) == 0
    for name in ("keys.json", "secure-defaults.json", "components.json"):
        assert read(tmp_path / "e", name)["examined"] is False
    scope = read(tmp_path / "e", "scope.json")
    assert any("no keystore was given" in text for text in scope["not_checked"])
    assert not any(check["code"].startswith("keystore-") for check in scope["checked"])


def test_gaps_are_named_and_end_in_a_failed_check(tmp_path: Path) -> None:
    launch = tmp_path / "f.launch.xml"
    launch.write_text('<launch><node pkg="demo_nodes" exec="unheard_of" name="x"/></launch>')
    program = tmp_path / "ws" / "lib" / "demo_nodes" / "unheard_of"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    index = tmp_path / "ws" / "share" / "ament_index" / "resource_index" / "packages"
    index.mkdir(parents=True)
    (index / "demo_nodes").write_text("")
    words = ("--prefix", str(tmp_path / "ws"), str(launch))
    assert main(["evidence", *words, *AT, "-o", str(tmp_path / "e")]) == 1
    assert any("demo_nodes/unheard_of" in gap for gap in read(tmp_path / "e", "scope.json")["gaps"])
    assert read(tmp_path / "e", "statement.json")["predicate"]["result"] == "FAILED"


def test_accepted_exceptions_stand_there_with_their_reason(tmp_path: Path) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text(
        "never:\n- {from: /operator, to: /robot1/adder}\naccept:\n- {code: flow-forbidden, why: asked for}\n"
    )
    assert main(["evidence", *WORDS, *AT, "-o", str(tmp_path / "e"), "--expect", str(rules)]) == 0
    (accepted,) = read(tmp_path / "e", "accepted.json")["accepted"]
    assert (accepted["code"], accepted["reason"]) == ("flow-forbidden", "asked for")
    assert "asked for" in (tmp_path / "e" / "README.md").read_text()


def test_the_bill_of_materials_is_linked_by_bom_link_and_hash(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sbom = tmp_path / "robot.cdx.json"
    content = {
        "bomFormat": "CycloneDX", "specVersion": "1.6", "version": 3, "components": [{"type": "library", "name": "x"}],
        "serialNumber": "urn:uuid:3e671687-395b-41f5-a30f-a58921a69b79",
    }  # fmt: skip
    sbom.write_text(json.dumps(content))
    assert main(["evidence", *WORDS, *AT, "-o", str(tmp_path / "e"), "--sbom", str(sbom)]) == 0
    assert read(tmp_path / "e", "components.json")["bill_of_materials"] == {
        "file": "robot.cdx.json", "sha256": hashlib.sha256(sbom.read_bytes()).hexdigest(), "spec_version": "1.6",
        "bom_link": "urn:cdx:3e671687-395b-41f5-a30f-a58921a69b79/3", "components": 1,
    }  # fmt: skip
    sbom.write_text("{}")
    assert main(["evidence", *WORDS, *AT, "-o", str(tmp_path / "other"), "--sbom", str(sbom)]) == 2
    assert "is not a CycloneDX document" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


def test_the_statement_names_every_file_by_its_hash(evidence: Path) -> None:
    said = read(evidence, "statement.json")
    assert said["_type"] == "https://in-toto.io/Statement/v1"
    assert said["predicateType"] == "https://in-toto.io/attestation/test-result/v0.1"
    assert {each["name"]: each["digest"]["sha256"] for each in said["subject"]} == {
        path.name: hashlib.sha256(path.read_bytes()).hexdigest()
        for path in evidence.iterdir()
        if path.name != "statement.json"
    }
    assert said["predicate"]["result"] == "PASSED" and "wildcard" in said["predicate"]["passedTests"]


@pytest.mark.parametrize(
    "algorithm",
    [["-algorithm", "EC", "-pkeyopt", "ec_paramgen_curve:P-256"], ["-algorithm", "RSA"]],
    ids=["EC", "RSA"],
)
def test_openssl_accepts_the_signature_and_refuses_a_changed_statement(
    tmp_path: Path, algorithm: list[str]
) -> None:
    key, public = tmp_path / "key.pem", tmp_path / "public.pem"
    subprocess.run(["openssl", "genpkey", *algorithm, "-out", key], check=True, capture_output=True)
    subprocess.run(["openssl", "pkey", "-in", key, "-pubout", "-out", public], check=True)
    folder = tmp_path / "e"
    assert main(["evidence", *WORDS, *AT, "-o", str(folder), "--sign-key", str(key)]) == 0
    envelope = read(folder, "statement.dsse.json")
    payload = base64.b64decode(envelope["payload"])
    assert payload == (folder / "statement.json").read_bytes() and envelope["payloadType"] == PAYLOAD_TYPE
    (tmp_path / "sig").write_bytes(base64.b64decode(envelope["signatures"][0]["sig"]))

    def verified(data: bytes) -> bool:
        (tmp_path / "data").write_bytes(data)
        files = (public, "-signature", tmp_path / "sig", tmp_path / "data")
        command = ["openssl", "dgst", "-sha256", "-verify", *map(str, files)]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    assert verified(f"DSSEv1 {len(PAYLOAD_TYPE)} {PAYLOAD_TYPE} {len(payload)} ".encode() + payload)
    assert not verified(signed_bytes(payload.replace(b"PASSED", b"WARNED"), PAYLOAD_TYPE))
    assert not verified(signed_bytes(payload, "application/json"))


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--sign-key", "absent.pem"], "absent.pem: No such file"),
        (["--sign-key", "/dev/null"], "/dev/null"),
        (["--at", "yesterday"], "--at yesterday"),
        (["--keystore", "absent"], "there is no keystore at"),
    ],
)
def test_what_cannot_be_done_is_told_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], why: str
) -> None:
    assert main(["evidence", *WORDS, "-o", str(tmp_path / "e"), *words]) != 0
    assert why in capsys.readouterr().err
    assert not (tmp_path / "e").exists()


def test_a_folder_that_holds_something_is_refused(evidence: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["evidence", *WORDS, "-o", str(evidence)]) == 2
    assert "is not empty" in capsys.readouterr().err


def test_no_conformity_is_claimed(evidence: Path) -> None:
    text = (evidence / "README.md").read_text()
    assert DISCLAIMER in text
    assert "conforms" not in text and "compliant" not in text and "certified" not in text


@pytest.mark.parametrize("option", ["--passphrase-env", "--pin-env"])
def test_a_secret_is_for_a_saved_plan_since_code_of_a_launch_file_could_read_it(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ("-o", str(tmp_path / "out"), "--sign-key", "key.pem", option, "SECRET")
    assert main(["evidence", *WORDS, *given]) == 2
    assert "go with a saved plan" in capsys.readouterr().err
    (tmp_path / "plan.json").write_text("{}")
    assert main(["evidence", str(tmp_path / "plan.json"), *given]) == 2
    assert "go with a saved plan" not in capsys.readouterr().err, "refused for what it holds"
