"""Programs of PolyScope become URScript, or are refused by the node that is not simulated."""

from __future__ import annotations

import gzip
import json

import pytest

from coneskin.robot.sim.ports.program_file import _read_program, program_information
from coneskin.robot.sim.ports.program_tree import EXTERNAL_CONTROL
from coneskin.robot.sim.urscript.values import ScriptError
from tests.robot.sim.ports.console import EXTERNAL, WAIT, packed


def test_the_nodes_that_are_simulated_become_lines() -> None:
    script = '<Script type="File"><cachedContents>x = 1\ny = 2</cachedContents></Script>'
    folder = f'<Folder name="f"><children>{WAIT}</children></Folder>'
    text = _read_program("my prog.urp", packed(script + folder + "<Comment/>" + EXTERNAL, once="true"))
    assert text.splitlines() == ["def my_prog():", "x = 1", "y = 2", "sleep(0.01)", EXTERNAL_CONTROL, "end"]


def test_a_program_that_does_not_run_once_is_a_loop_that_waits() -> None:
    assert _read_program("a.urp", packed("")).splitlines() == ["def a():", "while True:", "sync()", "end", "end"]


def test_variables_conditions_loops_moves_and_threads_become_lines() -> None:
    """In the form of Universal Robots' own example for its RTDE client."""

    def chars(text: str) -> str:
        return "<expression>" + "".join(f'<ExpressionChar character="{c}"/>' for c in text) + "</expression>"

    first = f'<Assignment valueSource="Expression"><variable name="goal"/>{chars("p[0]")}</Assignment>'
    target = "SpecialSequence/children/Assignment/variable"
    move = (
        '<Move motionType="MoveL" speed="0.08" acceleration="1.2"><feature referencedName="Joint_0_name"/><children>'
        f'<Waypoint type="Variable"><variable reference="{8 * "../"}{target}"/></Waypoint></children></Move>'
    )
    known = f'<ExpressionVariable><ProgramVariable reference="{6 * "../"}{target}"/></ExpressionVariable>'
    equal = "".join(f'<ExpressionChar character="{c}"/>' for c in "x≟1")
    choice = (
        f'<If type="If"><expression>{known}'
        f'<ExpressionToken token=" and "/>{equal}</expression><children>{move}</children></If>'
    )
    loop = f'<Loop type="While">{chars("y")}<children><Script type="Line">{chars("sync()")}</Script></children></Loop>'
    nodes = (
        f'<SpecialSequence type="BeforeStart"><children>{first}</children></SpecialSequence>'
        f'<MainProgram runOnlyOnce="true"><children>{choice}{loop}</children></MainProgram>'
        f'<Thread name="T 1" runOnlyOnce="false"><children>{WAIT}</children></Thread>'
    )
    text = _read_program("a.urp", f"<URProgram><children>{nodes}</children></URProgram>".encode())
    assert text.splitlines() == [
        *("def a():", "global goal = p[0]"),
        *("thread T_1():", "while True:", "sleep(0.01)", "sync()", "end", "end", "T_1_handle = run T_1()"),
        *("if goal and x==1:", "movel(goal, a=1.2, v=0.08)", "end"),
        *("while y:", "sync()", "sync()", "end", "end"),
    ]


def test_a_suppressed_node_is_left_out() -> None:
    assert "sleep" not in _read_program("a.urp", packed(WAIT.replace("<Wait ", '<Wait suppressed="true" ')))


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        (packed('<Move motionType="MoveC"/>'), "the node Move MoveC is not simulated"),
        (packed("<Grip/>"), "the node Grip is not simulated"),
        (packed('<Script type="Line"><expression/></Script>'), "the node Script has no expression of one line"),
        (packed('<Assignment valueSource="Expression"><variable reference="../x"/></Assignment>'), "needs a name"),
        (packed("<Folder><children>" * 5000 + "</children></Folder>" * 5000), "recursion"),
        (packed('<Wait type="DigitalInput"/>'), "the node Wait DigitalInput is not simulated"),
        (packed('<Contributed strategyProgramNodeType="Gripper"/>'), "the node Gripper is not simulated"),
        (packed('<Wait type="Sleep"><waitTime>soon</waitTime></Wait>'), "a wait needs its numbers"),
        (gzip.compress(b"<URProgram/>", mtime=0), "has no main program"),
        (b"<URProgram>", "is not a program"),
        (b"\x1f\x8bnothing", "is not a program"),
        (b'<!DOCTYPE x [<!ENTITY a "b">]><URProgram>&a;</URProgram>', "declares a document type"),
    ],
)
def test_what_is_not_simulated_is_refused_by_name(data: bytes, problem: str) -> None:
    with pytest.raises(ScriptError, match=problem):
        _read_program("a.urp", data)


def test_a_packed_file_is_unpacked_to_a_bound_only() -> None:
    with pytest.raises(ScriptError, match="is not a program"):
        _read_program("a.urp", gzip.compress(b"<URProgram>" + b" " * 20_000_000, 1, mtime=0))


def test_a_script_is_taken_as_it_is_or_given_a_name() -> None:
    assert _read_program("a.script", b"# c\ndef p():\nend\n") == "# c\ndef p():\nend\n"
    assert _read_program("a.script", b"sleep(1)") == "def a():\nsleep(1)\nend\n"


def test_a_program_of_polyscope_x_has_its_script_in_it() -> None:
    facts = {"programInformation": {"name": "n"}, "urscript": {"script": '$ 1 "x"\nsleep(1)'}}
    data = json.dumps({"program": facts}).encode()
    assert _read_program("n.urpx", data) == 'def n():\n$ 1 "x"\nsleep(1)\nend\n'
    assert program_information(data)["name"] == "n"
    for wrong in (b"{", b"[]", b'{"program": 1}', b"[" * 100_000):
        with pytest.raises(ScriptError, match=r"n\.urpx is not a program"):
            _read_program("n.urpx", wrong)
        with pytest.raises(ValueError, match=r".+"):
            program_information(wrong)
