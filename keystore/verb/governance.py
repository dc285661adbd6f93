"""Put another governance in force, from YAML or XML; signs only when it differs.

All participants need it at the same time: with different protection kinds they do not talk, without an error.
"""

from __future__ import annotations

import argparse

from enclave_common.command_line import PATH
from keystore.formats.governance_yaml import governance_of
from keystore.steps.governance import set_governance
from keystore.steps.opening import ChangeOptions
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("file FILE", PATH, "YAML (docs/keystore.md), or DDS-Security's XML, which is written again in one form"),
    *common.CHANGE,
)


def run(arguments: argparse.Namespace) -> int:
    """Sign the governance if it differs, and print whether it did. Returns 0."""
    governance = governance_of(arguments.file)
    options = ChangeOptions(**common.change(arguments))
    changed = set_governance(arguments.keystore, governance, options=options)
    print(
        "governance signed; deploy it to all participants"
        if changed
        else "the governance is the same already"
    )
    return 0
