"""A cache of answers about Python programs, by content.

A cached answer is valid while our own code, the Python version and everything that the analysis read are unchanged: the
content of each file, and the names in each folder where it looked for modules. Reads and writes files.
"""

from __future__ import annotations

import sys
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import nodl
from enclave_addons.inference.answers.codec import keep_variant, variants
from enclave_addons.inference.answers.folder import CacheFolder, digest, digest_of

if TYPE_CHECKING:
    from enclave_addons.inference.python.program import Program

VARIANTS = 32
"""Number of answers cached for one question, under different launches or after different edits; the newest stay."""


def own_sources() -> list[Path]:
    """Return the files of our own code that answers depend on."""
    inference, nodl_package = Path(__file__).parents[1], Path(nodl.__file__).parent
    return sorted(path for folder in (inference, nodl_package) for path in folder.rglob("*.py"))


@lru_cache(maxsize=1)
def _analyser() -> str:
    """Return a digest of our own code and of the Python version."""
    return digest(sys.version, [(path.name, digest_of(str(path))) for path in own_sources()])


class CachedAnswer:
    """The cached answer to one ``question``, identified by its ``repr``, about ``program``."""

    def __init__(self, program: Program, question: object) -> None:
        self._program = program
        self._folder = CacheFolder()
        self._question = question

    @cached_property
    def _key(self) -> str:
        return digest("python", _analyser(), self._program.roots, self._question)

    def find(self) -> Any:
        """Return the cached answer, or None if there is none or a file that it depends on has changed."""
        for asked, answer in variants(self._folder, self._key):
            if all(self._program.ask(kind, what) == said for kind, what, said in asked):
                return answer
        return None

    def store(self, answer: object) -> None:
        """Cache ``answer`` with everything that the analysis read."""
        asked = [(kind, what, said) for (kind, what), said in self._program.asked.items()]
        keep_variant(self._folder, self._key, (asked, answer), VARIANTS)
