"""``ROS_DOMAIN_ID`` as rcl reads it: ``strtoul`` with base 0 (rcl ``domain_id.c``)."""

from __future__ import annotations

import pytest

from enclave_common.environment import domain_id


@pytest.mark.parametrize(
    ("text", "number"), [("", 0), ("0", 0), ("7", 7), ("232", 232), ("010", 8), ("0x1F", 31)]
)
def test_a_number_of_c(text: str, number: int) -> None:
    assert domain_id(text) == number


@pytest.mark.parametrize("text", ["abc", "-1", "1 2", " 7", "08", "0o7", "0x", "7\n", "٣"])
def test_what_is_no_number_of_c_is_refused(text: str) -> None:
    assert domain_id(text) is None
