"""The dry run as one call: a launch file and arguments in, processes out; our process is left as it was."""

from __future__ import annotations

import os
import sysconfig
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import enclave_common
import enclave_launch
import keystore
import nodl
from enclave_common.source_location import SourceLocation
from enclave_common.words import did_you_mean
from enclave_launch.description.actions.includes import IncludeLaunchDescription
from enclave_launch.description.argument_scan import check_is_description
from enclave_launch.description.events.event import IncludeLaunchDescription as IncludeEvent
from enclave_launch.description.events.handlers import OnIncludeLaunchDescription
from enclave_launch.description.install import installed
from enclave_launch.description.launch_context import LaunchContext
from enclave_launch.description.launch_description import LaunchDescription
from enclave_launch.description.location import OUTSIDE, place_of
from enclave_launch.description.markup import expose
from enclave_launch.description.sources import (
    AnyLaunchDescriptionSource,
    get_launch_description_from_any_launch_file,
)
from enclave_launch.diagnostics.evaluation import argument_unknown
from enclave_launch.errors import EnclaveLaunchError, LaunchFileError
from enclave_launch.evaluation.active_environment import ENVIRONMENT_SWITCH
from enclave_launch.evaluation.error_text import error_text
from enclave_launch.evaluation.explore import Explorer
from enclave_launch.frontend import error_location, python_file
from enclave_launch.host.current import active_host
from enclave_launch.host.environment import environment_untouched
from enclave_launch.host.host import Host
from enclave_launch.host.plan_host import PlanHost
from enclave_launch.process import Evaluation

if TYPE_CHECKING:
    from enclave_launch.diagnostics import Diagnostic

Arguments = Sequence[tuple[str, str]]


class EvaluationError(LaunchFileError):
    """The launch file failed. ``partial``: what real launch would have started before that."""

    partial: Evaluation = Evaluation((), ())


def evaluate(
    launch_file: str | os.PathLike[str],
    arguments: Arguments = (),
    *,
    host: PlanHost | None = None,
    launch_configurations: Mapping[str, str] | None = None,
) -> Evaluation:
    """Return everything that ``ros2 launch launch_file name:=value ...`` would start, in launch order.

    ``launch_configurations`` are set before the file is included. Python launch files, ``$(command)`` and
    ``OpaqueFunction`` run for real. Raises ``EvaluationError``, whose ``cause`` is launch's own exception.
    """
    host = host or PlanHost()
    path = os.path.abspath(launch_file)
    with evaluation_surroundings(host):
        context = LaunchContext(host=host)
        context.launch_configurations.update(launch_configurations or {})
        try:
            context.register_event_handler(OnIncludeLaunchDescription())
            context.emit_event_sync(IncludeEvent(top_description(path, arguments)))
            Explorer(context, host).run()
            host.warnings.extend(_unknown_arguments(arguments, context.configurations_read))
        except EnclaveLaunchError:
            raise
        except error_location.RAISED_BY_USER_CODE as error:
            raise _evaluation_error(error, path, host) from error
        finally:
            if host.user_code_results is not None:
                host.user_code_results.stop_listening()
    return _evaluation(host)


def top_description(path: str, arguments: Arguments) -> Any:
    """Build the description that ``ros2 launch`` makes around a file: it includes the file with the arguments."""
    include = IncludeLaunchDescription(AnyLaunchDescriptionSource(path), launch_arguments=arguments)
    include.source_location = None
    return LaunchDescription([include])


@contextmanager
def read_description(launch_file: str | os.PathLike[str], host: PlanHost) -> Iterator[LaunchDescription]:
    """Load a description without visiting it; usable within the block. Raises ``EvaluationError``."""
    path = os.path.abspath(launch_file)
    with evaluation_surroundings(host):
        try:
            description = get_launch_description_from_any_launch_file(path)
            check_is_description(description)
            yield description
        except EnclaveLaunchError:
            raise
        except error_location.RAISED_BY_USER_CODE as error:
            raise _evaluation_error(error, path, host) from error


@contextmanager
def evaluation_surroundings(host: Host) -> Iterator[None]:
    """Install what evaluation needs: our packages under their public names, the host, the environment."""
    with ExitStack() as stack:
        stack.enter_context(ENVIRONMENT_SWITCH.restored())
        stack.enter_context(environment_untouched())
        stack.enter_context(active_host(host))
        stack.enter_context(installed(host.prefixes()))
        stack.callback(forget_elements_of_launch_files)
        yield


def forget_elements_of_launch_files() -> None:
    """Unregister the elements that launch files exposed (``expose_action``)."""
    expose.forget(python_file.MODULE_NAME)


def parse_arguments(words: Sequence[str]) -> list[tuple[str, str]]:
    """Parse ``name:=value`` words, of which the last with a name is used; raises launch's RuntimeError."""
    parsed: dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(":=")
        if not name or not separator or not value:
            raise RuntimeError(f"malformed launch argument '{word}', expected format '<name>:=<value>'")
        parsed[name] = value
    return list(parsed.items())


def _unknown_arguments(arguments: Arguments, names_read: Collection[str]) -> Iterator[Diagnostic]:
    for name, _ in arguments:
        if name not in names_read:
            yield argument_unknown(name, did_you_mean(name, names_read))


def _evaluation(host: PlanHost) -> Evaluation:
    return Evaluation(
        tuple(host.processes),
        tuple(host.components),
        tuple(host.calls),
        tuple(host.unforeseen),
        tuple(host.warnings),
        host.release,
        tuple(host.reactions),
        host.release.uncertain(),
    )


def _evaluation_error(error: BaseException, path: str, host: PlanHost) -> EvaluationError:
    wrapped = launch_file_error(error, path)
    wrapped.partial = _evaluation(host)
    return wrapped


def launch_file_error(error: BaseException, path: str) -> EvaluationError:
    """Convert an exception of visiting ``path`` to an error with its place, include chain and remedy."""
    location, helper = _location(error, path)
    where = f" (in {helper.file}:{helper.line})" if helper else ""
    return EvaluationError(error_text(error_location.likeliest(error)) + where, location, error)


def _location(error: BaseException, path: str) -> tuple[SourceLocation, SourceLocation | None]:
    """Return the innermost known place, with the include chain of the visited entity, and the place in a helper
    module if the entity comes from one."""
    visited = place_of(error)
    known, frame = error_location.location_of(error), _user_frame(error)
    exact = known or frame
    if exact is None:
        return (visited if visited is not None and visited.file != OUTSIDE else SourceLocation(path)), None
    if known is None and visited is not None and visited.line and visited.file != exact.file:
        return visited, exact
    includes = visited.includes if visited is not None else ()
    if visited is not None and visited.element == "include" and visited.file not in (exact.file, OUTSIDE):
        includes = (*includes, str(visited))
    return SourceLocation(exact.file, exact.line, exact.element, includes), None


def _user_frame(error: BaseException) -> SourceLocation | None:
    """Return the innermost frame of the user's own code, neither ours nor of the standard library."""
    packages = (enclave_launch.__file__, nodl.__file__, keystore.__file__, enclave_common.__file__)
    ours = tuple(os.path.dirname(os.path.abspath(file)) + os.sep for file in packages if file)
    library = sysconfig.get_paths()["stdlib"]
    found = None
    for step in error_location.frames(error):
        file = step.tb_frame.f_code.co_filename
        if not file.startswith((*ours, library, "<")) or file.startswith(library + "/site-packages"):
            found = SourceLocation(file, step.tb_lineno)
    return found
