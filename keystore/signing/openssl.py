"""OpenSSL's own judgement of certificates: Cyclone DDS and Fast DDS leave theirs to it (X509_verify_cert).

It is asked because it refuses what no rule of ours names: extensions that it does not know, constraints of names, an
intermediate without its root. Asked is the program ``openssl``, once for any number of certificates.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from keystore.errors import InvalidInputError, NotInstalledError, StorageError, storage_errors
from keystore.formats.certificate import CertificateFacts
from keystore.formats.role import Role

_COMMAND = ("openssl", "verify", "-no-CApath", "-no-CAstore", "-no_check_time", "-CAfile", "ca")
_AS_DDS = {
    Role.IDENTITY: ("-policy_check",),  # Fast DDS; Cyclone DDS asks for nothing more
    Role.PERMISSIONS: ("-verify_name", "smime_sign"),  # of PKCS7_verify, which reads signed documents
}
_AT_ONCE = 1000  # names on a command line
_SECONDS = 60
_ERROR = re.compile(r"error (\d+) at \d+ depth lookup: (.*)")
_END = re.compile(r"error (\d+): verification failed$")
_PLAIN = "a self-signed CA without critical extensions that OpenSSL does not know"
_WANTED = {
    Role.IDENTITY: f"{_PLAIN} and without constraints of names",
    Role.PERMISSIONS: f"{_PLAIN}, whose extended key usage, if it has one, includes emailProtection",
}


def refusals(ca: CertificateFacts, certificates: Sequence[CertificateFacts], role: Role) -> list[str]:
    """Return why OpenSSL refuses each certificate where ``ca`` alone is trusted for ``role``; "" where it does not.

    Dates are not looked at. Raises NotInstalledError without the program, StorageError.
    """
    found: list[str] = []
    with storage_errors("asking OpenSSL"), TemporaryDirectory() as folder:
        (Path(folder) / "ca").write_bytes(ca.pem)
        for start in range(0, len(certificates), _AT_ONCE):
            names = [str(start + at) for at in range(len(certificates[start : start + _AT_ONCE]))]
            for name in names:
                (Path(folder) / name).write_bytes(certificates[int(name)].pem)
            found += _asked(folder, names, role)
    return found


def _asked(folder: str, names: list[str], role: Role) -> list[str]:
    try:
        done = subprocess.run(
            [*_COMMAND, *_AS_DDS[role], *names],
            cwd=folder, capture_output=True, text=True, errors="replace", timeout=_SECONDS,
        )  # fmt: skip
    except FileNotFoundError:
        raise NotInstalledError("the program openssl is not installed: apt install openssl") from None
    except subprocess.TimeoutExpired:
        raise StorageError(f"openssl verify gave no answer within {_SECONDS} s") from None
    accepted, refused, told = set(done.stdout.splitlines()), dict[str, str](), list[str]()
    for line in done.stderr.splitlines():
        if error := _ERROR.match(line):
            told.append(f"{error[2]} (error {error[1]})")
        elif end := _END.match(line):
            refused[end[1]], told = ", ".join(dict.fromkeys(told)), []
    return ["" if f"{name}: OK" in accepted else refused.get(name) or "it cannot be read" for name in names]


def refuse_unfit_ca(
    ca: CertificateFacts, role: Role, place: str, probe: CertificateFacts | None = None
) -> None:
    """Raise InvalidInputError if OpenSSL refuses the CA, or ``probe``, a certificate for an enclave signed by it."""
    for why in refusals(ca, [ca, *([probe] if probe is not None else [])], role):
        if why:
            raise InvalidInputError(
                f"{place} cannot be the {role.label}: OpenSSL, by which DDS implementations check, refuses what it "
                f"signs: {why}; give {_WANTED[role]}"
            )
