"""Write an enclaves.yaml: what all four commands read, so that keystore, sources and scope are named once.

It is found upwards from the launch file, else from the current folder. An option on the command line wins.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from enclave_common.command_line import PATH, Option
from enclave_common.files import write_text
from enclave_common.project import FILE_NAME
from enclave_common.project_file import SCHEMA_URL
from enclave_launch.errors import UsageError, translated

WORDS: tuple[Option, ...] = (
    ("folder DIR", {**PATH, "nargs": "?"}, "the workspace (default: the current folder)"),
)
OPTIONS: dict[str, tuple[Option, ...]] = {}
PLANS = False

CONTENT = f"""\
# yaml-language-server: $schema={SCHEMA_URL}
# Read by secure-launch, secure-plan, secure-keystore and secure-nodl. Options on the command line come first,
# then ROS_SECURITY_KEYSTORE. Paths are relative to this file.

# Keys, certificates and signed permissions. Keep private/ out of git: a new keystore has a .gitignore for that.
keystore: keystore

# Which processes share an enclave: node (each its own), namespace (ROS 2's design article), process, launch.
enclave-scope: node

# NoDL manifests, or folders of them, such as those that secure-launch --learn wrote.
# nodl: [manifests]

# Where the sources of nodes are, besides the workspace itself.
# source: [../other_ws/src]

# Documents of your own for the library of well-known packages (docs/library.md).
# library: [library]

# The distribution to plan for, where ROS_DISTRO is not set.
# distro: jazzy

# Which host runs what (docs/deployment.md).
# hosts: hosts.yaml

# Findings of secure-plan check that you accept, each with the reason; what must never influence what.
# accept:
# - {{code: no-publisher, subject: /scan, why: the driver runs on another computer}}
# never:
# - {{from: /camera, to: /base, why: a camera must not move the robot}}
"""


def run(options: argparse.Namespace) -> int:
    """Write the file, unless there is one. Returns 0."""
    folder = options.folder or Path()
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such directory")
    file = Path(os.path.abspath(folder)) / FILE_NAME
    if file.exists():
        raise UsageError(
            f"{file} exists already, and is left as it is\ntry: secure-plan doctor -v PACKAGE LAUNCH_FILE"
        )
    with translated(OSError, UsageError, f"{file}: "):
        write_text(file, CONTENT)
    print(f"{file}: written; look at it, then: secure-plan doctor PACKAGE LAUNCH_FILE")
    return 0
