"""Renew what expires soon, repair what is exposed, or replace the CAs.

Without enclaves: all certificates that expire within --expiring-within, with their permissions, the CRL, and the
repairs that verify names. With enclaves: those. --ca start|switch|finish replaces CAs in three steps, to
be deployed one after the other. Fast DDS then trusts old and new side by side; Cyclone DDS reads only the
first CA of a file, so its participants must take 'switch' together.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from enclave_common.command_line import FLAG, PATH
from keystore.errors import InvalidInputError
from keystore.formats.role import Role
from keystore.formats.validity import parse_duration, parse_end, utc_now
from keystore.steps.renewal import RenewOptions, renew
from keystore.steps.rollover import Step, roll_over
from keystore.verb import common

if TYPE_CHECKING:
    from keystore.steps.options import ProvisionOptions, ProvisionReport


OPTIONS: common.Table = (
    common.KEYSTORE,
    ("enclaves", {**common.ENCLAVES, "nargs": "*"}, "enclaves to renew in any case"),
    ("--expiring-within (--within) TIME", {"default": "30d"}, "what expires sooner is renewed (30d)"),
    ("--all", FLAG, "renew every enclave"),
    ("--new-keys", FLAG, "new private keys too, not only certificates"),
    common.REVOKE_OLD,
    ("--adopt-crl FILE", PATH, "keep revoked what this CRL lists: of a host that knows more"),
    ("--ca", {"choices": ("start", "switch", "finish")}, "a step of replacing CAs"),
    ("--ca-role", {"choices": ("identity", "permissions", "both"), "default": "both"},
     "which CA to replace (both)"),
    ("--lost-key", FLAG, "with --ca start: the permissions CA's key is lost: hosts must pin the new CAs"),
    ("--ca-valid-for TIME", {"default": "10y"}, "validity of new CAs (10y)"),
    common.ENCRYPTION,
    *common.PROVISIONING,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Renew, repair or replace, and print what was done. Returns 0."""
    now = utc_now()
    options = common.provision_options(arguments, ca_lifetime=parse_end(arguments.ca_valid_for, now) - now)
    report = _roll_over(arguments, options) if arguments.ca else _renew(arguments, options)
    common.print_report(report, arguments)
    return 0


def _renew(arguments: argparse.Namespace, options: ProvisionOptions) -> ProvisionReport:
    wanted = RenewOptions(
        within=parse_duration(arguments.expiring_within),
        everything=arguments.all,
        new_keys=arguments.new_keys,
        revoke_old=arguments.revoke_old,
        encrypt_ca_keys=arguments.encrypt_ca_keys,
        adopt_crl=arguments.adopt_crl,
        provisioning=options,
    )
    return renew(arguments.keystore, arguments.enclaves or None, options=wanted)


def _roll_over(arguments: argparse.Namespace, options: ProvisionOptions) -> ProvisionReport:
    if arguments.enclaves:
        raise InvalidInputError("--ca concerns all enclaves; do not name any")
    roles = tuple(Role) if arguments.ca_role == "both" else (Role(f"{arguments.ca_role}_ca"),)
    step = Step(arguments.ca)
    report = roll_over(
        arguments.keystore,
        step,
        roles,
        options=options,
        encrypt=arguments.encrypt_ca_keys,
        lost_key=arguments.lost_key,
    )
    following = {
        Step.START: "deploy to all, then: --ca switch",
        Step.SWITCH: "deploy (Cyclone DDS: to all at once), then: --ca finish",
        Step.FINISH: "deploy; the old CA is trusted no more",
    }
    return report._replace(created=(*report.created, following[step]))
