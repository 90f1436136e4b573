"""Boards whose parts are drawn from their data sheets: all that are offered work, and what does not is not offered."""

import pytest

from coneskin.core.errors import SensorError
from coneskin.skin.firmware.board_circuit import board_circuit
from tests.support.firmware.board_population import FOREARM, judge

OFFERED = [
    *(("uno", "built-in"), ("nano-every", "built-in"), ("pico", "built-in"), ("teensy", "built-in")),
    *(("esp32", "ads1115"), ("uno", "ads1115"), ("uno", "ads1015"), ("uno", "ltc1867")),
]


@pytest.mark.long
@pytest.mark.parametrize(("board", "converter"), OFFERED)
def test_boards_within_their_data_sheets_become_ready_and_place_touches_and_never_fault(board, converter):
    found = [judge(board, converter, seed) for seed in range(40)]
    assert [each for each in found if not each.good] == []


@pytest.mark.parametrize(("millivolts", "fault"), [(0.5, None), (-0.5, None), (1.0, "ZERO"), (-1.0, "ZERO")])
def test_the_offset_of_a_lesser_amplifier_is_taken_off_or_named(millivolts, fault):
    for seed in range(3):
        found = judge("pico", "built-in", seed, offset=1e-3 * millivolts, hour=False)
        assert found.good if fault is None else {*found.faults} == {fault}


def test_the_own_converter_of_an_esp32_fails_and_is_not_offered():
    assert not any(judge("pico", "built-in", seed, esp32=True, hour=False).good for seed in range(5))
    with pytest.raises(SensorError, match="give it a converter"):
        board_circuit("esp32", FOREARM)
