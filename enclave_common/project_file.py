"""The content of ``enclaves.yaml``: what a project says once, so that no command needs to be given it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Optional

from pydantic import Field, StrictStr

from enclave_common.files import read_bytes
from enclave_common.strict_yaml import MAX_BYTES, Strict, YamlFileError, parse_strict

SCHEMA_URL = (
    "https://raw.githubusercontent.com/enclave-launch/enclave-launch/main/schemas/enclaves.schema.json"
)
_LISTS = ("nodl", "source", "library")


# Only what pydantic 1.8 and 2 have in common, see strict_yaml.
class NeverRule(Strict, frozen=True):
    """A forbidden influence: from an enclave or node to another, or to a name."""

    source: StrictStr = Field(alias="from")
    target: StrictStr = Field(alias="to")
    why: StrictStr = ""


class AcceptEntry(Strict, frozen=True):
    """A finding of ``secure-plan check`` that the project accepts, and the reason."""

    code: StrictStr
    why: StrictStr
    subject: StrictStr = "*"


class ReviewRules(Strict, frozen=True):
    """Content of ``enclaves.review.yaml``: the rules alone."""

    never: Optional[list[NeverRule]] = None
    accept: Optional[list[AcceptEntry]] = None


class ProjectFile(ReviewRules, frozen=True):
    """Content of ``enclaves.yaml``. A key without a value counts as left out."""

    keystore: Optional[StrictStr] = None
    enclave_scope: Optional[StrictStr] = Field(default=None, alias="enclave-scope")
    nodl: Optional[list[StrictStr]] = None
    source: Optional[list[StrictStr]] = None
    library: Optional[list[StrictStr]] = None
    distro: Optional[StrictStr] = None
    hosts: Optional[StrictStr] = None

    @classmethod
    def prepared(cls, content: dict[str, Any]) -> dict[str, Any]:
        """Return ``content`` with a list of one where a text stands in the place of a list."""
        alone = {key: [content[key]] for key in _LISTS if isinstance(content.get(key), str)}
        return {**content, **alone}


def read_project_file(file: Path) -> ProjectFile:
    """Read an ``enclaves.yaml``; raises YamlFileError naming the file and the line of each mistake."""
    return parse_strict(ProjectFile, _content(file) or b"{}", str(file))


def read_review_rules(file: Path) -> ReviewRules:
    """Read an ``enclaves.review.yaml``; raises as ``read_project_file``."""
    return parse_strict(ReviewRules, _content(file) or b"{}", str(file))


def _content(file: Path) -> bytes:
    """Return the content of ``file``, empty if nothing but comments is in it. Raises YamlFileError."""
    try:
        content = read_bytes(file, MAX_BYTES)
    except OSError as error:
        raise YamlFileError(f"{file}: {error.strerror}") from None
    lines = (line.strip() for line in content.splitlines())
    return content if any(line and not line.startswith(b"#") for line in lines) else b""
