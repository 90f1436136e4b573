"""Axes that a link may be wrapped about: those of its cones, and those that its normals meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .fit_cone import Cone, fit_cone
from .fit_revolution import revolution_axis
from .fit_samples import Samples
from .fit_starts import cone_starts

__all__ = ["Candidate", "find_candidates"]

Floats = NDArray[np.float64]

_SAME_ANGLE = 0.002  #: axes closer than this [rad] ...
_SAME_SHIFT = 0.0002  #: ... and this [m] amid the link are one


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """An axis to try.

    Attributes:
        origin: a point of it [m], shape (3,).
        axis: unit vector; its largest component is positive, shape (3,).
        cone: the cone it belongs to; None for an axis that only the normals meet.
    """

    origin: Floats
    axis: Floats
    cone: Cone | None


def find_candidates(samples: Samples, tolerance: float) -> list[Candidate]:
    """Axes worth a profile, without repetition.

    Args:
        samples: points and normals of the hull.
        tolerance: of the sheets [m]; it sets the gates of the fit.
    """
    found: list[Candidate] = []

    def add(origin: Floats, axis: Floats, cone: Cone | None) -> None:
        if axis[int(np.abs(axis).argmax())] < 0.0:
            axis = -axis
            cone = cone and Cone(cone.origin, axis, cone.radius, -cone.half_angle)
        for other in found:
            gap = origin - other.origin
            gap = gap - (gap @ other.axis) * other.axis
            tilt = float(np.linalg.norm(np.cross(axis, other.axis)))
            twins = other.cone is None or cone is None or abs(cone.radius - other.cone.radius) < 2.0 * tolerance
            if tilt < _SAME_ANGLE and np.linalg.norm(gap) < _SAME_SHIFT and twins:
                return
        found.append(Candidate(origin, axis, cone))

    for start in cone_starts(samples, max(2.0 * tolerance, 0.03 * float(np.ptp(samples.points)) / 10.0)):
        wide = max(4.0 * tolerance, 0.06 * start.radius)
        for gates in ((wide, 2.0 * tolerance, 0.5 * tolerance), (wide, 2.0 * tolerance)):
            cone = fit_cone(samples, start, gates)
            if cone is not None:
                add(cone.origin, cone.axis, cone)
                break
    centred = samples.points - samples.points.mean(axis=0)
    principal = np.linalg.eigh(centred.T @ centred)[1].T
    starts: list[tuple[Floats, Floats] | None] = [None, (samples.points.mean(axis=0), principal[2])]
    starts += [(c.origin, c.axis) for c in found[:2]]
    for begin in starts:
        line = revolution_axis(samples, begin)
        if line is not None:
            add(*line, None)
    return found
