"""Flat sheet of a picture: the names of its electrodes stand beside it, each at its own edge."""

import math
from unittest.mock import Mock

import numpy as np
import pytest

from coneskin.commissioning.sheet_picture import draw_sheet
from coneskin.geometry.frustum import Frustum


@pytest.mark.parametrize("cone", [Frustum(0.05, 0.05, 0.1, 2.0), Frustum(0.04, 0.07, 0.15), Frustum(0.07, 0.04, 0.3)])
def test_the_names_of_all_electrodes_stand_equally_far_beside_their_edges(cone: Frustum) -> None:
    axes = Mock()
    draw_sheet(axes, cone)
    rim = np.array(axes.plot.call_args.args[:2]).T
    names = {call.args[2][0]: np.array(call.args[:2]) for call in axes.text.call_args_list}
    assert [*names] == [*"BADC"]
    end1, end2, middle = rim[:61], rim[61:-1], 0.5 * (rim.min(axis=0) + rim.max(axis=0))
    edges = {"B": end1, "A": end2, "D": (end1[0], end2[-1]), "C": (end1[-1], end2[0])}
    far = []
    for name, edge in edges.items():
        part = np.linspace(0.0, 1.0, 201)[:, None, None]
        line = (np.array(edge)[:-1] * (1.0 - part) + np.array(edge)[1:] * part).reshape(-1, 2)
        apart = np.linalg.norm(line - names[name], axis=1)
        assert math.dist(names[name], middle) > math.dist(line[apart.argmin()], middle), "outside"
        far.append(float(apart.min()))
    assert far == pytest.approx([far[0]] * 4, rel=0.02)
    assert 0.03 * 1e3 * cone.slant < far[0] < 0.12 * 1e3 * cone.slant
