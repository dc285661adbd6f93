"""Admit a process to a secured start: nothing on its way takes the enclave away again."""

from collections.abc import Iterator
from typing import NamedTuple

from enclave_launch.admission.middleware import VARIABLE, ZENOH, Vendor, middleware_of, vendor_of, why_not
from enclave_launch.admission.variables import domain_of, overridden, own_security, preloaded
from enclave_launch.admission.wrappers import obstacles
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics import enclaves as diagnostics
from enclave_launch.errors import UsageError
from enclave_launch.process import ResolvedProcess

__all__ = ["AdmissionOptions", "notes", "prefix_refusals", "refusals"]


class AdmissionOptions(NamedTuple):
    """Names that the user vouches for: launch prefixes (``shell`` for shells), and middlewares."""

    prefixes: frozenset[str] = frozenset()
    middlewares: frozenset[str] = frozenset()


def prefix_refusals(process: ResolvedProcess, options: AdmissionOptions) -> Iterator[Diagnostic]:
    """Report what may change the environment of a process; it keeps programs without enclave out, too."""
    for obstacle in obstacles(process, options.prefixes):
        yield diagnostics.prefix_refused(
            process.process_name, obstacle.wrapper, obstacle.why, process.location
        )


def refusals(process: ResolvedProcess, options: AdmissionOptions) -> Iterator[Diagnostic]:
    """Report why a process must not start in its enclave."""
    name, place = process.process_name, process.location
    yield from prefix_refusals(process, options)
    middleware = middleware_of(process.final_environment)
    if (why := why_not(middleware, options.middlewares)) is not None:
        given = VARIABLE in process.environment
        yield diagnostics.middleware_refused(name, middleware, why, place, by_launch_file=given)
    try:
        domain_of(process.final_environment)
    except UsageError as error:
        yield diagnostics.domain_invalid(name, str(error), place)
    for setting in own_security(process.final_environment):
        yield diagnostics.security_configured(name, setting.variable, setting.value, place)


def notes(process: ResolvedProcess) -> Iterator[Diagnostic]:
    """Report what matters about a process that may start."""
    name, place = process.process_name, process.location
    middleware = middleware_of(process.final_environment)
    for setting in overridden(process.environment, on_zenoh=middleware == ZENOH):
        yield diagnostics.variable_overridden(name, setting.variable, setting.value, place)
    for setting in preloaded(process.environment):
        yield diagnostics.library_preloaded(name, setting.variable, setting.value, place)
    if vendor_of(middleware) is Vendor.CONNEXT:
        yield diagnostics.connext(name, place)
