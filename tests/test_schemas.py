"""The JSON Schemas for editors follow from the models, and judge the files as the commands do."""

from __future__ import annotations

import json
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from enclave_addons.review.verb.init import CONTENT

ROOT = Path(__file__).resolve().parents[1]


def written() -> dict[str, str]:
    loader = SourceFileLoader("schemas_tool", str(ROOT / "tools" / "schemas"))
    spec = spec_from_loader("schemas_tool", loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    files: dict[str, str] = module.files()
    return files


def schema(name: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((ROOT / "schemas" / f"{name}.schema.json").read_text(encoding="utf-8"))
    return found


def test_the_schemas_are_what_the_models_say() -> None:
    for path, text in written().items():
        assert (ROOT / path).read_text(encoding="utf-8") == text, f"{path} is old: run tools/schemas"


@pytest.mark.parametrize(
    ("name", "text", "valid"),
    [
        ("enclaves", CONTENT, True),
        ("enclaves", "nodl: one\nsource: [a, b]\n", True),
        ("enclaves", "keystor: ks\n", False),
        ("enclaves", "enclave-scope: nod\n", False),
        ("enclaves", "accept:\n- {code: no-server, why: x}\n", True),
        ("enclaves", "accept:\n- {code: no-server}\n", False),
        ("hosts", "version: 1\nhosts: {a: {enclaves: [/x]}}\n", True),
        ("hosts", "version: 1\nhosts: {a: {enclave: [/x]}}\n", False),
        ("governance", "version: 1\ndomain_rules: [{rtps_protection_kind: SIGN}]\n", True),
        ("governance", "version: 1\ndomain_rules: [{rtps_protection: SIGN}]\n", False),
    ],
)
def test_a_schema_judges_as_the_command_does(name: str, text: str, valid: bool) -> None:
    errors = list(jsonschema.Draft202012Validator(schema(name)).iter_errors(yaml.safe_load(text)))
    assert (errors == []) is valid
