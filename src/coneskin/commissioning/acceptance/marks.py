"""Marks on a sensor that a person is asked to touch, chosen so that no misreading can hide, and the words for them.

The words name the distance along the link, and the side as it points in the world now, not the sensor's coordinates. So
a person who follows them also tests the pose of the sheet on its link, the direction of its normal and the arm's model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence

from coneskin.commissioning.misreadings import power, shifts
from coneskin.commissioning.touching import Mark
from coneskin.geometry.pose import Pose, Vector
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.vectors import added, cross, dot, minus, scaled
from coneskin.scene.build import SensorOnArm
from coneskin.scene.commissioning_record import MIN_MARKS
from coneskin.skin.sensor import Sensor

MIN_POWER = 2.0  #: tolerances by which each misreading must miss one of the marks
_MAX_MARKS = 9
_SLANT_PARTS = (0.2, 0.5, 0.8)  # parts of the slant at which there are marks
_EDGE_PART = 0.1  # part of the wrap beside each edge without marks
_FINGER_WIDTH = 0.015  # m from an edge that a finger needs


def _azimuth_margin(sensor: Sensor) -> float:
    """Return the azimuth beside each straight edge in which a sensor has no marks [rad]."""
    cone = sensor.frustum
    return min(max(_EDGE_PART * cone.wrap, _FINGER_WIDTH / min(cone.radius1, cone.radius2)), 0.25 * cone.wrap)


def plan_marks(
    sensor: Sensor, offered: Sequence[Mark], taken: Sequence[Mark] = (), refused: Collection[Mark] = ()
) -> tuple[Mark, ...] | None:
    """Choose marks that show every misreading.

    Args:
        offered: all places that can be described.
        taken: marks that were touched already; they come first in the result.
        refused: marks that a person cannot reach.

    Returns:
        at least MIN_MARKS of them, of at least MIN_POWER together; None where those that are left do not suffice.
    """
    chosen = list(taken)
    left = [mark for mark in offered if mark not in chosen and mark not in refused]
    moved = {mark: shifts(sensor, mark.place) for mark in (*chosen, *left)}

    def worth(mark: Mark) -> tuple[float, float]:
        """Return the power with a further mark, as far as it matters, then its distance from the others."""
        cone = sensor.frustum
        apart = (math.hypot((mark.u - o.u) / cone.slant, (mark.phi - o.phi) / cone.wrap) for o in chosen)
        return min(power(sensor, [moved[one] for one in (*chosen, mark)]), 2.0 * MIN_POWER), min(apart, default=0.0)

    while len(chosen) < MIN_MARKS or power(sensor, [moved[mark] for mark in chosen]) < MIN_POWER:
        if not left or len(chosen) >= _MAX_MARKS:
            return None
        best = max(left, key=worth)
        left.remove(best)
        chosen.append(best)
    return tuple(chosen)


#: [i]: where link i begins
_JOINT_NAMES = ("the floor", "the base", "the shoulder", "the elbow", "wrist 1", "wrist 2", "wrist 3", "the flange")
_SHEET_ENDS = ("electrode B (end 1)", "electrode A (end 2)")
_ALONG_COSINE = 0.5  # of the angle between a sheet's axis and its link, below which the sheet does not lie along it
_TUBE_LINKS = (2, 3)  # links whose mesh begins on their joint's axis and runs along the link
_CLOCK_STEPS = (30.0, 15.0, 7.5, 3.75)  # deg; an hour of the clock, and parts of one
_MIN_OFFERED = 9  # marks to choose from
_FULL_TURN = 2.0 * math.pi  # rad
_SIDE_STEPS = 720  # of a bent side, between which its azimuths are interpolated
_DISTANCE_STEP = 0.005  # m; distances are multiples of it
_MIN_COMPONENT = 0.35  # part of a direction from which on it is named
_UPRIGHT_COSINE = math.cos(math.radians(30.0))  # from which on a link counts as upright


def offer_marks(sensor: Sensor, placed: SensorOnArm, q: Sequence[float] | None) -> list[Mark]:
    """Return all places of a sensor that can be described.

    Args:
        placed: where it is; without an arm the words name its electrodes.
        q: joint positions of the arm [rad]; None without an arm.
    """
    offered: list[Mark] = []
    for step in _CLOCK_STEPS:
        offered = _on_sheet(sensor, step) if placed.model is None or q is None else _on_arm(sensor, placed, q, step)
        if len(offered) >= _MIN_OFFERED:
            break
    return offered


def _on_sheet(sensor: Sensor, step: float) -> list[Mark]:
    cone, margin = sensor.frustum, _azimuth_margin(sensor)
    marks = []
    for u in (part * cone.slant for part in _SLANT_PARTS):
        for number in range(1, math.ceil(math.degrees(cone.wrap) / step)):
            phi = math.radians(number * step)
            if margin <= phi <= cone.wrap - margin:
                arc = 1e3 * cone.radius_at(u) * phi
                where = f"{1e3 * u:.0f} mm from {_SHEET_ENDS[0]} and {arc:.0f} mm along the arc from electrode D"
                marks.append(Mark(u, phi, where))
    return marks


def _on_arm(sensor: Sensor, placed: SensorOnArm, q: Sequence[float], step: float) -> list[Mark]:
    from coneskin.robot.arm.kinematics import link_poses

    assert placed.model is not None
    cone, poses = sensor.frustum, link_poses(placed.model, q)
    base_link, joint = poses[placed.link], poses[max(placed.link - 1, 0)].translation  # at which the link begins
    link = minus(base_link.translation, joint)
    ends = [base_link.apply(placed.frustum.centre(u)) for u in (0.0, cone.slant)]
    axis = scaled(added(ends[1], scaled(ends[0], -1.0)), 1.0 / math.dist(*ends))
    crosswise = abs(dot(axis, link)) < _ALONG_COSINE * math.hypot(*link)  # about the axis of the joint at its end
    from_end1 = crosswise or math.dist(joint, ends[0]) <= math.dist(joint, ends[1])
    along = axis if from_end1 else scaled(axis, -1.0)  # from the joint nearer the base to the farther one
    twelve, reference = _twelve(along)
    right = cross(along, twelve)
    near, far, way = _JOINT_NAMES[placed.link], _JOINT_NAMES[placed.link + 1], f"along the {placed.link_name}"
    if crosswise:
        near, far, way = _SHEET_ENDS[0], _SHEET_ENDS[1], f"about the end of the {placed.link_name}"
    margin, marks = _azimuth_margin(sensor), []
    for u in _rounded(sensor, placed, placed.model):
        distance = f"{1e3 * u:.0f} mm from {near}" if crosswise else _distance(sensor, placed, u, from_end1, near)
        azimuth = _azimuths(placed, u)
        for number in range(round(360.0 / step)):
            angle = math.radians(number * step)
            side = added(scaled(twelve, math.cos(angle)), scaled(right, math.sin(angle)))
            phi = azimuth(base_link.inverse().rotate(side))
            if margin <= phi <= cone.wrap - margin:
                where = (
                    f"{distance}, {way}, at {_clock(angle)} as seen from {near} towards {far} "
                    f"(12:00 is {reference}): the side that points {_direction(side)}"
                )
                marks.append(Mark(u, phi, where))
    return marks


def _azimuths(placed: SensorOnArm, u: float) -> Callable[[Vector], float]:
    """Return what gives the azimuth [rad] of the place at u [m] in a direction from the middle of the link there."""
    side = placed.frustum
    back = side.link_frustum.inverse()
    if not side.bends:

        def azimuth(way: Vector) -> float:
            x, y, _ = back.rotate(way)
            return math.atan2(y, x) % _FULL_TURN

        return azimuth
    import numpy as np

    first = np.array(side.normal(0.0))
    ahead = np.cross(np.array(side.centre(side.frustum.slant)) - side.centre(0.0), first)
    ahead /= np.linalg.norm(ahead)
    steps = np.linspace(0.0, side.frustum.wrap, _SIDE_STEPS + 1)
    ways = side.place(u, steps)[0] - side.centre(u)
    angles = np.unwrap(np.arctan2(ways @ ahead, ways @ first))  # about the middle, from the normal of edge 0 on

    def bent_azimuth(way: Vector) -> float:
        sought = angles[0] + (math.atan2(way @ ahead, way @ first) - angles[0]) % _FULL_TURN
        return float(np.interp(sought, angles, steps, right=_FULL_TURN))  # where no part of the sheet is

    return bent_azimuth


def _from_joint(placed: SensorOnArm, model: ArmModel, u: float) -> float:
    """Return the distance of a place from the axis of the joint at which a tube begins, along the link [m]."""
    from coneskin.robot.arm.kinematics import dh_mesh

    mesh: Pose = dh_mesh(model, placed.link_name)
    return mesh.inverse().apply(placed.frustum.centre(u))[2]


def _rounded(sensor: Sensor, placed: SensorOnArm, model: ArmModel) -> list[float]:
    """Return slant distances of marks whose distance from the joint is a round number [m]."""
    places = [part * sensor.frustum.slant for part in _SLANT_PARTS]
    if placed.link not in _TUBE_LINKS or sensor.frustum.slant < 20.0 * _DISTANCE_STEP:
        return places
    found = [_from_joint(placed, model, u) for u in places]
    slope = (found[-1] - found[0]) / (places[-1] - places[0])
    if abs(slope) < 0.5:
        return places
    return [
        u + (_DISTANCE_STEP * round(distance / _DISTANCE_STEP) - distance) / slope
        for u, distance in zip(places, found, strict=True)
    ]


def _distance(sensor: Sensor, placed: SensorOnArm, u: float, from_end1: bool, near: str) -> str:
    if placed.link in _TUBE_LINKS and placed.model is not None:
        return f"{1e3 * _from_joint(placed, placed.model, u):.0f} mm from the axis of {near}"
    edge = u if from_end1 else sensor.frustum.slant - u
    return f"{1e3 * edge:.0f} mm from the edge of the sheet's active area that is nearer {near}"


def _twelve(along: Vector) -> tuple[Vector, str]:
    """Return the direction of 12:00 on a clock that is seen along a link, and what it is called."""
    up, name = (
        ((1.0, 0.0, 0.0), "towards the base's +x") if abs(along[2]) > _UPRIGHT_COSINE else ((0.0, 0.0, 1.0), "up")
    )
    across = sum(a * b for a, b in zip(up, along, strict=True))
    rest = added(up, scaled(along, -across))
    return scaled(rest, 1.0 / math.hypot(*rest)), name


def _direction(side: Vector) -> str:
    """Return where a direction of the base frame points, in words."""
    x, y, z = side
    level = [(abs(x), f"{'+' if x > 0.0 else '-'}x"), (abs(y), f"{'+' if y > 0.0 else '-'}y")]
    named = " and ".join(name for part, name in sorted(level, reverse=True) if part > _MIN_COMPONENT)
    upright = "up" if z > _MIN_COMPONENT else "down" if z < -_MIN_COMPONENT else ""
    return ", and ".join(part for part in (upright, f"towards the base's {named}" if named else "") if part)


def _clock(angle: float) -> str:
    minutes = round(2.0 * math.degrees(angle)) % 720
    return f"{minutes // 60 or 12}:{minutes % 60:02d}"
