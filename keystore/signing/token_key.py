"""A CA key in a PKCS#11 token (HSM, smart card, SoftHSM2), by the ``pkcs11:`` URI of RFC 7512.

Optional: needs ``python-pkcs11`` (``pip install python-pkcs11``). The URI names token and
object; the module comes from ``module-path`` or ``PKCS11_MODULE_PATH``, the PIN from a ``Secret`` or
``pin-source``. A ``pin-value`` in a URI is refused: such a file would carry the secret in clear.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn
from urllib.parse import unquote

import cryptography
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.asymmetric.utils import Prehashed, encode_dss_signature
from cryptography.hazmat.primitives.serialization import load_der_public_key

from keystore.errors import InvalidInputError, SigningUnavailableError
from keystore.signing.ca_access import CaAccess, Secret
from keystore.signing.private_key import PrivateKey, PublicKey, load_private_key

MODULE_VARIABLE = "PKCS11_MODULE_PATH"
TOKENS_SINCE = 41
"""The release of ``cryptography`` from which on its builders sign with a key that is not its own."""


def parse_uri(uri: str) -> dict[str, str]:
    """Parse the attributes of a ``pkcs11:`` URI, percent-decoded; raises InvalidInputError without showing the URI."""
    body = uri.removeprefix("pkcs11:")
    path, _, query = body.partition("?")
    attributes: dict[str, str] = {}
    for part in (*path.split(";"), *query.split("&")):
        name, found, value = part.partition("=")
        if part and (not found or name in attributes):
            raise InvalidInputError("a pkcs11: URI consists of different name=value pairs (RFC 7512)")
        if part:
            attributes[name] = unquote(value)
    if "pin-value" in attributes:
        raise InvalidInputError(
            "pin-value in a pkcs11: URI stores the PIN in clear; use pin-source or --pin-file"
        )
    if not {"object", "id"} & attributes.keys():
        raise InvalidInputError("a pkcs11: URI must name the key with object= or id=")
    return attributes


class _TokenKey:
    """Sign with a key in a token through the interface of a ``cryptography`` private key.

    The session with the token stays open as long as this object. The key itself stays in the token: ``sign`` and
    ``public_key`` work, everything else raises SigningUnavailableError.
    """

    def __init__(self, key: Any, public: PublicKey):
        self._key = key
        self._public = public

    def public_key(self) -> Any:
        return self._public

    @property
    def key_size(self) -> int:
        return self._public.key_size

    def sign(self, data: Any, *parameters: Any) -> bytes:
        import pkcs11
        import pkcs11.exceptions

        if not any(isinstance(getattr(part, "algorithm", part), hashes.SHA256) for part in parameters):
            raise SigningUnavailableError("a token signs with SHA-256 only")
        if any(isinstance(part, Prehashed) for part in parameters):
            raise SigningUnavailableError("a token is given data, not digests")
        try:
            if self._key.key_type == pkcs11.KeyType.RSA:
                return bytes(self._key.sign(bytes(data), mechanism=pkcs11.Mechanism.SHA256_RSA_PKCS))
            return _sign_ecdsa(pkcs11, self._key, bytes(data))
        except pkcs11.exceptions.PKCS11Error as error:
            raise SigningUnavailableError(
                f"the PKCS#11 token refused to sign: {type(error).__name__}"
            ) from None

    def _refuse(self, *_arguments: Any, **_named: Any) -> NoReturn:
        raise SigningUnavailableError("a key in a token can sign, nothing else")

    # ``signer``: of cryptography before 37
    exchange = decrypt = private_numbers = private_bytes = signer = _refuse

    def __copy__(self) -> Any:
        return self

    def __deepcopy__(self, _memo: dict[int, Any]) -> Any:
        return self


class _EcTokenKey(_TokenKey, ec.EllipticCurvePrivateKey):
    @property
    def curve(self) -> ec.EllipticCurve:
        key: ec.EllipticCurvePublicKey = self.public_key()
        return key.curve


class _RsaTokenKey(_TokenKey, rsa.RSAPrivateKey):
    pass


def builder_key(key: PrivateKey) -> PrivateKey:
    """Return ``key``, for the builders of ``cryptography`` to sign with.

    Raises SigningUnavailableError for a token's if ``cryptography`` is too old.
    """
    if isinstance(key, _TokenKey) and int(cryptography.__version__.split(".")[0]) < TOKENS_SINCE:
        raise SigningUnavailableError(
            f"a CA key in a token needs cryptography {TOKENS_SINCE} or newer, this is {cryptography.__version__}: "
            f"pip install 'cryptography>={TOKENS_SINCE}'"
        )
    return key


def _open_token(uri: str, pin: Secret | None, environment: Mapping[str, str]) -> PrivateKey:
    """Find the key in its token; raises SigningUnavailableError if module, token, PIN or key is missing."""
    attributes = parse_uri(uri)
    try:
        import pkcs11
        import pkcs11.exceptions
    except ImportError:
        raise SigningUnavailableError(
            "a key in a PKCS#11 token needs python-pkcs11: pip install python-pkcs11"
        ) from None
    try:
        key, public = _find(pkcs11, attributes, _module(attributes, environment), _pin(attributes, pin))
    except pkcs11.exceptions.PKCS11Error as error:
        raise SigningUnavailableError(f"the PKCS#11 token refused: {type(error).__name__}") from None
    except RuntimeError:
        raise SigningUnavailableError("the PKCS#11 module cannot be loaded; check module-path") from None
    is_ec = isinstance(public, ec.EllipticCurvePublicKey)
    return _EcTokenKey(key, public) if is_ec else _RsaTokenKey(key, public)


def _sign_ecdsa(pkcs11: Any, key: Any, data: bytes) -> bytes:
    """Sign with a hash made here, which suits every token; X.509 and CMS want r and s in DER."""
    raw = bytes(key.sign(hashlib.sha256(data).digest(), mechanism=pkcs11.Mechanism.ECDSA))
    half = len(raw) // 2
    return encode_dss_signature(int.from_bytes(raw[:half], "big"), int.from_bytes(raw[half:], "big"))


def _module(attributes: Mapping[str, str], environment: Mapping[str, str]) -> str:
    module = attributes.get("module-path") or environment.get(MODULE_VARIABLE)
    if not module:
        raise SigningUnavailableError(
            f"name the PKCS#11 module: module-path= in the URI or {MODULE_VARIABLE}"
        )
    return module


def _pin(attributes: Mapping[str, str], pin: Secret | None) -> str | None:
    source = attributes.get("pin-source")
    if pin is None and source:
        pin = Secret(file=Path(source.removeprefix("file:").replace("//", "/", 1)))
    return pin.value().decode("utf-8", "replace") if pin else None


def _find(pkcs11: Any, attributes: Mapping[str, str], module: str, pin: str | None) -> tuple[Any, PublicKey]:
    serial = attributes.get("serial", "").encode() or None
    token = pkcs11.lib(module).get_token(token_label=attributes.get("token"), token_serial=serial)
    session = _session(pkcs11, token, pin)
    wanted: dict[Any, Any] = {}
    if "object" in attributes:
        wanted[pkcs11.Attribute.LABEL] = attributes["object"]
    if "id" in attributes:
        wanted[pkcs11.Attribute.ID] = attributes["id"].encode("latin-1")
    key = _single(session, pkcs11.ObjectClass.PRIVATE_KEY, wanted, pkcs11)
    public = _single(session, pkcs11.ObjectClass.PUBLIC_KEY, wanted, pkcs11)
    return key, _public_key(pkcs11, public)


def _session(pkcs11: Any, token: Any, pin: str | None) -> Any:
    """Open a session. A login holds for all sessions of a process (PKCS#11 section 5.6): the second CA key needs
    none.
    """
    try:
        return token.open(user_pin=pin)
    except pkcs11.exceptions.UserAlreadyLoggedIn:
        return token.open()


def _single(session: Any, kind: Any, wanted: Mapping[Any, Any], pkcs11: Any) -> Any:
    found = list(session.get_objects({pkcs11.Attribute.CLASS: kind, **wanted}))
    if len(found) != 1:
        raise SigningUnavailableError(
            f"the token holds {len(found)} objects of kind {kind.name} with that object/id, one is needed"
        )
    return found[0]


def _public_key(pkcs11: Any, key: Any) -> PublicKey:
    if key.key_type == pkcs11.KeyType.RSA:
        from pkcs11.util.rsa import encode_rsa_public_key

        loaded = load_der_public_key(encode_rsa_public_key(key))
    else:
        from pkcs11.util.ec import encode_ec_public_key

        loaded = load_der_public_key(encode_ec_public_key(key))
    if not isinstance(loaded, (ec.EllipticCurvePublicKey, rsa.RSAPublicKey)):
        raise SigningUnavailableError("the token's key is neither EC nor RSA")
    return loaded


def is_token_uri(reference: bytes) -> bool:
    """Return True if a key file holds the ``pkcs11:`` URI of a key in a token instead of a key."""
    return reference.lstrip().startswith(b"pkcs11:")


def open_key(reference: bytes, place: str, access: CaAccess) -> PrivateKey:
    """Open the key of a key file of ``private/``: PEM, or the ``pkcs11:`` URI of a ``.p11`` file."""
    if is_token_uri(reference):
        return _open_token(reference.split()[0].decode("ascii", "replace"), access.pin, access.environment)
    return load_private_key(reference, access.passphrase, place)
