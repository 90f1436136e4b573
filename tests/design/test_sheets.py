"""Sheets for the places on a link: a link on which nothing fits is refused with its reason."""

import re

import numpy as np
import pytest

from coneskin.core.errors import GeometryError
from coneskin.design.sheets.sheet_design import design_sheets
from coneskin.design.sheets.summary import design_summary
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
