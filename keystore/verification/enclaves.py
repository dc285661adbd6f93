"""Each enclave: key, certificate, permissions, links, and whether they belong together."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime

from cryptography import x509

from enclave_common.terminal import quoted
from enclave_common.words import counted, some_of
from keystore.disk import layout, safe_files
from keystore.disk.register_file import needs_register
from keystore.disk.signed_documents import foreign_document, governance_in_force
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystoreError, KeystoreError, OtherFormError, UnsafeKeystoreError
from keystore.formats.certificate import NOT_OUR_FORM, CertificateFacts, read_certificate
from keystore.formats.compact import compact_nodes
from keystore.formats.domains import Domains
from keystore.formats.permissions import DdsRules, Permissions, TopicSets
from keystore.formats.permissions_document import parse_permissions
from keystore.formats.permissions_patterns import EVERY_KIND, has_wildcard
from keystore.formats.permissions_size import FAST_DDS_LIMIT_BYTES, WARN_BYTES
from keystore.formats.register import Register
from keystore.formats.role import Role
from keystore.formats.subject import (
    SubjectScheme,
    borrowable,
    indistinguishable,
    names_enclave,
    scheme_of,
    subject_name,
)
from keystore.formats.validity import Validity, iso, why_not_valid
from keystore.signing import smime
from keystore.signing.public_key import (
    cyclone_takes,
    fingerprint,
    is_our_form,
    is_weak,
    issued_by,
    key_kind,
    key_matches,
)
from keystore.verification import repair
from keystore.verification.finding import Finding, Severity
from keystore.verification.governance import check_domains
from keystore.verification.issued import check_certificate_issued, check_permissions_issued

_TOKEN_URI = re.compile(rb"pkcs11:[!-~]*?(?:object|id)=[!-~]+\s*\Z")
_BROKEN_HASHES = frozenset({"md5", "sha1"})


def check_enclaves(
    view: KeystoreView, register: Register | None, revoked: frozenset[int], now: datetime
) -> Iterator[Finding]:
    """Check every enclave, and what enclaves must not share."""
    names: dict[str, str] = {}
    serials: dict[int, str] = {}
    owners = {facts.public_key: f"the {role.value}" for role in Role for facts in view.ca_bundle(role)}
    granted: dict[str, Domains] = {}
    for enclave in view.enclaves():
        check = _EnclaveCheck(view, register, enclave, revoked, now)
        yield from check.findings()
        if check.domains is not None:
            granted[enclave] = check.domains
        if check.facts is None:
            continue
        names[enclave] = check.facts.common_name or ""
        other = serials.setdefault(check.facts.serial, enclave)
        if other != enclave:
            yield check.error(
                "serial-reused", layout.CERT, f"same serial number as {other}; one CRL entry hits both"
            )
        # One key, one enclave: who has the key of two is both, and who has a CA's is everybody.
        holder = owners.setdefault(check.facts.public_key, f"enclave {enclave}")
        if holder != f"enclave {enclave}":
            yield check.leaf(Severity.ERROR, "shared-key", f"has the same key as {holder}")
    yield from _check_subjects(view, names)
    with contextlib.suppress(KeystoreError):  # of the governance, which is reported where it is checked
        yield from check_domains(view.root, governance_in_force(view), granted)


def _check_subjects(view: KeystoreView, names: dict[str, str]) -> Iterator[Finding]:
    compatible = [enclave for enclave, cn in names.items() if scheme_of(cn) is SubjectScheme.COMPATIBLE]
    pairs = borrowable(names)
    if pairs:
        yield Finding(
            Severity.EXPOSURE, "borrowed-permissions", layout.ENCLAVES,
            f"on Cyclone DDS (every version so far) {indistinguishable(pairs)}: it compares subjects as "
            "bags of path segments",
            repair.renew(view.root, "--all", note="gives exact subjects"),
        )  # fmt: skip
    elif compatible:
        yield Finding(
            Severity.NOTE, "compatible-subjects", layout.ENCLAVES,
            f"{counted(len(compatible), 'enclave')} with SROS2's subjects (CN=/path); a new enclave could make their "
            "permissions borrowable on Cyclone DDS",
            repair.renew(view.root, *compatible, note="gives exact subjects"),
        )  # fmt: skip


@dataclass
class _EnclaveCheck:
    """One enclave; ``facts`` of its certificate and ``domains`` of its permissions are known after ``findings``."""

    _view: KeystoreView
    _register: Register | None
    _enclave: str
    _revoked: frozenset[int]
    _now: datetime
    facts: CertificateFacts | None = None
    domains: Domains | None = None

    @property
    def _directory(self) -> str:
        return layout.enclave_directory(self._enclave)

    def error(self, code: str, file: str, message: str) -> Finding:
        return self._finding(Severity.ERROR, code, file, message, self._renew())

    def _renew(self) -> str:
        return repair.renew(self._view.root, self._enclave)

    def _distrusted(self, code: str, message: str) -> Finding:
        again = repair.grant_again(self._view.root, self._enclave)
        return self._finding(Severity.ERROR, code, layout.PERMISSIONS, message, again)

    def _finding(self, severity: Severity, code: str, file: str, message: str, fix: str = "") -> Finding:
        return Finding(severity, code, f"{self._directory}/{file}".rstrip("/"), message, fix)

    def _read(self, name: str) -> bytes | None:
        return safe_files.read_if_there(self._view.root, f"{self._directory}/{name}")

    def findings(self) -> Iterator[Finding]:
        try:
            yield from self._missing()
            yield from self._token()
            yield from self._certificate()
            yield from self._links()
            yield from self._permissions()
        except UnsafeKeystoreError:
            return  # the check of all files names it, with what to do about it
        except KeystoreError as error:
            yield self.error("unreadable", "", str(error))

    def _missing(self) -> Iterator[Finding]:
        elsewhere = self._view.has_request(self._enclave) or self._read(layout.KEY_URI) is not None
        for name in layout.RUNTIME_FILES:
            if name == layout.KEY and elsewhere:
                continue  # the key is on its host, or in a token
            if self._read(name) is None:
                yield self.error("missing", name, "missing: a process cannot start with this enclave")

    def _token(self) -> Iterator[Finding]:
        uri = self._read(layout.KEY_URI)
        if uri is not None and not _TOKEN_URI.match(uri):
            fix = repair.run_on(self._view.root, "rm", f"{self._directory}/{layout.KEY_URI}", "then renew it")
            text = "is not a pkcs11: URI that names a key (object= or id=)"
            yield self._finding(Severity.ERROR, "key", layout.KEY_URI, text, fix)

    def _certificate(self) -> Iterator[Finding]:
        pem = self._read(layout.CERT)
        if pem is None:
            return
        try:
            self.facts = read_certificate(pem, layout.CERT)
        except DamagedKeystoreError as error:
            yield self.error("certificate", layout.CERT, str(error))
            return
        yield from self._chain(self.facts)
        yield from self._subject(self.facts)
        yield from self._profile(self.facts)
        if self.facts.serial not in self._revoked:
            yield from check_certificate_issued(self._view, self._register, self._enclave, self.facts)
        key = self._read(layout.KEY)
        if key is not None and not is_our_form(key):
            fix = repair.renew(self._view.root, self._enclave, "--new-keys")
            yield self._finding(
                Severity.ERROR, "key", layout.KEY, f"not a usable private key: {NOT_OUR_FORM}", fix
            )
        elif key is not None and not key_matches(key, self.facts):
            text = "does not belong to cert.pem; Cyclone DDS starts but never talks"
            yield self.error("key-mismatch", layout.KEY, text)
        kind = key_kind(self.facts.public_key)
        if not cyclone_takes(self.facts.public_key):
            text = f"a {kind} key: Cyclone DDS refuses it, Fast DDS accepts it"
            yield self._finding(Severity.WARNING, "key-kind", layout.CERT, text)
        if is_weak(self.facts.public_key):
            text = f"a {kind} key, which is weak: who breaks it is this enclave"
            yield self.leaf(Severity.EXPOSURE, "weak-key", text)

    def _chain(self, facts: CertificateFacts) -> Iterator[Finding]:
        bundle = self._view.ca_bundle(Role.IDENTITY)
        issuer = next((ca for ca in bundle if issued_by(facts, ca)), None)
        if issuer is None:
            yield self.error("wrong-ca", layout.CERT, "not signed by the identity CA of this keystore")
        elif facts.validity.not_after > issuer.validity.not_after:
            yield self._finding(
                Severity.WARNING, "outlives-ca", layout.CERT,
                f"valid until {iso(facts.validity.not_after)}, its CA until {iso(issuer.validity.not_after)}",
            )  # fmt: skip
        if not facts.validity.covers(self._now):
            code = "expired" if facts.validity.not_after < self._now else "not-yet-valid"
            yield self.error(code, layout.CERT, why_not_valid(facts.validity, self._now))
        if facts.serial in self._revoked:
            remedy = (self._enclave, "--new-keys")
            fix = repair.renew(self._view.root, *remedy, note="or secure-keystore remove")
            yield self._finding(Severity.ERROR, "revoked", layout.CERT, "revoked: peers refuse it", fix)
        if facts.can_sign_mail and self._view.shares_one_ca:
            yield self._finding(
                Severity.EXPOSURE, "leaf-can-sign", layout.CERT,
                "its key can sign permissions that older DDS versions accept (shared CA, no EKU)",
                repair.renew(self._view.root),
            )  # fmt: skip

    def _profile(self, facts: CertificateFacts) -> Iterator[Finding]:
        # RFC 5280 sections 4.2.1.3, 4.2.1.9.
        algorithm = facts.certificate.signature_hash_algorithm
        if algorithm is None or algorithm.name in _BROKEN_HASHES:
            text = f"signed with {'no hash' if algorithm is None else algorithm.name}, which can be forged"
            yield self.leaf(Severity.EXPOSURE, "weak-signature", text)
        constraints = facts.extension(x509.BasicConstraints)
        if constraints is not None and constraints.ca:
            text = "a CA certificate: its key can certify enclaves of its own"
            yield self.leaf(Severity.ERROR, "leaf-is-ca", text)
        yield from self._key_usage(facts.extension(x509.KeyUsage))
        if facts.extension(x509.ExtendedKeyUsage) is None:
            text = "its certificate does not forbid its key to sign documents: if a permissions CA certified it, it can"
            yield self.leaf(Severity.WARNING, "no-extended-key-usage", text)

    def _key_usage(self, usage: x509.KeyUsage | None) -> Iterator[Finding]:
        if usage is None:
            yield self.leaf(Severity.WARNING, "no-key-usage", "nothing restricts what its key may do")
        elif usage.key_cert_sign or usage.crl_sign:
            yield self.leaf(Severity.ERROR, "leaf-can-certify", "its key may sign certificates or CRLs")
        elif not usage.digital_signature:
            text = "its key may not sign, which authentication needs"
            yield self.leaf(Severity.WARNING, "key-usage", text)

    def leaf(self, severity: Severity, code: str, message: str) -> Finding:
        fix = repair.renew(self._view.root, self._enclave, "--new-keys", "--revoke-old")
        return self._finding(severity, code, layout.CERT, message, fix)

    def _subject(self, facts: CertificateFacts) -> Iterator[Finding]:
        if not names_enclave(facts.common_name, self._enclave) or facts.name_parts != 1:
            yield self.error("wrong-subject", layout.CERT, "its subject is not that of this enclave")

    def _links(self) -> Iterator[Finding]:
        if self._view.has_crl and self._read(layout.ENCLAVE_CRL) is None:
            yield self.error("no-crl", layout.ENCLAVE_CRL, "missing: this enclave would accept revoked peers")
        for name in layout.enclave_links(self._enclave, crl=self._view.has_crl):
            relative = f"{self._directory}/{name}"
            if safe_files.link_target(self._view.root, relative) is not None:
                continue  # the target was checked with all files
            copy = self._read(name)
            source = layout.link_source(name)
            if copy is not None and copy != safe_files.read_if_there(self._view.root, source):
                yield self.error("copy-differs", name, f"a copy that differs from {source}")

    def _permissions(self) -> Iterator[Finding]:
        p7s = self._read(layout.PERMISSIONS)
        if p7s is None:
            return
        place = f"{self._directory}/{layout.PERMISSIONS}"
        try:
            signed = smime.read(p7s, place)
            smime.check(signed, self._view.ca_bundle(Role.PERMISSIONS), place)
            permissions = parse_permissions(signed.document, place)
        except OtherFormError as error:
            yield self._foreign(error)
            return
        except KeystoreError as error:
            yield self._distrusted("permissions", str(error))
            return
        if not signed.embeds(self._view.ca(Role.PERMISSIONS).der):
            yield self.error(
                "embedded-differs", layout.PERMISSIONS,
                "carries another certificate than that of the permissions CA: older DDS versions refuse it",
            )  # fmt: skip
        yield from check_permissions_issued(self._view, self._register, self._enclave, signed.document)
        twin = self._read(layout.PERMISSIONS_XML)
        if twin is not None and twin.replace(b"\r\n", b"\n") != signed.document:
            yield self.error(
                "twin-differs", layout.PERMISSIONS_XML, "differs from the signed permissions.p7s in force"
            )
        yield from self._grant(permissions)
        if len(p7s) >= WARN_BYTES:
            severity = Severity.ERROR if len(p7s) > FAST_DDS_LIMIT_BYTES else Severity.WARNING
            text = f"{len(p7s)} bytes; Fast DDS carries at most {FAST_DDS_LIMIT_BYTES}"
            fix = repair.run(
                self._view.root, "create", "--compact", note="then apply-policy or a launch; or split it"
            )
            if self._view.key_file(Role.PERMISSIONS) is None:
                fix = repair.renew(self._view.root, self._enclave)
            elif compact_nodes(permissions.rules.allow.publish):
                fix = "split the enclave: give some of its nodes their own (enclave=)"
            yield self._finding(severity, "too-large", layout.PERMISSIONS, text, fix)

    def _foreign(self, error: OtherFormError) -> Finding:
        """Report what is not as we write it: to be taken over where another tool made the keystore, else distrusted."""
        try:
            foreign_document(self._view, f"{self._directory}/{layout.PERMISSIONS}")
        except KeystoreError as worse:
            return self._distrusted("permissions", str(worse))
        last = self._register.permissions(self._enclave) if self._register is not None else None
        twin = self._read(layout.PERMISSIONS_XML)
        if last is not None and twin is not None and fingerprint(twin) == last.document:
            fix = repair.renew(self._view.root, self._enclave, note="signs permissions.xml again")
        elif needs_register(self._view):
            fix = repair.renew(self._view.root, note="takes the keystore over")
        else:
            fix = repair.grant_again(self._view.root, self._enclave)
        return self._finding(Severity.ERROR, "other-form", layout.PERMISSIONS, str(error), fix)

    def _grant(self, permissions: Permissions) -> Iterator[Finding]:
        self.domains = permissions.domains
        if self.facts is None:
            return
        if permissions.subject != subject_name(self.facts.common_name or ""):
            text = f"for {quoted(permissions.subject)}, which is not the subject of cert.pem"
            yield self._distrusted("wrong-grant", text)
            return
        yield from self._validity(permissions.validity, self.facts.validity)
        rules = permissions.rules
        wide = sorted({one for one in (*rules.allow.publish, *rules.allow.subscribe) if has_wildcard(one)})
        if not wide:
            return
        shown = ", ".join(wide[:4]) + (" ..." if len(wide) > 4 else "")
        kinds = {direction: _open_kinds(rules, direction) for direction in TopicSets._fields}
        everything = [direction for direction, found in kinds.items() if len(found) == len(EVERY_KIND)]
        if everything:
            text = f"may {' and '.join(everything)} everything, or nearly, by {shown} (* also matches /)"
            fix = repair.run(self._view.root, "apply-policy", "POLICY.xml", note="that names what it needs")
            yield self._finding(Severity.EXPOSURE, "everything", layout.PERMISSIONS, text, fix)
            return
        opened = [f"{direction} {kind}" for direction, found in kinds.items() for kind in found]
        text = f"grants by wildcard (* also matches /): {shown}" + "".join(
            f"; it may {one}" for one in opened
        )
        if compact := compact_nodes(rules.allow.publish):
            text += f"; compact: the parameter services of {some_of(compact, 4)}"
        yield self._finding(Severity.NOTE, "wildcard", layout.PERMISSIONS, text)

    def _validity(self, permissions: Validity, certificate: Validity) -> Iterator[Finding]:
        if not permissions.covers(self._now):
            code = "permissions-expired" if permissions.not_after < self._now else "permissions-not-yet-valid"
            yield self.error(code, layout.PERMISSIONS, why_not_valid(permissions, self._now))
        elif permissions.not_after != certificate.not_after:
            text = "not valid as long as the certificate"
            yield self._finding(Severity.WARNING, "validity-differs", layout.PERMISSIONS, text, self._renew())


def _open_kinds(rules: DdsRules, direction: str) -> list[str]:
    """Return of which kinds it grants all names, or nearly: most of those that have nothing in common."""
    return [
        kind
        for kind, names in EVERY_KIND.items()
        if sum(rules.permits(direction, name) for name in names) * 4 >= len(names) * 3
    ]
