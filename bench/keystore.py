"""A thousand enclaves: ours, SROS2's own code, and the floor that the cryptography and the file system set.

    python bench/keystore.py [COUNT]          COUNT enclaves (1000), each with 20 topics

    floor     P-256 key, certificate, PKCS#7 signature (both by ``cryptography``), five files, three links
    ours      ``provision`` of a new keystore, and again with nothing changed
    SROS2     create_enclave + create_permissions_from_policy_element, in an interpreter of its own; found
              through SROS2_PYTHON and SROS2_PYTHONPATH (see tests/keystore/sros2_peer.py), else "not available"

Every figure is the best of BENCH_RUNS (3): on a shared machine the lowest is the one least disturbed. With and
without fsync are told apart; SROS2 never calls it. ``BENCH_DIR`` chooses the file system.
"""

from __future__ import annotations

import datetime
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from cryptography import x509  # noqa: E402
from cryptography.hazmat.primitives import hashes, serialization  # noqa: E402
from cryptography.hazmat.primitives.asymmetric import ec  # noqa: E402
from cryptography.hazmat.primitives.serialization import pkcs7  # noqa: E402

import keystore  # noqa: E402
from keystore.formats.domains import Domains  # noqa: E402
from keystore.formats.permissions import permissions_document  # noqa: E402
from keystore.formats.policy import EnclavePolicy, Operation, Profile, Qualifier, Rule  # noqa: E402
from keystore.formats.validity import Validity, utc_now  # noqa: E402
from tests.keystore import sros2_peer  # noqa: E402

RUNS = int(os.environ.get("BENCH_RUNS", "3"))
# On a machine that others use too, BENCH_CLOCK=process_time counts only our own processor time.
CLOCK_NAME = os.environ.get("BENCH_CLOCK", "perf_counter")
CLOCK: Callable[[], float] = getattr(time, CLOCK_NAME)
TOPICS = 20
PEER_COUNT = 100

PEER = """
import pathlib, sys, time
from lxml import etree
from sros2 import keystore
root, count, topics = pathlib.Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
keystore.create_keystore(root)
rules = ''.join(f'<topic>t{n}</topic>' for n in range(topics))
def policy(name):
    return etree.fromstring(
        f'<policy version="0.2.0"><enclaves><enclave path="{name}"><profiles><profile ns="/" node="n">'
        f'<topics publish="ALLOW">{rules}</topics></profile></profiles></enclave></enclaves></policy>')
clock = getattr(time, sys.argv[4])
start = clock()
for number in range(count):
    name = f'/robot{number % 10}/node{number}'
    keystore.create_enclave(root, name)
    keystore._permission.create_permissions_from_policy_element(root, name, policy(name))
print(clock() - start)
"""


def policies(count: int) -> list[EnclavePolicy]:
    rules = tuple(Rule(Operation.PUBLISH, Qualifier.ALLOW, f"/t{number}") for number in range(TOPICS))
    profile = Profile("/", "n", rules)
    return [EnclavePolicy(f"/robot{number % 10}/node{number}", (profile,)) for number in range(count)]


def best(work: Callable[[Path], float]) -> float:
    """Seconds; each run in a directory of its own."""
    times = []
    for _ in range(RUNS):
        directory = Path(tempfile.mkdtemp(dir=os.environ.get("BENCH_DIR")))
        try:
            times.append(work(directory))
        finally:
            shutil.rmtree(directory)
    return min(times)


def timed(work: Callable[[], object]) -> float:
    start = CLOCK()
    work()
    return CLOCK() - start


class Floor:
    """What cannot be left out, done in the plainest way: no names checked, no policy read, nothing compared."""

    def __init__(self, fsync: bool):
        self._fsync = fsync
        self._ca_key = ec.generate_private_key(ec.SECP256R1())
        self._name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "CA")])
        self._begin = datetime.datetime(2026, 1, 1)
        self._ca = self._certificate(self._name, self._ca_key.public_key())
        validity = Validity.starting(utc_now())
        (policy,) = policies(1)
        self._document = permissions_document("CN=x", policy, validity=validity, domains=Domains.single(0))

    def _certificate(self, subject: x509.Name, key: ec.EllipticCurvePublicKey) -> x509.Certificate:
        return (
            x509.CertificateBuilder()
            .subject_name(subject)
            .issuer_name(self._name)
            .public_key(key)
            .serial_number(x509.random_serial_number())
            .not_valid_before(self._begin)
            .not_valid_after(self._begin + datetime.timedelta(days=3650))
            .add_extension(x509.BasicConstraints(False, None), critical=True)
            .sign(self._ca_key, hashes.SHA256())
        )

    def enclave(self, directory: Path) -> None:
        key = ec.generate_private_key(ec.SECP256R1())
        subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, directory.name)])
        certificate = self._certificate(subject, key.public_key())
        options = [pkcs7.PKCS7Options.Binary, pkcs7.PKCS7Options.DetachedSignature]
        builder = pkcs7.PKCS7SignatureBuilder().set_data(self._document)
        signed = builder.add_signer(self._ca, self._ca_key, hashes.SHA256()).sign(
            serialization.Encoding.DER, options
        )
        pem, pkcs8 = serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8
        os.mkdir(directory)
        self._write(f"{directory}/key.pem", key.private_bytes(pem, pkcs8, serialization.NoEncryption()))
        self._write(f"{directory}/cert.pem", certificate.public_bytes(pem))
        self._write(f"{directory}/permissions.xml", self._document)
        self._write(f"{directory}/permissions.p7s", self._document + signed)
        for name in ("identity_ca", "permissions_ca", "governance"):
            os.symlink("../x", f"{directory}/{name}")

    def _write(self, path: str, data: bytes) -> None:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        os.write(descriptor, data)
        if self._fsync:
            os.fsync(descriptor)
        os.close(descriptor)

    def run(self, root: Path, count: int) -> float:
        def all_of_them() -> None:
            for number in range(count):
                self.enclave(root / str(number))

        return timed(all_of_them)


def ours(root: Path, count: int, durable: bool) -> float:
    options = keystore.ProvisionOptions(durable=durable)
    return timed(lambda: keystore.provision(root / "ks", policies(count), options=options))


def unchanged(root: Path, count: int) -> float:
    ours(root, count, durable=False)
    return timed(lambda: keystore.provision(root / "ks", policies(count)))


def verified(root: Path, count: int) -> float:
    ours(root, count, durable=False)
    return timed(lambda: keystore.verify(root / "ks"))


def peer(root: Path) -> float:
    output = sros2_peer.run(PEER, root / "ks", str(PEER_COUNT), str(TOPICS), CLOCK_NAME, scratch=root)
    return float(output) / PEER_COUNT


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    best(lambda root: ours(root, 20, durable=False))  # imports and first use of OpenSSL are not per enclave
    floor = best(lambda root: Floor(False).run(root, count)) / count
    floor_fsync = best(lambda root: Floor(True).run(root, min(count, 200))) / min(count, 200)
    mine = best(lambda root: ours(root, count, durable=False)) / count
    mine_fsync = best(lambda root: ours(root, count, durable=True)) / count
    theirs = best(peer) if sros2_peer.available() else None

    print(f"{count} enclaves with {TOPICS} topics each, milliseconds per enclave\n")
    row("floor, no fsync", floor, floor, theirs)
    row("ours, not durable", mine, floor, theirs)
    row("floor, fsync of each file", floor_fsync, floor_fsync, theirs)
    row("ours, durable (default)", mine_fsync, floor_fsync, theirs)
    if theirs is None:
        print(f"{'SROS2':28} not available (SROS2_PYTHON, SROS2_PYTHONPATH)")
    else:
        row("SROS2's own code", theirs, floor, theirs)
    print()
    print(
        f"{'provision, nothing changed':28} {best(lambda root: unchanged(root, 50)) * 1000:8.2f} ms for 50 enclaves"
    )
    print(f"{'verify':28} {best(lambda root: verified(root, count)):8.2f} s for {count} enclaves")


def row(name: str, seconds: float, floor: float, theirs: float | None) -> None:
    compared = f"   {theirs / seconds:6.1f} times faster than SROS2" if theirs is not None else ""
    print(f"{name:28} {seconds * 1000:8.3f}   {seconds / floor:5.2f} times the floor{compared}")


if __name__ == "__main__":
    main()
