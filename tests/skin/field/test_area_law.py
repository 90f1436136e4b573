"""The law of the area error: its order, its limits. What inverts it is tested with the decode."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.skin.field.model import FieldModel
from tests.support.field.area_law import Robin, area_error, effective_area

from ..field_cases import PAPER, SHEETS


def displacement(model: FieldModel, u, phi, radius, g=math.inf):
    """Exact electrical centre minus true centre, flat lengths [m]."""
    sheet = model.sheet
    c = model.contacts(u, phi, radius, g)
    seen_u, seen_phi = sheet.locate(c.x * sheet.length, c.y * sheet.breadth)
    return seen_u - u, (seen_phi - phi) * sheet.arc / sheet.wrap * sheet.stretch(u)


@pytest.mark.parametrize("name", list(SHEETS))
@pytest.mark.parametrize("lower", [1.0, 5.0])
def test_the_law_is_the_first_order_in_the_area(name: str, lower: float) -> None:
    sheet = SHEETS[name]
    model = FieldModel(sheet, 1.0, lower)
    rng = np.random.default_rng(1)
    u, phi = rng.uniform(0.15, 0.85, 20) * sheet.width, rng.uniform(0.15, 0.85, 20) * sheet.wrap
    room = sheet.edge_distances(u, phi).min(axis=1)
    worst = []
    for part in (0.08, 0.04, 0.02):
        radius = part * room
        g = (2.0 / radius) ** 2 / (1.0 + lower)
        exact, law = displacement(model, u, phi, radius, g), area_error(model, u, phi, radius, g)
        size = radius**2 / room
        worst.append(max(float(np.max(np.abs(e - a) / size)) for e, a in zip(exact, law, strict=True)))
    assert worst[0] < 0.02
    # The neglected part is of relative order (a/D)^2: halving the radius leaves a quarter.
    assert worst[1] == pytest.approx(worst[0] / 4, rel=0.15)
    assert worst[2] == pytest.approx(worst[0] / 16, rel=0.2)


def test_limit_of_validity_a_third_of_the_room_leaves_five_percent() -> None:
    model = FieldModel(PAPER, 1.0, 1.0)
    u, phi = PAPER.from_polar(np.full(9, 0.12), np.radians(np.linspace(10, 45, 9)))
    room = PAPER.edge_distances(u, phi).min(axis=1)
    for part, bound in ((0.33, 0.06), (0.75, 0.3)):
        exact, law = displacement(model, u, phi, part * room), area_error(model, u, phi, part * room)
        size = np.hypot(*exact)
        assert np.max(np.hypot(exact[0] - law[0], exact[1] - law[1]) / size) < bound


def test_only_the_taper_is_left_in_the_middle() -> None:
    model = FieldModel(PAPER, 1.0, 1.0)
    u, phi = PAPER.from_polar(math.sqrt(0.1 * 0.2), math.radians(45))  # middle of the rectangle
    along, across = area_error(model, u, phi, 0.01)
    assert float(along) == pytest.approx(-(0.01**2) / (2 * math.sqrt(0.02)), rel=1e-12)
    assert float(across) == pytest.approx(0.0, abs=1e-18)
    flat = FieldModel(SHEETS["cylinder"], 1.0, 4.0)
    sheet = flat.sheet
    assert np.abs(area_error(flat, 0.5 * sheet.width, 0.5 * sheet.wrap, 0.01)).max() < 1e-17


def test_the_law_is_a_gradient_field() -> None:
    model = FieldModel(SHEETS["narrowing"], 1.0, 3.0)
    sheet = model.sheet
    robin = Robin(sheet, 1.0, 3.0)
    h = 1e-5 * sheet.length
    x, y = 0.3 * sheet.length, 0.35 * sheet.breadth

    def gradient(x: float, y: float) -> tuple[float, float]:
        along, across = robin.gradients(sheet, *sheet.locate(x, y))
        return float(along), float(across)

    curl = (gradient(x + h, y)[1] - gradient(x - h, y)[1]) - (gradient(x, y + h)[0] - gradient(x, y - h)[0])
    size = abs(gradient(x + h, y)[0] - gradient(x - h, y)[0])
    assert abs(curl) < 1e-9 * size  # rounding over 2h


def test_effective_area() -> None:
    assert effective_area(0.01, math.inf, 2.0) == pytest.approx(1e-4)
    assert effective_area(0.01, 0.0, 2.0) == 0.0
    weak = 1e-3 / (2.0 * 1e-4)  # (ka)^2 = 1e-3; I2/I0 = (ka)^2/8
    assert effective_area(0.01, weak, 2.0) == pytest.approx(1e-4 * 1e-3 / 8, rel=2e-4)
