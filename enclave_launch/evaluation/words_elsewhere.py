"""Words of ROS 1 or of a newer release in a launch file: what ROS 2 writes, or since when the word is there."""

from __future__ import annotations

import re

from enclave_launch.description.markup.expose import gate_of
from enclave_launch.ros_rules.distro import Distro, Release, Since, version_text

_UNKNOWN = re.compile(r"^(Unrecognized entity of the type|Unknown substitution): (\S+)$")
_UNEXPECTED = re.compile(r"^Unexpected (?:attribute|nested tag|key)\(s\).* found in `(\w+)`: \{(.*)\}$")
_MISSING_EXEC = "Attribute 'exec' of type str not found in Entity 'node'"

_SUBSTITUTIONS = {
    "arg": "$(var NAME)",
    "find": "$(find-pkg-share PACKAGE)",
    "optenv": "$(env NAME DEFAULT)",
}
_ELEMENTS = {
    "rosparam": '<param from="FILE"/> inside a node, <set_parameters_from_file filename="FILE"/> for a scope',
    "param": '<set_parameter name="NAME" value="VALUE"/>; ROS 2 has no parameters outside of nodes',
    "remap": '<set_remap from="A" to="B"/>',
    "env": '<set_env name="NAME" value="VALUE"/>',
}
_WITHIN = {
    "rosparam": '<param from="FILE"/>',
    "type": 'exec="PROGRAM"',
    "ns": 'namespace="NAMESPACE"',
    "required": 'on_exit="shutdown"',
    "command": "value=\"$(command '...')\"",
    "textfile": 'value="$(file-content FILE)"',
    "doc": 'description="TEXT"',
    "pass_all_args": "nothing: an included file sees all arguments",
    "clear_params": "nothing: ROS 2 keeps no parameters when a node ends",
}
_IN_ELEMENT = {
    ("group", "ns"): '<push_ros_namespace namespace="NAMESPACE"/> inside the group',
    ("include", "ns"): 'a <group> with <push_ros_namespace namespace="NAMESPACE"/> around the include',
    ("arg", "value"): '<let name="NAME" value="VALUE"/> for what no caller may change',
}


def word_elsewhere(text: str, release: Release) -> str:
    """Return the sentence about a word in the error ``text`` that is of ROS 1 or of a newer release, or nothing."""
    if unknown := _UNKNOWN.match(text):
        is_substitution, word = unknown[1] == "Unknown substitution", unknown[2]
        gate = gate_of("substitution" if is_substitution else "action", word)
        if gate is not None:
            return f"\n{word} is {_since(gate)}; this file is read as {release}"
        instead = (_SUBSTITUTIONS if is_substitution else _ELEMENTS).get(word)
        return _of_ros_1(f"$({word})" if is_substitution else f"<{word}>", instead)
    if unexpected := _UNEXPECTED.match(text):
        element, words = unexpected[1], re.findall(r"'(\w+)'", unexpected[2])
        sayings = [
            _of_ros_1(word, _IN_ELEMENT.get((element, word), _WITHIN.get(word))) for word in sorted(words)
        ]
        return "".join(sayings)
    return _of_ros_1("type", _WITHIN["type"]) if text == _MISSING_EXEC else ""


def _of_ros_1(word: str, instead: str | None) -> str:
    return f"\n{word} is of ROS 1; ROS 2 writes {instead}" if instead else ""


def _since(gate: Since) -> str:
    firsts = [
        f"{gate.package} {version_text(first)} in {distro.value}" if any(first) else f"all of {distro.value}"
        for distro in Distro
        if (first := gate.first_in(distro)) is not None
    ]
    return f"there since {', '.join(firsts)}"
