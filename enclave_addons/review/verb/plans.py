"""Plans as the verbs are given them: a launch file with its arguments, or a saved dry run."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from enclave_common.command_line import Kind, Option, one_of
from enclave_common.files import read_text
from enclave_common.terminal import progress, stdout_is_for_the_plan
from enclave_launch.dry_run import DryRun
from enclave_launch.errors import UsageError
from enclave_launch.flow import resolve
from enclave_launch.options import ResolveOptions
from enclave_launch.report.plan_json import plan_document
from enclave_launch.verb.completion import launch_words
from enclave_launch.verb.options import EVALUATION, POLICY, resolve_options
from enclave_launch.verb.target import find_target
from nodl.ament_index import search_prefixes

LARGEST_PLAN = 256 << 20  # bytes
WORDS: Kind = {
    "nargs": "+",
    "metavar": "PLAN.json | PACKAGE LAUNCH_FILE | PATH [name:=value ...]",
    "completer": launch_words,
}
FORM: Option = ("--format", one_of("text", "json"), "how to print (text)")


def read_plan(words: Sequence[str], options: argparse.Namespace) -> DryRun:
    """Return the plan that ``words`` name; raises UsageError, also for options that a saved plan does not take."""
    return _saved_as_named(words, options)[1] if is_saved_plan(words) else plan_of(words, options)


def read_document(words: Sequence[str], options: argparse.Namespace) -> Mapping[str, Any]:
    """Return the JSON of the plan that ``words`` name, as it was saved or would be; raises as ``read_plan``."""
    return _saved_as_named(words, options)[0] if is_saved_plan(words) else _planned(words, options)


def is_saved_plan(words: Sequence[str]) -> bool:
    """Return True if ``words`` name the JSON of a dry run and no launch file."""
    return words[0].endswith(".json")


def _saved_as_named(words: Sequence[str], options: argparse.Namespace) -> tuple[Mapping[str, Any], DryRun]:
    """Read a saved plan; raises ``UsageError`` for arguments and options of planning, which would have no effect."""
    flags = [written.split()[0] for written, *_ in (*POLICY, *EVALUATION)]
    idle = [*words[1:], *(flag for flag in flags if flag[2:].replace("-", "_") in options.given)]
    if idle:
        raise UsageError(
            f"{idle[0]} has no effect: {words[0]} is a saved plan; plan the launch file again with it"
        )
    return _saved(Path(words[0]))


def plan_of(words: Sequence[str], options: argparse.Namespace) -> DryRun:
    """Return the plan of a launch file; raises UsageError."""
    return DryRun(**_planned(words, options))


def read_saved(file: Path) -> DryRun:
    """Read a saved plan; raises ``UsageError`` unless it is the JSON of a dry run of this version."""
    return _saved(file)[1]


def planned_file(words: Sequence[str], options: argparse.Namespace, plan: DryRun) -> str:
    """Return the launch file that ``words`` name; of a saved plan, the file of what it starts first, else itself."""
    if is_saved_plan(words):
        return next((each.launch_file for each in plan.launched), words[0])
    return find_target(words, search_prefixes(options.prefix)).launch_file


def _planned(words: Sequence[str], options: argparse.Namespace) -> Mapping[str, Any]:
    target = find_target(words, search_prefixes(options.prefix))
    here = os.getcwd()
    try:
        with stdout_is_for_the_plan():
            plan = resolve(target.launch_file, target.arguments, options=_resolving(options))
    finally:
        os.chdir(here)  # code of the launch file may have changed it, and our options are relative to it
    return plan_document(plan)


_SAVE = "try: secure-plan show --format json PACKAGE LAUNCH_FILE > plan.json"


def _resolving(options: argparse.Namespace) -> ResolveOptions:
    return replace(resolve_options(options), progress=progress("analysing", quiet=options.quiet))


def _saved(file: Path) -> tuple[Mapping[str, Any], DryRun]:
    try:
        document: Mapping[str, Any] = json.loads(read_text(file, limit=LARGEST_PLAN))
        if not isinstance(document, dict):
            raise ValueError("not an object")
        plan = DryRun(**document)
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}") from error
    except ValidationError as error:
        place = ".".join(map(str, error.errors()[0]["loc"]))
        raise UsageError(
            f"{file} is not the JSON of secure-launch --dry-run: {place!r} is missing or not as it should be\n{_SAVE}"
        ) from error
    except (TypeError, ValueError, RecursionError) as error:
        what = (
            f"line {error.lineno} is not JSON"
            if isinstance(error, json.JSONDecodeError)
            else "no plan is in it"
        )
        raise UsageError(f"{file} is not the JSON of secure-launch --dry-run: {what}\n{_SAVE}") from error
    _refuse_misfits(plan, file)
    return document, plan


def _refuse_misfits(plan: DryRun, file: Path) -> None:
    """Raise ``UsageError`` if a process, component or node is in an enclave that the plan does not have."""
    named = [(f"process {one.fqn or one.executable}", one.enclave) for one in plan.processes]
    named += [(f"component {one.fqn}", one.enclave) for one in plan.components]
    named += [(f"node {one.fqn}", one.enclave) for one in plan.nodes]
    for what, enclave in named:
        if enclave is not None and enclave not in plan.enclaves:
            raise UsageError(
                f"{file} does not fit together: {what} is in enclave {enclave}, which is not among its enclaves; "
                "write it again with secure-launch --dry-run --format json"
            )
