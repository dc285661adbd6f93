"""Learnt interfaces of one node → the text of a NoDL v2 document, merged with its previous text. Performs no I/O.

NoDL v2 has no place for a name that comes from a parameter, nor for runs: they are in our section of ``codegen``
(``nodl.document.v2``), beside a standard entry under the name that was seen. Nothing is removed from a document
because it was not seen: entries, descriptions and parameters that stand there stay.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import yaml

from enclave_addons.recording.record.learning import LearntEndpoint, LearntNode
from enclave_addons.recording.record.origins import Source
from enclave_common.yaml_reader import load_yaml
from nodl.document.v2_learnt import ONE_RUN
from nodl.document.v2_schema import NAME_PATTERN
from nodl.document.v2_section import CATEGORIES, IDENTITY_KEY
from nodl.node_interface import ClientLibrary

_HEAD = "# Learnt by secure-launch --learn from what the node requested of librcl; see docs/recording.md.\n"
_HISTORY = {0: "SYSTEM_DEFAULT", 1: "KEEP_LAST", 2: "KEEP_ALL"}
_RELIABILITY = {0: "SYSTEM_DEFAULT", 1: "RELIABLE", 2: "BEST_EFFORT", 4: "BEST_AVAILABLE"}
_DURABILITY = {0: "SYSTEM_DEFAULT", 1: "TRANSIENT_LOCAL", 2: "VOLATILE", 4: "BEST_AVAILABLE"}


OBSERVED_HEAD = (
    "# Observed by secure-nodl observe in the graph of a running system; see docs/running-systems.md.\n"
)


def manifest_text(node: LearntNode, before: str = "", head: str = _HEAD) -> str:
    """Return the document of ``node``, joined with the text ``before``; raises ``yaml.YAMLError`` for that."""
    old = load_yaml(before) if before.strip() else None
    document = _united(_document(node), old if isinstance(old, dict) else {})
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    notes = "".join(f"# {_line(text)}\n" for text in (*node.incomplete, *node.notes))
    text = yaml.dump(document, Dumper=dumper, sort_keys=False, width=110, allow_unicode=True)
    return f"{head}{notes}{text}"


def manifest_file_name(node: LearntNode, alone: bool) -> str:
    """Return ``PACKAGE__PROGRAM.nodl.yaml``; with the node's name if it is not ``alone`` in its program."""
    key = node.key
    program = (key.plugin or key.executable).replace("::", ".")
    name = f"{key.package}__{program}" if key.package else program
    return f"{_safe(name if alone else f'{name}.{key.node}')}.nodl.yaml"


def _safe(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.+-]", "_", text)


def _line(text: str) -> str:
    return " ".join(text.split())


def _document(node: LearntNode) -> dict[str, Any]:
    document: dict[str, Any] = {"nodl_version": 2, "codegen": {IDENTITY_KEY: _section(node)}}
    for category, kind in CATEGORIES.items():
        entries = [entry for entry in node.entries if entry.kind is kind]
        listed = [_entry(entry) for entry in entries]
        if listed:
            document[category] = list({each["name"]: each for each in listed}.values())
    return document


def _section(node: LearntNode) -> dict[str, Any]:
    key = node.key
    section: dict[str, Any] = {
        "package": key.package,
        "executable": key.executable,
        "plugin": key.plugin,
        "node": key.node,
        "namespace": key.namespace,
        "library": node.library.value if node.library is not ClientLibrary.UNKNOWN else "",
        "lifecycle": node.lifecycle,
        "logger_services": node.logger_services,
        "random_name": node.random_name,
        "tf_listener": node.tf_listener,
        "incomplete": [_line(text) for text in node.incomplete],
        "runs": [_run(run._asdict()) for run in node.runs],
        "endpoints": [_about(entry) for entry in node.entries],
    }
    return {name: value for name, value in section.items() if value}


def _run(fields: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if value}


def _entry(entry: LearntEndpoint) -> dict[str, Any]:
    fields: dict[str, Any] = {"name": _plain_name(entry), "type": entry.type}
    if entry.kind.family == "topic":
        fields["qos"] = _quality(entry.qos)
    return fields


def _plain_name(entry: LearntEndpoint) -> str:
    """Return what NoDL v2 lets a name be; ``written`` in our section has the source's if that is something else."""
    if re.search(NAME_PATTERN, entry.name):
        return entry.name
    return "unwritable_" + re.sub(r"[^A-Za-z0-9]+", "_", entry.name).strip("_")


def _quality(qos: tuple[int, ...]) -> dict[str, Any]:
    history, depth, reliability, durability = qos if len(qos) == 4 else (0, 0, 0, 0)
    fields: dict[str, Any] = {"history": _HISTORY.get(history, "SYSTEM_DEFAULT")}
    if fields["history"] == "KEEP_LAST":
        fields["depth"] = max(1, depth)
    fields["reliability"] = _RELIABILITY.get(reliability, "SYSTEM_DEFAULT")
    fields["durability"] = _DURABILITY.get(durability, "SYSTEM_DEFAULT")
    return fields


def _about(entry: LearntEndpoint) -> dict[str, Any]:
    name, origin = _plain_name(entry), entry.origin
    fields: dict[str, Any] = {"in": entry.kind.category, "name": name}
    if name != entry.name:
        fields["written"] = entry.name
    if origin.source:
        fields["parameter"] = origin.source.parameter
        fields["each"] = origin.source.each
        fields["suffix"] = origin.source.suffix or None
        fields["prefix"] = origin.source.prefix or None
        fields["default"] = origin.default
        fields["proof"] = "another value was followed" if origin.proven else ONE_RUN
        fields["seen"] = [] if origin.proven else list(entry.seen)
    if origin.undecided or entry.spellings or entry.readings:
        fields["undecided"] = [*map(str, origin.candidates), *entry.spellings, *entry.readings]
    fields["readings"] = list(entry.readings)
    fields["candidates"] = [
        {name: value for name, value in each._asdict().items() if value} for each in origin.candidates
    ]
    fields["introspection"] = entry.introspected
    fields["runs"] = list(entry.runs)
    return {name: value for name, value in fields.items() if value not in (None, False, [])}


def _united(new: dict[str, Any], old: Mapping[str, Any]) -> dict[str, Any]:
    united = {**{key: value for key, value in old.items() if key not in new}, **new}
    section = _section_of(new)
    ours, theirs = section.get("endpoints", []), _section_of(old).get("endpoints", [])
    runs = {run["id"] for run in section.get("runs", []) if "id" in run}
    known = {(each["in"], each["name"]) for each in ours}
    learnt_again = {(e.get("in"), e.get("name")) for e in theirs if runs.issuperset(e.get("runs") or ["?"])}
    seen_elsewhere = {
        (e.get("in"), e.get("name")): e for e in theirs if (e.get("in"), e.get("name")) not in learnt_again
    }
    for category in CATEGORIES:
        dropped = {name for listed, name in learnt_again - known if listed == category}
        elsewhere = {name for listed, name in seen_elsewhere if listed == category}
        united_list = _united_entries(new.get(category), old.get(category), dropped, elsewhere)
        united.pop(category, None)
        if united_list:
            united[category] = united_list
    gone = known | learnt_again
    ours = [
        _with_other_runs(each, other) if (other := seen_elsewhere.get((each["in"], each["name"]))) else each
        for each in ours
    ]
    section["endpoints"] = [*ours, *(e for e in theirs if (e.get("in"), e.get("name")) not in gone)]
    section["runs"] = _united_runs(section.get("runs", []), _section_of(old).get("runs", []))
    others = old.get("codegen")
    united["codegen"] = {**(others if isinstance(others, dict) else {}), IDENTITY_KEY: section}
    order = ["nodl_version", "description", "codegen", "include", "parameters", *CATEGORIES]
    return {key: united[key] for key in order if key in united}


def _section_of(document: Mapping[str, Any]) -> dict[str, Any]:
    codegen = document.get("codegen")
    section = codegen.get(IDENTITY_KEY) if isinstance(codegen, dict) else None
    return section if isinstance(section, dict) else {}


_SOURCE = ("parameter", "each", "suffix", "prefix")


def _with_other_runs(new: dict[str, Any], old: Mapping[str, Any]) -> dict[str, Any]:
    """Return the row united with ``old``, of other runs: where a run proved the source, that holds, else both."""
    if not old.get("runs"):
        return {**new, **old}
    runs = sorted({*old["runs"], *new["runs"]})
    proofs = [each.get("proof") not in (None, ONE_RUN) for each in (new, old)]
    first, other = (old, new) if proofs == [False, True] else (new, old)
    possible = [*_possible(first), *(each for each in _possible(other) if each not in _possible(first))]
    known = {name: first[name] for name in _SOURCE if name in first}
    candidates = [] if any(proofs) else [each for each in possible if each != known]
    united = {**first, "runs": runs}
    if any(proofs) and not _possible(new) and not {"suffix", "prefix", "each"} & known.keys():
        united.setdefault("default", new.get("written", new["name"]))  # seen where nothing is set
    if len(_possible(first)) < len(possible) and candidates:
        united["candidates"] = candidates
        united["undecided"] = [str(Source(**each)) for each in candidates]
    return united


def _possible(row: Mapping[str, Any]) -> list[dict[str, Any]]:
    own = {name: row[name] for name in _SOURCE if name in row}
    return [*([own] if own else []), *row.get("candidates", ())]


def _united_entries(new: Any, old: Any, dropped: set[Any], elsewhere: set[Any]) -> list[dict[str, Any]]:
    """Return the entries of both; ``dropped``: explained differently before, unless seen ``elsewhere``."""
    ours = list(new or ())
    theirs = {each["name"]: each for each in old or () if isinstance(each, dict) and "name" in each}
    kept = [{**theirs.get(each["name"], {}), **each} for each in ours]
    for each in kept:
        quality = theirs.get(each["name"], {}).get("qos")
        if each["name"] in elsewhere and isinstance(quality, dict) and "qos" in each:
            each["qos"] = _common_quality(each["qos"], quality)
    names = {each["name"] for each in ours} | dropped
    return [*kept, *(each for name, each in theirs.items() if name not in names)]


def _common_quality(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> dict[str, Any]:
    """Return what both have; the system's default where they differ, as a parameter may decide it."""
    same = {name: ours[name] == theirs.get(name) for name in ours}
    common = {name: ours[name] if same[name] else "SYSTEM_DEFAULT" for name in ours if name != "depth"}
    if common["history"] == "KEEP_LAST":
        common["depth"] = ours["depth"]
    return common


def _united_runs(new: Iterable[Any], old: Iterable[Any]) -> list[Any]:
    runs = {run.get("id"): run for run in (*old, *new) if isinstance(run, dict)}
    return [runs[key] for key in sorted(runs, key=str)]
