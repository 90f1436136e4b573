"""Coverage notes: convex hulls are recognised, bare lengths have a reason."""

from __future__ import annotations

import pytest

from coneskin.geometry.fit.bare_areas import hull_note
from coneskin.geometry.fit.surface_samples import sample_surface
from coneskin.geometry.mesh import make_mesh
from coneskin.geometry.ray_casting import RayCaster

from ..synthetic import Floats, Indices, flipped, frustum, joined, revolve


def note(body: tuple[Floats, Indices]) -> str:
    mesh = make_mesh(*body)
    return hull_note(mesh, sample_surface(mesh, RayCaster(mesh)))


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_convex_hull_is_recognised(share: float) -> None:
    box = flipped(revolve([(0.0, 0.05), (0.3, 0.05)], segments=4), share)
    assert "100 % of the surface lies on the convex hull" in note(box)
    assert note(revolve([(0.0, 0.06), (0.15, 0.04), (0.3, 0.06)])) == ""
    # the walls between two boxes are inside of their hull
    assert note(joined(box, (box[0] + [0.3, 0.0, 0.0], box[1]))) == ""
    assert note(frustum(0.05, 0.05, 0.3, rings=30)) == ""  # convex, but too fine for a collision body
