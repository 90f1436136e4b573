"""Functions of a sheet in plain floats: the logarithmic scale, and the Robin function against that for arrays."""

import math
import random

import mpmath as mp
import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.sheet_functions import LogScale, RobinFunction
from tests.support.field.area_law import Robin

SHAPES = ("cylinder", "nearly a cylinder", "cone", "nearly an apex")


def draw(shape: str, rng: random.Random) -> tuple[float, float, float]:
    near = 10 ** rng.uniform(-4, 1)
    far = {
        "cylinder": near,
        "nearly a cylinder": near * (1 + rng.uniform(-1, 1) * 10 ** rng.uniform(-15, -1)),
        "cone": near * rng.uniform(0.05, 20),
        "nearly an apex": near * 10 ** rng.uniform(-9, 9),
    }[shape]
    return near, far, max(abs(far - near), near) * rng.choice([1.0, rng.uniform(1, 100)])


@pytest.mark.parametrize("shape", SHAPES)
def test_both_directions_to_1e_14(shape):
    rng = random.Random(shape)
    with mp.workdps(60):
        for _ in range(600):
            near, far, length = draw(shape, rng)
            scale = LogScale(near, far, length)
            log_ratio = mp.log(mp.mpf(far) / near)
            f = rng.choice([rng.random(), 10 ** rng.uniform(-12, 0), 1.0])
            exact = mp.mpf(length) * (mp.expm1(f * log_ratio) / mp.expm1(log_ratio) if log_ratio else f)
            assert abs(scale.distance(f) - exact) <= 1e-14 * exact  # measured: 6e-16
            t = length * f
            growth = (mp.mpf(far) - near) / near
            exact = mp.log1p(mp.mpf(t) / length * growth) / log_ratio if log_ratio else mp.mpf(t) / length
            assert abs(scale.fraction(t) - exact) <= 1e-14 * exact  # measured: 5e-16


@pytest.mark.parametrize("shape", SHAPES)
def test_ends_are_ends(shape):
    rng = random.Random(shape)
    for _ in range(200):
        scale = LogScale(*draw(shape, rng))
        assert scale.distance(0.0) == scale.fraction(0.0) == 0.0
        assert scale.distance(1.0) == pytest.approx(scale.length, rel=1e-14)
        assert scale.fraction(scale.length) == pytest.approx(1.0, rel=1e-14)


def test_cone_tends_to_cylinder_at_first_order():
    # t/s - f = -L f (1 - f)/2 + O(L^2): halving the taper halves the distance from the cylinder
    errors = [LogScale(0.05, 0.05 * (1 + taper), 0.4).distance(0.3) / 0.4 - 0.3 for taper in (1e-5, 5e-6)]
    assert errors[0] == pytest.approx(-1e-5 * 0.3 * 0.7 / 2, rel=1e-4)
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=1e-4)


def test_slope_is_the_derivative():
    for near, far in ((0.05, 0.05), (0.04, 0.07), (0.2, 0.001)):
        scale = LogScale(near, far, 0.3)
        h = 1e-6  # truncation ~ (h/s)**2 = 1e-11, rounding ~ eps/h = 2e-10, both relative to slopes above 1
        numeric = (scale.fraction(0.1 + h) - scale.fraction(0.1 - h)) / (2 * h)
        assert scale.slope(0.1) == pytest.approx(numeric, rel=1e-8)


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
        assert robin.value_and_gradient(x, y)[1:] == pytest.approx([float(v) for v in wanted], abs=1e-4 * largest)


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
