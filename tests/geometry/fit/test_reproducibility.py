"""The same surface gives the same sheets, at any number of samples, in noise and torn; looser is not worse."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest

from coneskin.geometry.fit.cones import LinkFit, find_cones
from coneskin.geometry.mesh import Mesh, make_mesh
from coneskin.geometry.pose import Pose

from ..synthetic import frustum, noisy, placed, rugby, shoulder
from .shared_fits import cones
from .test_cones import link

BODIES: dict[str, Callable[[], Mesh]] = {
    "rugby": lambda: placed(noisy(rugby(), 2e-4)),
    "shoulder": lambda: placed(shoulder()),
    "UR5e forearm": lambda: link("ur/ur5e/visual/forearm.dae"),
}
REAL = ("ur/ur5e/visual/forearm.dae", "xarm/uf850_link4.stl")


def area(fit: LinkFit) -> float:
    return sum(sheet.frustum.area for sheet in fit.sheets)


@pytest.mark.long
@pytest.mark.parametrize("name", BODIES)
def test_the_sheets_do_not_depend_on_the_samples(name: str) -> None:
    mesh = BODIES[name]()
    few, many = (find_cones(mesh, samples=count) for count in (3000, 40_000))
    assert few.sheets
    assert [sheet.placed for sheet in few.sheets] == [sheet.placed for sheet in many.sheets]
    for a, b in zip(few.sheets, many.sheets, strict=True):
        assert a.area_share == pytest.approx(b.area_share, abs=0.03)  # three standard deviations of 3000


@pytest.mark.long
@pytest.mark.parametrize("name", REAL)
def test_a_looser_tolerance_is_never_worse_on_a_real_link(name: str) -> None:
    mesh = link(name)
    areas = [area(cones(mesh, tolerance=tolerance)) for tolerance in (7e-4, 1e-3, 2e-3)]
    assert all(b > 0.99 * a for a, b in itertools.pairwise(areas))


@pytest.mark.long
def test_faces_and_pose_do_not_matter() -> None:
    mesh = link("xarm/uf850_link4.stl")
    turned = Pose.from_xyz_rpy((0.3, -0.2, 0.1), (0.4, -0.7, 1.1)).apply_all(mesh.vertices * [-1.0, 1.0, 1.0])
    faces = np.random.default_rng(0).permutation(mesh.faces)[:, ::-1]
    areas = [area(find_cones(one, max_sheets=3)) for one in (mesh, make_mesh(turned, faces))]
    assert areas[0] == pytest.approx(areas[1], rel=0.002)


@pytest.mark.long
def test_noise_is_told_from_the_link_and_allowed_for() -> None:
    fit = find_cones(placed(noisy(frustum(0.045, 0.06, 0.2, rings=24), 1e-3)))
    assert area(fit) > 0.85 * math.pi * 0.105 * math.hypot(0.2, 0.015)
    assert any("rough by 1.0 mm" in note for note in fit.notes)
    assert fit.tolerance == pytest.approx(0.003, rel=0.05)


@pytest.mark.long
def test_faces_that_are_missing_are_no_holes_of_the_link() -> None:
    corners, faces = frustum(0.045, 0.06, 0.2, rings=24)
    fit = find_cones(placed((corners, faces[np.random.default_rng(1).random(len(faces)) > 0.3])))
    (sheet,) = fit.sheets
    assert sheet.frustum.area > 0.98 * math.pi * 0.105 * math.hypot(0.2, 0.015)
    assert any("faces are missing" in note for note in fit.notes)
