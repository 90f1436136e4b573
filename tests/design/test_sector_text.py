"""Flat sectors in words: what a person can measure, also where radii are longer than any ruler."""

import math

import pytest

from coneskin.design.sheets.summary import sector_text
from coneskin.geometry.frustum import Frustum


def test_a_cone_has_radii_in_mm_and_a_cylinder_is_a_rectangle() -> None:
    """Half angle 30 deg: polar radius is twice the radius; theta0 is half a turn."""
    text = sector_text(Frustum(0.05, 0.1, 0.05 * math.sqrt(3.0)))
    assert text == "r1 100.000 mm, r2 200.000 mm, theta0 180.0000 deg"
    assert sector_text(Frustum(0.05, 0.05, 0.2)) == f"rectangle {100.0 * math.pi:.3f} x 200.000 mm"


def test_a_slender_cone_says_how_far_its_arcs_rise() -> None:
    """The sagitta of a chord: arc^2 / (8 r), to third order."""
    cone = Frustum(0.054, 0.0541, 0.3)
    text = sector_text(cone)
    far = 0.054 * math.hypot(0.3, 0.0001) / 0.0001
    assert f"r1 {far:.3f} m" in text
    rise = (2.0 * math.pi * 0.054) ** 2 / (8.0 * far)
    said = float(text.split("rise by ")[1].split(" and")[0])
    assert said == pytest.approx(1e3 * rise, abs=6e-4)
    assert sector_text(Frustum(0.054, 0.054 + 1e-9, 0.3)).startswith("rectangle")
