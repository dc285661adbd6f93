"""Options that several verbs have."""

from __future__ import annotations

import argparse
import os


def add_prefix_argument(parser: argparse.ArgumentParser) -> None:
    """Where packages are looked for."""
    parser.add_argument(
        "--prefix",
        metavar="DIR",
        action="append",
        default=[],
        type=os.path.abspath,
        help="ament install prefix, searched before AMENT_PREFIX_PATH (repeatable)",
    )
