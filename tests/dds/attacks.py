"""What somebody can try who holds the directory of one enclave, and the public part of all others.

Every attempt ends in a directory with the six security files, ready for a DDS participant. The tools
here are the attacker's: they share no code with the keystore they are used against.
"""

from __future__ import annotations

import itertools
import re
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from tests.dds.probe import Participant
from tests.dds.sros2_style import Credential, Grant, issue

ENCLAVES = ("/", "/a", "/a/b", "/b/a", "/a/b/c")
HONEST, VICTIM, REVOKED = "/honest", "/victim", "/revoked"
SECRET = "/secret"  # nobody may publish it, the victim listens to it
FILES = (
    "identity_ca.cert.pem",
    "cert.pem",
    "key.pem",
    "permissions_ca.cert.pem",
    "governance.p7s",
    "permissions.p7s",
)


def topic_of(enclave: str) -> str:
    """The one topic that this enclave may publish."""
    return "/of" + enclave.replace("/", "_")


GRANTS: Mapping[str, Grant] = {
    **{enclave: Grant(publish=(topic_of(enclave),)) for enclave in (*ENCLAVES, HONEST, REVOKED)},
    VICTIM: Grant(subscribe=(SECRET, *map(topic_of, (*ENCLAVES, HONEST, REVOKED)))),
}


@dataclass(frozen=True)
class Attempt:
    """``directory`` poses as somebody who may publish ``topic`` (a ROS name); ``None``: no security at all.

    ``claim``: the subject of the directory's certificate, and the one that a patched DDS library takes it
    for, to get past its own checks.
    """

    label: str
    directory: Path | None
    topic: str
    claim: tuple[str, str] | None = None

    def participant(self, patched: bool = False) -> Participant:
        names = ("PATCHED_SUBJECT", "PATCHED_CLAIM")
        environment = tuple(zip(names, self.claim, strict=True)) if patched and self.claim else ()
        return Participant(self.label, self.directory, (f"rt{self.topic}",), environment=environment)


def victim(directory: Path) -> Participant:
    return Participant(VICTIM, directory, subscribe=tuple(f"rt{topic}" for topic in GRANTS[VICTIM].subscribe))


@dataclass(frozen=True)
class Workshop:
    """Where attempts are prepared. ``keystore`` is the one attacked."""

    keystore: Path
    folder: Path

    def enclave(self, path: str) -> Path:
        return self.keystore / "enclaves" / path.lstrip("/")

    def honest(self, path: str) -> Attempt:
        """No attack: the enclave as it is, doing what it may."""
        return Attempt(f"honest {path}", self.enclave(path), topic_of(path))

    def borrowed(self) -> Iterator[Attempt]:
        """The identity of one with the (public, validly signed) permissions of another."""
        for borrower, lender in itertools.permutations(ENCLAVES, 2):
            permissions = (self.enclave(lender) / "permissions.p7s").read_bytes()
            label = borrowed_label(borrower, lender)
            attempt = self._attempt(label, borrower, topic_of(lender), {"permissions.p7s": permissions})
            claim = subject_of(self.enclave(borrower)), subject_of(self.enclave(lender))
            yield replace(attempt, claim=claim)

    def self_signed_permissions(self, path: str) -> Attempt:
        return self._attempt(
            f"self-signed permissions {path}", path, SECRET, {"permissions.p7s": self._forge(path)}
        )

    def self_signed_governance(self, path: str) -> Attempt:
        """Permissions and governance both: what is forged can then also be exempt from any check."""
        identity = Credential.read(self.enclave(path))
        governance = identity.sign(signed_text(self.enclave(path) / "governance.p7s"))
        return self._attempt(
            f"self-signed governance {path}",
            path,
            SECRET,
            {"permissions.p7s": self._forge(path), "governance.p7s": governance},
        )

    def tampered_permissions(self, path: str) -> Attempt:
        """The signed document edited, its signature left as it was."""
        document = (self.enclave(path) / "permissions.p7s").read_bytes()
        edited = document.replace(f"rt{topic_of(path)}<".encode(), f"rt{SECRET}<".encode())
        assert edited != document
        return self._attempt(f"tampered permissions {path}", path, SECRET, {"permissions.p7s": edited})

    def unknown_authority(self, path: str) -> Attempt:
        """Everything of a name that exists, from a CA of the attacker's own."""
        common_name = subject_of(self.enclave(path)).removeprefix("CN=")
        ca = issue("sros2CA", is_ca=True)
        identity = issue(common_name, ca)
        files = {
            "cert.pem": identity.certificate_pem,
            "key.pem": identity.key_pem,
            "identity_ca.cert.pem": ca.certificate_pem,
            "permissions_ca.cert.pem": ca.certificate_pem,
            "governance.p7s": ca.sign(signed_text(self.enclave(path) / "governance.p7s")),
            "permissions.p7s": ca.sign(self._permissions_with_secret(path)),
        }
        return self._attempt(f"unknown CA {path}", path, SECRET, files)

    def expired_identity(self, path: str, identity_ca: Credential) -> Attempt:
        """An identity the CA did issue, whose time is over."""
        common_name = subject_of(self.enclave(path)).removeprefix("CN=")
        identity = issue(common_name, identity_ca, days=-1)
        files = {"cert.pem": identity.certificate_pem, "key.pem": identity.key_pem}
        return self._attempt(f"expired identity {path}", path, topic_of(path), files)

    def stolen_copy(self, path: str) -> Attempt:
        """The enclave as it is now, kept for later. A thief does not keep the list of what is revoked."""
        return self._attempt(f"stolen {path}", path, topic_of(path), {})

    def _forge(self, path: str) -> bytes:
        return Credential.read(self.enclave(path)).sign(self._permissions_with_secret(path))

    def _permissions_with_secret(self, path: str) -> str:
        """The enclave's own permissions, and one more topic in every list."""
        document = signed_text(self.enclave(path) / "permissions.p7s")
        return document.replace("<topics>", f"<topics><topic>rt{SECRET}</topic>")

    def _attempt(self, label: str, path: str, topic: str, replaced: Mapping[str, bytes]) -> Attempt:
        directory = self.folder / re.sub(r"\W+", "_", label)
        directory.mkdir()
        for name in FILES:
            shutil.copyfile(self.enclave(path) / name, directory / name)
        for name, content in replaced.items():
            (directory / name).write_bytes(content)
        return Attempt(label, directory, topic)


def borrowed_label(borrower: str, lender: str) -> str:
    return f"{borrower} with permissions of {lender}"


def subject_of(directory: Path) -> str:
    return Credential.read(directory).certificate.subject.rfc4514_string()


def signed_text(path: Path) -> str:
    """The XML inside a signed document; anybody can read it."""
    text = path.read_bytes().replace(b"\r\n", b"\n").decode()
    start = text.index("Content-Type: text/plain")
    return text[text.index("<", start) : text.index("</dds>", start) + len("</dds>")] + "\n"
