"""Repairs as lines for a shell, anything to know behind a ``#``; a sentence where no command can help."""

from __future__ import annotations

import shlex
from pathlib import Path

from keystore.disk import layout
from keystore.disk.versions import imported_at
from keystore.disk.view import KeystoreView
from keystore.formats.role import Role

BACKUP = "restore it from a backup"
_END_ENTITY = (
    "an end entity: CA:FALSE, key usage digitalSignature, extended key usage serverAuth and clientAuth"
)


def run(root: Path, verb: str, *arguments: str, note: str = "") -> str:
    """Return ``secure-keystore VERB KEYSTORE ARGUMENTS  # note``."""
    return _line(" ".join(("secure-keystore", verb, _quoted(root), *map(shlex.quote, arguments))), note)


def renew(root: Path, *arguments: str, note: str = "") -> str:
    """Return how documents are made again, as it is possible for this keystore.

    Where the CA keys are, ``renew`` with these arguments. A certificate of another company's CA is requested there.
    A host without CA keys imports a bundle.
    """
    view = KeystoreView(root)
    enclaves = [word for word in arguments if word.startswith("/")]
    if view.key_file(Role.PERMISSIONS) is None:
        again = shlex.join(("renew", "KEYSTORE", *arguments))
        text = f"after this, where the CA keys are: secure-keystore {again} and secure-keystore export"
        return run(imported_at(root), "import", "HOST.bundle", note=text)
    if view.key_file(Role.IDENTITY) is not None:
        return run(root, "renew", *arguments, note=note)
    if not enclaves:
        return run(root, "renew", note=note)
    text = (
        f"on its host. Have the identity CA issue {_END_ENTITY}. Then here: "
        f"{run(root, 'sign', 'requests.pem', '--issued', 'issued.pem')}"
    )
    request = ("secure-keystore", "request", "HOST_KEYSTORE", *enclaves, "-o", "requests.pem")
    return _line(shlex.join(request), text)


def replace_ca(root: Path, role: Role) -> str:
    """Return how a CA is replaced. Another company's identity CA is replaced by its owner, in a new keystore."""
    view = KeystoreView(root)
    if role is Role.IDENTITY and view.key_file(role) is None and view.key_file(Role.PERMISSIONS) is not None:
        text = "with another certificate by the owner of the identity CA"
        return _line("secure-keystore create NEW_KEYSTORE --external-identity-ca CA.pem", text)
    return renew(root, "--ca", "start", note="deploy; then --ca switch and --ca finish")


def run_on(root: Path, command: str, relative: str, note: str = "") -> str:
    """Return a command such as ``chmod go-w`` on one entry of the keystore."""
    return _line(f"{command} {_quoted(root / relative)}", note)


def grant_again(root: Path, enclave: str) -> str:
    """Advise to start from nothing: what an enclave may do is unknown without trustworthy permissions."""
    document = layout.enclave_file(enclave, layout.PERMISSIONS)
    note = "grants nothing until secure-keystore apply-policy, or the next launch"
    if KeystoreView(root).key_file(Role.PERMISSIONS) is None:
        return renew(root, enclave)
    # Without a name, since the certificate stays: it may be that of another company's CA.
    names = () if KeystoreView(root).key_file(Role.IDENTITY) is None else (enclave,)
    return f"{run_on(root, 'rm -f', document)} && {run(root, 'renew', *names, note=note)}"


def sign_governance(root: Path) -> str:
    """Advise to go back to the default: unsigned XML is nothing to sign again."""
    if KeystoreView(root).key_file(Role.PERMISSIONS) is None:
        return renew(root)
    removed = " ".join(_quoted(root / name) for name in (layout.GOVERNANCE, layout.GOVERNANCE_XML))
    note = "SROS2's default governance for domain 0; another: secure-keystore governance"
    return f"rm -f {removed} && {run(root, 'create', note=note)}"


def _line(command: str, note: str) -> str:
    return f"{command}  # {note}" if note else command


def _quoted(path: Path) -> str:
    """Quote for a shell, unless the name holds something that would speak to the terminal instead."""
    text = str(path)
    return shlex.quote(text) if text.isprintable() else ascii(text)
