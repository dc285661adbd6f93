"""Make an enclave for a ROS tool: what it needs on its target, for 8 hours, and how to use it.

docs/running-systems.md has a table of the tools. Run it again for another 8 hours; secure-keystore remove revokes it.
"""

from __future__ import annotations

import argparse

from enclave_common.command_line import TEXT
from enclave_common.words import counted
from keystore.formats.tool_needs import TABLE
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
    ("--name ENCLAVE", TEXT, "default: /tools/TOOL/TARGET"),
    common.DOMAINS,
    *common.PROVISIONING,
    common.FORMAT,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Make the enclave, and print how to use it. Returns 0."""
    options = common.provision_options(arguments, domains=common.domains(arguments))
    tool, *targets = arguments.tool
    made = create_tool_enclave(
        arguments.keystore, tool, [*arguments.targets, *targets], name=arguments.name, options=options
    )
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
