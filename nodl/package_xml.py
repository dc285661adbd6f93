"""Read the ``package.xml`` of a package (REP 149)."""

from __future__ import annotations

import re
from os import PathLike
from pathlib import Path
from typing import NamedTuple

from enclave_common.files import read_bytes
from enclave_common.xml_tree import XmlElement
from nodl.errors import InvalidXMLError
from nodl.xml_text import parse_xml

PACKAGE_XML = "package.xml"
_VERSION = re.compile(r"[0-9]+(?:\.[0-9]+)*")


class PackageXml(NamedTuple):
    """The parts that are read; each is empty if the file does not have it.

    Attributes:
        build_types: Several if conditions choose between them.
        depends: Packages and rosdep keys, of every kind of dependency.
        plugins: Files that describe plugins, as written.
    """

    name: str = ""
    version: str = ""
    build_types: frozenset[str] = frozenset()
    depends: frozenset[str] = frozenset()
    plugins: tuple[str, ...] = ()


def read_package_xml(folder: str | PathLike[str]) -> PackageXml:
    """Read the ``package.xml`` in ``folder``; all parts are empty if there is none, or it cannot be read."""
    path = Path(folder, PACKAGE_XML)
    try:
        root = parse_xml(read_bytes(path), str(path))
    except (OSError, InvalidXMLError):
        return PackageXml()
    version = _first(root, "version")
    return PackageXml(
        _first(root, "name"),
        version if _VERSION.fullmatch(version) else "",
        frozenset(each.text.strip() for each in root.iter("build_type")),
        frozenset(each.text.strip() for each in root if each.tag.endswith("depend")),
        tuple(each.get("plugin") for each in root.iter() if each.get("plugin")),
    )


def _first(root: XmlElement, tag: str) -> str:
    return next((each.text.strip() for each in root.iter(tag)), "")
