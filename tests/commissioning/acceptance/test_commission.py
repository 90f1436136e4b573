"""A commissioning with the process of a virtual skin: a right one passes, a wrong one is named; the command itself."""

import json
import socket
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from coneskin.cli import main
from coneskin.commissioning.acceptance.commission import Commissioner, _ArmWatch, commission_virtual_skin
from coneskin.commissioning.skin_watch import TouchSession
from coneskin.core.errors import RobotError, SkinConnectionError
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.values.scene import Scene
from tests.support.scenes import START, forearm_scene

TEXT = forearm_scene(reaction='kind = "retreat"').replace("[[link.sensor]]", '[[link.sensor]]\nname = "forearm skin"')
Output = pytest.CaptureFixture[str]


def saved(folder: Path, text: str = TEXT) -> Path:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return path


def wired(keys: str) -> Scene:
    """The scene of a skin whose wires are exchanged against TEXT."""
    return parse_scene(TEXT.replace("radius1_mm", f"{keys}\nradius1_mm"))


@pytest.mark.long
@pytest.mark.processes
def test_a_right_skin_passes_and_the_record_is_valid(tmp_path: Path, capsys: Output) -> None:
    path = saved(tmp_path)
    assert main(["doctor", str(path), "--check"]) == 0
    assert "NOT VALID: the arm only stops; there is no commissioning record" in capsys.readouterr().out
    assert main(["commission", str(path), "--simulated", "--by", "a test", "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["kind"] for line in lines if line["kind"] != "reading"] == ["mark", "passed"] * 5 + ["sensor", "end"]
    assert lines[-1]["passed"] is True
    record = json.loads((tmp_path / "scene.commissioning.json").read_text())
    assert record["sheet_ohm"] == {"0/0": pytest.approx([1000.0, 1000.0], rel=3e-3)}
    assert "wrist 3" in lines[-1]["no_skin_on"]
    assert main(["doctor", str(path), "--check", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["commissioning"].endswith("by a test, 5 marks")


@pytest.mark.long
@pytest.mark.processes
@pytest.mark.parametrize(
    ("happens", "words"),
    [
        (f"def nudge():\n  movej({[*START[:5], START[5] + 0.03]})\nend\n", "the arm has moved, a joint by 0.0"),
        ("rtde silent", "the controller has sent no state for 1 s"),
    ],
)
def test_the_arm_has_to_stay_where_the_marks_were_described(happens: str, words: str) -> None:
    with SimulatedController("UR5e", free_host(), START) as controller, ExitStack() as stack:
        watch = _ArmWatch(parse_scene(forearm_scene(controller.host, "external")).arm, stack)
        assert watch.q == pytest.approx(START)
        watch.check()
        if happens.startswith("def"):
            with socket.create_connection((controller.host, 30002), 60.0) as script:
                script.sendall(happens.encode())
                script.shutdown(socket.SHUT_WR)
                while script.recv(65536):
                    pass
        else:
            controller.call(happens)
        end, said = time.monotonic() + 60.0, ""
        while not said and time.monotonic() < end:
            try:
                watch.check()
            except RobotError as exc:
                said = str(exc)
        assert said.startswith(words), said


@pytest.mark.long
@pytest.mark.processes
@pytest.mark.parametrize(
    ("keys", "cause"),
    [
        ('radial_positive = "A"', "A and B were exchanged (their wires"),
        ('angular_positive = "D"', "C and D were exchanged (their wires"),
        ('radial_positive = "A"\nangular_positive = "D"', "A and B, and C and D, were exchanged"),
    ],
)
def test_exchanged_wires_fail_and_are_named(keys: str, cause: str) -> None:
    record = Commissioner(TouchSession(parse_scene(TEXT), simulated=True, wired_as=wired(keys))).run()
    assert not record.passed
    assert f"it reads as if {cause}" in record.cause
    assert not all(mark.passed for mark in record.marks)


@pytest.mark.long
@pytest.mark.processes
def test_a_program_commissions_its_virtual_skin() -> None:
    known = commission_virtual_skin(parse_scene(TEXT)).commissioning
    assert known is not None
    assert known.valid
    assert known.sheet_ohm == {"0/0": pytest.approx((1000.0, 1000.0), rel=3e-3)}
    assert "5 marks touched by this program" in known.note


def test_simulated_touches_are_refused_for_a_real_skin(tmp_path: Path, capsys: Output) -> None:
    path = saved(tmp_path, TEXT.replace('kind = "virtual"', 'kind = "serial"\nport = "/dev/null"'))
    assert main(["commission", str(path), "--simulated"]) == 1
    assert "only a person can touch it" in capsys.readouterr().err
    with pytest.raises(SkinConnectionError, match="nobody can touch it: use --simulated"):
        TouchSession(load_scene(saved(tmp_path)))
    assert [item.name for item in tmp_path.iterdir()] == ["scene.toml"]


def test_an_interrupt_writes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Output) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Commissioner, "run", interrupted)
    assert main(["commission", str(saved(tmp_path)), "--simulated"]) == 130
    assert [item.name for item in tmp_path.iterdir()] == ["scene.toml"]
    assert "interrupted" in capsys.readouterr().err


def test_the_marks_are_listed_for_a_posture(tmp_path: Path, capsys: Output) -> None:
    path = saved(tmp_path, TEXT.replace('kind = "virtual"', 'kind = "serial"\nport = "/dev/null"'))
    assert main(["commission", str(path), "--list", "--posture-deg=0,-90,0,0,0,0"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == 5
    assert all("(12:00 is towards the base's +x)" in line for line in listed), "the forearm is upright"
    with pytest.raises(SystemExit):
        main(["commission", str(path), "--list", "--posture-deg=0,1"])
