"""Write a folder of evidence for an assessment: permissions with reasons, attack surface, keys, findings.

  secure-plan evidence PACKAGE LAUNCH_FILE -o evidence --keystore ks --sbom robot.cdx.json --sign-key release.pem

Each part names the requirements that it supports; it claims no conformity. What was not checked is listed as well. The
same input and time (--at, or SOURCE_DATE_EPOCH) give the same bytes, but for a signature.
A key file may hold the pkcs11: URI of a token, as those of a keystore. Exit status as of check.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import json
import os
from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from enclave_addons.review.checks import MEANINGS
from enclave_addons.review.contents import report_contents
from enclave_addons.review.evidence.documents import PAYLOAD_TYPE, Examined, evidence_files, statement
from enclave_addons.review.verb.judging import EXPECT, WITHIN, judged
from enclave_addons.review.verb.keystores import endings
from enclave_addons.review.verb.plans import is_saved_plan, planned_file, read_document
from enclave_common.command_line import PATH, TEXT, FromProject
from enclave_common.files import read_bytes, write_bytes
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import UsageError, keystore_errors, translated
from keystore.errors import InvalidInputError
from keystore.formats.validity import iso, parse_time, utc_now
from keystore.signing.ca_access import CaAccess, Secret
from keystore.signing.private_key import PrivateKey, signature, spki
from keystore.signing.public_key import fingerprint
from keystore.signing.token_key import open_key
from keystore.steps.inventory import governance_facts, inventory
from keystore.verification import verify

SIGNED = "statement.dsse.json"


OPTIONS = {
    "": (
        ("-o --output DIR", {**PATH, "required": True}, "a new or empty folder"),
        (
            "--keystore DIR",
            {**PATH, "configured": FromProject("keystore", if_exists=True)},
            "look at its keys, governance and files",
        ),
        ("--sbom FILE", PATH, "the product's CycloneDX document (JSON)"),
        ("--sign-key FILE", PATH, "sign the statement with this EC or RSA key"),
        ("--passphrase-env NAME", TEXT, "the variable with the key's passphrase"),
        ("--pin-env NAME", TEXT, "the variable with the token's PIN"),
        ("--at TIME", TEXT, "time of the examination, such as 2026-11-22T10:00:00Z (default: now)"),
        WITHIN,
        EXPECT,
    )
}


def run(options: argparse.Namespace) -> int:
    """Write the files; return 1 if the checks find an error. Raises ``UsageError`` for a readable secret."""
    if (options.passphrase_env or options.pin_env) and not is_saved_plan(options.words):
        raise UsageError(
            "evidence: --passphrase-env and --pin-env go with a saved plan (PLAN.json of secure-launch --dry-run "
            "--format json): the code of a launch file could read them"
        )
    folder = _new_folder(options.output)
    examined = _examine(options)
    files = evidence_files(examined)
    found = examined.contents.judged
    scope = json.loads(files["scope.json"])
    said = statement(files, found, [check["code"] for check in scope["checked"]])
    signed = _signed(said, options) if options.sign_key is not None else {}
    _write(folder, {**files, "statement.json": said, **signed})
    return 1 if any(finding.severity == "error" for finding, accepted in found if accepted is None) else 0


def _new_folder(folder: Path) -> Path:
    """Return ``folder`` if it is new or empty; raises ``UsageError`` else: old files must not pass for evidence."""
    with translated(OSError, UsageError, f"{folder}: "):
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise UsageError(
                f"{folder} is not empty: name a new folder, so that nothing old is among the evidence"
            )
    return folder


def _examine(options: argparse.Namespace) -> Examined:
    now, keystore = _time(options.at), options.keystore
    document = read_document(options.words, options)
    plan = DryRun(**document)
    components = _bill_of_materials(options.sbom) if options.sbom is not None else None
    found = judged(plan, options.expect, keystore, options.expiring_within, now, options.project)
    ends = endings(keystore, now=now) if keystore is not None else None
    root = os.getcwd()
    contents = report_contents(plan, found, title=" ".join(options.words), root=root, endings=ends)
    file = planned_file(options.words, options, plan)
    examined = Examined(document, plan, contents, MEANINGS, iso(now), root, file, components=components)
    if keystore is None:
        return examined
    return examined._replace(keys=_keys(keystore), defaults=_defaults(keystore, now))


def _time(text: str | None) -> datetime:
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    try:
        if text is not None:
            return parse_time(text)
        return datetime.fromtimestamp(int(epoch), timezone.utc) if epoch else utc_now()
    except InvalidInputError as error:
        raise UsageError(f"--at {text}: {error}") from error
    except (ValueError, OverflowError, OSError) as error:
        raise UsageError(f"SOURCE_DATE_EPOCH={epoch} is not a time: {error}") from error


def _keys(keystore: Path) -> list[dict[str, Any]]:
    with keystore_errors():
        return [entry._asdict() for entry in inventory(keystore)]


def _defaults(keystore: Path, now: datetime) -> dict[str, Any]:
    with keystore_errors():
        facts = governance_facts(keystore)
        report = verify(keystore, now=now)
    return {
        "governance": facts.rules,
        "weaker_than_default": list(facts.weaknesses),
        "strategy": "Enforce, unless --strategy says otherwise",
        "verify": {
            "good": report.is_good,
            "findings": [
                {"severity": one.severity.value, "code": one.code, "place": one.place, "message": one.message}
                for one in report.findings
            ],
        },
    }


def _bill_of_materials(file: Path) -> dict[str, Any]:
    """Return the BOM-Link (CycloneDX specification, "BOM-Link") and the hash of ``file``; raises UsageError."""
    with translated(OSError, UsageError, f"--sbom {file}: "):
        data = read_bytes(file)
    with translated(ValueError, UsageError, f"--sbom {file} is not JSON: "):
        content = json.loads(data)
    if not isinstance(content, Mapping) or content.get("bomFormat") != "CycloneDX":
        raise UsageError(f'--sbom {file} is not a CycloneDX document ("bomFormat": "CycloneDX")')
    serial = str(content.get("serialNumber", "")).removeprefix("urn:uuid:")
    return {
        "file": file.name,
        "sha256": hashlib.sha256(data).hexdigest(),
        "spec_version": content.get("specVersion"),
        "bom_link": f"urn:cdx:{serial}/{content.get('version', 1)}" if serial else None,
        "components": len(content.get("components") or ()),
    }


def _signed(said: bytes, options: argparse.Namespace) -> dict[str, bytes]:
    def secret(variable: str | None) -> Secret | None:
        return Secret(variable=variable) if variable else None

    with translated(OSError, UsageError, f"--sign-key {options.sign_key}: "):
        reference = read_bytes(options.sign_key)
    access = CaAccess(passphrase=secret(options.passphrase_env), pin=secret(options.pin_env))
    with keystore_errors():
        key = open_key(reference, str(options.sign_key), access)
        return {SIGNED: envelope_text(envelope(said, PAYLOAD_TYPE, key)).encode()}


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    with translated(OSError, UsageError, f"{folder}: "):
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in files.items():
            write_bytes(folder / name, data)


def envelope(payload: bytes, payload_type: str, key: PrivateKey) -> dict[str, Any]:
    """Make a DSSE envelope (secure-systems-lab/dsse, protocol.md 1.0.2) with one signature over type and content.

    ``keyid`` is the SHA-256 of the public key in DER, in hex.

    Raises ``SigningUnavailableError`` if a token refuses.
    """
    signed = base64.b64encode(signature(key, signed_bytes(payload, payload_type))).decode()
    entry = {"keyid": fingerprint(spki(key.public_key())), "sig": signed}
    return {"payload": base64.b64encode(payload).decode(), "payloadType": payload_type, "signatures": [entry]}


def signed_bytes(payload: bytes, payload_type: str) -> bytes:
    """Return the pre-authentication encoding, which is what is signed."""
    kind = payload_type.encode()
    return b"DSSEv1 %d %b %d %b" % (len(kind), kind, len(payload), payload)


def envelope_text(content: dict[str, Any]) -> str:
    """Render an envelope as the JSON text that is written."""
    return json.dumps(content, indent=2) + "\n"
