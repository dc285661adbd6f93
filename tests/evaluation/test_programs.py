"""Programs that are not there are known before anything starts."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from enclave_launch import LaunchFileError
from enclave_launch.evaluation.programs import check_programs, missing_programs


def test_missing_programs_are_named_with_their_place(launch_xml: Any, tmp_path: Path) -> None:
    (tmp_path / "tool").write_text("#!/bin/sh\n")
    (tmp_path / "tool").chmod(0o755)
    found = launch_xml(f"""
        <executable cmd="true"/>
        <executable cmd="no_such_program --flag"/>
        <executable cmd="./tool" cwd="{tmp_path}"/>
        <executable cmd="/nowhere/tool"/>
        <executable cmd="no_such_program | cat" shell="true"/>
        <executable cmd="tool"><env name="PATH" value="{tmp_path}"/></executable>
        <executable cmd="true" launch-prefix="no_such_prefix"/>
    """)
    messages = [str(error) for _, error in missing_programs(found.processes)]
    assert [message.split("'")[1] for message in messages] == [
        "no_such_program",
        "/nowhere/tool",
        "no_such_prefix",
    ]
    assert "main.launch.xml:3: <executable>" in messages[0]


def test_what_an_event_starts_may_come_later(launch_xml: Any) -> None:
    process = launch_xml('<executable cmd="no_such_program"/>').processes[0]
    with pytest.raises(
        LaunchFileError, match=r"main\.launch\.xml:\d+: <executable> program 'no_such_program'"
    ):
        check_programs([process])
    check_programs([process._replace(on_event="process exit")])
