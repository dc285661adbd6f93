"""Objects that a library makes, known by the path of their class."""

from __future__ import annotations

from nodl.infer.interpreter.frames import Call
from nodl.infer.interpreter.run import Run
from nodl.infer.values import (
    External,
    Instance,
)


def library_instance(run: Run, call: Call, path: str) -> Instance:
    """The object of the library class ``path`` that this call makes; made twice it stands for all of them."""
    site = (call.source.file, call.source.line)
    instance = run.allocate(call.node, path, lambda: Instance(External(path), site))
    assert isinstance(instance, Instance)
    return instance
