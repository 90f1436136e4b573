"""The sketch, built once for all tests, and the sensor that its board is wired to."""

import math

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.electronics import GivenElectronics, LeadOhms, match_electronics
from coneskin.skin.sensor import Sensor, sheet_resistances
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
    # A and D are driven to ground by a pin of 25 ohm, B and C to the rail by a switch of 2 ohm; 1 ohm of wire each
    given = GivenElectronics(adc_bits=BITS, lead_ohms=LeadOhms(26.0, 3.0, 3.0, 26.0))
    return Sensor(CONE, electronics=match_electronics(*sheet_resistances(CONE, 1000.0, 1000.0), given))
