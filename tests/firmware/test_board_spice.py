"""ngspice on the board's netlist: the virtual circuit reads what it does, all has settled, warm parts leak little."""

import shutil

import pytest

from coneskin.skin.firmware.board_circuit import board_circuit
from tests.support.firmware.spice_deck import BOARDS, SENSORS, compare, scenes

pytestmark = [
    pytest.mark.long,
    pytest.mark.processes,
    pytest.mark.skipif(shutil.which("ngspice") is None, reason="no ngspice: apt-get install ngspice"),
]


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("sensor", SENSORS)
def test_the_netlist_and_the_virtual_circuit_agree(sensor, board):
    circuit = board_circuit(board[0], SENSORS[sensor], board[1])
    found = compare(circuit, scenes(circuit.sensor)["3 mS"])
    assert found["agreement"] < 1e-4
    assert found["unsettled"] < 1e-5
    assert found["warm"] < 5e-3  # half of what an untouched guide may show
    assert found["mains"] < 1e-4


def test_a_light_touch_on_the_ring_has_settled_to_a_count_of_12_bits():
    circuit = board_circuit("pico", SENSORS["1.3 ohm ring"])
    assert compare(circuit, scenes(circuit.sensor)[".4 mS"])["unsettled"] < 1.0 / 4095.0
