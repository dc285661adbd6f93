"""The inputs of a program besides ROS arguments: options, positional words, environment. Performs no I/O.

Inference may find a topic name that is an input of the program: ``--topic`` of its command line,
``<argument>``, ``$VARIABLE`` (see ``nodl.name_template.ParameterPart``). The value that launch passes
counts; if it is not known, the default in the source must not be believed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from enclave_launch.process import ResolvedProcess
from nodl.name_template import NameTemplate, ParameterPart, Part, UnknownPart
from nodl.ros_arguments import arguments_as_inputs, is_option, words_without_ros_arguments


class ProgramInputs(NamedTuple):
    """Inputs of a program besides ROS arguments. ``values`` by input name (``--topic``, ``-t``, ``$VARIABLE``).

    ``bare_words``: there are words that may be positional arguments; ``short_flags``: there are flags
    with one dash, which may be another spelling of any option; ``all_leading``: no word stands behind an option.
    """

    values: Mapping[str, str] = MappingProxyType({})
    bare_words: bool = False
    short_flags: bool = False
    all_leading: bool = False

    def doubtful(self, template: NameTemplate) -> NameTemplate:
        """Return ``template`` with an unknown part for each input that the command line may set unseen."""
        return NameTemplate(tuple(self._doubted(part) for part in template.parts))

    def is_known(self, name: str) -> bool:
        """Return whether ``values`` has the input, or else it certainly has its default."""
        part = ParameterPart(name)
        return self._doubted(part) is part

    def _doubted(self, part: Part) -> Part:
        if not isinstance(part, ParameterPart) or part.name in self.values:
            return part
        if part.name[1:-1].isdigit() and self.all_leading:
            return part  # fewer words than places
        shortened = any(len(name) > 2 and part.name.startswith(name) for name in self.values)  # argparse
        if (part.name[:1] == "<" and self.bare_words) or (
            part.name[:1] == "-" and (self.short_flags or shortened)
        ):
            return UnknownPart(f"the command line may set {part.name}")
        return part


def environment_inputs(process: ResolvedProcess) -> ProgramInputs:
    """Return what each program in ``process`` finds in its environment, inherited variables included."""
    return ProgramInputs({f"${name}": value for name, value in process.final_environment.items()})


def program_inputs(process: ResolvedProcess) -> ProgramInputs:
    """Return the inputs of ``process``; words by their places are as learnt manifests have them."""
    words = own_words(process)
    options = [word for word in words if is_option(word)]
    return ProgramInputs(
        {**environment_inputs(process).values, **arguments_as_inputs(words)},
        bare_words=len(options) < len(words),
        short_flags=any(not word.startswith("--") for word in options),
        all_leading=not options,
    )


def _file_name(word: str) -> str:
    return word.rstrip("/").rpartition("/")[2]


def words_of(process: ResolvedProcess) -> Sequence[str]:
    """Return the words after the executable."""
    program = _file_name(process.executable)
    start = next((i for i, word in enumerate(process.cmd) if _file_name(word) == program), 0)
    return process.cmd[start + 1 :]


def own_words(process: ResolvedProcess) -> Sequence[str]:
    """Return the words after the executable that are no ROS arguments."""
    return words_without_ros_arguments(words_of(process))
