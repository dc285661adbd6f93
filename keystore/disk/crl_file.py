"""The CRL in force: from when until when. Cheap: asked before a launch."""

from __future__ import annotations

from keystore.disk import layout, safe_files
from keystore.disk.view import KeystoreView
from keystore.errors import DamagedKeystore, printable
from keystore.formats import der
from keystore.formats.validity import Validity


def crl_validity(view: KeystoreView) -> Validity:
    """thisUpdate and nextUpdate of the CRL (RFC 5280 section 5.1)."""
    pem = safe_files.read(view.root, layout.CRL)
    place = printable(view.root / layout.CRL)
    try:
        body = pem.split(b"-----BEGIN X509 CRL-----")[1].split(b"-----END")[0]
        fields = der.parse(der.from_base64(body)).children()[0].children()
        times = [part for part in fields if part.tag in (der.UTC_TIME, der.GENERALIZED_TIME)]
        return Validity(der.time_value(times[0]), der.time_value(times[1]))
    except (IndexError, der.DerError):
        raise DamagedKeystore(f"{place} is no CRL with an end") from None
