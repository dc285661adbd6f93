"""The functions of the Python package ``xacro`` that launch files call. They are used if it cannot be imported.

The program ``xacro`` does the work, as with ``$(command 'xacro ...')``: it is there where ROS has another Python than
this one. With ``--allow-missing-packages`` a marked placeholder stands for its output if it is not installed either.
Source: https://github.com/ros/xacro; its program writes what ``toprettyxml(indent='  ')`` gives.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import IO

from enclave_launch.host.current import current_host


class Document:
    """A description that ``process_file`` or ``process_doc`` made from a file."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.text: str | None = None

    def toxml(self, *_: object, **__: object) -> str:
        """Return the text of the description; raises RuntimeError if it was not processed."""
        if self.text is None:
            raise RuntimeError(
                f"xacro is not installed for this Python: {self.file} is read by process_doc()"
            )
        return self.text

    toprettyxml = toxml


def process_file(
    input_file_name: str | os.PathLike[str], *, mappings: Mapping[str, str] | None = None, **_: object
) -> Document:
    """Process a file with the values ``mappings``; raises RuntimeError with what xacro reports."""
    document = Document(os.fspath(input_file_name))
    process_doc(document, mappings=mappings)
    return document


def parse(inp: IO[str] | None, filename: str | os.PathLike[str] | None = None) -> Document:
    """Return the document of an open file, or of the file of that name, for ``process_doc``."""
    return Document(os.fspath(filename) if inp is None and filename is not None else getattr(inp, "name", ""))


def process_doc(doc: Document, *, mappings: Mapping[str, str] | None = None, **_: object) -> None:
    """Process a document that ``parse`` returned; raises RuntimeError with what xacro reports."""
    words = ["xacro", doc.file, *(f"{name}:={value}" for name, value in (mappings or {}).items())]
    try:
        result = current_host().run_command(words)
    except FileNotFoundError as error:
        raise ModuleNotFoundError(
            "No module named 'xacro', and no program of that name", name="xacro"
        ) from error
    if result.returncode != 0:
        raise RuntimeError(f"xacro {doc.file} failed: {result.stderr.strip()}")
    doc.text = result.stdout
