"""Candidate axes of a link: the axes of fitted cones, and the axes of revolution.

The search knows no tolerance: it has gates of its own, so that the axes of a link are the same whatever is asked of the
sheets about them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .cone_fit import InfiniteCone, fit_cone
from .hypotheses import cone_hypotheses
from .revolution_axis import find_revolution_axis
from .surface_samples import SurfaceSamples

__all__ = ["AxisCandidate", "find_axis_candidates"]

Floats = NDArray[np.float64]

_MAX_DUPLICATE_TILT = 0.002  # rad; angle below which two axes are one
_MAX_DUPLICATE_SHIFT = 0.0002  # m; distance in the middle of the link below which two axes are one
_MAX_DUPLICATE_RADIUS = 0.001  # m; difference of radii below which two cones about one axis are one
_GATES = ((0.002, 0.0005), (0.001,), (0.005,))  # m, one after another; from exact tubes to crowned ones


@dataclass(frozen=True, slots=True, eq=False)
class AxisCandidate:
    """An axis about which sheets may lie.

    Attributes:
        origin: a point of the axis [m], shape (3,).
        axis: unit vector; its largest component is positive, shape (3,).
        cones: the cones fitted about it; empty for an axis of revolution.
    """

    origin: Floats
    axis: Floats
    cones: tuple[InfiniteCone, ...]


def find_axis_candidates(samples: SurfaceSamples) -> list[AxisCandidate]:
    """Find the axes about which a profile is worth measuring, without duplicates.

    Args:
        samples: points and normals of the hull.
    """
    found: list[AxisCandidate] = []
    size = float(np.ptp(samples.points, axis=0).max())

    def add(origin: Floats, axis: Floats, cone: InfiniteCone | None) -> None:
        if axis[int(np.abs(axis).argmax())] < 0.0:
            axis = -axis
            cone = cone and InfiniteCone(cone.origin, axis, cone.radius, -cone.half_angle)
        for number, other in enumerate(found):
            gap = origin - other.origin
            gap = gap - (gap @ other.axis) * other.axis
            tilt = float(np.linalg.norm(np.cross(axis, other.axis)))
            if tilt < _MAX_DUPLICATE_TILT and np.linalg.norm(gap) < _MAX_DUPLICATE_SHIFT:
                if cone is not None and not any(_same_side(cone, known) for known in other.cones):
                    found[number] = replace(other, cones=(*other.cones, cone))
                return
        found.append(AxisCandidate(origin, axis, (cone,) if cone else ()))

    thinned = samples.subset(np.arange(len(samples)) % max(1, len(samples) // 2000) == 0)
    for seed, distance in enumerate((max(0.0015, 0.004 * size), 0.001), 2):
        for start in cone_hypotheses(samples, distance, seed=seed):
            rough = fit_cone(thinned, start, (max(0.006, 0.06 * start.radius),), 0.4, 1e-2)
            for gates in _GATES if rough is not None else ():
                cone = rough
                for gate in gates:
                    cone = cone and fit_cone(samples, cone, (gate,), precision=1e-3)
                    if cone is not None:
                        add(cone.origin, cone.axis, cone)
    centred = samples.points - samples.points.mean(axis=0)
    principal = np.linalg.eigh(centred.T @ centred)[1].T
    begins: list[tuple[Floats, Floats] | None] = [None, (samples.points.mean(axis=0), principal[2])]
    begins += [(c.origin, c.axis) for c in found[:3]]
    for begin in begins:
        line = find_revolution_axis(samples, begin)
        if line is not None:
            add(*line, None)
    return found


def _same_side(cone: InfiniteCone, other: InfiniteCone) -> bool:
    """Tell whether two cones about one axis are one."""
    away = float((cone.origin - other.origin) @ other.axis)
    radius = other.radius + away * float(np.tan(other.half_angle))
    return abs(cone.radius - radius) < _MAX_DUPLICATE_RADIUS and abs(cone.half_angle - other.half_angle) < 0.02
