"""What the processes' environment says of security, taken as rcl takes it."""

from __future__ import annotations

from pathlib import Path

import pytest

from enclave_common.source_location import SourceLocation
from enclave_launch import UsageError
from enclave_launch.admission.variables import domain_of
from enclave_launch.enclave import AssignmentReason, EnclaveAssignment
from enclave_launch.plan import PlannedProcess
from enclave_launch.process import EnclaveRequest, ProcessKind, ResolvedProcess
from enclave_launch.security_environment import (
    SecuritySettings,
    secured_environment,
)


@pytest.mark.parametrize(("text", "domain"), [("", 0), ("0", 0), ("42", 42), ("007", 7), ("230", 230)])
def test_the_domain_of_the_environment(text: str, domain: int) -> None:
    assert domain_of({"ROS_DOMAIN_ID": text}) == domain


def test_without_one_it_is_zero() -> None:
    assert domain_of({}) == 0


@pytest.mark.parametrize(
    "text", ["all", "0-10", "1,2", "-1", "231", " 5", "5x", "٣", "99999999999", "0x", "5\n"]
)
def test_what_no_process_would_take_signs_nothing(text: str) -> None:
    """Permissions for more domains than one are somebody's decision, never a slip of a variable."""
    with pytest.raises(UsageError, match="ROS_DOMAIN_ID"):
        domain_of({"ROS_DOMAIN_ID": text})


def planned(kind: ProcessKind, enclave: str | None) -> PlannedProcess:
    process = ResolvedProcess(
        1, kind, None, "x", "x-1", None, None, None, ("x",), (), {}, {}, EnclaveRequest(), SourceLocation("a")
    )
    return PlannedProcess(
        process, EnclaveAssignment(enclave, AssignmentReason.ABSOLUTE) if enclave else None, ()
    )


@pytest.mark.parametrize("strategy", ["Enforce", "Permissive"])
def test_what_each_kind_of_process_is_told(strategy: str) -> None:
    settings = SecuritySettings("/ks", strategy)
    ours = {
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_KEYSTORE": "/ks",
        "ROS_SECURITY_STRATEGY": strategy,
    }
    assert secured_environment(planned("node", "/a"), settings) == ours
    tool = secured_environment(planned("executable", "/a"), settings)
    assert tool == {**ours, "ROS_SECURITY_ENCLAVE_OVERRIDE": "/a"}
    nowhere = secured_environment(planned("executable", None), settings)
    assert nowhere["ROS_SECURITY_ENABLE"] == "true" and nowhere["ROS_SECURITY_STRATEGY"] == "Enforce"
    assert not Path(nowhere["ROS_SECURITY_KEYSTORE"]).parent.is_dir(), "nothing can ever be there"
    assert secured_environment(planned("node", "/a"), None) == {}


def test_the_security_log_is_switched_on_where_the_middleware_has_one() -> None:
    settings = SecuritySettings("/ks", log_folder="/logs")
    log = {"ROS_SECURITY_LOG_FILE": "/logs/x-1.log", "ROS_SECURITY_LOG_VERBOSITY": "WARNING"}
    on_fast = planned("node", "/a")._replace(middleware="rmw_fastrtps_cpp")
    assert log.items() <= secured_environment(on_fast, settings).items()
    assert not log.keys() & secured_environment(on_fast, SecuritySettings("/ks")).keys()
    on_cyclone = on_fast._replace(middleware="rmw_cyclonedds_cpp")
    assert not log.keys() & secured_environment(on_cyclone, settings).keys()
    own = {"ROS_SECURITY_LOG_FILE": "mine.log"}
    kept = on_fast._replace(process=on_fast.process._replace(environment=own))
    assert not log.keys() & secured_environment(kept, settings).keys(), "the launch file's own stays"
