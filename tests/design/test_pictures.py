"""Pictures of a design: the mesh under a sheet is not drawn, the rest of the link is."""

import math

import numpy as np
import pytest

from coneskin.design.link_picture import _covered, draw_weights
from coneskin.design.sheets.sheet_design import DesignOptions, design_sheets
from coneskin.geometry.fit.touch_weights import TouchWeights
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose

PLACE = Pose.from_xyz_rpy((0.1, -0.2, 0.3), (0.4, 0.5, 0.6))


@pytest.mark.parametrize(
    ("u", "phi", "height", "covered"),
    [
        (0.07, 1.0, 0.0, True),
        (0.07, 4.6, 0.0, True),
        (0.07, 1.0, -0.004, True),  # a groove
        (0.07, 5.0, 0.0, False),  # beyond the partial wrap of 4.7 rad
        (-0.02, 1.0, 0.0, False),  # beyond end 1
        (0.17, 1.0, 0.0, False),  # beyond end 2
        (0.07, 1.0, 0.02, False),  # a part of the link that stands out
    ],
)
def test_a_triangle_under_a_sheet_is_covered(u: float, phi: float, height: float, covered: bool) -> None:
    side = Frustum(0.04, 0.07, 0.15, 4.7)
    (design,) = design_sheets([PlacedFrustum(side, PLACE)], DesignOptions())
    corners = []
    for du, dphi in ((0.0, 0.0), (0.002, 0.0), (0.0, 0.02)):
        point, normal = side.point(u + du, phi + dphi), side.normal(phi + dphi)
        corners.append(
            PLACE.apply((point[0] + height * normal[0], point[1] + height * normal[1], point[2] + height * normal[2]))
        )
    assert _covered(design, np.array([corners])).tolist() == [covered]
    assert math.dist(corners[0], corners[1]) == pytest.approx(0.002)


def test_what_counts_is_drawn_in_the_colours_of_its_weights() -> None:
    """Half of a tube counts, half does not: each triangle has the colour of the nearest place of the map."""
    module = pytest.importorskip("matplotlib.figure", reason="the extra coneskin[pictures] is not installed")
    from matplotlib import colormaps

    figure = module.Figure()
    side = Frustum(0.05, 0.05, 0.2)
    designs = design_sheets([PlacedFrustum(side)], DesignOptions())
    phi = np.linspace(0.0, 2.0 * math.pi, 41)[:-1]
    around = np.stack([0.05 * np.cos(phi), 0.05 * np.sin(phi), np.full(40, 0.1)], axis=1)
    triangles = np.stack([around, around + [0.0, 0.0, 0.01], np.roll(around, -1, axis=0)], axis=1)
    weights = TouchWeights(np.array([[0.05, 0.0, 0.1], [-0.05, 0.0, 0.1]]), np.array([4.0, 1.0]), "map.csv")
    draw_weights(figure, triangles, designs, weights)
    one, two, bar = figure.axes
    assert "map.csv" in bar.get_xlabel()
    for axes in (one, two):
        drawn = axes.collections[0]
        colours = np.unique(np.round(drawn.get_facecolor(), 6), axis=0)
        wanted = np.round([colormaps["viridis"](1.0), colormaps["viridis"](0.25)], 2)
        assert len(colours) == 2
        assert sorted(map(tuple, np.round(colours, 2).tolist())) == sorted(map(tuple, wanted.tolist()))
        assert len(axes.lines) == 4 * len(designs)
