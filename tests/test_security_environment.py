"""What the processes' environment says of security, taken as rcl takes it."""

from __future__ import annotations

import pytest

from enclave_launch.errors import UsageError
from enclave_launch.security_environment import environment_domains
from keystore.formats.domains import Domains


@pytest.mark.parametrize(("text", "domain"), [("", 0), ("0", 0), ("42", 42), ("007", 7), ("230", 230)])
def test_the_domain_of_the_environment(text: str, domain: int) -> None:
    assert environment_domains({"ROS_DOMAIN_ID": text}) == Domains.single(domain)


def test_without_one_it_is_zero() -> None:
    assert environment_domains({}) == Domains.single(0)


@pytest.mark.parametrize(
    "text", ["all", "0-10", "1,2", "-1", "231", " 5", "5x", "٣", "99999999999", "0x1", "5\n"]
)
def test_what_no_process_would_take_signs_nothing(text: str) -> None:
    """Permissions for more domains than one are somebody's decision, never a slip of a variable."""
    with pytest.raises(UsageError, match="ROS_DOMAIN_ID"):
        environment_domains({"ROS_DOMAIN_ID": text})
