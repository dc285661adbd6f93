"""Write a report for people: graph, findings, permissions with their reasons, flows, statistics, expiry.

  secure-plan report PACKAGE LAUNCH_FILE -o report.html             one file; it needs no network
  secure-plan report plan.json --format mermaid                     the graph alone; or dot

Findings are those of check, less those that enclaves.review.yaml accepts. --keystore adds how it
differs from the plan and what expires when.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from enclave_addons.review.contents import report_contents
from enclave_addons.review.diagrams import dot, mermaid
from enclave_addons.review.graph import plan_graph
from enclave_addons.review.html.page import html_report
from enclave_addons.review.markdown import markdown_report
from enclave_addons.review.verb.judging import EXPECT, judged
from enclave_addons.review.verb.keystores import endings
from enclave_addons.review.verb.plans import read_plan
from enclave_common.command_line import PATH, FromProject, one_of
from enclave_common.files import write_text
from enclave_common.project import Project
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import UsageError, translated

OPTIONS = {
    "": (
        ("--format", one_of("html", "markdown", "dot", "mermaid"), "what to write (html)"),
        ("-o --output FILE", PATH, "default: standard output"),
        (
            "--keystore DIR",
            {**PATH, "configured": FromProject("keystore", if_exists=True)},
            "report how it differs, and what expires",
        ),
        EXPECT,
    )
}


def run(options: argparse.Namespace) -> int:
    """Print or write the report. Returns 0."""
    document = read_plan(options.words, options)
    title = " ".join(options.words)
    text = report_text(
        document,
        options.format,
        title,
        keystore=options.keystore,
        expect=options.expect,
        project=options.project,
    )
    if options.output is None:
        sys.stdout.write(text)
        return 0
    with translated(OSError, UsageError, f"{options.output}: "):
        write_text(options.output, text)
    return 0


def report_text(
    document: DryRun,
    form: str,
    title: str,
    *,
    keystore: Path | str | None = None,
    expect: Path | None = None,
    project: Project | None = None,
) -> str:
    """Return the report on a dry run in the given form; raises UsageError and ProvisionError."""
    if form in ("dot", "mermaid"):
        return (dot if form == "dot" else mermaid)(plan_graph(document))

    ends = endings(keystore) if keystore is not None else None
    found = judged(document, expect, keystore, project=project)
    contents = report_contents(document, found, title=title, root=os.getcwd(), endings=ends)
    if form == "markdown":
        return markdown_report(contents)

    return html_report(contents)
