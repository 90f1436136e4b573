"""Pictures of a design: the mesh under a sheet is not drawn, the rest of the link is."""

import math

import numpy as np
import pytest

from coneskin.design.pictures import _covered
from coneskin.design.sheets import DesignOptions, design_sheets
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
