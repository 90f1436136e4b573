"""The same mesh gives the same sheets at any number of samples, looser is not worse, and what is advised works."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import pytest

from coneskin.geometry.fit.cones import LinkFit, find_cones
from coneskin.geometry.mesh import Mesh

from ..synthetic import noisy, placed, rugby, shoulder
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
