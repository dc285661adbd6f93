"""Whatever ``verify`` calls good grants the same to Cyclone DDS, to Fast DDS and to us.

Here is a slice of it, the same in each run; ``./dev fuzz dds-documents`` makes new ones as long as you like.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.dds.differential import Laboratory
from tests.dds.probe import Probe

pytestmark = pytest.mark.dds


def test_documents_that_are_good_are_read_alike(
    cyclone: Probe, fastdds: Probe, domain_id: int, tmp_path: Path
) -> None:
    verdicts = Laboratory(tmp_path, domain_id).judge(1, 150, (cyclone, fastdds))
    assert not verdicts.differences, verdicts.differences[0]
    assert verdicts.made == 150 and verdicts.good > 30
    assert verdicts.changed_and_good > 2, "else the changes never hit what is written otherwise and good"
