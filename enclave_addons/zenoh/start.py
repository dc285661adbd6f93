"""The router of a launch with processes on Zenoh: its files, and who serves them."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from enclave_addons.zenoh.configuration import RouterAddress
from enclave_addons.zenoh.denials import RouterLogExplainer
from enclave_addons.zenoh.files import present_address
from enclave_addons.zenoh.planning import enclave_types
from enclave_addons.zenoh.router import RouterPlace, ZenohRouter, find_router, missing_router
from enclave_addons.zenoh.types import types_text
from enclave_addons.zenoh.writing import ZenohReport, router_differences, session_differences, write_zenoh
from enclave_launch.add_ons import ZenohStart
from enclave_launch.errors import RuntimeFailure, keystore_errors
from enclave_launch.plan import LaunchPlan
from keystore.disk import layout
from keystore.disk.view import KeystoreView
from keystore.errors import KeystoreError
from keystore.formats.role import Role
from keystore.steps.options import ProvisionOptions
from nodl.ament_index import search_prefixes


class ConfiguredRouter(NamedTuple):
    """The router of a launch. ``program``: ``rmw_zenohd``, None if it is not installed or another host's."""

    report: ZenohReport
    program: str | None

    @property
    def gaps(self) -> tuple[str, ...]:
        return self.report.gaps

    def differences(self, enclave: str) -> tuple[str, ...]:
        return session_differences(self.report.keystore, enclave, self.report.router)

    def serve(self, environment: Mapping[str, str], say: Callable[[str], None]) -> ZenohRouter:
        keystore = self.report.keystore
        place = RouterPlace(
            (self.report.router.host, self.report.router.port),
            str(keystore / layout.ZENOH_ROUTER),
            str(keystore / layout.ZENOH_ROUTER_CERT),
            str(keystore / layout.ca_cert(Role.IDENTITY)),
            self._refusals,
        )
        return ZenohRouter(place, self.program, environment, say, _explained(keystore, environment, say))

    def wait(self) -> None:
        self.serve({}, lambda _: None).wait()

    def _refusals(self) -> tuple[str, ...]:
        try:
            return router_differences(self.report.keystore)
        except KeystoreError as error:
            return (str(error),)


def configure(
    plan: LaunchPlan, keystore: str, enclaves: Collection[str], options: ProvisionOptions
) -> ConfiguredRouter:
    """Write the files of ``enclaves`` and of the router that serves them."""
    report = write_zenoh(keystore, enclaves, options=options)
    return ConfiguredRouter(report, _program(plan) if report.router.is_here else None)


def types(
    plan: LaunchPlan, enclaves: Collection[str]
) -> Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]]:
    """Return the types of what each enclave communicates."""
    return {path: types_text(enclave_types(plan.derived, path)) for path in sorted(enclaves)}


def check(plan: LaunchPlan, keystore: str) -> None:
    """Check, before keys are made, that a router is installed or answers. Raises ``RuntimeFailure``."""
    if _program(plan):
        return
    with keystore_errors():
        address = present_address(KeystoreView(Path(keystore))) or RouterAddress()
    try:
        socket.create_connection((address.host, address.port), timeout=5.0).close()
    except OSError:
        file = os.path.join(keystore, layout.ZENOH_ROUTER)
        raise RuntimeFailure(missing_router((address.host, address.port), file)) from None


def _program(plan: LaunchPlan) -> str | None:
    return find_router(search_prefixes(plan.inputs.source.prefixes))


def _explained(
    keystore: Path, environment: Mapping[str, str], say: Callable[[str], None]
) -> Callable[[str], bool]:
    if "interceptor" not in environment.get("RUST_LOG", ""):
        return lambda line: False

    explainer = RouterLogExplainer(keystore)

    def heard(line: str) -> bool:
        if (said := explainer.read(line)) is not None:
            say("\n".join(said.lines))
        return "zenoh::net::routing::interceptor" in line

    return heard


ADD_ON = ZenohStart(check, types, configure)
