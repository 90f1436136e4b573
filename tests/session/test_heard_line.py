"""A guard that refuses says what is wrong with the skin's line, by the same diagnosis as the monitor."""

import time
from collections.abc import Callable

import pytest

from coneskin.core.recording.block import Block
from coneskin.robot.guard.signals.journal import BlockKind, GuardEvent
from coneskin.scene.reader import parse_scene
from coneskin.session.heard_line import HeardLine
from coneskin.session.outcome import activation_error
from coneskin.skin.virtual.skin import VirtualSkin

from ..scene.scenes import SERIAL_RETREAT

SCENE = parse_scene(SERIAL_RETREAT)
SENSOR = SCENE.sensors[0].sensor
WAITS = [f"{SENSOR.name}: no valid frame"]


def heard(change: Callable[[bytes], bytes]) -> HeardLine:
    """Half a second of a skin, until now."""
    line, end = HeardLine(), time.monotonic()
    packets = list(VirtualSkin(SENSOR, model="ladder", duration=0.5, seed=1).packets())
    line.take([Block(BlockKind.SKIN, end - 0.5 + at, change(data)) for at, data in packets])
    return line


def test_the_refusal_names_the_mistake_in_the_firmware() -> None:
    line = heard(lambda data: data[:-2] + data[-1:] + data[-2:-1])
    error = activation_error([GuardEvent("waiting", 1.0, {"reasons": WAITS})], lambda why: line.describe(SCENE, why))
    assert str(error).splitlines() == [
        "the guard did not become active:",
        "  on serial hwgrep://0403:6001, the checksum is another CRC: its low byte goes first: append the CRC with its "
        "high byte first",
        f"  {WAITS[0]}",
    ]


def test_a_silent_line_is_named_too() -> None:
    assert HeardLine().describe(SCENE, WAITS).startswith("no byte has come from serial hwgrep://0403:6001: check power")


@pytest.mark.parametrize("reasons", [[], ["the arm is not powered"]])
def test_reasons_of_the_arm_get_no_words_about_the_skin(reasons: list[str]) -> None:
    assert heard(lambda _: b"nonsense").describe(SCENE, reasons) == ""


def test_a_line_on_which_all_is_right_gets_none_either() -> None:
    assert heard(lambda data: data).describe(SCENE, WAITS) == ""
