"""One Python program, analysed from where it starts."""

from __future__ import annotations

from nodl.infer.analysis import failure, start, start_function, without_collector
from nodl.infer.interpreter.run import Run
from nodl.infer.net import unsettled_places
from nodl.infer.program import Program, ProgramTarget
from nodl.infer.results import interfaces_of
from nodl.infer.start import LaunchKey
from nodl.node_interface import Gap, NodeInterface
from nodl.source_ref import SourceRef


def infer_program(
    program: Program, target: ProgramTarget, path: str, origin: LaunchKey
) -> tuple[tuple[NodeInterface, ...], str]:
    """Return the nodes that the program behind ``path`` creates, with its gaps; without any, why none was found."""
    try:
        with without_collector():
            run = _run(program, target, path)
            interfaces = interfaces_of(run.findings, origin)
            for gap in unsettled_places(run):
                run.findings.gap(gap.source, gap.why)
    except Exception as error:  # a mistake of ours in one program must not end the plan of all
        return (), f"{path}: {failure(error)}"
    if interfaces:
        return _with_gaps(interfaces, run), ""
    reasons = "; ".join(f"{source}: {why}" for source, why in run.findings.gaps)
    return (), f"no node was found in {path}" + (f" ({reasons})" if reasons else "")


def _run(program: Program, target: ProgramTarget, path: str) -> Run:
    source = program.load(target.file, target.module)
    if target.function:
        return start_function(program, source, list(target.function))
    run = start(program, source)
    if target.missing:
        run.findings.gap(SourceRef(path), target.missing)
    return run


def _with_gaps(interfaces: list[NodeInterface], run: Run) -> tuple[NodeInterface, ...]:
    """Give gaps that belong to the whole program to its first node, so that nobody overlooks them."""
    gaps = tuple(Gap(source, why) for source, why in run.findings.gaps)
    first = interfaces[0]
    return (first._replace(gaps=(*first.gaps, *gaps)), *interfaces[1:])
