"""A bounded number of inputs for each parser: it gives a value or refuses, and nothing else happens."""

from __future__ import annotations

import contextlib
import os

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz.inputs import damaged
from tests.fuzz.targets import targets

EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "40"))


@pytest.mark.parametrize("name", targets())
@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.data())
def test_a_parser_gives_a_value_or_refuses(name: str, data: st.DataObject) -> None:
    target = targets()[name]
    document = data.draw(damaged(target.seeds, target.words))
    with contextlib.suppress(*target.refusals):
        target.run(document)


@pytest.mark.parametrize("name", targets())
def test_the_documents_to_start_from_are_read(name: str) -> None:
    """Else a target would only ever see its first check."""
    target = targets()[name]
    results = []
    for seed in target.seeds:
        try:
            results.append(target.run(seed))
        except target.refusals:
            continue
    assert results
