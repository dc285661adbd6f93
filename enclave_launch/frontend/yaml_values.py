"""Plain values of YAML text, built from libyaml's events in one pass.

PyYAML makes a node of each event, tries its patterns on each scalar and runs a generator for each collection. Documents
without anchors, tags and merged mappings, which nearly all are, need none of that.
"""

from __future__ import annotations

import yaml

from enclave_launch.boundary.light import Any
from enclave_launch.frontend.yaml_scalar import UNDECIDED, plain


class NeedsNodes(ValueError):
    """What only PyYAML's nodes give, or an error that it words."""


def values_of(text: str, loader: Any) -> Any:
    """What ``loader``, one of PyYAML's own with libyaml, gives for ``text``.

    Raises ``NeedsNodes``, ``TypeError`` or ``yaml.YAMLError`` where it must be asked itself.
    """
    reader = loader(text)
    try:
        return _Values(reader).document()
    finally:
        reader.dispose()


class _Values:
    def __init__(self, loader: Any) -> None:
        self._loader = loader
        self._next = loader.get_event
        self._plain: dict[str, Any] = {}  # scalars met

    def document(self) -> Any:
        self._next()  # the stream starts
        if type(self._next()) is yaml.StreamEndEvent:
            return None
        value = self._value(self._next())
        self._next()  # the document ends
        if type(self._next()) is not yaml.StreamEndEvent:
            raise NeedsNodes("several documents")
        return value

    def _value(self, event: Any) -> Any:
        kind = type(event)
        if event.anchor is not None or event.tag is not None:
            raise NeedsNodes("an anchor, an alias or a tag")
        if kind is yaml.ScalarEvent:
            text: str = event.value
            if not event.implicit[0]:
                return text
            if text not in self._plain:
                self._plain[text] = self._plain_value(text)
            return self._plain[text]
        if kind is yaml.SequenceStartEvent:
            items = []
            while type(event := self._next()) is not yaml.SequenceEndEvent:
                items.append(self._value(event))
            return items
        found = {}
        while type(event := self._next()) is not yaml.MappingEndEvent:
            key = self._value(event)
            found[key] = self._value(self._next())
        return found

    def _plain_value(self, text: str) -> Any:
        value = plain(text)
        if value is not UNDECIDED:
            return value
        tag = self._loader.resolve(yaml.ScalarNode, text, (True, False))
        return self._loader.construct_object(yaml.ScalarNode(tag, text))
