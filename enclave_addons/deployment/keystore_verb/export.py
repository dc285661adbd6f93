"""Write bundles for hosts: the chosen enclaves, no CA keys, no other enclaves' keys.

With --hosts FILE (glob of enclaves -> host) or --host NAME: one signed bundle for each host, OUT/NAME.bundle, which
secure-keystore import puts in force there; the same keystore gives the same bytes. Without: OUT is a new directory,
or an archive when it ends in .tar or .tar.gz, for whoever unpacks it himself.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

from enclave_addons.deployment.host_bundles import (
    SUFFIX,
    BundleOptions,
    enclaves_of_hosts,
    export_hosts,
    hosts_that_left,
    pinned,
)
from enclave_addons.deployment.hosts import load_hosts
from enclave_addons.deployment.public_files import PublicFiles, export
from enclave_common.command_line import FLAG, PATH, TEXTS, FromProject, one_of
from enclave_common.words import counted
from keystore.disk.safe_files import resolve_root
from keystore.disk.view import KeystoreView
from keystore.errors import InvalidInputError
from keystore.formats.role import Role
from keystore.signing.public_key import fingerprint
from keystore.steps.provisioning import list_enclaves
from keystore.verb import common

OPTIONS: common.Table = (
    common.KEYSTORE,
    ("-o --output OUT", {**PATH, "required": True}, ""),
    ("--enclave PATTERN", TEXTS, "name or fnmatch pattern such as '/robot1/*'; repeatable"),
    ("--hosts FILE", {**PATH, "configured": FromProject("hosts", unless="enclave")},
     "YAML: which enclaves belong to which host"),
    ("--host NAME", TEXTS, "with --hosts only these; without, the one host that gets the enclaves of --enclave"),
    ("--public", one_of("link", "copy"),
     "link: public/ once and links to it (default); copy: each enclave directory stands alone"),
    ("--accept-exposures", FLAG, "export although verify finds exposures (errors are never exported)"),
    ("--accept-shared-enclaves", FLAG, "export although an enclave, and so its key, would be on several hosts"),
    *common.CHANGE,
)  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Write the bundles, print what they hold and how to pin their CAs. Returns 0."""
    if arguments.hosts or arguments.host:
        return _export_hosts(arguments)

    if not arguments.enclave:
        raise InvalidInputError(
            "say what to export: --hosts FILE, --host NAME --enclave PATTERN, or --enclave PATTERN"
        )
    names = export(
        arguments.keystore, arguments.output, arguments.enclave,
        public=PublicFiles(arguments.public), accept_exposures=arguments.accept_exposures,
    )  # fmt: skip
    common.print_lines(names)
    print(f"to pin its CAs where it is unpacked: {_pinned(arguments.keystore)}", file=sys.stderr)
    return 0


def _export_hosts(arguments: argparse.Namespace) -> int:
    options = BundleOptions(
        accept_exposures=arguments.accept_exposures,
        accept_shared=arguments.accept_shared_enclaves,
        **common.change(arguments),
    )
    assigned = _assigned(arguments)
    made = export_hosts(arguments.keystore, arguments.output, assigned, options=options)
    for one in made:
        state = "" if one.is_new else " (as last time)"
        print(
            f"{one.path}: number {one.manifest.number}, {counted(len(one.manifest.enclaves), 'enclave')}{state}"
        )
    if arguments.hosts and not arguments.host:
        _report_hosts_that_left(arguments, assigned)
    pins = " ".join(f"--require-ca {one}" for one in pinned(made[0].manifest))
    print(
        f"for the first import on a host, pass these fingerprints; send them separately from the bundle: {pins}",
        file=sys.stderr,
    )
    return 0


def _report_hosts_that_left(arguments: argparse.Namespace, hosts: Iterable[str]) -> None:
    """Warn who could still use what a host has that is not in the hosts file any more; remove its bundle here."""
    for host, enclaves in hosts_that_left(arguments.keystore, hosts).items():
        text = (
            f"host {host} is not in {arguments.hosts} any more and has good keys of {', '.join(enclaves)}: revoke "
            "them (secure-keystore remove), also if an enclave is on another host now (renew --new-keys --revoke-old)"
        )
        common.warn([text], arguments)
        bundle = arguments.output / f"{host}{SUFFIX}"
        if bundle.is_file():
            bundle.unlink()
            print(f"{bundle}: removed")


def _assigned(arguments: argparse.Namespace) -> dict[str, list[str]]:
    if arguments.hosts is None:
        if len(arguments.host) != 1 or not arguments.enclave:
            raise InvalidInputError("without --hosts FILE give one --host NAME and its --enclave PATTERN")
        return {arguments.host[0]: arguments.enclave}

    if arguments.enclave:
        raise InvalidInputError("--hosts FILE says which enclaves: leave --enclave out")
    hosts = load_hosts(arguments.hosts)
    enclaves = list_enclaves(arguments.keystore)
    assigned = enclaves_of_hosts(enclaves, hosts)
    unknown = sorted(set(arguments.host) - set(assigned))
    if unknown:
        raise InvalidInputError(f"{arguments.hosts} has no host {', '.join(unknown)}")
    if by_node := [name for name, one in hosts.hosts.items() if one.nodes]:
        common.warn([
            f"{arguments.hosts}: the nodes of {', '.join(by_node)} are not looked at here: a keystore knows enclaves. "
            "secure-plan hosts PLAN --hosts FILE --write-enclaves NEW.yaml names the enclaves"
        ], arguments)  # fmt: skip
    left = sorted(set(enclaves) - {one for listed in assigned.values() for one in listed})
    if left:
        common.warn([f"on no host: {', '.join(left)}"], arguments)
    chosen = {
        host: listed for host, listed in assigned.items() if not arguments.host or host in arguments.host
    }
    if not chosen:
        raise InvalidInputError(f"{arguments.hosts} names no host")
    return chosen


def _pinned(keystore: Path) -> str:
    """Return the command that verifies the bundle; a bundle has no register that would reveal a foreign CA."""
    view = KeystoreView(resolve_root(keystore))
    found = dict.fromkeys(fingerprint(ca.der) for role in Role for ca in view.ca_bundle(role))
    return " ".join(("secure-keystore verify BUNDLE", *(f"--require-ca {one}" for one in found)))
