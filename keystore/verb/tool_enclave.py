"""Make an enclave for a ROS tool: what it needs on its target, for 8 hours, and how to use it.

docs/running-systems.md has a table of the tools. Run it again for another 8 hours; secure-keystore remove revokes it.
"""

from __future__ import annotations

import argparse

from enclave_common.add_ons import add_on
from enclave_common.command_line import FLAG, TEXT
from enclave_common.words import counted
from keystore.errors import InvalidInputError
from keystore.formats.tool_needs import TABLE, TOOLS, takes_planned_topics
from keystore.formats.validity import iso
from keystore.steps.tool_enclaves import create_tool_enclave
from keystore.verb import common

SETTINGS = {
    "usage": "secure-keystore tool-enclave [KEYSTORE] --for TOOL [TARGET ...] [options]",
    "epilog": "tools:\n"
    + "".join(f"  {f'{tool.name} {tool.target.value}':20}  {tool.what}\n" for tool in TABLE),
}
OPTIONS: common.Table = (
    common.KEYSTORE,
    ("targets TARGET", {"nargs": "*"}, argparse.SUPPRESS),
    ("--for", {"dest": "tool", "required": True, "nargs": "+", "metavar": ("TOOL", "TARGET")},
     "the tool, and the topics, nodes or services that it works on"),
    ("--plan WORD", {"nargs": "+", "metavar": ("PACKAGE|PATH", "LAUNCH_FILE")},
     "all topics that this launch publishes, as targets of a tool that reads topics; words as of secure-launch"),
    ("--all -a", FLAG, argparse.SUPPRESS),
    ("--name ENCLAVE", TEXT, "default: /tools/TOOL/TARGET"),
    common.DOMAINS,
    *common.PROVISIONING,
    common.FORMAT,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Make the enclave, and print how to use it. Returns 0."""
    options = common.provision_options(arguments, domains=common.domains(arguments))
    tool, *targets = arguments.tool
    targets = [*arguments.targets, *targets]
    if arguments.all:
        raise InvalidInputError(
            "no tool gets everything: name its targets, or give --plan PACKAGE LAUNCH_FILE for all topics of a launch"
        )
    if arguments.plan:
        targets += _planned(tool, arguments)
    made = create_tool_enclave(arguments.keystore, tool, targets, name=arguments.name, options=options)
    rules = [rule for profile in made.policy.profiles for rule in profile.rules]
    if arguments.format == "json":
        common.print_json(
            {
                "enclave": made.enclave,
                "ends": iso(made.ends),
                "environment": dict(made.environment),
                "command": made.command,
                "remove": made.remove,
                "permissions": [f"{rule.operation.value} {rule.expression}" for rule in rules],
            }
        )
    else:
        common.print_lines(
            (
                f"{made.enclave}: until {iso(made.ends)}, {counted(len(rules), 'permission')}",
                f"use it:       {made.command}",
                f"take it back: {made.remove}",
            )
        )
    common.warn(made.report.warnings, arguments)
    return 0


def _planned(tool: str, arguments: argparse.Namespace) -> list[str]:
    """Return the topics of a launch; raises ``InvalidInputError`` for a tool that does not read topics."""
    if tool in TOOLS and not takes_planned_topics(TOOLS[tool]):
        readers = ", ".join(each.name for each in TABLE if takes_planned_topics(each))
        raise InvalidInputError(
            f"--plan is for tools that read topics ({readers}); name the target of {tool}"
        )
    planned_topics = add_on("keystore.planned_topics", "launch")
    if planned_topics is None:
        raise InvalidInputError("--plan needs secure-launch, which is not part of this installation")
    topics, unknown = planned_topics(arguments.plan)
    common.warn(unknown, arguments)
    return list(topics)
