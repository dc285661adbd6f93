"""Word an exception that a launch file, its parser or launch raised.

Texts of launch stay as they are, for they are searched for on the web; the class in front of them goes where it says
nothing more. What Python raised in the user's own code keeps its class, as in a traceback. The place is not repeated.
"""

from __future__ import annotations

import os
import re
import sys
from typing import cast

from enclave_common.dependencies import missing_dependency
from enclave_common.words import did_you_mean
from enclave_launch.description.argument_scan import MISSING_ARGUMENT, REQUIRED_ARGUMENT
from enclave_launch.description.conditions import InvalidConditionExpressionError
from enclave_launch.description.launch_context import WatchedConfigurations
from enclave_launch.description.markup.expose import action_parse_methods, substitution_parse_methods
from enclave_launch.description.markup.tags import ELEMENTS, SUBSTITUTIONS
from enclave_launch.errors import EnclaveLaunchError
from enclave_launch.evaluation.usual_causes import usual_cause, without_addresses
from enclave_launch.evaluation.words_elsewhere import word_elsewhere
from enclave_launch.frontend.error_location import frames
from enclave_launch.host.current import current_release
from nodl.ament_index import (
    MISSING_PREFIX,
    ExecutableNotInstalledError,
    PackageNotFoundError,
    executables,
    installed_packages,
)

_OWN_PACKAGES = ("enclave_launch", "nodl", "keystore", "enclave_common")

_TYPE = re.compile(r"'<class '(\w+)'>'")  # upstream's "of type '<class 'str'>'"

_UNKNOWN_WORD = re.compile(r"^(?:Unrecognized entity of the type|(Unknown substitution)): (\S+)$")

_PLACE = re.compile(r": line \d+(, column \d+)?$")  # at the end of what XML parsers say


def error_text(error: BaseException) -> str:
    """Return one message: what is wrong and, if something can be done about it, what."""
    error = getattr(error, "orig_exc", error)  # of a template: the complaint of the substitution in it
    text = without_addresses(_PLACE.sub("", _TYPE.sub(r"\1", _text(error).strip())))
    return text + (usual_cause(error, text) or _next_step(error, text)) if text else type(error).__name__


def _text(error: BaseException) -> str:
    if isinstance(error, UnicodeDecodeError):
        return f"not UTF-8 text: byte 0x{error.object[error.start]:02x} at offset {error.start}"
    if isinstance(error, ImportError) and (missing := missing_dependency(error)):
        return missing
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.strerror}: '{os.fsdecode(error.filename)}'"
    if isinstance(error, SyntaxError):
        return _syntax(error)
    if isinstance(error, SystemExit):
        code = "" if error.code is None else repr(error.code)
        return f"this calls sys.exit({code}); to refuse to launch, raise an error that says why"
    if hasattr(error, "problem_mark"):  # yaml.MarkedYAMLError, without loading PyYAML for the question
        parts = (getattr(error, "context", None), getattr(error, "problem", None))
        return "malformed YAML: " + ", ".join(part for part in parts if part)
    if isinstance(error, InvalidConditionExpressionError):
        return error.reason
    text = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
    if isinstance(error, EnclaveLaunchError | RuntimeError) or _raised_by_us(error):
        return text
    return f"{type(error).__name__}: {text}" if text else ""


def _syntax(error: SyntaxError) -> str:
    if getattr(error, "position", None) is not None:
        return "malformed XML: " + str(error).rpartition(": line")[0]
    return f"{type(error).__name__}: {error.msg}"


def _modules(error: BaseException) -> list[object]:
    return [step.tb_frame.f_globals.get("__name__", "") for step in frames(error)]


def _raised_by_us(error: BaseException) -> bool:
    modules = _modules(error)
    if modules[-1:] == [WatchedConfigurations.__module__]:  # a dict to whoever looks something up in it
        modules.pop()
    if not modules:
        return type(error).__module__.partition(".")[0] in _OWN_PACKAGES
    module = modules[-1]
    return isinstance(module, str) and module.partition(".")[0] in _OWN_PACKAGES


def _next_step(error: BaseException, text: str) -> str:
    if isinstance(error, PackageNotFoundError) and "not found, searching:" in text:
        return did_you_mean(error.package, installed_packages(error.prefixes)) + (
            "\nsource its workspace (AMENT_PREFIX_PATH) or name the install prefix with --prefix; "
            "--allow-missing-packages goes on without it, for looking only"
        )
    if isinstance(error.__cause__ or error, ExecutableNotInstalledError):
        missing = cast("ExecutableNotInstalledError", error.__cause__ or error)
        return did_you_mean(missing.executable, executables(missing.folder))
    if elsewhere := word_elsewhere(text, current_release()):
        return elsewhere
    if unknown := _UNKNOWN_WORD.match(text):
        known = (
            (SUBSTITUTIONS, substitution_parse_methods) if unknown[1] else (ELEMENTS, action_parse_methods)
        )
        return did_you_mean(unknown[2], [name for names in known for name in names])
    if text.startswith((MISSING_ARGUMENT, REQUIRED_ARGUMENT)):
        return "\ngive it as NAME:=VALUE after the launch file (--show-args lists all), or in the include"
    raised_in = _modules(error)[-1:]
    if isinstance(error, KeyError) and raised_in == ["os"]:
        return f"\nthe launch file needs the environment variable {error.args[0]}, which is not set"
    if isinstance(error, FileNotFoundError) and raised_in == ["subprocess"]:
        return "\nthe launch file runs this program itself; install it, or add its folder to PATH"
    if isinstance(error, OSError) and f"'{MISSING_PREFIX}/" in text:
        return "\nthat file is part of a package that is not installed here; this launch file reads it itself"
    if isinstance(error, ModuleNotFoundError) and not missing_dependency(error):
        folders = (
            f"Python {sys.version_info.major}.{sys.version_info.minor}, PYTHONPATH and the install prefixes"
        )
        return f" (searched: {folders})"
    return ""
