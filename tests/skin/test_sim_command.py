"""``coneskin sim-skin``: its options, and the program as it is run."""

import argparse
import json
import math
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from coneskin.errors import SensorError, SkinConnectionError
from coneskin.geometry.frustum import Frustum
from coneskin.skin import sim_command
from coneskin.skin.events import TouchBegan
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.sensor import Sensor
from coneskin.skin.serial_port import SerialPort
from coneskin.skin.stream import Stream
from coneskin.skin.virtual import VirtualSkin

PROGRAM = """
import argparse, sys
from coneskin.skin import sim_command
parser = argparse.ArgumentParser("coneskin sim-skin")
sim_command.add_arguments(parser)
sys.exit(sim_command.run(parser.parse_args()))
"""
CONE = ["--radius1-mm", "40", "--radius2-mm", "70", "--height-mm", "150"]


def run(*words: str) -> int:
    parser = argparse.ArgumentParser("coneskin sim-skin")
    sim_command.add_arguments(parser)
    return sim_command.run(parser.parse_args(words))


def test_a_touch_is_read_in_millimetres_and_degrees():
    assert sim_command.parse_touch("1:1.5:200:90") == ScriptedTouch(1.0, 1.5, 0.2, math.pi / 2)
    assert sim_command.parse_touch("1:1.5:200:90:7").force == 7.0


@pytest.mark.parametrize("text", ["", "1:2:3", "1:2:3:4:5:6", "a:b:c:d", "2:1:100:10"])
def test_a_touch_that_cannot_be(text):
    with pytest.raises(SensorError, match="a touch must"):
        sim_command.parse_touch(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("warp=1", "a fault must be one of drop_every"),
        ("drop_every=x", "fault drop_every must be a whole number, got 'x'"),
        ("wiring=melt-A", "wiring must be open-A or short-A-ground"),
        ("wiring=open-E", "open wire must be one of A, B, C, D, got 'E'"),
    ],
)
def test_a_fault_that_cannot_be(text, words):
    with pytest.raises(SensorError, match=words):
        sim_command.parse_fault(text)


def test_a_file_holds_the_bytes_of_the_virtual_skin(tmp_path, capsys):
    file = tmp_path / "touch.bin"
    words = ["--touch", "0.01:0.03:50:90", "--fault", "drop_every=10", "--seed", "4", "--duration-s", "0.05"]
    assert run(*CONE, *words, "--output", str(file), "--json") == 0
    from coneskin.skin.faults import Faults

    touch = ScriptedTouch(0.01, 0.03, 0.05, math.pi / 2)
    sensor = Sensor(Frustum(0.04, 0.07, 0.15, 2 * math.pi))
    skin = VirtualSkin(sensor, [touch], seed=4, faults=Faults(drop_every=10), duration=0.05)
    expected = b"".join(data for _, data in skin.packets())
    assert file.read_bytes() == expected
    assert json.loads(capsys.readouterr().out) == {"output": str(file), "bytes": len(expected)}


def test_the_model_of_the_sheets_can_be_chosen(tmp_path):
    files = [tmp_path / model for model in ("field", "ladder")]
    for file in files:
        words = ["--touch", "0.01:0.03:50:90", "--duration-s", "0.05", "--model", file.name]
        assert run(*CONE, *words, "--output", str(file)) == 0
    assert files[0].read_bytes() != files[1].read_bytes()
    with pytest.raises(SystemExit):
        run("--model", "comsol")


def test_a_file_needs_an_end_and_a_place(tmp_path):
    with pytest.raises(SensorError, match="give --duration-s"):
        run("--output", str(tmp_path / "x"))
    with pytest.raises(SkinConnectionError, match="cannot be written"):
        run("--output", str(tmp_path / "no" / "x"), "--duration-s", "1")


def test_a_mistake_is_one_line_of_usage(capsys):
    with pytest.raises(SystemExit):
        run("--touch", "1:2")
    assert "a touch must be START_S:END_S:U_MM:PHI_DEG[:FORCE_N], got '1:2'" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")
def test_the_program_on_a_port_is_touched_as_its_script_says(tmp_path):
    link = tmp_path / "skin"
    words = [*CONE, "--touch", "0.15:0.25:50:90", "--duration-s", "0.3", "--link", str(link), "--json"]
    with subprocess.Popen([sys.executable, "-c", PROGRAM, *words], stdout=subprocess.PIPE, text=True) as program:
        try:
            assert program.stdout is not None
            assert json.loads(program.stdout.readline())["link"] == str(link)
            stream = Stream([Sensor(Frustum(0.04, 0.07, 0.15))])
            events = []
            with SerialPort(str(link)) as port, suppress(SkinConnectionError):  # gone when the script has ended
                while True:
                    events += stream.feed(port.read(10.0), time.monotonic())
            summary = json.loads(program.stdout.readline())
        finally:
            program.kill()
    began = [event for event in events if isinstance(event, TouchBegan)]
    assert len(began) == 1
    assert began[0].clock_us == pytest.approx(153_000, abs=3000)  # 10 ms of rise, above 0.5 N after 2 ms
    assert summary["packets"] == 300
    assert not link.exists()
