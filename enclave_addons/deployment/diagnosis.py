"""Find the one cause for which processes of a keystore stay silent on this machine.

Asked are the clock, then the owner of the files, the CRL, domains, validity, the CAs, the other files, tokens, the
middleware and discovery. Each can be the reason for all that follow, so the first cause is the one to repair.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from enclave_common.terminal import printable
from enclave_launch.admission.middleware import ZENOH, Vendor, middleware_of, vendor_of, why_not
from enclave_launch.admission.variables import DOMAIN, discovery_is_off, domain_of, foreign_configurations
from enclave_launch.errors import UsageError
from keystore.disk import layout
from keystore.disk.view import KeystoreView, keystore_at
from keystore.errors import InvalidInputError, KeystoreError, StorageError
from keystore.formats.domains import Domains
from keystore.formats.permissions_document import parse_permissions
from keystore.signing import smime
from keystore.verification import Finding, Severity, verify

STEPS = (
    "clock", "owner", "CRL", "domain", "validity", "CA", "files", "token", "middleware", "discovery",
)  # fmt: skip
_STEP_OF_CODE = {
    "clock": "clock",
    **dict.fromkeys(
        (
            "foreign-owner",
            "unsafe-owner",
            "replaceable",
            "writable-by-others",
            "readable-by-others",
            "hard-link",
        ),
        "owner",
    ),
    **dict.fromkeys(("crl", "crl-expired", "crl-not-last", "no-crl", "revoked"), "CRL"),
    "domain-not-governed": "domain",
    **dict.fromkeys(("expired", "permissions-expired"), "validity"),
    **dict.fromkeys(
        (
            *("wrong-ca", "ca-unfit", "ca-refused", "ca-signature", "foreign-ca"),
            *("certificate-refused", "embedded-differs"),
        ),
        "CA",
    ),
    "too-large": "middleware",
}
"""Codes of ``verify`` by the step that asks for them. All other errors are of ``files``."""
_CYCLONE_REFUSES = frozenset({"key-kind", "ca-key-kind"})
_MODULE_PATH = re.compile(r"[?&]module-path=([^&]+)")


@dataclass(frozen=True)
class SilenceCause:
    """A cause for which processes are silent. ``step`` is one of ``STEPS``, and ``repair`` works on this machine."""

    step: str
    text: str
    repair: str


@dataclass(frozen=True)
class Diagnosis:
    """The first cause, or none. ``passed``: the steps that found nothing."""

    keystore: Path
    passed: tuple[str, ...]
    cause: SilenceCause | None


def diagnose(
    keystore: Path, enclave: str | None, environment: Mapping[str, str], working_directory: Path
) -> Diagnosis:
    """Ask step by step and stop at the first cause.

    Args:
        keystore: The keystore, as the processes name it.
        enclave: The enclave whose processes are silent, ``None`` for all.
        environment: That of the processes.
        working_directory: Where they run, since middlewares read files there.

    Raises:
        NotAKeystoreError: There is no complete keystore.
        InvalidInputError: There is no such enclave.
    """
    try:
        view = keystore_at(keystore)
        if enclave is not None:
            view.require_enclaves([enclave])
        findings = [one for one in verify(keystore).findings if _concerns(one, enclave)]
    except StorageError as error:
        text = "run it as the user of the processes, who must be able to read the keystore"
        return Diagnosis(keystore, ("clock",), SilenceCause("owner", str(error), text))
    asked = _Asked(view, enclave, environment, working_directory, findings)
    passed: list[str] = []
    for step in STEPS:
        cause = next(asked.causes(step), None)
        if cause is not None:
            return Diagnosis(view.root, tuple(passed), cause)
        passed.append(step)
    return Diagnosis(view.root, tuple(passed), None)


def _concerns(finding: Finding, enclave: str | None) -> bool:
    """Return whether a finding is of this enclave, or of the whole keystore."""
    folder, _, name = finding.place.rpartition("/")
    if (
        enclave is None
        or not finding.place.startswith(f"{layout.ENCLAVES}/")
        or name.startswith("governance")
    ):
        return True
    return layout.enclave_directory(enclave) in (folder, finding.place)


@dataclass(frozen=True)
class _Asked:
    """One machine, one keystore, and what ``verify`` found there."""

    view: KeystoreView
    enclave: str | None
    environment: Mapping[str, str]
    working_directory: Path
    findings: list[Finding]

    def causes(self, step: str) -> Iterator[SilenceCause]:
        """Yield the causes of one step."""
        for one in self.findings:
            if _STEP_OF_CODE.get(one.code, "files") == step and self._silences(one):
                yield SilenceCause(step, f"{printable(one.place)}: {one.message}", one.repair)
        own: dict[str, Callable[[], Iterator[SilenceCause]]] = {
            "domain": self._domain,
            "token": self._token,
            "middleware": self._middleware,
            "discovery": self._discovery,
        }
        if step in own:
            yield from own[step]()

    def _silences(self, finding: Finding) -> bool:
        if finding.code == "too-large":
            return finding.severity is Severity.ERROR and self._vendor is not Vendor.CYCLONE
        return finding.severity is Severity.ERROR

    @property
    def _name(self) -> str:
        return middleware_of(self.environment)

    @property
    def _vendor(self) -> Vendor | None:
        return vendor_of(self._name)

    def _enclaves(self) -> Iterable[str]:
        return self.view.enclaves() if self.enclave is None else (self.enclave,)

    def _domain(self) -> Iterator[SilenceCause]:
        try:
            domain = domain_of(self.environment)
        except UsageError as error:
            yield SilenceCause("domain", str(error), f"export {DOMAIN}=0")
            return
        for enclave in self._enclaves():
            domains = self._domains_of(enclave)
            if domains is not None and not domains.covers(Domains.single(domain)):
                first = domains.ranges[0][0]
                yield SilenceCause(
                    "domain",
                    f"the permissions of {enclave} are for domains {domains}, and {DOMAIN} is {domain}: Cyclone DDS "
                    "refuses the participant there, Fast DDS each endpoint",
                    f"export {DOMAIN}={first}  # or, where the CA keys are: {DOMAIN}={domain} secure-launch --secure "
                    "--provision-only, then secure-keystore export",
                )

    def _domains_of(self, enclave: str) -> Domains | None:
        place = layout.enclave_file(enclave, layout.PERMISSIONS)
        try:
            p7s = self.view.enclave_file(enclave, layout.PERMISSIONS)
            return None if p7s is None else parse_permissions(smime.read(p7s, place).document, place).domains
        except KeystoreError:
            return None  # reported by verify

    def _token(self) -> Iterator[SilenceCause]:
        for enclave in self._enclaves():
            uri = self.view.enclave_file(enclave, layout.KEY_URI)
            if uri is None:
                continue
            text = uri.decode(errors="replace").strip()
            module = _MODULE_PATH.search(text)
            if self._vendor is Vendor.CYCLONE:
                yield SilenceCause(
                    "token",
                    f"the key of {enclave} is in a token, which Cyclone DDS 0.10 cannot use",
                    "export RMW_IMPLEMENTATION=rmw_fastrtps_cpp",
                )
            elif module is not None and not Path(unquote(module[1])).is_file():
                yield SilenceCause(
                    "token",
                    f"the PKCS#11 module of {enclave} is not here: {printable(unquote(module[1]))}",
                    "install it, or correct module-path in key.p11",
                )

    def _middleware(self) -> Iterator[SilenceCause]:
        if (why := why_not(self._name)) is not None:
            text = f"RMW_IMPLEMENTATION is {printable(self._name)}: {why}"
            yield SilenceCause("middleware", text, "export RMW_IMPLEMENTATION=rmw_fastrtps_cpp")
        for one in self.findings if self._vendor is Vendor.CYCLONE else ():
            if one.code in _CYCLONE_REFUSES:
                text = f"{printable(one.place)}: {one.message}"
                yield SilenceCause("middleware", text, "export RMW_IMPLEMENTATION=rmw_fastrtps_cpp")
        if (
            self._name == ZENOH
            and self.enclave is not None
            and self.enclave not in self.view.zenoh_enclaves()
        ):
            text = f"{self.enclave} has no session configuration for Zenoh"
            command = f"secure-keystore zenoh {shlex.quote(str(self.view.root))} --enclave {self.enclave}"
            yield SilenceCause("middleware", text, command)

    def _discovery(self) -> Iterator[SilenceCause]:
        on_fast = self._vendor is Vendor.FAST
        for found in foreign_configurations(self.environment, self.working_directory, on_fast=on_fast):
            where = printable(str(self.working_directory))
            gone = (
                f"unset {found.variable}" if found.variable in self.environment else f"remove it from {where}"
            )
            yield SilenceCause("discovery", f"{found.variable} {found.why}: {printable(found.value)}", gone)
        if discovery_is_off(self.environment):
            text = "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF: processes discover no others"
            yield SilenceCause("discovery", text, "export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET")


def keystore_and_enclave(words: list[str]) -> tuple[Path, str | None]:
    """Return the keystore and the enclave among one or two words, in either order.

    Raises:
        InvalidInputError: Neither of two words is a folder.
    """
    if len(words) == 1:
        return Path(words[0]), None
    folders = [word for word in reversed(words) if Path(word).is_dir()]
    if not folders:
        raise InvalidInputError(f"neither {printable(words[0])} nor {printable(words[1])} is a keystore")
    enclave = words[0] if folders[0] == words[1] else words[1]
    return Path(folders[0]), enclave
