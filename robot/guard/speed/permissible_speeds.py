"""Permissible speeds of the surfaces of an arm towards what they could strike, and a motion's share of them. Pure.

Each patch of a skin has a permissible speed along its outward normal. It depends on the lever: the speed of the patch
over that of the leading joint, which says how far the surface still goes while that joint brakes.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from operator import itemgetter, mul

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import link_motion
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.vectors import cross


@dataclass(frozen=True, slots=True)
class PermissiblePatch:
    """Patch of a skin."""

    name: str  #: of its sensor
    link: int  #: index of the link's DH frame
    point: Vector  #: in that frame [m]
    normal: Vector  #: outward unit normal in that frame
    curve: tuple[float, ...]  #: permissible speeds within the joint positions of the motion, for each lever [m/s]
    any_curve: tuple[float, ...]  #: in any position [m/s]


@dataclass(frozen=True, slots=True)
class PermissibleSpeeds:
    """Permissible speeds of one arm.

    Attributes:
        levers: [m/rad], rising.
        patches: of its skins.
        lowest: joint positions [rad] from which on the patches' own curves hold. Empty where they never do.
        highest: joint positions [rad] up to which they do.
        between: factor by which a place between the patches may be faster than they are.
    """

    levers: tuple[float, ...]
    patches: tuple[PermissiblePatch, ...]
    lowest: tuple[float, ...] = ()
    highest: tuple[float, ...] = ()
    between: float = 1.0


class SurfaceSpeeds:
    """Speeds of the surfaces of one arm, held against those that are permissible."""

    def __init__(self, model: ArmModel, speeds: PermissibleSpeeds) -> None:
        self._speeds = speeds
        self._model = model
        rows: dict[int, list[tuple[PermissiblePatch, tuple[float, ...]]]] = {}
        for patch in speeds.patches:  # its weights make its speed of the velocity and the turning of its link
            if patch.link > 0:
                rows.setdefault(patch.link, []).append((patch, (*patch.normal, *cross(patch.point, patch.normal))))
        self._links = sorted(rows.items(), key=itemgetter(0))

    def ratio(self, q: Sequence[float], qd: Sequence[float]) -> tuple[float, str]:
        """Return the highest speed of a patch over what is permissible, and its sensor, at q [rad] and qd [rad/s]."""
        leading = max(map(abs, qd))
        if leading <= 0.0:
            return 0.0, ""
        speeds, worst, name = self._speeds, 0.0, ""
        within = zip(speeds.lowest, q, speeds.highest, strict=True) if speeds.lowest else ()
        inside = bool(speeds.lowest) and all(low <= at <= high for low, at, high in within)
        for link, rows in self._links:
            velocity, turn = link_motion(self._model, q, qd, link)
            flow = *velocity, *turn
            for patch, weights in rows:
                speed = speeds.between * sum(map(mul, weights, flow))
                if speed > 0.0:
                    curve = patch.curve if inside else patch.any_curve
                    ratio = speed / max(1e-6, _interpolate(speeds.levers, curve, speed / leading))
                    if ratio > worst:
                        worst, name = ratio, patch.name
        return worst, name


def _interpolate(levers: Sequence[float], curve: Sequence[float], lever: float) -> float:
    """Return a value of a curve that begins at 0. The curves bend downwards, so it is never above the curve."""
    if lever >= levers[-1]:
        return curve[-1]
    at = bisect_left(levers, lever)
    low, below = (levers[at - 1], curve[at - 1]) if at else (0.0, 0.0)
    return below + (curve[at] - below) * (lever - low) / (levers[at] - low)
