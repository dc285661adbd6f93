"""Answers about Python programs, kept by content between runs: an analysis is a function of what it asked of the disk.

An answer holds while our own code, the interpreter and everything that the analysis asked are as they were: the
content of each file, the names in each folder where it looked for modules. Reads and writes files.
"""

from __future__ import annotations

import sys
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nodl.infer.cpp.cache.codec import keep_variant, variants
from nodl.infer.cpp.cache.folder import CacheFolder, digest, digest_of

if TYPE_CHECKING:
    from nodl.infer.program import Program

VARIANTS = 4
"""Answers to one question, after different edits, of which the newest are kept."""


_OWN_SOURCES = (
    "*.py", "dependence/*.py", "document/*.py", "infer/*.py", "infer/interpreter/*.py", "infer/models/*.py",
    "infer/cpp/*.py", "infer/cpp/cache/*.py",
)  # fmt: skip


def own_sources() -> list[Path]:
    """Our own code that answers come from."""
    root = Path(__file__).parents[1]
    return sorted(path for pattern in _OWN_SOURCES for path in root.glob(pattern))


@lru_cache(maxsize=1)
def _analyser() -> str:
    """Of our own code, and of the Python that parses and computes."""
    return digest(sys.version, [(path.name, digest_of(str(path))) for path in own_sources()])


class KeptAnswer:
    """The answer to one ``question`` (whose ``repr`` says all of it) about ``program``."""

    def __init__(self, program: Program, question: object) -> None:
        self._program = program
        self._folder = CacheFolder()
        self._question = question

    @cached_property
    def _key(self) -> str:
        return digest("python", _analyser(), self._program.roots, self._question)

    def find(self) -> Any:
        """What was kept; ``None``: nothing, or the disk would answer otherwise now."""
        for asked, answer in variants(self._folder, self._key):
            if all(self._program.ask(kind, what) == said for kind, what, said in asked):
                return answer
        return None

    def keep(self, answer: object) -> None:
        asked = [(kind, what, said) for (kind, what), said in self._program.asked.items()]
        keep_variant(self._folder, self._key, (asked, answer), VARIANTS)
