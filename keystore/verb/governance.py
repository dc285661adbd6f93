"""Put another governance in force, from YAML; signs only when it differs.

All participants need it at the same time: with different protection kinds they do not talk, without an error.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from keystore.verb import common


def describe(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``secure-keystore governance``."""
    common.add_keystore(parser)
    parser.add_argument(
        "file", metavar="FILE.yaml", type=Path, help="see docs: version, domain_rules, topic_rules"
    )
    common.add_change(parser)


def run(arguments: argparse.Namespace) -> int:
    """Sign the governance if it differs, and print whether it did. Returns 0."""
    from keystore.formats.governance_yaml import load_governance_yaml
    from keystore.steps.governance import GovernanceOptions, set_governance

    governance = load_governance_yaml(arguments.file)
    options = GovernanceOptions(**common.change(arguments))
    changed = set_governance(arguments.keystore, governance, options=options)
    print(
        "governance signed; deploy it to all participants"
        if changed
        else "the governance is the same already"
    )
    return 0
