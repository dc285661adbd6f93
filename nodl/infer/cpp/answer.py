"""What is said of one compiled program."""

from __future__ import annotations

from nodl.node_interface import NodeInterface


class CppSupportMissing(Exception):
    """tree-sitter is not installed: ``pip install enclave-launch[cpp]``."""


class Answer:
    """What the sources say of one program. ``consulted``: parameters of the launch decided what it makes."""

    def __init__(self, interfaces: tuple[NodeInterface, ...], why: str = "", consulted: bool = False):
        self.interfaces = interfaces
        self.why = why
        self.consulted = consulted
