"""The script beside a program file is what runs, and a file without one is refused with a way out."""

from __future__ import annotations

from pathlib import Path

import pytest

from coneskin.robot.sim.ports.user_interface import EXTERNAL_CONTROL, _ProgramFolder
from coneskin.robot.sim.urscript.values import ScriptError
from tests.robot.sim.ports.console import EXTERNAL, WAIT, save_program


def test_a_program_is_the_script_beside_it(tmp_path: Path) -> None:
    save_program(tmp_path, "wait", WAIT)
    save_program(tmp_path, "external_control", EXTERNAL)
    waits, external = (_ProgramFolder(tmp_path).load(f"{name}.urp") for name in ("wait", "external_control"))
    assert (waits.name, waits.path, waits.text, waits.function) == ("wait.urp", "/programs/wait.urp", WAIT, "wait")
    assert (EXTERNAL_CONTROL in waits.text, EXTERNAL_CONTROL in external.text) == (False, True)


def test_a_program_without_its_script_is_refused_with_what_to_write(tmp_path: Path) -> None:
    (tmp_path / "grip.urp").write_bytes(b"")
    with pytest.raises(ScriptError, match=rf"has no grip.script beside it.*the line '{EXTERNAL_CONTROL}'"):
        _ProgramFolder(tmp_path).load("grip.urp")


def test_a_script_is_taken_as_it_is_or_given_a_name(tmp_path: Path) -> None:
    for text, wanted in (("# c\ndef p():\nend\n", "# c\ndef p():\nend\n"), ("sleep(1)", "def a_b():\nsleep(1)\nend\n")):
        (tmp_path / "a b.script").write_text(text)
        assert _ProgramFolder(tmp_path).load("a b.script").text == wanted
