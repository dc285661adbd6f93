"""Read from ``CMakeLists.txt`` what a package builds and installs.

These are targets with sources and links, registered components, plugin descriptions, and scripts. Reads files below the
package; runs nothing. Conditions are not decided, except tests (left out): both sides count. What sources are compiled
with is left to the build (``built``).
"""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from enclave_common.files import read_text
from nodl.package_xml import read_package_xml

SOURCES = (".cpp", ".cc", ".cxx", ".c++", ".C")
"""The suffixes of files that a C++ compiler gets."""
_SOURCE_SUFFIXES = (*SOURCES, ".cu")
_EXECUTABLES = frozenset({
    "add_executable", "ament_auto_add_executable", "rclcpp_add_executable", "qt5_add_executable", "qt6_add_executable",
    "qt_add_executable", "cuda_add_executable",
})  # fmt: skip
_LIBRARIES = frozenset({"add_library", "ament_auto_add_library", "cuda_add_library"})
_GLOB_OPTIONS = frozenset({"CONFIGURE_DEPENDS", "RELATIVE", "LIST_DIRECTORIES", "true", "false"})
_LIBRARY_WORDS = frozenset({
    "SHARED", "STATIC", "MODULE", "OBJECT", "INTERFACE", "EXCLUDE_FROM_ALL", "IMPORTED", "ALIAS", "GLOBAL", "UNKNOWN",
})  # fmt: skip


@dataclass
class Target:
    """An executable or library. ``links``: names as written, of this package or of others."""

    name: str
    executable: bool
    sources: list[str] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    automatic: bool = False  # ament_auto: links every library of the package


@dataclass
class Build:
    """``plugins``: class -> executable that is made for it; ``plugin_files``: descriptions for pluginlib."""

    targets: dict[str, Target] = field(default_factory=dict)
    plugins: dict[str, str | None] = field(default_factory=dict)
    plugin_targets: dict[str, str] = field(default_factory=dict)  # class -> library target
    plugin_files: list[str] = field(default_factory=list)
    includes: list[str] = field(default_factory=list)
    renamed: dict[str, str] = field(default_factory=dict)  # target -> OUTPUT_NAME
    # Header of generate_parameter_library -> YAML.
    parameter_files: dict[str, str] = field(default_factory=dict)
    scripts: dict[str, str] = field(default_factory=dict)  # executable -> file that is installed as it is
    # Path below include/ -> folder that is installed there.
    headers: dict[str, str] = field(default_factory=dict)

    @property
    def libraries(self) -> list[Target]:
        return [each for each in self.targets.values() if not each.executable]


def read_build(folder: str | None) -> Build:
    """Read the build of a package folder; an empty one without ``CMakeLists.txt``."""
    build = Build()
    if folder is not None:
        name = read_package_xml(folder).name
        BuildReader(build).read(folder, {"PROJECT_NAME": name, "CMAKE_PROJECT_NAME": name})
    return build


class BuildReader:
    """Runs the commands of a build; a command NAME that matters has a method ``_do_NAME``."""

    def __init__(self, build: Build):
        self.build = build
        self.functions: dict[str, tuple[bool, list[str], list[Command]]] = {}
        self.steps = 0
        self.included: list[str] = []  # files and folders that are being read

    def read(self, folder: str, variables: dict[str, str]) -> None:
        try:
            source = read_text(Path(folder, "CMakeLists.txt"), errors="replace")
        except OSError:
            return
        if folder in self.included:  # by itself: the folder's name is made of a variable that is not known
            return
        self.included.append(folder)
        variables = {**variables, "CMAKE_CURRENT_SOURCE_DIR": folder, "CMAKE_CURRENT_LIST_DIR": folder}
        variables.setdefault("CMAKE_SOURCE_DIR", folder)
        variables.setdefault("PROJECT_SOURCE_DIR", folder)
        self.run(list(commands(source)), variables)
        self.included.pop()

    def run(self, listed: Sequence[Command], variables: dict[str, str]) -> None:
        index = 0
        while index < len(listed):
            name, words = listed[index]
            self.steps += 1
            if self.steps > 20_000:
                return
            end = end_of_block(listed, index) if name in BLOCK_ENDS else index
            if end > index:
                self.block(name, words, listed[index + 1 : end], variables)
            elif name not in ("else", "elseif"):
                self.command(name, words, variables)
            index = end + 1

    def block(self, name: str, words: list[str], body: Sequence[Command], variables: dict[str, str]) -> None:
        if name in ("function", "macro"):
            self.functions[words[0].lower()] = (name == "function", words[1:], list(body))
        elif name == "foreach":
            given = expand(words, variables)
            items = [word for word in given[1:] if word not in ("IN", "ITEMS", "LISTS")]
            if "LISTS" in given:
                items = [part for word in items for part in variables.get(word, "").split(";") if part]
            for item in items:
                variables[given[0]] = item
                self.run(body, variables)
        elif name == "if":
            self._if(words, body, variables)

    def _if(self, words: list[str], body: Sequence[Command], variables: dict[str, str]) -> None:
        parts: list[tuple[list[str], list[Command]]] = [(words, [])]
        depth = 0
        for command in body:
            depth += (command[0] == "if") - (command[0] == "endif")
            if depth == 0 and command[0] in ("else", "elseif"):
                parts.append((command[1] if command[0] == "elseif" else ["ELSE"], []))
            else:
                parts[-1][1].append(command)
        for condition, inside in parts:
            known = condition_state(condition)
            if known is not False:
                self.run(inside, variables)
            if known is True:
                return

    def command(self, name: str, words: list[str], variables: dict[str, str]) -> None:
        given = expand(words, variables)
        used = {match for word in words for match in _VARIABLE.findall(word)}
        if name == "project" and not variables.keys() >= used:
            return  # a macro made the name of package.xml, which is what ament demands
        if name in self.functions:
            self._call(name, given, variables)
            return
        if not given:
            return
        if name in _EXECUTABLES | _LIBRARIES:
            self._target(name, given, variables)
        elif (handler := getattr(self, f"_do_{name}", None)) is not None:
            handler(given, variables)

    def _call(self, name: str, given: list[str], variables: dict[str, str]) -> None:
        own, parameters, body = self.functions[name]
        inner = dict(zip(parameters, given, strict=False))
        inner |= {"ARGN": ";".join(given[len(parameters) :]), "ARGV": ";".join(given)}
        inner |= {f"ARGV{index}": word for index, word in enumerate(given)}
        if own:
            variables = dict(variables)
        before = {parameter: variables.get(parameter, "") for parameter in inner}
        variables.update(inner)
        self.run(body, variables)
        variables.update(before)

    def _target(self, name: str, given: list[str], variables: dict[str, str]) -> None:
        if "IMPORTED" in given or "ALIAS" in given:
            return
        target = self.build.targets.setdefault(given[0], Target(given[0], name in _EXECUTABLES))
        target.automatic = name.startswith("ament_auto")
        words = given[1:]
        if target.automatic and "DIRECTORY" in words:
            folder = absolute(words[words.index("DIRECTORY") + 1], variables)
            found = [glob.glob(f"{folder}/**/*{suffix}", recursive=True) for suffix in _SOURCE_SUFFIXES]
            words = [file for files in found for file in sorted(files)]
        self._sources(target, words, variables)

    def _sources(self, target: Target, words: list[str], variables: dict[str, str]) -> None:
        for word in words:
            if word in _LIBRARY_WORDS or word in LINK_WORDS:
                continue
            if word.startswith("$<TARGET_OBJECTS:"):
                target.links.append(word[len("$<TARGET_OBJECTS:") :].rstrip(">"))
                continue
            file = absolute(word, variables)
            if not os.path.splitext(file)[1]:  # CMP0115: a name without its suffix
                file = next((file + each for each in _SOURCE_SUFFIXES if os.path.isfile(file + each)), file)
            if file.endswith(_SOURCE_SUFFIXES) and file not in target.sources:
                target.sources.append(file)

    # --- single commands --------------------------------------------------------------------------------

    def _do_set(self, given: list[str], variables: dict[str, str]) -> None:
        words = given[1 : given.index("CACHE")] if "CACHE" in given else given[1:]
        variables[given[0]] = ";".join(word for word in words if word != "PARENT_SCOPE")

    def _do_list(self, given: list[str], variables: dict[str, str]) -> None:
        before = [variables[given[1]]] if len(given) > 1 and variables.get(given[1]) else []
        if given[0] == "APPEND" and len(given) > 1:
            variables[given[1]] = ";".join([*before, *given[2:]])
        elif given[0] in ("INSERT", "PREPEND") and len(given) > 2:
            variables[given[1]] = ";".join([*given[2 + (given[0] == "INSERT") :], *before])

    def _do_cmake_parse_arguments(self, given: list[str], variables: dict[str, str]) -> None:
        """Parse ``PREFIX options one-value-words multi-value-words arguments...``; empty lists stay empty words."""
        if len(given) < 4:
            return
        prefix, single, several = given[0], given[2].split(";"), given[3].split(";")
        words = set(filter(None, [*given[1].split(";"), *single, *several]))
        found: dict[str, list[str]] = {}
        current = ""
        for word in given[4:]:
            if word in words:
                current = word
                found.setdefault(word, [])
            elif current:
                found[current].append(word)
        for name in words:
            variables[f"{prefix}_{name}"] = ";".join(found.get(name, []))

    def _do_project(self, given: list[str], variables: dict[str, str]) -> None:
        variables["PROJECT_NAME"] = variables["CMAKE_PROJECT_NAME"] = given[0]

    def _do_file(self, given: list[str], variables: dict[str, str]) -> None:
        if given[0] in ("GLOB", "GLOB_RECURSE") and len(given) > 2:
            patterns = [absolute(word, variables) for word in given[2:] if word not in _GLOB_OPTIONS]
            recursive = given[0] == "GLOB_RECURSE"  # elsewhere ** is what * is
            found = [
                glob.glob(recursive_pattern(each) if recursive else each, recursive=recursive)
                for each in patterns
                if near(each, variables)
            ]
            variables[given[1]] = ";".join(file for files in found for file in sorted(files))

    def _do_target_sources(self, given: list[str], variables: dict[str, str]) -> None:
        if given[0] in self.build.targets:
            self._sources(self.build.targets[given[0]], given[1:], variables)

    def _do_target_link_libraries(self, given: list[str], variables: dict[str, str]) -> None:
        if given[0] in self.build.targets:
            self.build.targets[given[0]].links += [w for w in given[1:] if w not in LINK_WORDS]

    def _do_add_subdirectory(self, given: list[str], variables: dict[str, str]) -> None:
        folder = absolute(given[0], variables)
        if os.path.basename(folder) not in ("test", "tests"):
            self.read(folder, variables)

    def _do_include(self, given: list[str], variables: dict[str, str]) -> None:
        """Include a file of the package, or a module in a folder of ``CMAKE_MODULE_PATH``."""
        folders = (".", *variables.get("CMAKE_MODULE_PATH", "").split(";"))
        names = (given[0], f"{given[0]}.cmake")
        paths = (absolute(os.path.join(folder, name), variables) for folder in folders for name in names)
        file = next((path for path in paths if os.path.isfile(path)), None)
        if file is None or file in self.included:
            return
        self.included.append(file)
        with suppress(OSError):
            listed = list(commands(read_text(file, errors="replace")))
            before = variables["CMAKE_CURRENT_LIST_DIR"]
            variables["CMAKE_CURRENT_LIST_DIR"] = os.path.dirname(file)
            self.run(listed, variables)
            variables["CMAKE_CURRENT_LIST_DIR"] = before
        self.included.pop()

    def _do_generate_parameter_library(self, given: list[str], variables: dict[str, str]) -> None:
        if len(given) > 1:
            self.build.parameter_files[given[0]] = absolute(given[1], variables)

    def _do_include_directories(self, given: list[str], variables: dict[str, str]) -> None:
        self.build.includes += [absolute(word, variables) for word in given if not word.startswith("$")]

    def _do_target_include_directories(self, given: list[str], variables: dict[str, str]) -> None:
        words = [re.sub(r"^\$<BUILD_INTERFACE:(.*)>$", r"\1", word) for word in given[1:]]
        self.build.includes += [
            absolute(w, variables) for w in words if not w.startswith("$<") and w not in LINK_WORDS
        ]

    def _do_set_target_properties(self, given: list[str], variables: dict[str, str]) -> None:
        if "OUTPUT_NAME" in given and "PROPERTIES" in given:
            name = given[given.index("OUTPUT_NAME") + 1 :][:1]
            for target in given[: given.index("PROPERTIES")]:
                self.build.renamed[target] = "".join(name)

    def _do_install(self, given: list[str], variables: dict[str, str]) -> None:
        """Note the files that become executables of the package as they are: those in ``lib/<package>``; and where
        folders of headers go.
        """
        destination = given[given.index("DESTINATION") + 1 :][:1] if "DESTINATION" in given else []
        if destination and given[0] == "DIRECTORY" and destination[0].startswith("include/"):
            self._note_headers(given[1 : given.index("DESTINATION")], destination[0], variables)
        if [each.rstrip("/") for each in destination] != [f"lib/{variables.get('PROJECT_NAME')}"]:
            return
        words = given[1 : given.index("DESTINATION")]
        if given[0] == "PROGRAMS":
            renamed = given[given.index("RENAME") + 1 :][:1] if "RENAME" in given else []
            for word in words:
                name = renamed[0] if renamed else os.path.basename(word)
                self.build.scripts[name] = absolute(word, variables)
        elif given[0] == "DIRECTORY" and "USE_SOURCE_PERMISSIONS" in given:
            folders = [absolute(word, variables) for word in words if word.endswith("/")]
            for file in (each for folder in folders for each in sorted(Path(folder).glob("*"))):
                self.build.scripts[file.name] = str(file)

    def _note_headers(self, words: Sequence[str], destination: str, variables: dict[str, str]) -> None:
        below = destination.removeprefix("include/").strip("/")
        for word in words:
            name = below if word.endswith("/") else f"{below}/{os.path.basename(word)}"
            self.build.headers.setdefault(name.strip("/"), absolute(word, variables))

    def _do_rclcpp_components_register_node(self, given: list[str], variables: dict[str, str]) -> None:
        options = {w: given[i + 1] for i, w in enumerate(given[:-1]) if w in ("PLUGIN", "EXECUTABLE")}
        if "PLUGIN" in options:
            name = options["PLUGIN"].lstrip(":")
            self.build.plugins[name] = options.get("EXECUTABLE")
            self.build.plugin_targets[name] = given[0]

    def _do_rclcpp_components_register_nodes(self, given: list[str], variables: dict[str, str]) -> None:
        for name in given[1:]:
            if name not in ("EXECUTOR", "RESOURCE_INDEX"):
                self.build.plugins.setdefault(name.lstrip(":"), None)
                self.build.plugin_targets[name.lstrip(":")] = given[0]

    def _do_pluginlib_export_plugin_description_file(
        self, given: list[str], variables: dict[str, str]
    ) -> None:
        if len(given) > 1:
            self.build.plugin_files.append(absolute(given[1], variables))


_ARGUMENT = re.compile(
    r'\[(=*)\[((?:.|\n)*?)\]\1\]|"((?:\\.|[^"\\])*)"|((?:\\.|[^\s()"\\])(?:\\.|"(?:\\.|[^"\\])*"|[^\s()"\\])*)|([()])'
)
_COMMAND = re.compile(r"[ \t]*(\w+)\s*\(")
_VARIABLE = re.compile(r"\$\{([\w.\-]+)\}")
LINK_WORDS = frozenset({"PUBLIC", "PRIVATE", "INTERFACE", "SYSTEM"})
BLOCK_ENDS = {name: f"end{name}" for name in ("if", "foreach", "function", "macro", "while")}

Command = tuple[str, list[str]]


def commands(source: str) -> Iterator[Command]:
    """Yield every command with its arguments, parentheses kept as arguments of their own."""
    source = re.sub(r"#\[(=*)\[(?:.|\n)*?\]\1\]|(?<!\\)#[^\n]*", "", source)
    position = 0
    while True:
        match = _COMMAND.search(source, position)
        if match is None:
            return
        words: list[str] = []
        depth, position = 1, match.end()
        while depth and (found := _ARGUMENT.search(source, position)):
            position = found.end()
            if found[5]:
                depth += 1 if found[5] == "(" else -1
                if depth:
                    words.append(found[5])
            elif found[3] is not None:
                words.append('"' + found[3])
            else:
                words.append(found[2] or found[4] or "")
        yield match[1].lower(), words
        if depth:
            return


def end_of_block(listed: Sequence[Command], start: int) -> int:
    """Return the index of the command that closes the block at ``start``; of the last command if none does."""
    name = listed[start][0]
    depth = 0
    for index in range(start, len(listed)):
        depth += (listed[index][0] == name) - (listed[index][0] == BLOCK_ENDS[name])
        if depth == 0:
            return index
    return len(listed) - 1


def expand(words: list[str], variables: dict[str, str]) -> list[str]:
    """Fill variables in; lists become several arguments unless they stand in quotes."""
    found: list[str] = []
    for word in words:
        quoted = word.startswith('"')
        for _ in range(8):
            filled = _VARIABLE.sub(lambda match: variables.get(match[1], ""), word)
            if filled == word:
                break
            word = filled
        found += [word[1:]] if quoted else [part for part in word.split(";") if part]
    return found


def condition_state(condition: list[str]) -> bool | None:
    """Decide whether a condition holds on Linux without tests; ``None`` for all but a few simple ones."""
    words = [word.lstrip('"') for word in condition if word not in ("(", ")")]
    written = " ".join(words)
    if written in ("BUILD_TESTING", "CATKIN_ENABLE_TESTING", "WIN32", "APPLE", "MSVC", "ANDROID", "FALSE"):
        return False
    if written in ("NOT WIN32", "UNIX", "TRUE", "NOT APPLE"):
        return True
    return False if "BUILD_TESTING" in words and "NOT" not in words and "OR" not in words else None


def absolute(word: str, variables: dict[str, str]) -> str:
    """Return a path as seen from ``CMAKE_CURRENT_SOURCE_DIR``, normalised; an absolute one stays where it is."""
    return os.path.normpath(os.path.join(variables.get("CMAKE_CURRENT_SOURCE_DIR", ""), word))


def near(pattern: str, variables: dict[str, str]) -> bool:
    """Return True if a pattern and the sources have a folder in common; ``/**/*`` is left of ``${UNKNOWN}/**/*``."""
    fixed = re.split(r"[*?\[]", pattern, maxsplit=1)[0]
    return (
        os.path.commonpath([os.path.abspath(fixed), os.path.abspath(variables["CMAKE_CURRENT_SOURCE_DIR"])])
        != "/"
    )


def recursive_pattern(pattern: str) -> str:
    """Return a pattern of ``GLOB_RECURSE`` with ``**`` before the file name."""
    folder, name = os.path.split(pattern)
    return os.path.join(folder.replace("**", "*"), "**", name)
