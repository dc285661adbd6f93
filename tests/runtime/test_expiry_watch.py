"""While a launch runs it is told in time that certificates, permissions or the CRL end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from enclave_launch import SecurityOptions, provision, resolve
from enclave_launch.expiry_watch import deadline_before, notices, watched
from keystore import Expiry, ProvisionOptions
from keystore.formats.validity import utc_now

NOW = datetime(2031, 5, 1, 12, tzinfo=timezone.utc)
HOUR, DAY = timedelta(hours=1), timedelta(days=1)


def ends(after: timedelta, what: str = "certificate", enclave: str = "/a") -> Expiry:
    return Expiry(NOW + after, what, enclave, NOW - DAY)


def test_each_margin_is_told_once_and_those_that_are_over_are_left_out() -> None:
    found = notices([ends(2 * DAY)], "ks", NOW)
    assert [one.at - NOW for one in found] == [DAY, 47 * HOUR, 2 * DAY - timedelta(minutes=5), 2 * DAY]
    assert "ends in 1 day" in found[0].text and "secure-keystore renew ks --within 2d" in found[0].text
    assert "has expired: Cyclone DDS peers receive nothing more" in found[-1].text


def test_what_ends_together_is_one_line() -> None:
    found = notices([ends(DAY, enclave=f"/{name}") for name in "abcde"], "ks", NOW)
    assert len(found) == 3 and "and 2 more end in 1 hour" in found[0].text


def test_what_has_ended_or_lives_long_is_told_in_its_time_only() -> None:
    assert notices([ends(-HOUR)], "ks", NOW) == []
    assert notices([ends(3650 * DAY)], "ks", NOW)[0].at == NOW + 3643 * DAY


@pytest.mark.parametrize("ahead", [timedelta(minutes=55), None])
def test_a_running_launch_says_so(tmp_path: Path, ahead: timedelta | None) -> None:
    """The clock is the watch's own: an hour of certificate is left, or, beside it, a day."""
    file = tmp_path / "test.launch.xml"
    file.write_text('<launch><executable cmd="true" enclave="/tool"/></launch>')
    start = utc_now()
    options = ProvisionOptions(valid_until=start + (HOUR if ahead else 30 * DAY), durable=False)
    launch = provision(resolve(file), tmp_path / "ks", options=SecurityOptions(keystore=options))
    said, heard = list[str](), threading.Event()

    def say(text: str) -> None:
        said.append(text)
        heard.set()

    clock = iter([start])

    def now() -> datetime:
        return next(clock, start + (ahead or timedelta(0)))

    with watched(launch, say, now):
        heard.wait(20 if ahead else 0.2)
    assert bool(said) is bool(ahead)
    assert not said or "of /tool ends" in said[0] or ("/tool" in said[0] and "5 minutes" in said[0])


EXECUTABLE = """<launch>
  <executable cmd="sh -c 'echo up; exec sleep 60'" name="tool" enclave="/tool" output="screen"/>
</launch>
"""


def test_with_restart_expiring_a_launch_is_renewed_and_started_anew_before_the_end(tmp_path: Path) -> None:
    """A life of 20 seconds: in its last fifth the launch is ended in order, what it uses renewed, and it runs again."""
    file = tmp_path / "test.launch.xml"
    file.write_text(EXECUTABLE)
    keystore = tmp_path / "ks"
    words = ["--secure", "--keystore", str(keystore), "--valid-for", "20s", "--restart-expiring", str(file)]
    environment = {**os.environ, "ROS_LOG_DIR": str(tmp_path / "log")}
    with subprocess.Popen(
        [sys.executable, "-m", "enclave_launch", "-n", *words],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    ) as launch:
        assert launch.stdout is not None
        certificates, shown = [], []
        for line in launch.stdout:
            shown.append(line)
            if line == "[tool-1] up\n":
                certificates.append((keystore / "enclaves" / "tool" / "cert.pem").read_bytes())
                if len(certificates) == 2:
                    launch.send_signal(signal.SIGINT)
        assert launch.wait() == 0, shown
    assert len(set(certificates)) == 2, shown
    assert any("renewing, starting again" in line for line in shown)


def test_a_new_start_is_planned_only_where_it_helps() -> None:
    assert _deadline(NOW, NOW + DAY, now=NOW) == NOW + DAY - timedelta(minutes=5)
    assert _deadline(NOW, NOW + timedelta(seconds=100), now=NOW) == NOW + timedelta(seconds=80)
    assert _deadline(NOW, NOW + HOUR, now=NOW + HOUR - timedelta(seconds=5)) is None, "renewing did not help"


def _deadline(not_before: datetime, not_after: datetime, now: datetime) -> datetime | None:
    end = Expiry(not_after, "certificate", "/tool", not_before)
    authority = Expiry(now + timedelta(seconds=1), "identity CA", None, not_before)
    deadline = deadline_before([end, authority], now)
    return deadline.at if deadline else None
