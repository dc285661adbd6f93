"""Look into the library of manifests of widely used packages: list, show, check."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator

from enclave_addons.library import Hit, Library
from enclave_addons.library.document import LibraryDocument
from enclave_common.command_line import TEXT, TEXTS, FromProject, Option
from enclave_common.terminal import printable
from enclave_common.words import did_you_mean
from nodl.ament_index import package_version, search_prefixes
from nodl.verb import PREFIX, Verb
from nodl.verb.show import description_lines

LIBRARY: Option = (
    "--library DIR",
    {**TEXTS, "configured": FromProject("library")},
    "documents of your own, which come first",
)
LIST: tuple[Option, ...] = (("packages PACKAGE", {"nargs": "*"}, "only these"), LIBRARY)
PROGRAM: tuple[Option, ...] = (
    ("package PACKAGE", TEXT, "its package"),
    ("name EXECUTABLE|PLUGIN", TEXT, "the program or the class of a component"),
    ("--distro", {"default": ""}, "ROS distribution (default: any)"),
    PREFIX,
    LIBRARY,
)
CHECK: tuple[Option, ...] = (
    ("sources DIR", TEXT, "a folder with packages, such as a workspace's src"),
    LIBRARY,
)


def _list(arguments: argparse.Namespace) -> int:
    wanted = arguments.packages
    found = [each for each in Library(arguments.library).documents() if not wanted or each.package in wanted]
    for document in found:
        print("\t".join(map(printable, _row(document))))
    if not found:
        print("the library has no document of that", file=sys.stderr)
    return 0 if found else 1


def _row(document: LibraryDocument) -> Iterator[str]:
    yield document.package
    yield " ".join((*document.programs, *document.classes)) or document.stem.partition("/")[2]
    yield " ".join(f"{distro} {series}" for distro, series in document.versions.items())
    yield f"{document.evidence.how} at {document.evidence.version}"


def _show(arguments: argparse.Namespace) -> int:
    hit = _found(arguments)
    if hit is None:
        return 1
    for line in (*description_lines(hit.document.interface), *_evidence(hit.document)):
        print(printable(line))
    if hit.doubt:
        print(hit.doubt, file=sys.stderr)
    return 0


def _found(arguments: argparse.Namespace) -> Hit | None:
    library = Library(arguments.library)
    version = package_version(arguments.package, search_prefixes(arguments.prefix))
    hit = library.find(arguments.package, arguments.name, distro=arguments.distro, version=version)
    recorded = library.recorded(arguments.package, arguments.name, distro=arguments.distro, version=version)
    hit = hit or next(iter(recorded), None) or library.of_class(arguments.name, distro=arguments.distro)
    if hit is None:
        known = {each.package: each for each in library.documents()}
        programs = [
            name
            for each in library.documents()
            if each.package == arguments.package
            for name in each.programs
        ]
        meant = did_you_mean(arguments.name, programs) if programs else did_you_mean(arguments.package, known)
        print(f"the library has no document of {arguments.package}/{arguments.name}{meant}", file=sys.stderr)
        print("try: secure-nodl library list", file=sys.stderr)
    return hit


def _evidence(document: LibraryDocument) -> Iterable[str]:
    evidence = document.evidence
    yield f"  {'known from':14} {evidence.how}: {evidence.repository} {evidence.version} ({evidence.commit})"
    if document.versions:
        yield f"  {'holds for':14} {', '.join(f'{d} {series}' for d, series in document.versions.items())}"
    yield f"  {'file':14} {document.file}"
    for text in evidence.missing:
        yield f"  {'left out':14} {text}"
    for text in evidence.differs:
        yield f"  {'analysis':14} {text}"


def _check(arguments: argparse.Namespace) -> int:
    from enclave_addons.library.check import check  # an add-on: inference

    verdicts = check(Library(arguments.library), arguments.sources)
    for verdict in verdicts:
        print("\n".join(printable(line) for line in str(verdict).splitlines()))
    if not verdicts:
        print(f"no package of the library is in {arguments.sources}", file=sys.stderr)
        return 1
    return 1 if any(verdict.is_wrong for verdict in verdicts) else 0


OPTIONS = ()
VERBS: dict[str, Verb] = {
    "list": Verb(_list, LIST, "List the documents: what each describes, for which versions."),
    "show": Verb(_show, PROGRAM, "Print what a document says, where that comes from, and its file."),
    "check": Verb(_check, CHECK, "Compare the documents with the sources in a folder."),
}
