"""Plans as the verbs are given them: a launch file with its arguments, or a saved dry run."""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from enclave_common.command_line import Option, one_of
from enclave_common.files import read_text
from enclave_common.terminal import stdout_is_for_the_plan
from enclave_launch.errors import UsageError
from enclave_launch.flow import resolve
from enclave_launch.report.plan_json import plan_document
from enclave_launch.verb.options import resolve_options
from enclave_launch.verb.target import find_target
from nodl.ament_index import search_prefixes

if TYPE_CHECKING:
    from enclave_launch.report.contract import DryRun

LARGEST_PLAN = 256 << 20  # bytes
WORDS = "PLAN.json | PACKAGE LAUNCH_FILE | PATH [name:=value ...]"
FORM: Option = ("--format", one_of("text", "json"), "how to print (text)")


def read_plan(words: Sequence[str], options: argparse.Namespace) -> Mapping[str, Any]:
    """Return the dry run's JSON document of the plan that ``words`` name; raises UsageError."""
    if is_saved_plan(words):
        return read_saved(Path(words[0]))
    return plan_of(words, options)


def is_saved_plan(words: Sequence[str]) -> bool:
    """Return True if ``words`` name the JSON of a dry run and no launch file."""
    return len(words) == 1 and words[0].endswith(".json")


def plan_of(words: Sequence[str], options: argparse.Namespace) -> Mapping[str, Any]:
    """Return the dry run's JSON document of a launch file; raises UsageError."""
    target = find_target(words, search_prefixes(options.prefix))
    with stdout_is_for_the_plan():
        plan = resolve(target.launch_file, target.arguments, options=resolve_options(options))
    return plan_document(plan)


def read_saved(file: Path) -> Mapping[str, Any]:
    """Raises ``UsageError`` for a file that cannot be read or is not the JSON of a dry run of this version."""
    from pydantic import ValidationError

    from enclave_launch.report.contract import DryRun

    try:
        document: Mapping[str, Any] = json.loads(read_text(file, limit=LARGEST_PLAN))
        plan = DryRun(**document)
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise UsageError(
            f"{file} is not the JSON of secure-launch --dry-run: {place}: {first['msg']}"
        ) from error
    except (TypeError, ValueError, RecursionError) as error:
        raise UsageError(f"{file} is not the JSON of secure-launch --dry-run: {error}") from error
    _refuse_misfits(plan, file)
    return document


def _refuse_misfits(plan: DryRun, file: Path) -> None:
    """Raises ``UsageError`` where a process, component or node is in an enclave that the plan does not have."""
    named = [(f"process {one.fqn or one.executable}", one.enclave) for one in plan.processes]
    named += [(f"component {one.fqn}", one.enclave) for one in plan.components]
    named += [(f"node {one.fqn}", one.enclave) for one in plan.nodes]
    for what, enclave in named:
        if enclave is not None and enclave not in plan.enclaves:
            raise UsageError(
                f"{file} does not fit together: {what} is in enclave {enclave}, which is not among its enclaves; "
                "write it again with secure-launch --dry-run --format json"
            )
