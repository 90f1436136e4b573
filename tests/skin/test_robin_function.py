"""Robin function in plain floats against the arrays', and against the spreading resistance of a small contact."""

import math
import random

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.robin import Robin
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.robin_function import RobinFunction

CASES = [
    (Frustum(0.0375, 0.0375, 0.24, math.radians(350)), 1000.0, 1000.0),
    (Frustum(0.0375, 0.05, 0.14, math.radians(350)), 1000.0, 3000.0),
    (Frustum(0.03, 0.03, 0.6), 500.0, 200.0),
]


@pytest.mark.parametrize(("cone", "upper", "lower"), CASES)
def test_its_gradient_is_that_of_the_arrays(cone, upper, lower):
    sheet, rng = SectorSheet.of_frustum(cone), random.Random(1)
    robin = RobinFunction(sheet.length, sheet.breadth, upper, lower)
    for _ in range(50):
        u, phi = rng.uniform(0.002, 0.998) * cone.slant, rng.uniform(0.002, 0.998) * cone.wrap
        x, y = float(sheet.along(u)[0]), float(sheet.across(phi)[0])
        wanted = Robin(sheet, upper, lower).gradients(sheet, u, phi)
        largest = max(abs(float(v)) for v in wanted) + (upper + lower) / sheet.breadth
        assert robin.gradient(x, y) == pytest.approx([float(v) for v in wanted], abs=1e-4 * largest)


@pytest.mark.parametrize(("cone", "upper", "lower"), CASES)
def test_its_value_is_what_the_edges_change_of_the_spreading_resistance(cone, upper, lower):
    sheet, rng, sheets = SectorSheet.of_frustum(cone), random.Random(2), upper + lower
    robin = RobinFunction(sheet.length, sheet.breadth, upper, lower)
    radius = 5e-4
    for _ in range(10):
        u, phi = rng.uniform(0.1, 0.9) * cone.slant, rng.uniform(0.1, 0.9) * cone.wrap
        coupling = FieldModel(sheet, upper, lower).contacts(u, phi, radius)  # a bond: 1/G = Rs/(2 pi) ln(1/a) + gamma
        x, y = float(sheet.along(u)[0]), float(sheet.across(phi)[0])
        own = -sheets / (2.0 * math.pi) * math.log(radius / float(sheet.stretch(u)))
        # its own radius beside the distance to the edges, squared
        assert own + robin.value_and_gradient(x, y)[0] == pytest.approx(1.0 / coupling.conductance[0], rel=1e-3)
