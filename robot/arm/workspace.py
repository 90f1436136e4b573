"""Room of an arm during a reaction: limits of its joints, its own links, the table, and how far it has swept. Pure.

Links are thick lines along those of `skeleton`, which are the axes of the tubes in the meshes.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, pairwise

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Vector

from .kinematics import LINK_INDEX, dh_mesh, link_pose, link_poses
from .model import ArmModel, Joints
from .models import MODEL_NAMES, arm_model, is_ur
from .vectors import added, dot, minus, scaled

#: distance kept from a joint's limit [rad]
_LIMIT_MARGIN = 0.02
#: time until a command acts: two controller cycles, the network, and one cycle to see it [s]
REACTION_TIME = 0.01


def blocked_joints(
    model: ArmModel, braking: float, q: Sequence[float], qd: Sequence[float], wanted: Sequence[float]
) -> list[int]:
    """Return the indices of joints that could no longer brake before their limit if they moved as wanted.

    Args:
        braking: deceleration available to a joint [rad/s^2].
        q: joint positions [rad].
        qd: present joint speeds [rad/s].
        wanted: wanted joint speeds [rad/s]; may be shorter than q, the joints beyond stand.
    """
    found = []
    for i, speed in enumerate(wanted):
        if speed > 0.0:
            room = model.joint_upper[i] - _LIMIT_MARGIN - q[i]
            fast = qd[i] if qd[i] > speed else speed
        elif speed < 0.0:
            room = q[i] - (model.joint_lower[i] + _LIMIT_MARGIN)
            fast = -qd[i] if -qd[i] > -speed else -speed
        else:
            continue
        if not fast * (REACTION_TIME + fast / (2.0 * braking)) <= room:
            found.append(i)
    return found


def reach(model: ArmModel) -> Joints:
    """Return an upper bound of the distance of any point of the bare arm from each joint's axis [m].

    It is that of the nominal arm, because a calibrated table has frames that are not on the arm, plus 10 cm for the
    thickness of the links and the calibration.
    """
    nominal = arm_model(model.name) if model.name in MODEL_NAMES else model
    steps = [math.hypot(a, d) for a, d in zip(nominal.a, nominal.d, strict=True)]
    # a joint's own d lies along its axis
    return tuple(abs(a) + sum(steps[i + 1 :]) + 0.1 for i, a in enumerate(nominal.a))


def skeleton(model: ArmModel, q: Sequence[float]) -> list[Vector]:
    """Return the corners of a line from base to flange, in the base frame [m], at joint positions q [rad].

    Upper arm and forearm of a UR arm lie beside the line between the origins of the DH table; their place is that of
    their meshes. The line of another arm goes along each joint's axis, then along the link.
    """
    poses = link_poses(model, q)
    if not is_ur(model):
        ends = [(pose.apply((-a, 0.0, 0.0)), pose.translation) for a, pose in zip(model.a, poses[1:], strict=True)]
        return [poses[0].translation, *chain.from_iterable(ends)]
    corners: list[Vector] = [poses[0].translation, poses[1].translation]
    for link, begin, end in _tubes(model):
        corners += [poses[link].apply(begin), poses[link].apply(end)]
    return [*corners, *(pose.translation for pose in poses[4:])]


@functools.lru_cache(maxsize=32)
def _tubes(model: ArmModel) -> tuple[tuple[int, Vector, Vector], ...]:
    """Return index of the DH frame, and both ends of the axis in it [m], of upper arm and forearm."""
    tubes: list[tuple[int, Vector, Vector]] = []
    for name, length in (("upper_arm", abs(model.a[1])), ("forearm", abs(model.a[2]))):
        try:
            mesh = dh_mesh(model, name)
        except KinematicsError:  # good enough for a picture; a `Workspace` refuses such an arm
            tubes.append((LINK_INDEX[name], (length, 0.0, 0.0), (0.0, 0.0, 0.0)))
            continue
        tubes.append((LINK_INDEX[name], mesh.translation, mesh.apply((0.0, 0.0, length))))
    return tuple(tubes)


#: names of the parts between the corners of the skeleton, from the base on
_PART_NAMES = ("base", "shoulder", "upper arm", "elbow", "forearm", "wrist 1", "wrist 2", "wrist 3")


@functools.lru_cache(maxsize=32)
def arm_parts(model: ArmModel) -> tuple[tuple[str, int, Vector, Vector], ...]:
    """Return the straight parts that joints move: name, index of the DH frame, and both ends in that frame [m]."""
    poses = link_poses(model, (0.0,) * model.joints)  # no joint turns an end about another axis than that of its part
    (upper, upper_begin, upper_end), (fore, fore_begin, fore_end) = _tubes(model)
    elbow_end = poses[upper].inverse().apply(poses[fore].apply(fore_begin))
    parts = [
        ("shoulder", 1, (0.0, 0.0, 0.0), poses[1].inverse().apply(poses[upper].apply(upper_begin))),
        ("upper arm", upper, upper_begin, upper_end),
        ("elbow", upper, upper_end, elbow_end),
        ("forearm", fore, fore_begin, fore_end),
    ]
    begins = (poses[fore].apply(fore_end), poses[4].translation, poses[5].translation)
    for link, begin in enumerate(begins, 4):
        parts.append((f"wrist {link - 3}", link, poses[link].inverse().apply(begin), (0.0, 0.0, 0.0)))
    return tuple(parts)


#: pairs of parts that can meet; neighbours cannot, and a forearm folds beside its upper arm, not onto it
_PART_PAIRS = tuple((a, b) for a in (0, 1, 2) for b in (4, 5, 6, 7) if (a, b) != (2, 4) and (a, b) != (2, 5))


def _clearance_needed(model: ArmModel) -> float:
    """Return the distance of two axes below which the arm counts as touching itself [m].

    The wrist's joints are about as thick as d5 is long, its fifth joint offset, and no tube of the family is thicker:
    43 mm of radius against d5 / 2 = 50 mm on the UR5e's upper arm, 54 against 58 on the UR10's (their meshes).
    """
    return model.d[4]


def _close_pairs(model: ArmModel, corners: Sequence[Vector]) -> list[tuple[int, int, float]]:
    """Return the pairs of parts that are closer than ``_clearance_needed``: their indices, and how far apart [m]."""
    least = _clearance_needed(model)
    sizes = [math.dist(a, b) for a, b in pairwise(corners)]
    found = []
    for a, b in _PART_PAIRS:
        if math.dist(corners[a], corners[b]) < least + sizes[a] + sizes[b]:  # else no two of their points are so close
            distance = _segment_distance(*corners[a : a + 2], *corners[b : b + 2])
            if distance < least:
                found.append((a, b, distance))
    return found


def _segment_distance(a: Vector, b: Vector, c: Vector, d: Vector) -> float:
    """Return the least distance between the line segments a b and c d [m]; either may be a point.

    The distance is convex along each segment, so the least one is between an end and its foot on the other segment, or
    where both feet are inside. All are tried, so that parallel segments need no case of their own.
    """
    best = min(_to_segment(a, c, d), _to_segment(b, c, d), _to_segment(c, a, b), _to_segment(d, a, b))
    u, v, w = minus(b, a), minus(d, c), minus(a, c)
    uu, uv, vv, uw, vw = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    det = uu * vv - uv * uv
    if det <= 0.0:
        return best  # parallel, or a point: the least distance is at a corner
    s, t = (uv * vw - vv * uw) / det, (uu * vw - uv * uw) / det
    if not (0.0 < s < 1.0 and 0.0 < t < 1.0):
        return best
    x, y, z = (w[k] + s * u[k] - t * v[k] for k in range(3))
    return min(best, math.sqrt(x * x + y * y + z * z))


def _to_segment(p: Vector, a: Vector, b: Vector) -> float:
    along, from_a = minus(b, a), minus(p, a)
    length = dot(along, along)
    share = min(1.0, max(0.0, dot(from_a, along) / length)) if length > 0.0 else 0.0
    return math.dist(p, (a[0] + share * along[0], a[1] + share * along[1], a[2] + share * along[2]))


_CRUSHING_GAP = 0.12  # m; a wider one crushes no person's arm (ISO 13854)


def part_in_front(model: ArmModel, q: Sequence[float], link: int, point: Vector, normal: Vector) -> str:
    """Return which part of the arm is too close in front of a point on a link, at q [rad]. Empty for none.

    It reaches into a ball as wide as ``_CRUSHING_GAP`` that touches the link at that point [m], and lies nearer to the
    ball's middle than to the point. Point and outward unit normal are in the link's DH frame.
    """
    pose = link_pose(model, q, link)
    place, middle = (pose.apply(added(point, scaled(normal, way))) for way in (0.0, 0.5 * _CRUSHING_GAP))
    for name, (begin, end) in zip(_PART_NAMES, pairwise(skeleton(model, q)), strict=True):
        near = min(0.5 * (_CRUSHING_GAP + _clearance_needed(model)), _to_segment(place, begin, end))
        if _to_segment(middle, begin, end) < near:
            return name
    return ""


@dataclass(frozen=True, slots=True)
class Workspace:
    """Room that an arm has.

    The arm is taken as the line along the axes of its tubes (``skeleton``); it may not go below a table from the
    shoulder on, because the base stands on it. The thickness of the tubes and the length of the tool belong in its
    height.

    Attributes:
        table: height in the base frame of a horizontal plane below which it must not go [m], or None.

    Raises:
        KinematicsError: it is not known where the arm's links are beside the lines of its DH table.
    """

    model: ArmModel
    table: float | None = None

    def __post_init__(self) -> None:
        dh_mesh(self.model, "forearm")

    def obstruction(self, q: Sequence[float], qd: Sequence[float], braking: float) -> str:
        """Return what is in the way of joints that move so, braking distance included; empty where nothing is.

        A part that is already where it must not be may move out.

        Args:
            q: joint positions [rad].
            qd: wanted joint speeds [rad/s].
            braking: deceleration of the leading joint [rad/s^2].
        """
        leading, table = max(map(abs, qd)), self.table
        if not leading:
            return ""
        ahead = REACTION_TIME + leading / (2.0 * braking)
        there = skeleton(self.model, [angle + ahead * speed for angle, speed in zip(q, qd, strict=True)])
        low = table is not None and any(corner[2] < table for corner in there[1:])
        near = _close_pairs(self.model, there)
        if not (low or near):  # nearly always; then the present skeleton is not needed
            return ""
        here = skeleton(self.model, q)
        corners = zip(here[1:], there[1:], strict=True)
        if table is not None and low and any(b[2] < table and b[2] < a[2] for a, b in corners):
            return f"the table at {1e3 * table:g} mm is in the way"
        for a, b, distance in near:
            if distance < _segment_distance(*here[a : a + 2], *here[b : b + 2]):
                first, second = _PART_NAMES[a], _PART_NAMES[b]
                return f"the {second} would come within {1e3 * distance:.0f} mm of the {first}, axis to axis"
        return ""


_LINK_RADIUS = 0.06  # m from the middle line of a link to its surface


@dataclass(frozen=True, slots=True)
class ArmSweep:
    """Place of the whole arm when a motion began."""

    model: ArmModel
    q: Joints  #: joint positions then [rad]
    corners: tuple[Vector, ...]  #: of its middle line then, in the base frame [m]

    @classmethod
    def begin(cls, model: ArmModel, q: Joints) -> ArmSweep:
        """Return the sweep of a motion that begins at joint positions q [rad]."""
        return cls(model, q, tuple(skeleton(model, q)))

    def distance(self, q: Joints) -> float:
        """Return an upper bound of how far any point of the bare arm is from where it was [m].

        A point between two corners moves no farther than the farther one of them; one off the middle line moves in
        addition by its distance from it times the angle.
        """
        turn = sum(abs(a - b) for a, b in zip(q, self.q, strict=True))
        if turn == 0.0:
            return 0.0
        corners = skeleton(self.model, q)
        return max(math.dist(a, b) for a, b in zip(corners, self.corners, strict=True)) + _LINK_RADIUS * turn
