"""Our section of a NoDL v2 document, ``codegen.enclave_launch``: its rules, and its reading (docs/library.md)."""

from __future__ import annotations

from collections.abc import Mapping

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
from nodl.yaml_text import YamlList, YamlMap, YamlScalar, YamlValue

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


def section_of(root: YamlMap) -> YamlMap | None:
    """Return our section of a checked document."""
    codegen = root.items.get("codegen")
    ours = codegen.items.get(IDENTITY_KEY) if isinstance(codegen, YamlMap) else None
    return ours if isinstance(ours, YamlMap) else None


def dependence_of(root: YamlMap) -> Dependence | None:
    """Return what varies, None if nothing does. ``root`` is a checked document."""
    section = section_of(root)
    if section is None or _DEPENDENT.isdisjoint(section.items):
        return None
    given: Mapping[str, object] = plain(section)  # type: ignore[assignment]
    return Dependence(
        variations=_variations(given.get("names") or {}),
        nodes=tuple(
            FurtherNode(
                each["document"], each["node"], each.get("namespace", ""), _when(each), _true(each, "renamed")
            )
            for each in _maps(given, "nodes")
        ),
        plugins=tuple(_plugins(each) for each in _maps(given, "plugins")),
        transports=tuple(
            Transport(e["side"], e["base"], e.get("parameter", ""), _when(e), e.get("each", ""))
            for e in _maps(given, "transports")
        ),
        configurations=tuple(
            Configuration(each["kind"], each.get("file", ""), each.get("document", ""), _when(each))
            for each in _maps(given, "configurations")
        ),
        gaps=tuple(StatedGap(e["why"], e.get("each", ""), _when(e)) for e in _maps(given, "gaps")),
        defaults=_defaults(root),
        options=_options(given.get("options") or {}),
        node_name=str(given.get("node_name") or ""),
        random_name=given.get("random_name") is True,
        own_node=given.get("own_node") is True,
        tf_listener=_tf_listener(given.get("tf_listener")),
    )


def plain(value: YamlValue) -> object:
    """Return the value without its places."""
    if isinstance(value, YamlScalar):
        return value.value
    if isinstance(value, YamlList):
        return [plain(item) for item in value.items]
    return {name: plain(item) for name, item in value.items.items()}


def _tf_listener(given: object) -> When | None:
    if isinstance(given, dict):
        return _when(given)
    return When() if given is True else None


def _maps(given: Mapping[str, object], key: str) -> list[dict[str, str]]:
    return given.get(key) or []  # type: ignore[return-value]


def _options(options: object) -> dict[str, tuple[str, ...]]:
    assert isinstance(options, dict)
    return {name: tuple(spellings) for name, spellings in options.items()}


def _variations(names: object) -> dict[tuple[EndpointKind, str], Variation]:
    found: dict[tuple[EndpointKind, str], Variation] = {}
    assert isinstance(names, dict)
    for category, entries in names.items():
        for name, each in entries.items():
            variation = Variation(each.get("name", ""), each.get("each", ""), _when(each))
            found[CATEGORIES[category], name] = variation
    return found


def _plugins(each: Mapping[str, object]) -> PluginList:
    types = each.get("types") or {}
    assert isinstance(types, dict)
    return PluginList(
        parameter=str(each["parameter"]),
        default=_names(each, "default"),
        type=str(each.get("type") or PluginList("").type),
        types=types,
        when=_when(each),
        spawned=_true(each, "spawned"),
        plugin_class=str(each.get("class") or ""),
        always=_names(each, "always"),
        without=str(each.get("without") or ""),
    )


def _true(each: Mapping[str, object], key: str) -> bool:
    return each.get(key) is True


def _names(each: Mapping[str, object], key: str) -> tuple[str, ...]:
    listed = each.get(key) or ()
    assert isinstance(listed, (list, tuple))
    return tuple(listed)


def _when(each: Mapping[str, object]) -> When:
    given = each.get("when") or []
    groups: list[dict[str, object]] = given if isinstance(given, list) else [given]  # type: ignore[list-item]
    return When(
        tuple(tuple(_test(name, demand) for name, demand in group.items()) for group in groups),
        str(each.get("since") or ""),
        str(each.get("until") or ""),
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
    section = root.items.get("parameters")
    entries = section.items if isinstance(section, YamlMap) else {}
    found = {
        name: plain(definition.items["default_value"])
        for name, definition in entries.items()
        if isinstance(definition, YamlMap) and "default_value" in definition.items
    }
    return {name: value for name, value in found.items() if value is not None}
