"""Sheets for the places on a link: a link on which nothing fits is refused with its reason."""

import re
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.sheet_design import DesignOptions, _check_wrap, design_sheets
from coneskin.design.sheets.summary import design_summary
from coneskin.geometry.drawing.layer_stack import PAPER_STACK
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit, find_cones
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.placed_frustum import PlacedFrustum


@pytest.mark.long
def test_a_link_on_which_no_cone_fits_has_no_sheet_to_design() -> None:
    corners = np.array([(x, y, z) for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.3)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    fit = find_cones(Mesh(corners, faces))
    assert fit.reason
    with pytest.raises(GeometryError, match=f"there is no sheet to design: {re.escape(fit.reason)}"):
        design_sheets(fit)
    with pytest.raises(GeometryError, match="there is no sheet to design: no place was given"):
        design_sheets([])


@pytest.mark.parametrize(("radius", "strain"), [(9.4e-3, 39), (8.6e-3, 41)])
def test_foam_is_strained_by_two_fifths_at_most(radius: float, strain: int) -> None:
    """12 mm of it on a link of 9 mm: half of that over the radius of its middle."""
    first, *others = PAPER_STACK.layers
    stack = replace(PAPER_STACK, layers=(replace(first, thickness=12e-3), *others))
    assert round(100.0 * 6e-3 / (radius + 6e-3)) == strain
    with nullcontext() if strain < 40 else pytest.raises(GeometryError, match=f"strained by .{strain}% .*at most 40%"):
        _check_wrap(PlacedFrustum(Frustum(radius, radius, 0.1)), DesignOptions(stack=stack))


@pytest.mark.parametrize(("taper", "straight"), [(8e-6, True), (-30e-6, True), (60e-6, False)])
def test_a_taper_below_the_noise_of_a_mesh_is_a_cylinder(taper: float, straight: bool) -> None:
    """A fitted cylinder is never exact: its sector would have a radius of a kilometre and more."""
    found = PlacedFrustum(Frustum(0.054, 0.054 + taper, 0.2))
    sheet = FittedSheet(found, 1e-4, 1e-4, 0.0, 0.0, 1.0, 1.0, 0.0)
    fit = LinkFit((sheet,), None, 1e-3, 0.2, 0.07, (), "", 1)
    (design,) = design_sheets(fit)
    side = design.place.frustum
    assert (side.radius1 == side.radius2 == pytest.approx(0.054 + 0.5 * taper)) == straight
    assert (design_summary(design)["link_cone"]["r1_mm"] is None) == straight
    (exact,) = design_sheets([found])  # dimensions that were given are kept
    assert exact.place.frustum == found.frustum
