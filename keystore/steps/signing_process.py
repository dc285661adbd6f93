"""Signing in a process of its own, for a launcher that runs other people's code.

The process is forked before any of that code runs. It alone reads the passphrase, keeps what was decided on the command
line, and later gets the plan as data (JSON over a socket): names, domains, rules. It checks them as any input,
signs, and answers what it did. The launcher's memory and environment hold no passphrase from then on.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import signal
import socket
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from keystore import errors
from keystore.add_ons import zenoh_files
from keystore.disk.safe_files import resolve_root
from keystore.disk.share_files import LaunchHold
from keystore.errors import InvalidInputError, KeystoreError, SigningUnavailableError
from keystore.formats.domains import Domains
from keystore.formats.enclave_name import validate_enclave_name
from keystore.formats.governance import NoGovernanceRuleError
from keystore.formats.policy import EnclavePolicy
from keystore.formats.shares import Share, parse_shares, shares_json
from keystore.formats.subject import Half
from keystore.formats.validity import Validity, iso, parse_time
from keystore.signing.ca_access import Secret, keep_memory_private
from keystore.steps.options import EnclaveReport, ProvisionOptions, ProvisionReport
from keystore.steps.provisioning import provision

_MARK = b"#"
"""Before each line of JSON: the byte that a descriptor comes with."""
_OWNER = "the launch"


class SigningProcess:
    """The launcher's end. Give it as ``ProvisionOptions.signing``; ``start`` makes it."""

    def __init__(self, channel: socket.socket):
        self._channel = channel

    @classmethod
    def start(cls, keystore: Path | str, options: ProvisionOptions) -> SigningProcess:
        """Fork the process that signs for this keystore, and forget the passphrase here.

        ``options``: what is decided already; nothing that comes later changes it. Call it before other people's code
        runs, and before there are threads.
        """
        ours, theirs = socket.socketpair()
        if os.fork() == 0:
            ours.close()
            _serve(theirs, resolve_root(keystore), options)
        theirs.close()
        secrets = (options.access.passphrase, options.access.pin)
        for secret in secrets:
            if secret is not None and secret.variable is not None:
                _forget_variable(secret.variable)
        return cls(ours)

    def provision(self, enclaves: Iterable[EnclavePolicy], options: ProvisionOptions) -> ProvisionReport:
        """Call ``provisioning.provision`` in the other process; raises what that raises."""
        policies = [[one.path, _policy_text(one, options)] for one in enclaves]
        return _report(
            self._ask({"do": "provision", "enclaves": policies, **_decided(options)}, options.launch)
        )

    def request(self, action: str, content: dict[str, Any], options: ProvisionOptions) -> Any:
        """Request ``action`` from the other process and return its result. Raises what that raises."""
        return self._ask({"do": action, **content, **_decided(options)}, None)

    def _ask(self, request: dict[str, Any], hold: LaunchHold | None) -> Any:
        descriptor = hold.descriptor if hold is not None else None
        try:
            _send(self._channel, request, descriptor)
            answer, _ = _receive(self._channel)
        except (OSError, EOFError):
            raise SigningUnavailableError(
                "the process that signs has ended; start the launch again"
            ) from None
        if "error" in answer:
            raise _error(*answer["error"])
        return answer["done"]


def _policy_text(one: EnclavePolicy, options: ProvisionOptions) -> str:
    types = options.types.get(one.path, ())
    return shares_json([Share(_OWNER, options.domains_of(one.path), one.profiles, types)]).decode()


def _decided(options: ProvisionOptions) -> dict[str, Any]:
    return {
        "domains": str(options.domains) if options.domains is not None else None,
        "enclave_domains": {name: str(domains) for name, domains in options.enclave_domains.items()},
        "guid_halves": {name: half.value for name, half in options.guid_halves.items()},
        "owner": options.launch.owner if options.launch is not None else None,
        "held": sorted(options.launch.enclaves) if options.launch is not None else [],
    }


# In the other process


def _serve(channel: socket.socket, root: Path, base: ProvisionOptions) -> None:
    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the launcher ends first, and then we do
        keep_memory_private()
        for secret in (base.access.passphrase, base.access.pin):
            _read_early(secret)
        with contextlib.suppress(EOFError, OSError):
            while True:
                request, descriptor = _receive(channel)
                _send(channel, _answer(root, base, request, descriptor), None)
    finally:
        os._exit(0)


def _read_early(secret: Secret | None) -> None:
    """Read a secret before anything else; one that cannot be read is reported when something is to be signed."""
    if secret is not None:
        with contextlib.suppress(KeystoreError):
            secret.value()


def _answer(root: Path, base: ProvisionOptions, request: Any, descriptor: int | None) -> dict[str, Any]:
    try:
        return {"done": _ACTIONS[request["do"]](root, _options(root, base, request, descriptor), request)}
    except KeystoreError as error:
        domains = str(error.domains) if isinstance(error, NoGovernanceRuleError) else ""
        return {"error": [type(error).__name__, str(error), domains]}
    except Exception as error:  # whatever was sent: the launcher gets the error, and requests no more
        return {"error": ["InvalidInputError", f"the plan cannot be signed: {type(error).__name__}", ""]}
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _options(root: Path, base: ProvisionOptions, request: Any, descriptor: int | None) -> ProvisionOptions:
    hold = None
    if request["owner"] is not None:
        hold = LaunchHold(root, str(request["owner"]))
        hold.enclaves.update(map(validate_enclave_name, request["held"]))
        if descriptor is not None:
            hold.adopt(os.dup(descriptor))
    given = request["enclave_domains"].items()
    types = {path: share.types for path, share in _shares(request)} if request["do"] == "provision" else {}
    return base._replace(
        domains=Domains.parse(request["domains"]) if request["domains"] is not None else None,
        enclave_domains={validate_enclave_name(name): Domains.parse(text) for name, text in given},
        guid_halves={
            validate_enclave_name(name): Half(half) for name, half in request["guid_halves"].items()
        },
        types=types,
        launch=hold,
    )


def _shares(request: Any) -> list[tuple[str, Share]]:
    found = []
    for path, text in request["enclaves"]:
        (share,) = parse_shares(text.encode(), f"the plan of {path}")
        found.append((validate_enclave_name(path), share))
    return found


def _provision(root: Path, options: ProvisionOptions, request: Any) -> Any:
    policies = [EnclavePolicy(path, share.profiles) for path, share in _shares(request)]
    report = provision(root, policies, options=options)
    return {
        "keystore": str(report.keystore),
        "created": report.created,
        "enclaves": [
            [one.enclave, one.actions, one.reasons, [iso(end) for end in one.validity or ()]]
            for one in report.enclaves
        ],
        "warnings": report.warnings,
        "ends": iso(report.ends) if report.ends is not None else None,
    }


def _zenoh(root: Path, options: ProvisionOptions, request: Any) -> Any:
    return zenoh_files().sign(root, options, request)


_ACTIONS = {"provision": _provision, "zenoh": _zenoh}


# Between them


def _report(found: Any) -> ProvisionReport:
    enclaves = tuple(
        EnclaveReport(
            name, tuple(actions), tuple(reasons), Validity(*map(parse_time, ends)) if ends else None
        )
        for name, actions, reasons, ends in found["enclaves"]
    )
    end = parse_time(found["ends"]) if found["ends"] is not None else None
    return ProvisionReport(
        Path(found["keystore"]), tuple(found["created"]), enclaves, tuple(found["warnings"]), end
    )


def _error(name: str, message: str, domains: str) -> KeystoreError:
    if name == NoGovernanceRuleError.__name__:
        return NoGovernanceRuleError(Domains.parse(domains), message)
    kind = getattr(errors, name, InvalidInputError)
    # An enclave's name and the reason are one message by now.
    return InvalidInputError(message) if issubclass(kind, errors.InvalidEnclaveNameError) else kind(message)


def _send(channel: socket.socket, content: Any, descriptor: int | None) -> None:
    socket.send_fds(channel, [_MARK], [] if descriptor is None else [descriptor])
    channel.sendall(json.dumps(content).encode() + b"\n")


def _receive(channel: socket.socket) -> tuple[Any, int | None]:
    """Read one message and the descriptor that came with it; raises EOFError when the other end is gone."""
    mark, descriptors, _, _ = socket.recv_fds(channel, len(_MARK), 1)
    with channel.makefile("rb") as stream:  # the other end waits for the answer: nothing follows the line
        line = stream.readline() if mark else b""
    if not line.endswith(b"\n"):
        raise EOFError
    return json.loads(line), descriptors[0] if descriptors else None


def _forget_variable(name: str) -> None:
    """Overwrite a variable also where /proc/self/environ shows it: in the block that the process was started with."""
    libc = ctypes.CDLL(None)
    libc.getenv.restype = ctypes.c_void_p
    place = libc.getenv(os.fsencode(name))
    if place is not None:
        length = len(ctypes.string_at(place))
        ctypes.memset(place, 0, length)
    os.environ.pop(name, None)
