"""The sketch with chips in place of the board's converter, as compiled, in emulation: ADS1015, ADS1115, LTC1867."""

import re

import pytest

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import SkinFault, TouchBegan
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.firmware.board_circuit import board_circuit
from coneskin.skin.firmware.boards import converters
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.wire import FrameDecoder, Status, encode
from tests.support.firmware.emulated_board import BoardPrograms, run_board
from tests.support.firmware.firmware_build import build_sketch

from .conftest import CONE

pytestmark = pytest.mark.long
TOUCH = ScriptedTouch(1.51, 2.0, 0.1, 2.0, 10.0)


@pytest.fixture(scope="module", params=["ads1015", "ads1115", "ltc1867"])
def converter(request):
    return converters()[request.param]


@pytest.fixture(scope="module")
def board(programs, converter):
    """The programs with this converter, the emulator's settings for it, and the sensor as the scene describes it."""
    kind = int(re.sub(r"\D", "", converter.name))
    firmware = build_sketch(programs.firmware.parent, chip=kind)
    sensor = board_circuit("uno", Sensor(CONE), converter.name).sensor
    return BoardPrograms(programs.emulator, firmware), {"chip": kind}, sensor


def test_a_touch_is_read_where_it_is(board, converter):
    programs, parts, sensor = board
    run = run_board(programs, sensor, 2.1, [TOUCH], parts=parts)
    frames = FrameDecoder().feed(run.data)
    assert len(frames) == pytest.approx(2.1 * converter.rate_hz, abs=3)
    assert frames[0].status == Status.RESTARTED
    assert {frame.status for frame in frames[1:]} == {0, Status.TOUCH}
    stream = TouchStream([sensor], DetectorSettings(stuck_frames=0))
    events = []
    for number, frame in enumerate(frames):
        events += stream.feed(encode(frame), number / converter.rate_hz)
    assert [event for event in events if isinstance(event, SkinFault)] == []
    (began,) = [event for event in events if isinstance(event, TouchBegan)]
    assert began.u == pytest.approx(TOUCH.u, abs=1e-3)
    assert 0.0375 * began.phi == pytest.approx(0.0375 * TOUCH.phi, abs=1e-3)


def test_it_says_which_converter_it_has(board, converter):
    programs, parts, sensor = board
    data = run_board(programs, sensor, 0.3, commands=["0.05 port ?"], parts=parts).data
    line = data[data.index(b"coneskin") :].split(b"\r\n")[0].decode()
    words = dict(word.split("=") for word in line.split()[1:])
    assert words["converter"] == converter.name
    assert int(words["adc_bits"]) == sensor.electronics.adc_bits
    assert int(words["rate_hz"]) == converter.rate_hz


def test_a_chip_that_does_not_answer_is_in_the_status_and_comes_back(board, converter):
    programs, parts, sensor = board
    run = run_board(programs, sensor, 1.2, commands=["0.4 bus off", "0.8 bus on"], parts=parts)
    frames = FrameDecoder().feed(run.data)
    # a bus of two wires has an answer to each byte; on SPI all that is read is 0, which is no supply
    lost = [frame for frame in frames if frame.status & (Status.SUPPLY if converter.pull_down else Status.ADC)]
    assert len(lost) > 10
    assert 0.38 < 1e-6 * lost[0].clock_us < 0.47
    assert 0.75 < 1e-6 * lost[-1].clock_us < 0.87
    assert frames[-1].status == 0


def test_a_board_of_3_3_v_is_not_offered_with_a_chip_that_answers_with_5():
    with pytest.raises(
        SensorError, match=r"an LTC1867 answers with 5 V, and the pins of a Raspberry Pi Pico have 3\.3 V"
    ):
        board_circuit("pico", Sensor(CONE), "ltc1867")


def test_an_electrode_at_ground_fails_the_self_test(board):
    """One electrode is read a frame, so it takes eight frames until all were."""
    programs, parts, sensor = board
    shorted = "0.3 sheets " + " ".join(["1.0" if i == j == 3 else "0.0" for i in range(4) for j in range(4)])
    frames = FrameDecoder().feed(run_board(programs, sensor, 1.2, commands=[shorted], parts=parts).data)
    assert not any(frame.status & Status.SELF_TEST for frame in frames if frame.clock_us < 290_000)
    assert all(frame.status & Status.SELF_TEST for frame in frames[-8:])


def test_the_sensor_has_the_ranges_of_the_chip(converter):
    parts = board_circuit("uno", Sensor(Frustum(0.05, 0.05, 0.2)), converter.name).sensor.electronics
    own = board_circuit("uno", Sensor(Frustum(0.05, 0.05, 0.2))).sensor.electronics
    assert (parts.adc_volts, parts.adc_bits) == (4.096, converter.bits)
    assert parts.current_full_scale == pytest.approx(own.current_full_scale * 4.096 / 3.3)  # by the same shunt
