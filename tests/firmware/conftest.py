"""The sketch, built once for all tests, and the sensor that its board is wired to."""

import math

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.firmware.board_circuit import board_circuit
from coneskin.skin.sensor import Sensor
from tests.support.firmware.emulated_board import BoardPrograms
from tests.support.firmware.firmware_build import build_emulator, build_sketch, missing_tools

CONE = Frustum(0.0375, 0.0375, 0.24, math.radians(350))  # on the forearm of a UR5e
BITS = 11  # of an Uno with its usual setting: two conversions a reading


@pytest.fixture(scope="session")
def programs(tmp_path_factory: pytest.TempPathFactory) -> BoardPrograms:
    if missing := missing_tools():
        pytest.skip(missing)
    folder = tmp_path_factory.mktemp("firmware")
    return BoardPrograms(build_emulator(folder), build_sketch(folder))


@pytest.fixture(scope="session")
def sensor() -> Sensor:
    return board_circuit("uno", Sensor(CONE)).sensor
