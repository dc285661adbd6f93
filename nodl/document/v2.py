"""NoDL v2 (YAML or JSON, ``nodl_version: 2``) -> ``ManifestNode``, its includes merged in.

A v2 document does not say who runs the node. The resource key ``<package>__<name>`` (or the file name
``<name>.nodl.yaml``) does: *name* is the executable and the node's name. Where that is not so, a section
of the opaque ``codegen`` says, which other tools ignore:

    codegen:
      enclave_launch: {package: demo, executable: talker, node: chatterbox, namespace: /demo, plugin: demo::Talker,
                       library: rclcpp, lifecycle: false}

What was learnt from runs stands there too (``v2_learnt``).
The same section may say what of the listed names depends on parameters and arguments: ``v2_section``.
Rules of includes, merging and collisions: ros-tooling/nodl, ``nodl_schema``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from enclave_common.source_location import SourceLocation
from nodl.document.v2_include import Included, follow_includes
from nodl.document.v2_learnt import LearntName, learnt_names, logger_services
from nodl.document.v2_schema import check_document, plain_types
from nodl.document.v2_section import CATEGORIES, dependence_of, section_of
from nodl.errors import InvalidElementError, InvalidNoDLDocumentError
from nodl.name_template import NameTemplate
from nodl.names import InvalidNameError, validate_namespace, validate_node_name, validate_written_name
from nodl.node_interface import ClientLibrary, Endpoint, EndpointKind, ManifestNode, NodeInterface
from nodl.yaml_text import YamlMap, parse_yaml

VERSION = 2
ANY_TYPE = "of any type"
"""The ``description`` of an entry whose type is a placeholder: nodes that pass on whatever they are given."""


def parse_v2(
    text: bytes, file: str, *, package: str | None, name: str, prefixes: Sequence[str] = ()
) -> ManifestNode:
    """Return the node of one document, registered as ``name``; reads included files. Raises ``InvalidNoDLError``."""
    return parse_root(
        check_document(parse_yaml(text, file)), file, package=package, name=name, prefixes=prefixes
    )


def parse_root(
    root: YamlMap, file: str, *, package: str | None, name: str, prefixes: Sequence[str] = ()
) -> ManifestNode:
    """Parse as ``parse_v2`` a document that was read and checked."""
    documents = (Included(file, root), *follow_includes(root, file, prefixes))
    section, parameters = section_of(root), _parameters(documents)
    interface = _identified(root, file, package, name)._replace(
        endpoints=(*_endpoints(documents, learnt_names(root)), *logger_services(root)),
        parameters=tuple(parameters),
        parameter_types=plain_types(parameters),
        depends=dependence_of(root),
        runs=len(section.listed("runs")),
        incomplete=section.texts("incomplete"),
        parameters_complete=section.scalar("all_parameters") is True,
    )
    included = tuple(document.file for document in documents[1:])
    explicit = not {"executable", "plugin"}.isdisjoint(section.items)
    return ManifestNode(interface, VERSION, parameters, explicit, included)


def _identified(root: YamlMap, file: str, package: str | None, name: str) -> NodeInterface:
    section = section_of(root)
    executable, plugin = section.text("executable") or None, section.text("plugin") or None
    if executable is None and plugin is None:
        executable, plugin = (None, name) if "::" in name else (name, None)
    node, namespace = section.text("node"), section.text("namespace")
    try:
        if node:
            validate_node_name(node)
        if namespace:
            validate_namespace(namespace)
    except InvalidNameError as error:
        raise InvalidElementError.at(section.source, str(error)) from None
    return NodeInterface(
        package=section.text("package") or package,
        executable=executable,
        plugin=plugin,
        name=node or _node_name_from(name),
        namespace=namespace or None,
        endpoints=(),
        source=SourceLocation(file, 1),
        library=ClientLibrary(section.text("library") or "unknown"),
        lifecycle=section.scalar("lifecycle") is True,
        parameter_services=section.scalar("parameter_services") is not False,
        source_digest=section.text("source_digest"),
    )


def _node_name_from(name: str) -> str | None:
    try:
        validate_node_name(name)
    except InvalidNameError:
        return None
    return name


def _endpoints(
    documents: Sequence[Included], learnt: Mapping[tuple[str, str], LearntName]
) -> Iterator[Endpoint]:
    for category, kind in CATEGORIES.items():
        seen: dict[str, SourceLocation] = {}
        for entry in (each for document in documents for each in document.root.mappings(category)):
            name, source, type_name = entry.text("name"), entry.items["name"].source, entry.text("type")
            try:
                validate_written_name(name)
            except InvalidNameError as error:
                raise InvalidElementError.at(source, str(error)) from None
            if name in seen:
                raise InvalidNoDLDocumentError.at(
                    source, f"'{name}' is listed twice under {category}, first at {seen[name]}"
                )
            seen[name] = source
            about = learnt.get((category, name), LearntName(NameTemplate.literal(name)))
            full_type = "" if _is_placeholder(entry, type_name) else _full_type(type_name, kind)
            introspected, qos = about.introspected, tuple(sorted(_qos(entry)))
            yield Endpoint(
                kind,
                about.template,
                full_type,
                source,
                introspected=introspected,
                qos=qos,
                note=about.note,
                readings=about.readings,
            )


_UNDECIDED = ("SYSTEM_DEFAULT", "BEST_AVAILABLE")
"""Values of QoS policies that are only known when the node runs."""


def _qos(entry: YamlMap) -> Iterator[tuple[str, str | int]]:
    given = entry.mapping("qos")
    for name in given.items:
        fixed = given.scalar(name)
        if isinstance(fixed, (str, int)) and fixed not in _UNDECIDED:
            yield name, fixed


def _is_placeholder(entry: YamlMap, type_name: str) -> bool:
    return entry.text("description") == ANY_TYPE or type_name.startswith("unknown/")


def _full_type(type_name: str, kind: EndpointKind) -> str:
    """Return ``std_msgs/msg/String`` for ``std_msgs/String``: the middle part may be omitted in v2."""
    package, _, rest = type_name.partition("/")
    return type_name if "/" in rest else f"{package}/{kind.type_folder}/{rest}"


def _parameters(documents: Sequence[Included]) -> dict[str, str]:
    found: dict[str, str] = {}
    first: dict[str, SourceLocation] = {}
    for document in documents:
        section = document.root.mapping("parameters")
        for name, source in section.keys.items():
            if name in found:
                raise InvalidNoDLDocumentError.at(
                    source, f"parameter '{name}' is declared twice, first at {first[name]}"
                )
            found[name] = section.mapping(name).text("type")
            first[name] = source
    return found
