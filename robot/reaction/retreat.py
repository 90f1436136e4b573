"""Retreat: it moves the touched point away from what touched it. Pure: the state of the arm in, joint speeds out.

The skin's normal n points out of the link, at the obstacle; the touched point therefore moves along -n. The direction
is fixed in the base frame at the touch, and the progress is measured along it from where the point was then, so that
what the arm still moved while it stopped is made good as well.

Objective: of all joint speeds below the touched link, those whose point velocity is nearest to the wanted one in the
least-squares sense, damped (``damped_least_squares.py``); the joints beyond stand still. The result is scaled down as
a whole, so that its direction is kept. A joint that could no longer brake before its limit is locked, and the rest is
solved again without it. With several touches none of the touched points moves towards its obstacle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Vector
from coneskin.robot.arm.damped_least_squares import DAMPING_FLOOR, damped_speeds
from coneskin.robot.arm.kinematics import PlacedPoint, link_name, place_point
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.vectors import dot, minus
from coneskin.robot.arm.workspace import REACTION_TIME, ArmSweep, Workspace, blocked_joints, reach

from .types import ArmState, ContactOnLink, Done, JointVelocity, Reaction

#: part of the wanted speed that a retreat must reach; otherwise it is not begun, or ends. In a regular place it is the
#: squared cosine of the angle between the wanted motion and the nearest possible one: 0.25 is 60 deg, where the point
#: slides 1.7 times as far along the obstacle as it gets away from it.
MIN_PROGRESS = 0.25
#: distance that may be missing at the end of a retreat [m]
DISTANCE_TOLERANCE = 0.5e-3
_ROOM_TOLERANCE = 2e-3  # m of the arm's way that may be missing; its speed is bounded by more than it has


@dataclass(frozen=True, slots=True)
class _Track:
    """Path of one touched point."""

    link: int  # that carries it
    point: Vector  # in the DH frame of the link [m]
    away: Vector  # unit vector that it is to move along, in the base frame
    start: Vector  # where it was at the touch, in the base frame [m]


@dataclass(frozen=True, slots=True)
class RetreatPlan:
    """Plan of a retreat, made once, at the touch, for ``retreat_step``."""

    model: ArmModel
    tracks: tuple[_Track, ...]  #: one for each touched point
    reaction: Reaction
    reach: Joints  #: of the arm, from each joint's axis [m]
    start_time: float  #: of the touch [s]
    space: Workspace | None = None  #: the room that the arm has, or None
    sweep: ArmSweep | None = None  #: where the whole arm was when the motion began; None where its way is not bounded

    def place(self, q: Joints) -> tuple[list[PlacedPoint], float]:
        """Return where the touched points are at joint positions [rad], and how far the farthest has come [m]."""
        placed = [place_point(self.model, q, track.link, track.point) for track in self.tracks]
        made = [dot(minus(at.point, track.start), track.away) for track, at in zip(self.tracks, placed, strict=True)]
        return placed, max(made)


def plan_retreat(
    model: ArmModel,
    state: ArmState,
    contacts: Sequence[ContactOnLink],
    reaction: Reaction,
    space: Workspace | None = None,
    sweep: ArmSweep | None = None,
) -> RetreatPlan | Done:
    """Fix direction, point and start of a retreat.

    Args:
        state: the arm at the touch.
        contacts: all touches at that time.
        space: the room that the arm has; without it nothing is in the way.
        sweep: where the whole arm was when the motion began; without it its way is not bounded.

    Returns:
        the plan, or Done with the reason why no retreat is possible.

    Raises:
        KinematicsError: there is no contact, or one is on a link that the arm does not have.
    """
    if not contacts:
        raise KinematicsError("a retreat needs at least one contact, got none")
    if not all(math.isfinite(value) for value in (*state.q, *state.qd)):
        return Done(f"joint positions and speeds must be finite, got {state.q} rad and {state.qd} rad/s")
    tracks = []
    for contact in contacts:
        if not contact.location_valid:
            return Done(f"the place of the touch on the {link_name(contact.link)} is not known")
        length = math.hypot(*contact.normal)
        if not all(math.isfinite(value) for value in contact.point) or not 0.99 < length < 1.01:
            return Done(f"touch on link {contact.link} at {contact.point} m has no unit normal: {contact.normal}")
        if contact.link == 0:
            return Done("the base was touched, and no joint moves it")
        start, (nx, ny, nz), _ = place_point(model, state.q, contact.link, contact.point, contact.normal)
        away = (-nx / length, -ny / length, -nz / length)
        tracks.append(_Track(contact.link, contact.point, away, start))
    plan = RetreatPlan(model, tuple(tracks), reaction, reach(model), state.time, space, sweep)
    first = retreat_step(plan, ArmState(state.time, state.q))  # from a standstill: the arm stops first
    return first if isinstance(first, Done) else plan


def retreat_step(plan: RetreatPlan, state: ArmState) -> JointVelocity | Done:
    """Return the command of this control cycle; the same for the same arguments."""
    reaction = plan.reaction
    q, qd = state.q, state.qd or (0.0,) * len(state.q)
    if not math.isfinite(sum(q)):
        return Done(f"joint positions must be finite, got {q} rad")
    placed, progress = plan.place(q)
    speeds, away, damping = _solve(plan, placed, ())
    left = reaction.distance - progress
    if not left > DISTANCE_TOLERANCE:
        return Done("the distance is made", progress, complete=True)
    if not state.time - plan.start_time < reaction.time_budget:
        return Done(f"the time of {reaction.time_budget} s is over", progress)
    room = math.inf if plan.sweep is None else reaction.arm_distance - plan.sweep.distance(q)
    if not room > _ROOM_TOLERANCE:
        most, wanted_way = 1e3 * reaction.arm_distance, 1e3 * reaction.distance
        why = f"a point of the arm has moved {most:g} mm, as far as arm_distance_mm lets it"
        return Done(f"{why}, before the touched one had moved {wanted_way:g} mm", progress)
    locked: list[int] = []
    while away >= MIN_PROGRESS:
        speed, clipped = _speed(plan, speeds, away, left, room)
        wanted = [speed * value for value in speeds]
        blocked = blocked_joints(plan.model, reaction.acceleration, q, qd, wanted)
        if not blocked:
            break
        locked += blocked
        speeds, away, damping = _solve(plan, placed, locked)
    else:
        return Done(_why_not(plan, locked, away, damping), progress)
    if locked:
        clipped += tuple(f"joint {i + 1} limit" for i in sorted(locked))
    if damping > DAMPING_FLOOR:
        clipped += ("singularity",)
    wanted += [0.0] * (len(q) - len(wanted))
    if plan.space is not None and (why := plan.space.obstruction(q, wanted, reaction.acceleration)):
        return Done(why, progress)
    return JointVelocity(tuple(wanted), reaction.acceleration, speed * away, progress, clipped)


def _speed(
    plan: RetreatPlan, speeds: Sequence[float], away: float, left: float, room: float
) -> tuple[float, tuple[str, ...]]:
    """Return the speed to want of the touched point [m/s], and the limits that keep it below the one that is set."""
    reaction, braking = plan.reaction, plan.reaction.acceleration
    leading = over = arm = 0.0
    for value, most, far in zip(speeds, plan.model.joint_speed, plan.reach, strict=False):
        size = value if value >= 0.0 else -value
        leading = size if size > leading else leading
        over = size / most if size / most > over else over
        arm += size * far
    speed = reaction.speed
    clipped: tuple[str, ...] = ()
    if speed * over > 1.0:
        speed, clipped = 1.0 / over, ("joint speed",)
    if speed * arm > reaction.arm_speed:
        speed, clipped = reaction.arm_speed / arm, ("arm speed",)
    # braking takes speed^2 away leading / (2 a) plus the distance during the reaction time: no more than what is left
    wait = braking * REACTION_TIME / leading
    ending = math.sqrt(wait * wait + 2.0 * braking * left / (away * leading)) - wait
    if speed > ending:
        speed, clipped = ending, ("distance",)
    if room < math.inf:  # the same for the point of the arm that moves farthest
        ending = math.sqrt(wait * wait + 2.0 * braking * room / (arm * leading)) - wait
        if speed > ending:
            speed, clipped = ending, ("arm distance",)
    return speed, clipped


def _solve(plan: RetreatPlan, placed: Sequence[PlacedPoint], locked: Sequence[int]) -> tuple[list[float], float, float]:
    """Return joint speeds for a wanted speed of 1 m/s, that away from the touches that they reach, and the damping."""
    joints = max(track.link for track in plan.tracks)
    free = [i for i in range(joints) if i not in locked]
    points = []
    for track, at in zip(plan.tracks, placed, strict=True):
        columns = at.columns + [(0.0, 0.0, 0.0)] * (joints - track.link)
        points.append(([columns[i] for i in free], track.away))
    some, damping = damped_speeds(points)
    made = 0.0
    for columns, u in points:
        for value, column in zip(some, columns, strict=True):
            made += value * dot(column, u)
    speeds = [0.0] * joints
    for i, value in zip(free, some, strict=True):
        speeds[i] = value
    return speeds, made / len(points), damping


def _why_not(plan: RetreatPlan, locked: Sequence[int], away: float, damping: float) -> str:
    joints = ", ".join(str(i + 1) for i in sorted(locked))
    part = f"{100.0 * away:.0f} % of the wanted speed could be reached, {100.0 * MIN_PROGRESS:.0f} % is the least"
    if locked:
        return f"no feasible motion with joint {joints} at its limit: {part}"
    if len(plan.tracks) > 1:
        return f"no feasible motion away from all {len(plan.tracks)} touches: {part}"
    if damping > DAMPING_FLOOR:
        return f"no feasible motion near a singularity: {part}"
    return f"link {plan.tracks[0].link} cannot move away from the touch: {part}"
