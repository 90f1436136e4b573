"""Cone hypotheses: near the true cones, and none from too few points."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.fit.candidates import _cone_hypotheses

from ..synthetic import TILTED, frustum, rugby, shoulder
from .axis_cases import AXIS, hull, off


@pytest.mark.parametrize("half_angle", [0.0, 3.0, 12.0, 30.0, 60.0])
def test_a_start_lies_near_the_cone(half_angle: float) -> None:
    height = 0.1 if half_angle < 40 else 0.05
    body = frustum(0.04, 0.04 + height * math.tan(math.radians(half_angle)), height)
    starts = _cone_hypotheses(hull(body), 0.002)
    tilt, shift = off(starts[0].origin, starts[0].axis)
    assert tilt < 6.0
    assert shift < 6.0
    sign = 1.0 if starts[0].axis @ AXIS > 0.0 else -1.0
    assert math.degrees(starts[0].half_angle) * sign == pytest.approx(half_angle, abs=6.0)


def test_crossing_cylinders_give_both_axes() -> None:
    starts = _cone_hypotheses(hull(shoulder()), 0.002)
    along = [abs(float(start.axis @ np.array(TILTED.rotation)[:, k])) for start in starts[:2] for k in (2, 0)]
    assert along[0] > 0.99
    assert along[3] > 0.99


def test_a_handful_of_points_gives_nothing() -> None:
    few = hull(rugby())
    assert _cone_hypotheses(few.subset(np.arange(len(few)) < 20), 0.002) == []
