"""Whether a private key and a certificate belong together. Its own module: a launch asks it of every enclave."""

from __future__ import annotations

import binascii

from keystore.errors import SigningUnavailableError
from keystore.formats.certificate import CertificateFacts


def key_matches(key_pem: bytes, facts: CertificateFacts) -> bool:
    """Whether the key's file carries the certificate's public point (PKCS#8 and SEC1 files of OpenSSL do).

    Only when it does not, or for RSA, ``cryptography`` has to load the key.
    """
    point = facts.public_key[-65:]
    try:
        body = key_pem.split(b"-----", 4)[2]
        if point[0] == 4 and point in binascii.a2b_base64(body):
            return True
    except (IndexError, binascii.Error):
        pass
    return _key_matches_slowly(key_pem, facts)


def _key_matches_slowly(key_pem: bytes, facts: CertificateFacts) -> bool:
    from keystore.signing.authority import spki
    from keystore.signing.identity import public_half

    try:
        return spki(public_half(key_pem, "the enclave's key")) == facts.public_key
    except SigningUnavailableError:
        return False
