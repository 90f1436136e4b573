"""Every hint of a fit works: followed, it covers more; where as many sheets were allowed, none asks for them."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.mesh import Mesh

from ..synthetic import frustum, holed, placed, revolve, shoulder
from .shared_fits import cones
from .test_cones import link

#: tubes and cones of one axis: one sheet fewer than there are straight sides is one too few
DOUBLE_CONE = [(0.0, 0.03), (0.1, 0.05), (0.2, 0.03)]
STEPS = [(0.0, 0.05), (0.08, 0.05), (0.081, 0.04), (0.16, 0.04), (0.161, 0.03), (0.24, 0.03)]


BODIES: dict[str, Callable[[], Mesh]] = {
    "tube": lambda: placed(frustum(0.05, 0.05, 0.2)),
    "double cone": lambda: placed(revolve(DOUBLE_CONE)),
    "steps": lambda: placed(revolve(STEPS)),
    "shoulder": lambda: placed(shoulder()),
    "holed": lambda: placed(holed()),
    "UR5e forearm": lambda: link("ur/ur5e/visual/forearm.dae"),
}


def area(fit: LinkFit) -> float:
    return sum(sheet.frustum.area for sheet in fit.sheets)


def asked_for(fit: LinkFit) -> list[int]:
    """Numbers of sheets that a fit advises to allow."""
    return [int(found[1]) for bare in fit.bare_areas if (found := re.search(r"allow (\d+) sheets", bare.reason))]


@pytest.mark.long
@pytest.mark.parametrize("name", BODIES)
def test_a_sheet_more_covers_more_until_none_is_advised(name: str) -> None:
    mesh = BODIES[name]()
    fit = cones(mesh, max_sheets=1)
    for count in (2, 3):
        hints = asked_for(fit)
        if not hints:
            break
        assert hints in ([], [count])
        more = cones(mesh, max_sheets=count, max_wires=4 * count)
        assert len(more.sheets) == count
        assert all(sheet.max_deviation <= more.tolerance + 1e-9 for sheet in more.sheets)
        assert area(more) > 1.01 * area(fit), "the advice works"
        fit = more
    again = cones(mesh, max_sheets=len(fit.sheets) + 1)
    if len(again.sheets) < len(fit.sheets) + 1:
        assert asked_for(again) == [], "as many sheets were allowed already"


@pytest.mark.long
def test_the_tolerance_that_is_advised_gives_a_sheet() -> None:
    mesh = link("xarm/uf850_link4.stl")
    tried = 0
    for tolerance in (2e-5, 1e-4):
        fit = cones(mesh, tolerance=tolerance)
        if not fit.sheets and fit.nearest is not None:
            tried += 1
            assert cones(mesh, tolerance=fit.needed_tolerance).sheets
    assert tried, "a body on which nothing is advised tests nothing"
