"""Infer nodes and their interfaces from source: as text, JSON, or manifests to start from.

With -o it writes manifests of the nodes that a secured start would refuse: their source leaves something open (listed
under gaps), or no launch finds their source.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from enclave_addons.inference.executable import infer_executable
from enclave_addons.inference.reach import SourcesInReach
from enclave_addons.inference.report import written
from enclave_addons.inference.report.comparison import lacking, to_text
from enclave_addons.inference.report.v2_report import open_questions, program_key, to_v2
from enclave_addons.inference.report.written import ExpandedSystem, expand
from enclave_addons.inference.source_digest import source_digest
from enclave_addons.inference.start import Progress
from enclave_addons.inference.system import InferredSystem, infer_paths
from enclave_common.command_line import FLAG, PATH, Option
from enclave_common.source_location import SourceLocation
from enclave_common.terminal import counted_progress, printable
from enclave_common.words import counted, some_of
from nodl.ament_index import PackageNotFoundError, executables, package_prefix, search_prefixes
from nodl.lookup import ManifestLookup
from nodl.node_interface import Gap, NodeInterface
from nodl.verb import PREFIX, encodable, write_documents

OPTIONS: tuple[Option, ...] = (
    ("subjects PACKAGE|PATH", {"nargs": "+"}, "an installed package, or files and folders"),
    ("-o --output DIR", PATH, "write files into DIR"),
    ("--format", {"choices": ("text", "json", "v2")}, "text (default); with -o: v2"),
    ("--all", FLAG, "with -o: also write manifests of nodes that a plan reads from their source by itself"),
    ("--compare", FLAG,
     "say what installed manifests lack of that which the sources make; 1: something is missing"),
    PREFIX,
)  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Return 0 if nodes were found, 1 if none, 2 if a subject does not exist. Open questions go to standard error."""
    try:
        progress = counted_progress("reading programs:", quiet=args.quiet)
        system = _infer(args.subjects, search_prefixes(args.prefix), progress)
    except LookupError as error:
        print(f"secure-nodl infer: error: {error.args[0]}", file=sys.stderr)
        return 2
    if args.compare:
        return _compare(system, search_prefixes(args.prefix))

    expanded = expand(system)
    chosen = args.format or ("v2" if args.output else "text")
    documents = _documents(chosen, system, expanded, args)
    if chosen == "v2" and not args.quiet:
        _report_guesses(system)
    if args.output:
        write_documents(args.output, documents)
    else:
        sys.stdout.write(encodable("".join(documents.values())))
    if not system.nodes:
        searched = counted(len(system.files), "source file")
        print(f"secure-nodl infer: error: no node was found in {searched}", file=sys.stderr)
    if expanded.unresolved and (chosen not in ("text", "json") or args.output):
        print(f"{len(expanded.unresolved)} unresolved:", file=sys.stderr)
        for question in expanded.unresolved:
            print(printable(f"  {question.source}: {question.why}"), file=sys.stderr)
    return 0 if system.nodes else 1


def _report_guesses(system: InferredSystem) -> None:
    """Report guesses: a source file that nothing installs does not say which program it becomes."""
    for node in system.nodes:
        if node.executable is None and node.plugin is None and node.name:
            text = (
                f"note: which executable runs node {node.name} is not known; the manifest says {node.name!r}"
            )
            print(printable(f"{text}: correct it if that is not its name ({node.source})"), file=sys.stderr)


def _compare(system: InferredSystem, prefixes: Sequence[str]) -> int:
    lookup = ManifestLookup(prefixes)
    programs: dict[tuple[str, str | None, str | None], list[NodeInterface]] = {}
    for node in system.nodes:
        if node.package and (node.executable or node.plugin):
            programs.setdefault((node.package, node.executable, node.plugin), []).append(node)
    described, complete = 0, True
    for (package, executable, plugin), nodes in sorted(programs.items(), key=str):
        name = f"{package}/{executable or plugin}"
        by_executable = lookup.find(package, executable=executable) if executable else None
        manifest = by_executable or lookup.find(package, plugin=plugin or executable)
        if not manifest:
            print(printable(f"{name}: no manifest; looked at {', '.join(manifest.searched)}"))
            continue
        found = lacking(manifest.found, nodes)
        sys.stdout.write(encodable(to_text(name, found)))
        described, complete = described + 1, complete and not found.endpoints
    return 0 if described and complete else 1


def _documents(
    chosen: str, system: InferredSystem, expanded: ExpandedSystem, args: argparse.Namespace
) -> dict[str, str]:
    if chosen == "json":
        return {"inferred.json": written.to_json(expanded)}
    if chosen == "text":
        text = written.to_text(expanded)
        here = os.path.join(os.getcwd(), "")
        return {"inferred.txt": text.replace(here, "")}  # as a person would name the files
    nodes = _with_digests(system.nodes)
    return to_v2(nodes if args.all or not args.output else _refused(nodes, args))


def _with_digests(nodes: Sequence[NodeInterface]) -> list[NodeInterface]:
    programs: dict[object, list[NodeInterface]] = {}
    for node in nodes:
        programs.setdefault(program_key(node), []).append(node)
    digests = {key: source_digest(of_one) for key, of_one in programs.items()}
    return [node._replace(source_digest=digests[program_key(node)]) for node in nodes]


def _refused(nodes: Sequence[NodeInterface], args: argparse.Namespace) -> list[NodeInterface]:
    """Return the nodes that a secured start would refuse without a manifest: a copy of the others only grows old."""
    prefixes = search_prefixes(args.prefix)
    sources = SourcesInReach(prefixes)
    kept, known = [], []
    for node in nodes:
        questions = open_questions(node)
        who = f"{node.package or '-'}/{node.executable or node.plugin or node.name}"
        if questions and not args.quiet:
            text = f"note: {who} has {counted(len(questions), 'open question')}, under gaps in its manifest"
            print(printable(text), file=sys.stderr)
        if questions or not _is_read_by_a_plan(node, sources, prefixes):
            kept.append(node)
        else:
            known.append(who)
    if known:
        text = f"not written: {some_of(dict.fromkeys(known), 8)}: a plan reads this from the source by itself (--all)"
        print(printable(text), file=sys.stderr)
    return kept


def _is_read_by_a_plan(node: NodeInterface, sources: SourcesInReach, prefixes: Sequence[str]) -> bool:
    """Return whether a launch in this environment finds the source of ``node``."""
    if node.package is None or not (node.executable or node.plugin):
        return False
    return bool(
        infer_executable(node.package, node.executable, node.plugin, prefixes=prefixes, sources=sources)
    )


def _infer(subjects: list[str], prefixes: Sequence[str], progress: Progress | None = None) -> InferredSystem:
    """Infer paths together, so that they find each other's modules; packages by their executables."""
    paths = [subject for subject in subjects if os.path.exists(subject)]
    found = [infer_paths(paths, progress)] if paths else []
    found.extend(_infer_package(subject, prefixes) for subject in subjects if subject not in paths)
    return InferredSystem(
        tuple(node for each in found for node in each.nodes),
        tuple(gap for each in found for gap in each.gaps),
        tuple(file for each in found for file in each.files),
    )


def _infer_package(package: str, prefixes: Sequence[str]) -> InferredSystem:
    try:
        folder = Path(package_prefix(package, prefixes), "lib", package)
    except ValueError:
        raise LookupError(f"no such file or folder: {package}") from None
    except PackageNotFoundError as error:
        why = f"'{package}' is neither a file or folder nor an installed package: {error}"
        raise LookupError(why) from None
    programs = [os.path.join(folder, name) for name in executables(str(folder))]
    inferred = {path: infer_executable(package, Path(path).name, prefixes=prefixes) for path in programs}
    nodes = (node for each in inferred.values() for node in each.interfaces)
    gaps = (Gap(SourceLocation(path), each.why) for path, each in inferred.items() if not each)
    return InferredSystem(tuple(nodes), tuple(gaps), tuple(programs))
