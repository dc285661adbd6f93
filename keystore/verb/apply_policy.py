"""Give every enclave of an SROS2 policy file exactly its permissions, creating enclaves that are missing.

Enclaves that the policy does not have stay, and are reported; --prune revokes and removes them. Those of tools stay.
"""

from __future__ import annotations

import argparse

from enclave_common.command_line import FLAG, PATH
from enclave_common.words import some_of
from keystore.formats.policy_xml import read_policy
from keystore.formats.tool_needs import is_tool_enclave
from keystore.steps.provisioning import apply_policy, list_enclaves
from keystore.steps.removal import RemoveOptions, remove
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("policy POLICY.xml", PATH, "SROS2 policy, version 0.2.0"),
    ("--prune", FLAG, "revoke and remove the enclaves that the policy does not have"),
    common.DOMAINS,
    *common.PROVISIONING,
)


def run(arguments: argparse.Namespace) -> int:
    """Apply the policy, and print which enclaves changed. Returns 0."""
    document = read_policy(arguments.policy)
    common.warn(document.warnings, arguments)
    wildcards = document.policy.wildcards()
    granted = (
        f"enclave {path} is granted by wildcard (* also matches /): {some_of(names, 8)}"
        for path, names in wildcards.items()
    )
    common.warn(granted, arguments)
    options = common.provision_options(arguments, domains=common.domains(arguments))
    report = apply_policy(arguments.keystore, document.policy, options=options)
    common.print_report(report, arguments)
    left = [
        name
        for name in list_enclaves(arguments.keystore)
        if name not in {one.path for one in document.policy.enclaves} and not is_tool_enclave(name)
    ]
    if left and arguments.prune:
        chosen = RemoveOptions(**common.change(arguments), revoke=not arguments.no_revoke)
        removed = remove(arguments.keystore, left, options=chosen)
        common.warn(removed.warnings, arguments)
        common.print_lines(f"{name}: removed" for name in removed.removed)
    elif left and not arguments.quiet:
        print(f"left over, not in the policy: {some_of(left, 8)} (--prune revokes and removes)")
    return 0
