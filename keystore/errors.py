"""All errors a user of the keystore can meet, cut by who must act.

    KeystoreError
    ├── InvalidEnclaveNameError      the author of a launch file, policy or command: a name that no enclave can have
    ├── InvalidInputError            the author of a YAML, policy, certificate or option value
    ├── NotAKeystoreError            the caller: the path is something else
    ├── UnsafeKeystoreError          the owner of the files: links, owners or modes that let others in
    ├── DamagedKeystoreError         the operator: a file is missing, unreadable or not what it should be
    ├── NotInstalledError            the installer: an add-on is not part of this installation
    ├── WrongClockError              the operator: the clock of this machine cannot be right
    ├── SigningUnavailableError      the holder of the CA key: no key here, no passphrase, a token that refuses
    ├── KeystoreBusyError            another run holds the lock
    └── StorageError                 the system: disk full, read-only, no permission

``str(error)`` is one message: what, where, what to do next. Key material, passphrases and PINs never
enter a message. Errors of the operating system, cryptography, lxml and yaml are translated where they enter.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from enclave_common.terminal import quoted


class KeystoreError(Exception):
    """Root of the tree. ``exit_status`` is what the command line returns."""

    exit_status = 1


class InvalidEnclaveNameError(KeystoreError, ValueError):
    """A name that no enclave can have. ``reason`` alone, for callers that know better where the name was written."""

    exit_status = 2

    def __init__(self, name: str, reason: str):
        self.name = name
        self.reason = reason
        super().__init__(f"{quoted(name)} is not an enclave name: {reason}")


class EnclaveTooDeep(InvalidEnclaveNameError):
    """A name that rcl accepts and Cyclone DDS cannot carry in a certificate."""


class InvalidInputError(KeystoreError, ValueError):
    """A document, certificate or option holds what cannot be used."""

    exit_status = 2


class NotAKeystoreError(KeystoreError):
    """The path is something other than a keystore."""


class UnsafeKeystoreError(KeystoreError):
    """Links, owners or modes let others read or change the keystore."""


class DamagedKeystoreError(KeystoreError):
    """A file of the keystore is missing, unreadable or not what it should be."""


class OtherFormError(DamagedKeystoreError):
    """A signed document is not in the form that is written here, so DDS implementations may read something else."""


class WrongClockError(KeystoreError):
    """The clock of this machine cannot be right."""


class NotInstalledError(KeystoreError):
    """An add-on that the keystore needs is not part of this installation."""


class SigningUnavailableError(KeystoreError):
    """A CA cannot sign here: no key, no passphrase, a token that refuses."""


class KeystoreBusyError(KeystoreError):
    """Another run holds the keystore's lock."""

    exit_status = 75  # EX_TEMPFAIL of sysexits.h: trying again may help


class StorageError(KeystoreError):
    """The system would not read or write a file."""

    @classmethod
    def of(cls, error: OSError, doing: str) -> StorageError:
        """Return the error of the keystore for ``error``; ``doing`` is a phrase such as ``writing the keystore``."""
        place = f" {quoted(str(error.filename))}" if error.filename else ""
        reason = error.strerror or error
        only_read = doing.split()[0] in ("reading", "looking", "checking", "asking")
        after = "" if only_read else "; no file was left half-written: fix this and run it again"
        return cls(f"{doing}{place}: {reason}{after}")


@contextmanager
def storage_errors(doing: str) -> Iterator[None]:
    """Translate each ``OSError`` to a ``StorageError``; ``doing`` as of ``StorageError.of``."""
    try:
        yield
    except OSError as error:
        raise StorageError.of(error, doing) from None
