"""What an action accepts where text is expected: text, a substitution, or a sequence of both to concatenate."""

from __future__ import annotations

import collections.abc

from enclave_launch.description.launch.substitution import Substitution

SomeSubstitutionsType = str | Substitution | collections.abc.Iterable[str | Substitution]
SomeSubstitutionsType_types_tuple = (str, Substitution, collections.abc.Iterable)
