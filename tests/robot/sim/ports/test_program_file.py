"""Program files of PolyScope become URScript, or are refused by what they lack."""

from __future__ import annotations

import gzip

import pytest

from coneskin.robot.sim.ports.program_file import EXTERNAL_CONTROL, _read_program
from coneskin.robot.sim.urscript.values import ScriptError
from tests.robot.sim.ports.console import EXTERNAL, WAIT, packed


@pytest.mark.parametrize(
    ("once", "lines"),
    [
        ("true", ["def my_prog():", EXTERNAL_CONTROL, "end"]),
        ("false", ["def my_prog():", "while True:", EXTERNAL_CONTROL, "sync()", "end", "end"]),
    ],
)
def test_a_program_of_external_control_alone_asks_for_its_script(once: str, lines: list[str]) -> None:
    nodes = f"<Folder><children>{EXTERNAL}</children></Folder><Comment/>"
    assert _read_program("my prog.urp", packed(nodes, once)).splitlines() == lines


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (packed(WAIT + EXTERNAL), "has the nodes Wait, External Control, and only a single External Control is"),
        (packed(EXTERNAL + EXTERNAL), "only a single External Control is simulated; save its .script file beside"),
        (packed('<Contributed strategyProgramNodeType="Gripper"/>'), "has the nodes Gripper, and only"),
        (packed(""), "has the nodes of an empty program"),
        (packed("<Folder><children>" * 5000 + "</children></Folder>" * 5000), "an empty program"),
        (gzip.compress(b"<URProgram/>", mtime=0), "has no main program"),
        (b"<URProgram>", "is not a program"),
        (b"\x1f\x8bnothing", "is not a program"),
        (b'<!DOCTYPE x [<!ENTITY a "b">]><URProgram>&a;</URProgram>', "declares a document type"),
    ],
)
def test_any_other_program_without_its_script_is_refused(data: bytes, problem: str) -> None:
    with pytest.raises(ScriptError, match=problem):
        _read_program("a.urp", data)


def test_a_packed_file_is_unpacked_to_a_bound_only() -> None:
    with pytest.raises(ScriptError, match="is not a program"):
        _read_program("a.urp", gzip.compress(b"<URProgram>" + b" " * 20_000_000, 1, mtime=0))


def test_a_script_is_taken_as_it_is_or_given_a_name() -> None:
    assert _read_program("a.script", b"# c\ndef p():\nend\n") == "# c\ndef p():\nend\n"
    assert _read_program("a.script", b"sleep(1)") == "def a():\nsleep(1)\nend\n"
