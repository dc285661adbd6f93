"""What a person reads of many findings: one paragraph for each kind, everything with ``-v``."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from enclave_addons.review.checks.rules import MEANINGS
from enclave_addons.review.review_text import findings_text
from enclave_launch.dry_run import Diagnostic


def told(
    code: str, subject: str, severity: Literal["error", "warning"] = "warning"
) -> tuple[Diagnostic, str | None]:
    text = f"{subject} is odd"
    return Diagnostic(
        severity=severity, code=code, subject=subject, file=None, line=0, text=text, remedy="fix it"
    ), None


def test_findings_of_one_kind_are_one_paragraph() -> None:
    text = findings_text([told("remap-dead", name) for name in ("/a", "/b", "/c")])
    assert text == (
        "warning: /a is odd (and 2 more of this kind, about /a, /b, /c) [remap-dead]\n  fix it\n"
        "0 errors, 3 warnings\n"
    )


def test_findings_of_two_kinds_are_two_paragraphs_errors_first() -> None:
    text = findings_text([told("remap-dead", "/a"), told("no-manifest", "p/x", "error")])
    assert [line for line in text.splitlines() if "[" in line] == [
        "error: p/x is odd [no-manifest]",
        "warning: /a is odd [remap-dead]",
    ]


def test_shared_enclaves_are_counted_and_listed_when_asked_for() -> None:
    shared = [told("enclave-shared", name) for name in ("/a", "/b")]
    assert findings_text(shared) == "0 errors, 2 warnings (2 enclave-shared; -v lists them)\n"
    assert findings_text(shared, verbose=True).count("[enclave-shared]") == 2


def test_packages_that_the_user_allowed_to_be_missing_are_counted() -> None:
    missing = [told("package-not-installed", name) for name in ("a", "b")]
    assert findings_text(missing) == "0 errors, 2 warnings (2 package-not-installed; -v lists them)\n"


def test_what_this_machine_lacks_of_a_launch_is_one_paragraph() -> None:
    missing = [
        told("package-not-installed", "a"),
        told("package-not-installed", "b"),
        told("include-left-out", "/missing/a/b.launch.py"),
        told("parameter-file-missing", "/missing/a/c.yaml"),
        told("program-not-executable", "xterm"),
    ]
    assert findings_text(missing) == (
        "warning: not on this machine, so the plan may be incomplete: packages a, b; "
        "launch file /missing/a/b.launch.py; "
        "parameter file /missing/a/c.yaml; program xterm "
        "[package-not-installed, include-left-out, parameter-file-missing, program-not-executable]\n"
        "  install or build them, and check again; -v lists each with its place\n"
        "0 errors, 5 warnings\n"
    )
    assert findings_text(missing, verbose=True).count("fix it") == 5


def test_files_of_the_launch_itself_that_are_not_there_are_findings_of_their_own() -> None:
    text = findings_text([
        told("parameter-file-missing", "/home/me/typo.yaml"), told("program-not-executable", "/home/me/typo"),
    ])  # fmt: skip
    assert "this machine" not in text
    assert "[parameter-file-missing]" in text and "[program-not-executable]" in text


def test_an_accepted_finding_is_never_summed_up() -> None:
    (finding, _) = told("enclave-shared", "/a")
    text = findings_text([(finding, "one process"), told("enclave-shared", "/b")])
    assert "accepted (one process): /a is odd [enclave-shared]" in text
    assert "0 errors, 1 warning, 1 accepted (1 enclave-shared; -v lists them)" in text


def test_every_code_has_a_section_of_its_own_in_the_documentation() -> None:
    page = (Path(__file__).parents[3] / "docs" / "checks.md").read_text(encoding="utf-8")
    headings = [
        code for line in page.splitlines() if line.startswith("### ") for code in line[4:].split(", ")
    ]
    assert sorted(headings) == sorted(MEANINGS)


def test_ends_that_another_launch_may_have_are_counted_and_those_of_nearly_the_same_name_are_printed() -> (
    None
):
    found = [
        told("no-subscriber", "/debug"),
        told("no-publisher", "/scan"),
        told("nearly-the-same-name", "/x"),
    ]
    text = findings_text(found)
    assert "[nearly-the-same-name]" in text
    assert "[no-publisher]" not in text and "[no-subscriber]" not in text
    assert text.endswith("0 errors, 3 warnings (1 no-subscriber, 1 no-publisher; -v lists them)\n")
