"""Admit a process to a secured start: nothing on its way takes the enclave away again."""

import re
import shlex
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from enclave_launch.admission.middleware import VARIABLE, ZENOH, Vendor, middleware_of, vendor_of, why_not
from enclave_launch.admission.variables import (
    discovery_is_off,
    domain_of,
    foreign_configurations,
    overridden,
    preloaded,
)
from enclave_launch.diagnostics import Diagnostic
from enclave_launch.diagnostics import enclaves as diagnostics
from enclave_launch.errors import UsageError
from enclave_launch.process import ResolvedProcess
from nodl.ros_arguments import shell_words

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
    cwd, on_fast = Path(process.cwd or ".").absolute(), vendor_of(middleware) is Vendor.FAST
    for found in foreign_configurations(process.final_environment, cwd, on_fast=on_fast):
        report = diagnostics.discovery_server if found.is_discovery else diagnostics.security_configured
        yield report(name, found.variable, found.value, found.why, place)


def notes(process: ResolvedProcess) -> Iterator[Diagnostic]:
    """Report what matters about a process that may start."""
    name, place = process.process_name, process.location
    middleware = middleware_of(process.final_environment)
    for setting in overridden(process.environment, on_zenoh=middleware == ZENOH):
        yield diagnostics.variable_overridden(name, setting.variable, setting.value, place)
    for setting in preloaded(process.environment):
        yield diagnostics.library_preloaded(name, setting.variable, setting.value, place)
    if discovery_is_off(process.final_environment):
        yield diagnostics.discovery_off(name, place)
    if vendor_of(middleware) is Vendor.CONNEXT:
        yield diagnostics.connext(name, place)


class Keeper(NamedTuple):
    """A program that runs another one with the environment it has. ``values``: options that take the next word;
    ``words``: words of its own before the program; ``changes``: options that alter the environment after all."""

    values: frozenset[str] = frozenset()
    words: int = 0
    changes: re.Pattern[str] | None = None


def _keeper(values: str = "", words: int = 0, changes: str | None = None) -> Keeper:
    return Keeper(frozenset(values.split()), words, re.compile(changes) if changes else None)


_DEBUGGER_COMMAND = r"(?i).*\benv"  # gdb "unset environment", "set env", lldb "settings ... env-vars"
_PYTHON = _keeper("-m -W -X --listen -o -s --rcfile", changes="-c$")

# rcl finds the enclave through variables; a prefix that drops them starts the program unsecured. So each program of a
# prefix (``nice -n 5 gdb --args``) must be in this reviewed table, or be accepted by name.
KEEPERS: dict[str, Keeper] = {
    # debuggers: the program inherits their environment (gdb adds LINES and COLUMNS)
    "gdb": _keeper("-ex -x -eval-command --eval-command --command -cd -iex -ix", changes=_DEBUGGER_COMMAND),
    "cgdb": _keeper("-ex -x", changes=_DEBUGGER_COMMAND),
    "gdbserver": _keeper(words=1, changes="--wrapper"),
    "lldb": _keeper("-o -O -s -S -k -K", changes=_DEBUGGER_COMMAND),
    "rr": _keeper(words=1, changes="-v|--env"),
    "strace": _keeper("-e -o -p -s -a -u -P -b", changes="-E|--env"),
    "ltrace": _keeper("-e -o -p -s -a -n -l"),
    # profilers and checkers
    "valgrind": _keeper(),
    "perf": _keeper("-o -F -e -c --call-graph", words=1),
    "heaptrack": _keeper("-o"),
    "time": _keeper("-o -f"),
    "vglrun": _keeper("-d -c -q"),
    # priority, processors, memory, buffers, sessions, time: they set an attribute and call exec
    "nice": _keeper("-n --adjustment"),
    "ionice": _keeper("-c -n --class --classdata"),
    "chrt": _keeper("-T -P -D", words=1),
    "taskset": _keeper(words=1),
    "numactl": _keeper("-m -N -C -p -i"),
    "prlimit": _keeper(),
    "setarch": _keeper(words=1),
    "stdbuf": _keeper("-i -o -e"),
    "unbuffer": _keeper(),
    "setsid": _keeper(),
    "nohup": _keeper(),
    "timeout": _keeper("-k -s --kill-after --signal", words=1),
    "catchsegv": _keeper(),
    # interpreters in front of a script, with a module such as debugpy or cProfile
    "python": _PYTHON,
    "python3": _PYTHON,
    # terminals that start the program themselves (a terminal with a server does not: see CHANGERS)
    "xterm": _keeper("-T -title -geometry -fn -fa -fs -bg -fg -n -name -xrm -sl"),
    "uxterm": _keeper("-T -title -geometry -fn -fa -fs -bg -fg"),
    "rxvt": _keeper("-T -title -geometry -fn -bg -fg"),
    "urxvt": _keeper("-T -title -geometry -fn -bg -fg"),
    "st": _keeper("-T -t -g -f -n -o -c"),
    "alacritty": _keeper("-T -t --title --working-directory -o --config-file --class"),
    "foot": _keeper("-T -t -a -f -w -W"),
}

_SERVER = "a server that runs already starts the program, with its own environment"
_OTHER_MACHINE = "the program starts elsewhere, with another environment"
_ROOT = "it starts the program for another user, with a cleaned environment"
_SHELL = "a shell script may change the environment; source its files before the launch, and write the program alone"
CHANGERS: dict[str, str] = {
    "env": "it exists to change the environment; write <env name=... value=.../> below the element instead",
    **dict.fromkeys(("sudo", "su", "doas", "pkexec", "runuser", "setpriv", "gosu", "chpst"), _ROOT),
    **dict.fromkeys(("sh", "bash", "dash", "zsh", "ksh", "fish", "busybox"), _SHELL),
    **dict.fromkeys(("ssh", "docker", "podman", "lxc-attach", "flatpak", "snap", "kubectl"), _OTHER_MACHINE),
    **dict.fromkeys(
        ("chroot", "nsenter", "unshare", "bwrap", "systemd-run", "systemd-nspawn"), _OTHER_MACHINE
    ),
    **dict.fromkeys(("gnome-terminal", "xfce4-terminal", "konsole", "mate-terminal", "terminator"), _SERVER),
    **dict.fromkeys(("tilix", "urxvtc", "footclient", "tmux", "screen", "x-terminal-emulator"), _SERVER),
}
_CHANGES_FOR_A_PROGRAM = frozenset(CHANGERS) - {"sh", "bash", "dash", "zsh", "ksh", "fish", "busybox"}


class Obstacle(NamedTuple):
    """A wrapper that is not known to keep the environment, and why."""

    wrapper: str
    why: str


def obstacles(process: ResolvedProcess, accepted: Collection[str] = ()) -> Iterator[Obstacle]:
    """Yield what stands between the launcher and the program of ``process`` and may take its enclave away.

    An ``executable`` is a program of its own, a shell included, unless it only starts another with other variables.

    :param accepted: names of wrappers that the user vouches for"""
    prefix = list(process.prefix)
    if process.kind == "executable":
        words = shell_words(process.cmd) if process.shell else list(process.cmd)
        prefix = words if _is_wrapper(words[len(prefix) :]) else prefix
    for obstacle in _of_prefix(prefix, program_follows=process.kind != "executable"):
        if obstacle.wrapper not in accepted:
            yield obstacle
    operator = (
        _shell_operator(" ".join(process.cmd)) if process.shell and process.kind != "executable" else None
    )
    if operator is not None and "shell" not in accepted:
        yield Obstacle(
            "shell", f"its command line goes through a shell that does more than start it: {operator}"
        )


def _is_wrapper(words: Sequence[str]) -> bool:
    return bool(words) and (_name(words[0]) in KEEPERS or _name(words[0]) in _CHANGES_FOR_A_PROGRAM)


def _name(word: str) -> str:
    name = word.rpartition("/")[2]
    return re.sub(r"^(python3?)\.[0-9.]+$", r"\1", name)


def _of_prefix(words: Sequence[str], *, program_follows: bool) -> Iterator[Obstacle]:
    rest = list(words)
    while rest:
        name, keeper = _name(rest[0]), KEEPERS.get(_name(rest[0]))
        if keeper is None:
            if program_follows or (name in _CHANGES_FOR_A_PROGRAM and len(rest) > 1):
                yield Obstacle(name, CHANGERS.get(name, "it is not known to pass the environment on"))
            return
        own, rest = _own_words(keeper, rest[1:])
        changes = [word for word in own if keeper.changes is not None and keeper.changes.match(word)]
        if changes:
            yield Obstacle(name, f"{changes[0]!r} may change the environment")
            return


def _own_words(keeper: Keeper, words: Sequence[str]) -> tuple[list[str], list[str]]:
    left, at = keeper.words, 0
    while at < len(words):
        word = words[at]
        if word.startswith("-") and word != "-":
            at += 2 if word in keeper.values else 1
        elif left:
            left -= 1
            at += 1
        else:
            break
    return list(words[:at]), list(words[at:])


_LONGEST = 50_000  # characters of a shell's command line; the reader of shlex is quadratic in its words


def _shell_operator(text: str) -> str | None:
    if len(text) > _LONGEST:
        return f"more than {_LONGEST} characters"

    lexer = shlex.shlex(text, posix=True, punctuation_chars=";&|()")
    lexer.whitespace_split = True
    lexer.commenters = ""
    try:
        tokens = list(lexer)
    except ValueError:
        return "a quote that is not closed"
    operator = next((token for token in tokens if token and set(token) <= set(";&|()")), None)
    if operator is None and "\n" in text.strip():
        operator = "a line break"
    if operator is None and tokens and re.match(r"[A-Za-z_][A-Za-z0-9_]*=", tokens[0]):
        operator = tokens[0]
    return operator or next((mark for mark in ("$(", "`") if mark in text), None)
