"""``coneskin sim-skin``: its options, and the program as it is run."""

import argparse
import json
import math
import os
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from coneskin.core.errors import SensorError, SkinConnectionError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import TouchBegan, TouchMoved
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.serial_port import SerialPort
from coneskin.skin.virtual import command
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import FrameDecoder

PROGRAM = """
import argparse, sys
from coneskin.skin.virtual import command
parser = argparse.ArgumentParser("coneskin sim-skin")
command.add_arguments(parser)
sys.exit(command.run(parser.parse_args()))
"""
CONE = ["--radius1-mm", "40", "--radius2-mm", "70", "--height-mm", "150"]


def run(*words: str) -> int:
    parser = argparse.ArgumentParser("coneskin sim-skin")
    command.add_arguments(parser)
    return command.run(parser.parse_args(words))


def test_a_touch_is_read_in_millimetres_and_degrees():
    assert command._parse_touch("1:1.5:200:90") == ScriptedTouch(1.0, 1.5, 0.2, math.pi / 2)
    assert command._parse_touch("1:1.5:200:90:7").force == 7.0
    assert command._parse_press("1:1.5:200:90") == ("finger", ScriptedTouch(1.0, 1.5, 0.2, math.pi / 2))
    assert command._parse_press("grip:1:1.5:200:90") == ("grip", ScriptedTouch(1.0, 1.5, 0.2, math.pi / 2))
    with pytest.raises(SensorError, match="must be one of finger, palm, fingers, grip, seam, got 'fist'"):
        command._parse_press("fist:1:1.5:200:90")


@pytest.mark.parametrize(("shape", "contacts"), [("finger", 1), ("palm", 1), ("fingers", 3), ("grip", 2), ("seam", 2)])
def test_every_shape_and_every_length_reach_the_bytes(shape, contacts, tmp_path, monkeypatch):
    made = []
    monkeypatch.setattr(
        VirtualSkin, "touch", lambda self, touch, real=VirtualSkin.touch: made.append(touch) or real(self, touch)
    )
    lengths = {"finger": ("36", "40", "52"), "palm": ("40",)}.get(shape, ("36",))
    for length in lengths:
        out = tmp_path / length
        words = ["--touch", f"{shape}:0.02:9:200:30:9", "--frame-length", length, "--model", "ladder"]
        assert run(*words, "--duration-s", "0.06", "--output", str(out)) == 0
        frames = FrameDecoder().feed(out.read_bytes())
        assert {frame.length for frame in frames} == {int(length)}
        assert len(frames) == 60
        assert frames[0].touch_c < 10 < 300 < frames[-1].touch_c
    assert len(made) == len(lengths) * contacts


@pytest.mark.parametrize("text", ["", "1:2:3", "1:2:3:4:5:6", "a:b:c:d", "2:1:100:10"])
def test_a_touch_that_cannot_be(text):
    with pytest.raises(SensorError, match="a touch must"):
        command._parse_touch(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("warp=1", "a fault must be one of drop_every"),
        ("drop_every=x", "fault drop_every must be a number such as drop_every=5, got 'x'"),
        ("wiring=melt-A", "wiring must be open-A or short-A-ground"),
        ("wiring=open-E", "open wire must be one of A, B, C, D, got 'E'"),
    ],
)
def test_a_fault_that_cannot_be(text, words):
    with pytest.raises(SensorError, match=words):
        command._parse_fault(text)


def test_every_fault_takes_a_value_of_its_kind():
    given = "gain_after=0", "gain_of=D", "gain=0.5", "status=0x08", "stuck_channel=radial_c", "wiring=short-A-rail"
    faults = FaultInjection(**dict(map(command._parse_fault, given)))
    assert (faults.gain_of, faults.gain, faults.status, faults.stuck_channel) == ("D", 0.5, 8, "radial_c")
    assert faults.wiring.shorts == (("A", "rail"),)


def test_a_file_holds_the_bytes_of_the_virtual_skin(tmp_path, capsys):
    file = tmp_path / "touch.bin"
    words = ["--touch", "0.01:0.03:50:90", "--fault", "drop_every=10", "--seed", "4", "--duration-s", "0.05"]
    assert run(*CONE, *words, "--output", str(file), "--json") == 0
    touch = ScriptedTouch(0.01, 0.03, 0.05, math.pi / 2)
    sensor = Sensor(Frustum(0.04, 0.07, 0.15, 2 * math.pi))
    skin = VirtualSkin(sensor, [touch], seed=4, faults=FaultInjection(drop_every=10), duration=0.05)
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


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_pipe_that_nobody_reads_is_refused_at_once(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(SkinConnectionError, match="pipe: nobody reads this pipe: start its reader first"):
        run("--duration-s", "0.01", "--output", str(pipe))


def test_a_mistake_is_one_line_of_usage(capsys):
    with pytest.raises(SystemExit):
        run("--touch", "1:2")
    assert "a touch must be START_S:END_S:U_MM:PHI_DEG[:FORCE_N], got '1:2'" in capsys.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")
@pytest.mark.long
def test_the_program_on_a_port_is_touched_as_its_script_says(tmp_path):
    link = tmp_path / "skin"
    words = [*CONE, "--touch", "0.15:0.25:50:90", "--duration-s", "0.3", "--link", str(link), "--json"]
    with subprocess.Popen([sys.executable, "-c", PROGRAM, *words], stdout=subprocess.PIPE, text=True) as program:
        try:
            assert program.stdout is not None
            assert json.loads(program.stdout.readline())["link"] == str(link)
            stream = TouchStream([Sensor(Frustum(0.04, 0.07, 0.15))])
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


def test_several_sensors_and_a_script_of_touches(tmp_path):
    script, out = tmp_path / "touches.txt", tmp_path / "bytes"
    script.write_text("# who is touched when\n0.1:0.2:200:90@2   # the second\n\nfinger:0.1:0.2:100..130:90:7@3\n")
    words = ["--sensor", "1", "--sensors", "3", "--model", "ladder", "--duration-s", "0.25", "--output", str(out)]
    assert run(*words, "--script", str(script)) == 0
    sensors = [Sensor(Frustum(0.054, 0.054, 0.434), number) for number in (1, 2, 3)]
    stream = TouchStream(sensors)
    data = out.read_bytes()
    touched = [e for at in range(0, len(data), 36) for e in stream.feed(data[at : at + 36], at / 108e3)]
    began = {e.sensor: round(e.u, 2) for e in touched if isinstance(e, TouchBegan)}
    assert began == {"sensor 0/2": 0.2, "sensor 0/3": 0.1}
    last = [e.u for e in touched if isinstance(e, TouchMoved) and e.sensor == "sensor 0/3"][-1]
    assert last == pytest.approx(0.13, abs=0.005)  # it has slid


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1:2:3", "touches.txt, line 2: a touch must be START_S:END_S"),
        ("fist:1:2:3:4", "touches.txt, line 2: the shape of a touch must be one of"),
        ("1:2:200:90@9", "the sensor of a touch must be one of 0, got @9"),
    ],
)
def test_a_script_with_a_mistake_names_it(line, message, tmp_path):
    script = tmp_path / "touches.txt"
    script.write_text(f"1:2:200:90\n{line}\n")
    with pytest.raises(SensorError, match=message):
        run("--script", str(script), "--duration-s", "0.1", "--output", str(tmp_path / "bytes"))
