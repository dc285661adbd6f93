"""A statement in a DSSE envelope: what is signed, how it is laid out. Pure but for the signer.

Source: secure-systems-lab/dsse, protocol.md (version 1.0.2) and envelope.md. The signature covers type and content
together, so that nobody can show the content as another kind of document.
"""

from __future__ import annotations

import base64
import json
from typing import Any

from keystore.signing.public_key import fingerprint
from keystore.signing.signer import Signer, spki


def envelope(payload: bytes, payload_type: str, signer: Signer) -> dict[str, Any]:
    """Make the envelope with one signature; ``keyid`` is the SHA-256 of the public key in DER, in hex.

    Raises ``SigningUnavailableError`` as ``signer``.
    """
    signature = signer.sign(signed_bytes(payload, payload_type))
    key = {"keyid": fingerprint(spki(signer.public_key())), "sig": base64.b64encode(signature).decode()}
    return {"payload": base64.b64encode(payload).decode(), "payloadType": payload_type, "signatures": [key]}


def signed_bytes(payload: bytes, payload_type: str) -> bytes:
    """Return the pre-authentication encoding, which is what is signed."""
    kind = payload_type.encode()
    return b"DSSEv1 %d %b %d %b" % (len(kind), kind, len(payload), payload)


def envelope_text(content: dict[str, Any]) -> str:
    """Render an envelope as the JSON text that is written."""
    return json.dumps(content, indent=2) + "\n"
