"""Our section of a NoDL v2 document, ``codegen.enclave_launch``: its rules, and its reading (docs/library.md)."""

from __future__ import annotations

from typing import Any

from nodl.builtin_interfaces import DISTROS
from nodl.dependence import (
    Configuration,
    Dependence,
    FurtherNode,
    PluginList,
    StatedGap,
    Test,
    Transport,
    Variation,
    When,
)
from nodl.document.checks import Checker, anything, boolean, either, list_of, map_of, one_of, text_of
from nodl.node_interface import EndpointKind
from nodl.yaml_text import YamlMap, YamlScalar, YamlValue, plain

IDENTITY_KEY = "enclave_launch"

CATEGORIES = {kind.category: kind for kind in EndpointKind}
_SIDES = ("publishers", "subscriptions")


def _scalar(value: YamlValue, what: str) -> None:
    if not isinstance(value, YamlScalar) or value.value is None:
        text_of()(value, what)


_TEST = either(
    map_of({"not": either(list_of(_scalar), _scalar)}, required=("not",)),
    map_of({"contains": either(list_of(_scalar), _scalar)}, required=("contains",)),
    map_of({"set": boolean}, required=("set",)),
    list_of(_scalar),
    _scalar,
)
_WHEN = either(list_of(map_of(others=_TEST), minimum=1), map_of(others=_TEST))
_DISTRO = one_of(*DISTROS)
_CONDITION: dict[str, Checker] = {"when": _WHEN, "since": _DISTRO, "until": _DISTRO}
_TEXTS = list_of(text_of())
_VARIATION = map_of({"name": text_of(), "each": text_of(), **_CONDITION})
_NODE = map_of(
    {"document": text_of(), "node": text_of(), "namespace": text_of(), "renamed": boolean, **_CONDITION},
    required=("document", "node"),
)
_PLUGINS = map_of(
    {
        "parameter": text_of(),
        "default": _TEXTS,
        "type": text_of(),
        "types": map_of(others=text_of()),
        "class": text_of(),
        "always": _TEXTS,
        "without": text_of(),
        "spawned": boolean,
        **_CONDITION,
    },
    required=("parameter",),
)
_TRANSPORT = map_of(
    {"side": one_of(*_SIDES), "base": text_of(), "parameter": text_of(), "each": text_of(), **_CONDITION},
    required=("side", "base"),
)
_CONFIGURATION = map_of(
    {"kind": text_of(), "file": text_of(), "document": text_of(), **_CONDITION}, required=("kind",)
)
_GAP = map_of({"why": text_of(), "each": text_of(), **_CONDITION}, required=("why",))
_EVIDENCE = map_of(
    {
        "repository": text_of(),
        "version": text_of(),
        "commit": text_of(r"^[0-9a-f]{7,40}$", "the hash of a commit"),
        "how": one_of("recorded", "source read", "inferred"),
        "missing": _TEXTS,
        "differs": _TEXTS,
    },
    required=("repository", "version", "commit", "how"),
)
_LEARNT_ENDPOINT = map_of(
    {
        "in": one_of(*CATEGORIES),
        "name": text_of(),
        "written": text_of(),
        "parameter": text_of(),
        "each": boolean,
        "suffix": text_of(),
        "prefix": text_of(),
        "default": text_of(),
        "proof": text_of(),
        "undecided": _TEXTS,
        "readings": _TEXTS,
        "seen": _TEXTS,
        "candidates": list_of(
            map_of(
                {"parameter": text_of(), "each": boolean, "suffix": text_of(), "prefix": text_of()},
                required=("parameter",),
            )
        ),
        "introspection": boolean,
        "runs": _TEXTS,
    },
    required=("in", "name"),
)
SECTION = map_of(
    {
        "package": text_of(),
        "logger_services": boolean,
        "incomplete": _TEXTS,
        "runs": list_of(map_of(others=anything)),
        "endpoints": list_of(_LEARNT_ENDPOINT),
        "node": text_of(),
        "namespace": text_of(),
        "executable": text_of(),
        "plugin": text_of(),
        "library": one_of("rclcpp", "rclpy"),
        "lifecycle": boolean,
        "parameter_services": boolean,
        "source_digest": text_of(),
        "also": _TEXTS,
        "classes": _TEXTS,
        "own_node": boolean,
        "random_name": boolean,
        "all_parameters": boolean,
        "tf_listener": either(map_of(_CONDITION), boolean),
        "node_name": text_of(),
        "options": map_of(others=_TEXTS),
        "names": map_of({category: map_of(others=_VARIATION) for category in CATEGORIES}),
        "nodes": list_of(_NODE),
        "plugins": list_of(_PLUGINS),
        "transports": list_of(_TRANSPORT),
        "configurations": list_of(_CONFIGURATION),
        "gaps": list_of(_GAP),
        "transport": text_of(),
        "versions": map_of({distro: text_of() for distro in DISTROS}),
        "evidence": _EVIDENCE,
    }
)
_DEPENDENT = frozenset(
    (
        *("own_node", "random_name", "tf_listener", "node_name", "options", "names"),
        *("nodes", "plugins", "transports", "configurations", "gaps"),
    )
)


def section_of(root: YamlMap) -> YamlMap:
    """Return our section of a checked document, empty if it has none."""
    return root.mapping("codegen").mapping(IDENTITY_KEY)


def dependence_of(root: YamlMap) -> Dependence | None:
    """Return what varies, None if nothing does. ``root`` is a checked document."""
    section = section_of(root)
    if _DEPENDENT.isdisjoint(section.items):
        return None
    names = section.mapping("names")
    rows = {
        field: tuple(_row(kind, each) for each in section.mappings(field)) for field, kind in _ROWS.items()
    }
    return Dependence(
        variations={
            (CATEGORIES[category], name): _row(Variation, names.mapping(category).mapping(name))
            for category in names.items
            for name in names.mapping(category).items
        },
        defaults=_defaults(root),
        options={name: section.mapping("options").texts(name) for name in section.mapping("options").items},
        node_name=section.text("node_name"),
        random_name=section.scalar("random_name") is True,
        own_node=section.scalar("own_node") is True,
        tf_listener=_tf_listener(section),
        **rows,
    )


_ROWS: dict[str, Any] = {
    "nodes": FurtherNode,
    "plugins": PluginList,
    "transports": Transport,
    "configurations": Configuration,
    "gaps": StatedGap,
}
"""The lists of our section, and of ``Dependence``: their rows have the fields of these."""
_FIELD_OF = {"class": "plugin_class"}


def _row(kind: Any, row: YamlMap) -> Any:
    """Return ``row`` as a ``kind``, with its condition as ``when``; what is left out or empty has its default."""
    given = {
        _FIELD_OF.get(key, key): plain(value) for key, value in row.items.items() if key not in _CONDITION
    }
    fields = {name: value or kind._field_defaults.get(name, value) for name, value in given.items()}
    listed = {name: tuple(value) for name, value in fields.items() if isinstance(value, list)}
    return kind(**{**fields, **listed}, when=_when(row))


def _tf_listener(section: YamlMap) -> When | None:
    is_made = "tf_listener" in section.items and section.scalar("tf_listener") is not False
    return _when(section.mapping("tf_listener")) if is_made else None


def _when(row: YamlMap) -> When:
    given = row.items.get("when")
    groups = [given] if isinstance(given, YamlMap) else row.mappings("when")
    return When(
        tuple(tuple(_test(name, plain(demand)) for name, demand in group.items.items()) for group in groups),
        row.text("since"),
        row.text("until"),
    )


def _test(parameter: str, demand: object) -> Test:
    if not isinstance(demand, dict):
        return Test(parameter, _values(demand))
    ((word, value),) = demand.items()
    if word == "set":
        return Test(parameter, is_set=True, negated=value is False)
    return Test(parameter, _values(value), contains=word == "contains", negated=word == "not")


def _values(value: object) -> tuple[str, ...]:
    """Return the values as they are compared: booleans as ROS writes them, all in small letters."""
    listed = value if isinstance(value, list) else [value]
    return tuple(str(each).lower() for each in listed)


def _defaults(root: YamlMap) -> dict[str, object]:
    parameters = root.mapping("parameters")
    given = {name: parameters.mapping(name).items.get("default_value") for name in parameters.items}
    found = {name: plain(value) for name, value in given.items() if value is not None}
    return {name: value for name, value in found.items() if value is not None}
