"""Settings, self-test and status of the firmware, on the emulated board."""

from itertools import groupby

import pytest

from coneskin.skin.detection.events import TouchBegan
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.electronics import Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.wire import FrameDecoder, Status, encode
from tests.support.firmware.emulated_board import run_board, sheets_at_touch

pytestmark = pytest.mark.long
TOUCH = ScriptedTouch(0.6, 0.9, 0.1, 2.0, 10.0)


def frames_of(run):
    return FrameDecoder().feed(run.data)


def test_it_tells_what_it_is_and_what_it_is_set_to(programs, sensor):
    data = run_board(programs, sensor, 0.4, commands=["0.05 port ?"]).data
    line = data[data.index(b"coneskin") :].split(b"\r\n")[0].decode()
    words = dict(word.split("=") for word in line.split()[1:])
    assert words["board"] == "uno"
    assert words["adc_bits"] == "11"
    assert {key: words[key] for key in ("device", "sensor", "frame_length", "rate_hz")} == {
        **{"device": "0", "sensor": "0", "frame_length": "52", "rate_hz": "200"}
    }


def test_a_setting_that_is_saved_survives_a_power_cut_and_one_that_is_not_does_not(programs, sensor):
    commands = ["0.05 port device=4660", "0.15 port save", "0.4 port sensor=7", "0.6 power off", "0.7 power on"]
    frames = frames_of(run_board(programs, sensor, 0.9, commands=commands))
    seen = [numbers for numbers, _ in groupby((frame.device, frame.sensor) for frame in frames)]
    assert seen == [(0, 0), (4660, 0), (4660, 7), (4660, 0)]
    starts = [frame for frame in frames if frame.status & Status.RESTARTED]
    assert all(frame.sequence == 0 for frame in starts)
    assert len(starts) == 5  # power, three lines, power


@pytest.mark.parametrize("line", ["rate_hz=5000", "rate_hz=", "rate_hz=2x", "frame_length=38", "colour=3", "nonsense"])
def test_a_line_that_it_does_not_understand_changes_nothing(programs, sensor, line):
    data = run_board(programs, sensor, 0.25, commands=[f"0.02 port {line}"]).data
    assert b"coneskin: not understood" in data
    frames = FrameDecoder().feed(data)
    assert len(frames) > 40
    assert [frame for frame in frames if frame.status & Status.RESTARTED] == frames[:1]


def test_a_rate_that_leaves_no_time_for_a_frame_is_an_overrun_and_can_be_taken_back(programs, sensor):
    commands = ["0.02 port rate_hz=1000", "0.3 port rate_hz=100"]
    frames = frames_of(run_board(programs, sensor, 0.5, commands=commands))
    *_, back = (number for number, frame in enumerate(frames) if frame.status & Status.RESTARTED)
    assert not any(frame.status & Status.OVERRUN for frame in frames[:5])
    assert any(frame.status & Status.OVERRUN for frame in frames[back - 10 : back])
    assert not any(frame.status & Status.OVERRUN for frame in frames[back:])
    assert frames[-1].clock_us - frames[-2].clock_us == pytest.approx(10_000, abs=100)


def test_the_self_test_finds_electrode_d_at_ground_which_no_untouched_phase_shows(programs, sensor):
    (line,) = sheets_at_touch(sensor, ())
    *head, d_to_itself = line.split()
    shorted = " ".join(["0.2", *head[1:], repr(float(d_to_itself) + 10.0)])  # 0.1 ohm
    frames = frames_of(run_board(programs, sensor, 0.5, commands=[shorted]))
    assert not any(frame.status & Status.SELF_TEST for frame in frames[:38])
    assert all(frame.status & Status.SELF_TEST for frame in frames[42:])


def test_a_supply_that_sags_is_in_the_status(programs, sensor):
    frames = frames_of(run_board(programs, sensor, 0.4, commands=["0.2 supply 2.1"]))
    assert not any(frame.status & Status.SUPPLY for frame in frames[:38])
    assert all(frame.status & Status.SUPPLY for frame in frames[42:])


@pytest.mark.parametrize("frame_length", [36, 52])
def test_the_other_polarity_reads_the_same_place(programs, sensor, frame_length):
    other = Sensor(sensor.frustum, electronics=sensor.electronics, polarity=Polarity("A", "D"))
    lines = ["0.02 port a_positive=1", "0.05 port d_positive=1", f"0.08 port frame_length={frame_length}"]
    frames = frames_of(run_board(programs, sensor, 0.9, [TOUCH], lines))
    last = max(number for number, frame in enumerate(frames) if frame.status & Status.RESTARTED)
    stream = TouchStream([other])
    events = [event for k, frame in enumerate(frames[last:]) for event in stream.feed(encode(frame), 5e-3 * k)]
    (touch,) = [event for event in events if isinstance(event, TouchBegan)]
    # the leads of the ends that are now at ground are the pins', and 36 bytes have one supply for all phases: a bound
    assert touch.u == pytest.approx(TOUCH.u, abs=6e-3)
    assert 0.0375 * touch.phi == pytest.approx(0.0375 * TOUCH.phi, abs=6e-3)
