"""The field everywhere: boundary conditions, the contact's own law inside it, and the current that leaves."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.core.errors import FieldError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.field.disc import Disc
from coneskin.skin.field.fourport import angular_phase, radial_phase
from coneskin.skin.field.maps import FieldMap
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from tests.support.field.contact_patch import rectangle_offsets

from ..field_cases import PAPER, SHEETS


@pytest.mark.parametrize("name", ["paper", "narrowing", "cylinder"])
@pytest.mark.parametrize("g", [2e4, math.inf])
def test_boundary_conditions_and_the_contacts_law(name: str, g: float) -> None:
    sheet = SHEETS[name]
    model = FieldModel(sheet, 1.0, 3.0)
    size = 0.12 * min(sheet.width, sheet.breadth)
    discs = [Disc(0.45 * sheet.width, 0.3 * sheet.wrap, size, g), Disc(0.5 * sheet.width, 0.7 * sheet.wrap, size, g)]
    field = FieldMap.of(model, discs, radial_phase())
    along, around = np.linspace(0.0, sheet.width, 9), np.linspace(0.0, sheet.wrap, 9)
    assert np.allclose(field.potentials(0.0, around)[0], field.electrodes[1], atol=1e-14)
    assert np.allclose(field.potentials(sheet.width, around)[0], field.electrodes[0], atol=1e-14)
    assert np.allclose(field.potentials(along, 0.0)[1], field.electrodes[3], atol=1e-14)
    assert np.allclose(field.potentials(along, sheet.wrap)[1], field.electrodes[2], atol=1e-14)
    one = discs[0]

    def places(rho: float, count: int = 64) -> tuple[np.ndarray, np.ndarray]:
        ring = rho * one.radius * np.exp(2j * math.pi * np.arange(count) / count)
        w = rectangle_offsets(sheet, ring, one.u)
        return sheet.locate(float(sheet.along(one.u)[0]) + w.real, float(sheet.across(one.phi)[0]) + w.imag)

    for inner, outer in (((1 - 1e-9), (1 + 1e-9)),):  # continuous over the rim
        for a, b in zip(field.potentials(*places(inner)), field.potentials(*places(outer)), strict=True):
            assert np.abs(a - b).max() < 2e-8  # 1e-9 of a radius beside a node, the distance to it keeps 7 digits
    drop = np.concatenate([np.subtract(*field.potentials(*places(rho))) for rho in (0.0, 0.4, 0.8)])
    if math.isinf(g):
        assert np.abs(drop).max() < 1e-9  # bonded: one potential, to the solver's tolerance times 1/(1-rho)
    else:
        # The current through the contact is g times the drop, summed: Gauss in rho^2, equal angles.
        nodes, weights = np.polynomial.legendre.leggauss(12)
        rho = np.sqrt(0.5 * (nodes + 1.0))
        mean = sum(
            0.5 * w * float(np.mean(np.subtract(*field.potentials(*places(float(r))))))
            for r, w in zip(rho, weights, strict=True)
        )
        assert g * math.pi * one.radius**2 * mean == pytest.approx(float(field.moments[0, 0]), rel=1e-9)


def test_current_density_integrates_to_the_electrodes() -> None:
    model = FieldModel(PAPER, 10.0, 30.0)
    field = FieldMap.of(model, [Disc(0.04, 0.8, 0.01, 1e3)], angular_phase(2.0))
    coupling = model.discs([Disc(0.04, 0.8, 0.01, 1e3)])
    drive = float(model.read(coupling, angular_phase(2.0)).currents[0, 2])
    nodes, weights = np.polynomial.legendre.leggauss(24)
    u = 0.5 * PAPER.width * (nodes + 1.0)
    flux = -field.currents(u, np.full(24, 0.98 * PAPER.wrap))[3]  # from C downwards through the lower sheet
    assert 0.5 * PAPER.width * float(weights @ flux) == pytest.approx(drive, rel=1e-7)


def test_without_contact_the_field_is_the_papers() -> None:
    """Equations 19 and 22: logarithm of the radius, proportional to the angle."""
    model = FieldModel(PAPER, 1.0, 1.0)
    r, theta = np.linspace(0.1, 0.2, 5), np.radians(np.linspace(0, 90, 5))
    u, phi = PAPER.from_polar(r, theta)
    u = np.clip(u, 0.0, 0.1)
    upper, _ = FieldMap.of(model, [], radial_phase(2.0, adc=1e9)).potentials(u, 0.4)
    assert np.allclose(upper, 2.0 * np.log(r / 0.2) / math.log(0.5), atol=1e-14)
    _, lower = FieldMap.of(model, [], angular_phase(2.0, adc=1e9)).potentials(0.03, phi)
    assert np.allclose(lower, 2.0 * theta / (math.pi / 2), atol=1e-14)


def test_the_current_has_a_value_at_every_edge() -> None:
    """Differences reach to the edge, where one rounding would lie off the sheet, as it did on this one."""
    sheet = SectorSheet.of_frustum(Frustum(0.04, 0.07, 0.15, math.radians(300.0)))
    field = FieldMap.of(FieldModel(sheet, 1e3, 1e3), (), radial_phase(2.5, 1e9))
    u, phi = np.meshgrid(np.linspace(0.0, sheet.width, 161), np.linspace(0.0, sheet.wrap, 13))
    assert np.isfinite(field.currents(u, phi)).all()


def test_points_off_the_sheet_are_refused() -> None:
    field = FieldMap.of(FieldModel(PAPER, 1.0, 1.0), [], radial_phase(adc=1e9))
    with pytest.raises(FieldError, match="points must lie on the sheet"):
        field.potentials(0.2, 0.1)
