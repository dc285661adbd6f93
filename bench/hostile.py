"""How time grows with the size of input that somebody made to be slow: ``python -m bench.hostile``.

Each parser is given one kind of input at three sizes, each twice the one before. In the last column the time of the
largest is divided by that of the middle one: 2 is linear, 4 quadratic. What is refused for its size says so.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from enclave_common.shell_words import split_words
from enclave_common.terminal import json_text, printable_lines
from enclave_common.yaml_reader import load_yaml
from enclave_launch.description.markup.xml import parse_launch_xml
from enclave_launch.frontend.substitution_grammar import parse_template
from enclave_launch.ros_rules.parameter_file import sections_of_text
from enclave_launch.ros_rules.rcl_parameters import section_applies
from keystore.formats.governance_yaml import parse_governance_yaml
from keystore.formats.policy_xml import parse_policy
from keystore.verification.files import holds_private_key
from nodl.document.v1 import parse_v1

Case = tuple[str, Callable[[Any], object], Callable[[int], Any], int]


def bomb(levels: int) -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, levels)]
    return "\n".join(lines)


ENTITY = f"<!DOCTYPE a [<!ENTITY e '{'x' * 200}'>]>"
INTERFACE, NODE = b"<interface version='1'>%s</interface>", b"<node name='a' executable='b'/>"


def sections(count: int) -> str:
    return "".join(f"n{number}:\n  ros__parameters:\n    a: 1\n" for number in range(count))


read_parameters = sections_of_text.__wrapped__  # without the cache: each round reads

CASES: list[Case] = [
    ("words: one long word", split_words, lambda n: "x" * n, 400_000),
    ("words: one long quotation", split_words, lambda n: "'" + "x" * n + "'", 400_000),
    ("words: backslashes", split_words, lambda n: "\\x" * n, 50_000),
    ("words: many", split_words, lambda n: "x " * n, 50_000),
    ("template: dollars", parse_template, lambda n: "$(" + "a " + "$" * n + ")", 100_000),
    ("template: backslashes", parse_template, lambda n: "$(a b)" + "\\" * n, 100_000),
    ("template: many calls", parse_template, lambda n: "$(var x)" * n, 10_000),
    ("template: never closed", parse_template, lambda n: "$(a" + " b" * n, 50_000),
    ("template: quotes", parse_template, lambda n: "$(a '" + "(" * n + "')", 100_000),
    ("XML: attributes", parse_launch_xml, lambda n: "<a " + " ".join(f'b{i}="c"' for i in range(n)) + "/>", 50_000),
    ("XML: entities", parse_launch_xml, lambda n: f"{ENTITY}<a b='{'&e;' * n}'/>", 20_000),
    ("XML: elements in elements", parse_launch_xml, lambda n: "<a>" * n, 50_000),
    ("YAML: flow", load_yaml, lambda n: "[" + "1," * n + "]", 8_000),
    ("YAML: depth", load_yaml, lambda n: "[" * n, 50_000),
    ("YAML: tabs, the slow scanner", load_yaml, lambda n: "- 'a\tb'\n" * n, 3_000),
    ("YAML: value of one word", load_yaml, lambda n: "x" * n, 400_000),
    ("YAML: value that is a list", load_yaml, lambda n: "[" + "1," * n + "]", 8_000),
    ("parameter file: alias bomb (levels)", read_parameters, bomb, 8),
    ("parameter file: many sections", read_parameters, sections, 2_000),
    ("section name: wildcards", lambda name: section_applies(name, ("a", "b")), lambda n: "/**" * n + "/x", 50_000),
    ("NoDL v1: nodes", lambda data: parse_v1(data, "a"), lambda n: INTERFACE % (NODE * n), 5_000),
    ("policy: comments", parse_policy, lambda n: b"<policy version='0.2.0'>" + b"<!-- a -->" * n, 50_000),
    ("governance YAML: depth", lambda data: parse_governance_yaml(data, "a"), lambda n: b"[" * n, 8_000),
    ("keystore file: base64", holds_private_key, lambda n: b"QUJD\n" * n, 50_000),
    ("terminal: control characters", printable_lines, lambda n: "\x1b" * n, 50_000),
    ("JSON: control characters", json_text, lambda n: "\x9b" * n, 50_000),
]  # fmt: skip


def measured(parse: Callable[[Any], object], document: Any) -> tuple[float, str]:
    """Seconds of processor time, best of two, and the first words of a refusal."""
    best, said = float("inf"), ""
    for _ in range(2):
        start = time.process_time()
        try:
            parse(document)
        except Exception as error:  # parsers refuse in their own ways; here only the time counts
            said = f"{type(error).__name__}: {error}"[:44].replace("\n", " ")
        best = min(best, time.process_time() - start)
    return best, said


def main() -> None:
    print(f"{'input':38} {'largest':>10} {'ms':>9} {'growth':>7}  refused with")
    for name, parse, make, size in CASES:
        times = [measured(parse, make(size * factor)) for factor in (1, 2, 4)]
        growth = times[2][0] / max(times[1][0], 1e-6)
        print(f"{name:38} {size * 4:10} {times[2][0] * 1000:9.1f} {growth:7.1f}  {times[2][1]}")


if __name__ == "__main__":
    main()
