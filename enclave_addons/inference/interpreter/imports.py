"""Imports: analysed modules are executed once per run, everything else becomes ``External``."""

from __future__ import annotations

import ast
import os

from enclave_addons.inference.interpreter.elements import elements
from enclave_addons.inference.interpreter.run import Run
from enclave_addons.inference.program import SourceModule
from enclave_addons.inference.values import Frame, ModuleValue, Value, external, sole
from nodl.source_ref import SourceRef


def run_import(run: Run, node: ast.Import, frame: Frame) -> bool:
    """Run ``import``: bind the module to its ``as`` name; without one, bind the top package to its own."""
    for alias in node.names:
        whole = import_module(run, alias.name, frame)
        if alias.asname:
            run.assign_name(alias.asname, whole, frame)
        else:
            top = alias.name.partition(".")[0]
            run.assign_name(top, import_module(run, top, frame), frame)
    return True


def run_import_from(run: Run, node: ast.ImportFrom, frame: Frame) -> bool:
    """Run ``from ... import``: bind each name to what the module holds; ``*`` of a library goes to ``stars``."""
    base = absolute_name(node, frame.module.source)
    module = import_module(run, base, frame) if base else external("")
    for alias in node.names:
        if alias.name == "*":
            _import_star(run, module, base, node, frame)
            continue
        value = member(run, module, base, alias.name, frame)
        run.assign_name(alias.asname or alias.name, value, frame)
    return True


def absolute_name(node: ast.ImportFrom, source: SourceModule) -> str:
    """Return the absolute name of the module that ``from ... import`` names."""
    if not node.level:
        return node.module or ""
    package = source.package()
    for _ in range(node.level - 1):
        package = package.rpartition(".")[0]
    return ".".join(part for part in (package, node.module) if part)


def member(run: Run, module: Value, base: str, name: str, frame: Frame) -> Value:
    """Return what a module holds under ``name``, or its submodule; an ``External`` where neither is found."""
    atom = module[0]
    if not isinstance(atom, ModuleValue):
        inner = f"{base}.{name}" if base else name
        found = _load(run, inner, frame)
        return (found,) if found else external(inner)
    if name in atom.cells:
        return atom.cells[name]
    if name != "__path__":
        found = _load(run, f"{atom.source.name}.{name}", frame)
        if found is not None:
            return (found,)
    if len(atom.stars) == 1:
        return external(f"{atom.stars[0]}.{name}")
    return external(f"{atom.source.name}.{name}")


def _import_star(run: Run, module: Value, base: str, node: ast.ImportFrom, frame: Frame) -> None:
    atom = module[0]
    if not isinstance(atom, ModuleValue):
        if base not in frame.module.stars:
            frame.module.stars.append(base)
        return
    listed = atom.cells.get("__all__")
    if listed is not None:
        items = elements(run, listed, node, frame).exact
        names = [name for name in map(sole, items or ()) if isinstance(name, str)]
        for name in names:
            run.assign_name(name, member(run, module, base, name, frame), frame)
        if items is not None and len(names) == len(items):
            return
        run.gap(node, frame, f"which names {base} gives is not known: its __all__ is made at run time")
    for star in atom.stars:
        if star not in frame.module.stars:
            frame.module.stars.append(star)
    for key, value in list(atom.cells.items()):
        if isinstance(key, str) and not key.startswith(("_", "[")):
            run.assign_name(key, value, frame)


def import_module(run: Run, name: str, frame: Frame) -> Value:
    """Return the module called ``name``, executed if it is new; submodules execute their packages first."""
    found = _load(run, name, frame)
    return external(name) if found is None else (found,)


def _load(run: Run, name: str, frame: Frame) -> ModuleValue | None:
    known = run.modules.get(name)
    if known is not None:
        return known
    package, _, last = name.rpartition(".")
    path = run.program.find(name, run.beside)
    if path is None:
        folder = os.path.dirname(frame.module.source.path)
        if package and frame.module.source.package() == package and not frame.module.source.is_package:
            path = run.program.find(last, folder)  # a relative import in a folder without __init__.py
    if path is None:
        return None
    parent = _load(run, package, frame) if package else None
    source = run.program.load(path, name)
    module = execute_module(run, source, name)
    if parent is not None:
        run.state.write(parent.cells, last, (module,))
    return module


def execute_module(run: Run, source: SourceModule, name: str) -> ModuleValue:
    """Run the top level of a file as module ``name``."""
    module = ModuleValue(source)
    run.modules[name] = module
    module.cells["__name__"] = (name,)
    module.cells["__file__"] = (source.path,)
    if source.error:
        run.findings.gap(SourceRef(source.path, source.error_line), f"the file {source.error}")
        return module
    body = Frame(module, module.cells, None, run.state.depth)
    body.forks = body.loop_forks = run.state.forks
    previous = run.enter(("module", name))
    run.execute(source.tree.body, body)
    run.context = previous
    if body.early or body.unsettled:
        run.state.join_seen(0, None)
    return module
