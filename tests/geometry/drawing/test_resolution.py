"""One step of the converter, against the paper's potentials differentiated numerically."""

import math

import mpmath as mp
import pytest

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.geometry.drawing.electrode_layout import forecast_resolution
from coneskin.geometry.frustum import Frustum, Sector, roll_up, unroll
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.skin.electronics import GivenElectronics

mp.mp.dps = 40
#: the sector that the paper's figures imply: 100 and 200 mm, 90 deg, rolled to a quarter of a turn: a flat disc
PAPER = roll_up(Sector(0.1, 0.05 * math.pi, 0.1 * math.pi, math.pi / 2), math.pi / 2)


def test_the_papers_sector_with_12_bits():
    """Eq. 25 at r = 150 mm: r ln(r2/r1) = 104 mm for all of U0; eq. 26: 90 deg for all of U0."""
    step = forecast_resolution(PAPER, 1.0 / 4095, 0.05)
    assert step.along == pytest.approx(0.150 * math.log(2.0) / 4095, rel=1e-12)
    assert step.theta == pytest.approx(math.radians(90.0) / 4095, rel=1e-12)
    assert step.around == pytest.approx(0.150 * math.radians(90.0) / 4095, rel=1e-12)


@pytest.mark.parametrize(
    "cone", [Frustum(0.04, 0.07, 0.15), Frustum(0.07, 0.04, 0.15), Frustum(0.05, 0.0501, 0.2, 3.0)]
)
def test_step_is_the_inverse_slope_of_equations_19_and_22(cone):
    flat = unroll(cone)
    lsb = mp.mpf("3.3") / 1023
    for u in (0.0, 0.3 * cone.slant, cone.slant):
        r = mp.mpf(flat.r1) + (u if cone.radius2 > cone.radius1 else -u)

        def volts(r, flat=flat):
            return mp.mpf("2.5") * (mp.log(r) - mp.log(flat.r2)) / mp.log(mp.mpf(flat.r1) / flat.r2)

        want = lsb / abs(mp.diff(volts, r))
        step = forecast_resolution(cone, 3.3 / 1023 / 2.5, u)
        assert step.along == pytest.approx(float(want), rel=1e-9)  # r1 and r2 are rounded, 1e-16 / 1e-3 of taper
        assert step.theta == pytest.approx(float(lsb / mp.mpf("2.5") * flat.theta0), rel=1e-12)
        assert step.azimuth == pytest.approx(step.theta * cone.wrap / flat.theta0, rel=1e-12)
        assert step.around == pytest.approx(float(r) * step.theta, rel=1e-9)


def test_cones_tend_to_the_cylinder_linearly():
    """The step at end 1 is s log1p(x)/x for a taper x: off by x/2, so ten times less taper is ten times nearer."""
    cylinder = forecast_resolution(Frustum(0.05, 0.05, 0.2), 1e-3, 0.0).along
    assert cylinder == pytest.approx(0.2 * 1e-3, rel=1e-15)
    errors = [
        forecast_resolution(Frustum(0.05, 0.05 * (1 + x), 0.2), 1e-3, 0.0).along / cylinder - 1
        for x in (1e-4, 1e-5, 1e-6)
    ]
    assert errors == pytest.approx([-0.5e-4, -0.5e-5, -0.5e-6], rel=1e-3)


def test_a_finer_converter_is_a_finer_place():
    """Through the design: U0 of 3.3 V, read over 3.3 V."""
    place = PlacedFrustum(Frustum(0.05, 0.05, 0.2))
    fine, coarse = (
        design_sheets([place], DesignOptions(electronics=GivenElectronics(adc_bits=bits)))[0].forecasts()[0].along
        for bits in (16, 10)
    )
    assert coarse / fine == pytest.approx(65535 / 1023)


def test_no_current_flows_to_an_apex():
    with pytest.raises(GeometryError, match="no current flows to an apex"):
        forecast_resolution(Frustum(0.0, 0.1, 0.1), 1e-3, 0.0)
