"""Every entry of the keystore: known, of the right kind, private where it must be; and who else could replace one.

Owners, hard links, the folders above up to the root; in files what does not belong there: further PEM blocks, and
private keys in whatever encoding. Never follows a link.
"""

from __future__ import annotations

import binascii
import os
import re
import shlex
import stat
from collections.abc import Iterator
from pathlib import Path

from enclave_common.files import read_bytes
from enclave_common.terminal import quoted
from keystore.disk import layout, safe_files
from keystore.disk.container_copies import differing_copies
from keystore.disk.crl_file import is_crl
from keystore.errors import DamagedKeystoreError, InvalidEnclaveNameError
from keystore.formats.certificate import read_certificate, read_certificates
from keystore.formats.enclave_name import check_distinct, is_enclave_name, validate_enclave_name
from keystore.formats.role import Role
from keystore.signing.public_key import is_our_form
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity

_TOP = frozenset({layout.PUBLIC, layout.PRIVATE, layout.ENCLAVES, layout.ZENOH, layout.CONTAINERS})
_KNOWN = frozenset({
    layout.LOCK, layout.GITIGNORE, layout.SETTINGS, layout.CRL, layout.GOVERNANCE_XML, layout.GOVERNANCE,
    layout.SHARED_CA_CERT, layout.SHARED_CA_KEY, layout.REGISTER, layout.CRL_UNLINKED,
    layout.ZENOH_ROUTER, layout.ZENOH_ROUTER_CERT, layout.ZENOH_ROUTER_KEY,
    layout.BUNDLE, layout.HANDOVER, layout.SIGNED_HANDOVER,
    *(layout.ca_cert(role) for role in Role),
    *(layout.ca_key(role) for role in Role), *(layout.ca_key_uri(role) for role in Role),
})  # fmt: skip
_NEXT_CAS = frozenset(
    f"{layout.NEXT}/{role.value}/{name}" for role in Role for name in (layout.KEY, layout.CERT)
)
_PRIVATE_FOLDERS: dict[str, tuple[str, ...]] = {
    layout.RETIRED: (".cert.pem",), layout.SHARES: (".json", ".lock"), layout.BUNDLES: (".p7s",),
    layout.REQUESTS: (".csr",),
}  # fmt: skip
"""How the names of what belongs in each of them end."""
_UNFINISHED = (layout.STAGING, layout.INCOMING)


def check_files(root: Path) -> Iterator[Finding]:
    """Check owners, modes, links and strange files below ``root``."""
    names: list[str] = []
    yield from _check_owner_of_all(root)
    yield from _check_owner(root, ".", os.lstat(root), private=False)
    for relative, info in _walk(root, ""):
        if stat.S_ISLNK(info.st_mode):
            yield from _check_link(root, relative)
        elif stat.S_ISDIR(info.st_mode):
            yield from _check_directory(root, relative, info, names)
        else:
            yield from _check_file(root, relative, info)
    for relative, problem in differing_copies(root):
        fix = "import the bundle again: secure-keystore import KEYSTORE HOST.bundle"
        yield Finding(Severity.ERROR, "container-copy", relative, problem, fix)
    try:
        check_distinct(names)
    except InvalidEnclaveNameError as error:
        yield Finding(
            Severity.ERROR, "case-collision", error.name, str(error),
            repair.run_on(root, "rm -r", _less_of_an_enclave(root, error.name, names), "or the other one"),
        )  # fmt: skip


def _less_of_an_enclave(root: Path, name: str, names: list[str]) -> str:
    """Return, of directories that differ only in case, one without key and certificate, if there is one."""
    alike = [layout.enclave_directory(other) for other in names if other.lower() == name.lower()]
    empty = [one for one in alike if not {layout.KEY, layout.CERT} & set(os.listdir(root / one))]
    return (empty or alike)[0]


def _walk(root: Path, relative: str) -> Iterator[tuple[str, os.stat_result]]:
    with os.scandir(root / relative) as entries:
        ordered = sorted(entries, key=lambda entry: entry.name)
    for entry in ordered:
        name = f"{relative}/{entry.name}".lstrip("/")
        info = entry.stat(follow_symlinks=False)
        yield name, info
        if stat.S_ISDIR(info.st_mode) and name not in (*_UNFINISHED, layout.CONTAINERS):
            yield from _walk(root, name)


def _check_link(root: Path, relative: str) -> Iterator[Finding]:
    target = safe_files.link_target(root, relative) or ""
    if target not in safe_files.allowed_targets(relative):
        message = str(safe_files.strange_link(root, relative, target))
        yield Finding(Severity.ERROR, "strange-link", relative, message, repair.run_on(root, "rm", relative))
    elif not os.path.exists(root / relative):
        yield Finding(
            Severity.ERROR, "dangling-link", relative, f"points at {quoted(target)}, which is missing",
            repair.run_on(root, "rm", relative, "or restore what it points at; without a CRL, the revoked are trusted"),
        )  # fmt: skip


def _check_directory(root: Path, relative: str, info: os.stat_result, names: list[str]) -> Iterator[Finding]:
    if relative in _UNFINISHED:
        yield Finding(
            Severity.WARNING, "interrupted", relative, "an interrupted run left this behind",
            repair.renew(root, note="as any command that writes, completes or clears it"),
        )  # fmt: skip
        return
    yield from _check_owner(root, relative, info, private=relative.split("/")[0] == layout.PRIVATE)
    if relative in _TOP or relative in _PRIVATE_FOLDERS or relative.startswith(layout.NEXT):
        return
    if relative.startswith(layout.ENCLAVES + "/"):
        name = relative.removeprefix(layout.ENCLAVES)
        try:
            names.append(validate_enclave_name(name))
        except InvalidEnclaveNameError as error:
            stray = _stray(root, relative, f"no enclave can have this name: {error.reason}")
            yield _not_a_file(root, relative, "rm -r") or stray
        else:
            yield from _incomplete(root, relative)
    else:
        yield _not_a_file(root, relative, "rm -r") or _stray(root, relative, "no keystore has this directory")


def _incomplete(root: Path, relative: str) -> Iterator[Finding]:
    """Report an enclave that has a key or a certificate and not both; without both the rest of it would go unseen."""
    names = set(os.listdir(root / relative))
    if names & layout.ENCLAVE_FILES and not names & {layout.KEY, layout.CERT}:
        enclave = relative.removeprefix(layout.ENCLAVES)
        yield Finding(
            Severity.ERROR, "incomplete", relative, "neither key nor certificate, but other files of an enclave",
            repair.run(root, "create-enclave", enclave),
        )  # fmt: skip


def _not_a_file(root: Path, relative: str, remove: str) -> Finding | None:
    name = relative.rpartition("/")[2]
    if relative not in _KNOWN and not (relative.startswith(layout.ENCLAVES) and name in layout.ENCLAVE_FILES):
        return None
    fix = repair.run_on(root, remove, relative, "then verify again")
    return Finding(Severity.ERROR, "not-a-file", relative, "not a regular file", fix)


def _check_file(root: Path, relative: str, info: os.stat_result) -> Iterator[Finding]:
    if not stat.S_ISREG(info.st_mode):
        yield _not_a_file(root, relative, "rm") or _stray(root, relative, "neither file, directory nor link")
        return
    directory, _, name = relative.rpartition("/")
    secret = directory == layout.PRIVATE or name == layout.KEY or relative == layout.ZENOH_ROUTER_KEY
    yield from _check_owner(root, relative, info, private=secret)
    if secret and info.st_nlink > 1:
        yield Finding(
            Severity.ERROR, "hard-link", relative,
            f"the same file has {info.st_nlink} names; reading one of the others gives the key",
            repair.run_on(root, "find / -xdev -samefile", relative, "then renew --new-keys --revoke-old"),
        )  # fmt: skip
    if relative in _KNOWN or name in layout.ENCLAVE_FILES:
        yield from check_content(root, relative)
    if _belongs(root, directory, name):
        return
    if name.endswith(".p11"):
        yield _stray(root, relative, "rcl prefers it to the .pem beside it, and Fast DDS takes only keys so")
    else:
        yield _stray(root, relative, "no keystore has this file")


def _belongs(root: Path, directory: str, name: str) -> bool:
    relative = f"{directory}/{name}".lstrip("/")
    if relative in _KNOWN or relative in _NEXT_CAS or name.endswith(_PRIVATE_FOLDERS.get(directory, ())):
        return True
    if directory.split("/")[0] == layout.ENCLAVES and name in {*layout.ENCLAVE_FILES, layout.ENCLAVE_ZENOH}:
        # Of the copy of an enclave that no process can use, the key is a second one.
        return name != layout.KEY or is_enclave_name(directory.removeprefix(layout.ENCLAVES) or "/")
    # Alone, the URI is that of the enclave's key in a token.
    return name == layout.KEY_URI and not os.path.lexists(root / directory / layout.KEY)


def _check_owner_of_all(root: Path) -> Iterator[Finding]:
    """Report a keystore of another user once: every file of it would be reported for the same reason."""
    owner = os.lstat(root).st_uid
    if owner not in (0, os.geteuid()):
        as_owner = f"sudo -u '#{owner}' secure-keystore verify {shlex.quote(str(root))}"
        yield Finding(
            Severity.ERROR, "foreign-owner", ".",
            f"this keystore belongs to user {owner}, who can change it at any time, and you are user {os.geteuid()}",
            f"chown -R {os.geteuid()} {shlex.quote(str(root))}  # or check it as its owner: {as_owner}",
        )  # fmt: skip


def _check_owner(root: Path, relative: str, info: os.stat_result, *, private: bool) -> Iterator[Finding]:
    """Check what is not secret: it must be ours or the administrator's all the same."""
    path = root / relative
    is_of_owner = (
        info.st_uid == os.lstat(root).st_uid
    )  # and reported with the whole keystore, if that is another's
    problem = safe_files.private_problem(path, info) if private else None
    if problem is not None and is_of_owner and info.st_uid != os.geteuid():
        problem = None
    if problem is not None:
        fix = safe_files.private_repair(path, info)
        yield Finding(Severity.ERROR, "unsafe-owner", relative, problem, fix)
    elif not private and not is_of_owner and not safe_files.is_trusted_owner(info):
        yield Finding(
            Severity.ERROR, "foreign-owner", relative,
            f"belongs to user {info.st_uid}, who can change it at any time",
            repair.run_on(root, f"chown {os.geteuid()}", relative),
        )  # fmt: skip
    if info.st_mode & 0o022 and problem is None:
        yield Finding(
            Severity.ERROR, "writable-by-others", relative,
            f"others can write it (mode {safe_files.mode_text(info)})", safe_files.close_to_others(root),
        )  # fmt: skip
    if private and info.st_mode & 0o077 and not info.st_mode & 0o022:
        yield Finding(
            Severity.ERROR, "readable-by-others", relative,
            f"others can read it (mode {safe_files.mode_text(info)}); anyone who did has the key",
            repair.run_on(root, "chmod go-rwx", relative, "a key that was read wants a new one: renew --new-keys"),
        )  # fmt: skip


def _stray(root: Path, relative: str, why: str) -> Finding:
    path = root / relative
    holds_key = _holds_key(path)
    return Finding(
        Severity.ERROR if holds_key else Severity.WARNING,
        "stray-key" if holds_key else "stray",
        relative,
        ("a private key that no DDS process reads" if holds_key else why) + "; it does not belong here",
        repair.run_on(root, "rm -r" if path.is_dir() else "rm", relative),
    )


def _holds_key(path: Path) -> bool:
    try:
        return holds_private_key(read_bytes(path, _MAX_BYTES))
    except OSError:
        return False


def check_parents(root: Path) -> Iterator[Finding]:
    """Check the folders above a keystore: who can rename one of them can put another keystore in its place."""
    for folder in root.parents:
        yield from _check_folder(folder)


def check_links(keystore: Path | str) -> Iterator[Finding]:
    """Check the folders of the links that lead to a keystore, as ``check_parents`` checks those above it."""
    above = Path(os.path.realpath(keystore)).parents
    for folder in safe_files.folders_of_links(keystore):
        if folder not in above:
            yield from _check_folder(folder)


def _check_folder(folder: Path) -> Iterator[Finding]:
    try:
        info = os.stat(folder)
    except OSError:
        return
    if not safe_files.is_trusted_owner(info):
        yield Finding(
            Severity.ERROR, "replaceable", str(folder),
            f"belongs to user {info.st_uid}, who can put another keystore in this place",
            f"put the keystore elsewhere, or: chown root {shlex.quote(str(folder))}",
        )  # fmt: skip
    elif info.st_mode & 0o022 and not info.st_mode & stat.S_ISVTX:
        everybody = bool(info.st_mode & stat.S_IWOTH)
        yield Finding(
            Severity.ERROR if everybody else Severity.WARNING, "replaceable", str(folder),
            f"{'everybody' if everybody else f'group {info.st_gid}'} can write in it (mode "
            f"{safe_files.mode_text(info)}) and put another keystore in this place",
            f"chmod go-w {shlex.quote(str(folder))}",
        )  # fmt: skip


_MAX_BYTES = 64_000_000
_BASE64_RUN = re.compile(rb"[A-Za-z0-9+/=\r\n]{80,}")
_DER_KEYS = (
    b"\x02\x01\x00\x30\x13\x06\x07\x2a\x86\x48\xce\x3d\x02\x01",  # PKCS#8 (RFC 5958), elliptic curve
    b"\x02\x01\x00\x30\x0d\x06\x09\x2a\x86\x48\x86\xf7\x0d\x01\x01\x01",  # PKCS#8, RSA
    b"\x02\x01\x00\x30\x05\x06\x03\x2b\x65",  # PKCS#8, Edwards curves (RFC 8410)
    b"\x02\x01\x01\x04\x20",  # SEC 1 ECPrivateKey of 256 bits (RFC 5915)
    b"\x02\x01\x00\x02\x82",  # PKCS#1 RSAPrivateKey (RFC 8017)
    b"\x06\x09\x2a\x86\x48\x86\xf7\x0d\x01\x05\x0d",  # PBES2: encrypted PKCS#8, PKCS#12
    b"\x06\x0b\x2a\x86\x48\x86\xf7\x0d\x01\x0c\x0a\x01",  # PKCS#12 key bags (RFC 7292)
)

_KEY = b"PRIVATE KEY"
_ONE_BLOCK = frozenset({layout.CERT, layout.ENCLAVE_CRL})
_TRUST_ANCHORS = frozenset(f"{role.value}.cert.pem" for role in Role) | {"ca.cert.pem"}


def holds_private_key(data: bytes) -> bool:
    """Return whether there is a key in PEM, in DER, or in base64 without its frame; alone or behind other content."""
    if _KEY in data or any(sign in data for sign in _DER_KEYS):
        return True
    return any(sign in decoded for decoded in _decoded(data) for sign in _DER_KEYS)


def check_content(root: Path, relative: str) -> Iterator[Finding]:
    """Finds what a file of the keystore holds beside what its name says; DDS implementations may read that instead."""
    try:
        data = read_bytes(root / relative, _MAX_BYTES)
    except OSError:
        return  # what cannot be read is reported by who needs it
    name = relative.rpartition("/")[2]
    is_key = name.endswith(".key.pem") or name == layout.KEY
    if not is_key and holds_private_key(data):
        yield Finding(
            Severity.ERROR, "private-key", relative,
            "holds a private key, which goes wherever this file goes; the key counts as exposed",
            _new_key(root, relative),
        )  # fmt: skip
    blocks = data.count(b"-----BEGIN ")
    several = blocks > 1 and (is_key or name in _ONE_BLOCK)
    if several or not _is_our_form(name, data):
        fix = _new_key(root, relative) if is_key or several else _written_again(root, relative)
        message = f"holds {blocks} PEM blocks" if several else "is not as secure-keystore writes it"
        yield Finding(
            Severity.ERROR, "several-blocks" if blocks > 1 else "other-form", relative,
            f"{message}: DDS implementations may read something else in it than was signed", fix,
        )  # fmt: skip


def _is_our_form(name: str, data: bytes) -> bool:
    try:
        if name == layout.KEY:
            return is_our_form(data)
        if name == layout.CERT:
            read_certificate(data)
        elif name in _TRUST_ANCHORS:
            read_certificates(data, name)
        elif name == layout.ENCLAVE_CRL:
            return is_crl(data)
    except DamagedKeystoreError:
        return False
    return True


def _decoded(data: bytes) -> Iterator[bytes]:
    for run in _BASE64_RUN.findall(data):
        compact = run.translate(None, b"\r\n=")
        try:
            yield binascii.a2b_base64(compact[: len(compact) // 4 * 4])
        except binascii.Error:
            continue


def _new_key(root: Path, relative: str) -> str:
    enclave = _enclave_of(relative)
    return repair.renew(root, enclave, "--new-keys", "--revoke-old") if enclave else repair.BACKUP


def _written_again(root: Path, relative: str) -> str:
    enclave = _enclave_of(relative)
    if not enclave or relative == layout.GOVERNANCE:
        return repair.renew(root, note="writes it again")
    return repair.renew(root, enclave)


def _enclave_of(relative: str) -> str:
    """Return the enclave in whose directory a file is, "" for none."""
    if not relative.startswith(layout.ENCLAVES + "/"):
        return ""
    return relative.removeprefix(layout.ENCLAVES).rpartition("/")[0] or "/"
