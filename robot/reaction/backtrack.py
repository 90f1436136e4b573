"""Backtrack: the recent path of the arm, and going back along it. Pure.

Where a retreat along the normal is not possible (the place of the touch is not known, a joint is at its limit, a
singularity is near), the arm's own recent path is the one way on which it is known that nothing stood a moment ago. It
is not known that nothing has come there since, which is why a scene has to ask for it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.arm.workspace import REACTION_TIME, JointLimits, Workspace

from .types import ArmState, Done, JointVelocity, Reaction

__all__ = ["BacktrackPlan", "PathHistory", "backtrack_step", "plan_backtrack"]

_HISTORY_LENGTH = 5.0  # s of path that are kept
_MIN_SPACING = 0.002  # rad by which some joint differs between two places
_MAX_PLACES = 2000  # places that are kept
_MAX_DEVIATION = 0.05  # rad by which a joint may be off the path; beyond it the motion ends
_MIN_LENGTH = 0.002  # m of path; an arm that came less far has not come from anywhere


class PathHistory:
    """Measured joint positions of the last seconds, at a minimum spacing."""

    def __init__(self) -> None:
        self._places: deque[tuple[float, Joints]] = deque(maxlen=_MAX_PLACES)

    def update(self, time: float, q: Joints) -> None:
        """Take measured joint positions [rad] of a time [s]."""
        places = self._places
        if places:
            a, b, c, d, e, f = places[-1][1]
            u, v, w, x, y, z = q
            if max(abs(u - a), abs(v - b), abs(w - c), abs(x - d), abs(y - e), abs(z - f)) < _MIN_SPACING:
                return
        places.append((time, q))

    def since(self, time: float) -> list[Joints]:
        """Return the places after a time [s], newest first."""
        return [q for at, q in reversed(self._places) if at >= time]


@dataclass(frozen=True, slots=True)
class BacktrackPlan:
    """Plan of a way back, for ``backtrack_step``.

    Attributes:
        places: joint positions to go through, in this order [rad]; the first is where it starts.
        lengths: of the way up to each place, as the farthest that a point of the bare arm may have come on it [m].
        reaction: the settings.
        limits: of the joints.
        space: the room that the arm has, or None.
        start_time: [s].
    """

    places: tuple[Joints, ...]
    lengths: tuple[float, ...]
    reaction: Reaction
    limits: JointLimits
    space: Workspace | None
    start_time: float


def plan_backtrack(
    model: ArmModel,
    state: ArmState,
    history: PathHistory,
    reaction: Reaction,
    space: Workspace | None = None,
    since: float = -math.inf,
) -> BacktrackPlan | Done:
    """Plan to go back the way the arm came, as far as the reaction's distance.

    Args:
        model: the arm.
        state: the arm, standing.
        history: where it has been.
        reaction: the settings.
        space: the room that the arm has.
        since: before which the arm's path does not count [s].
    """
    limits = JointLimits.of(model, reaction.acceleration)
    distance = min(reaction.distance, reaction.arm_distance)
    places, lengths = [state.q], [0.0]
    for q in history.since(max(since, state.time - _HISTORY_LENGTH)):
        step = _bound(limits, [b - a for a, b in zip(places[-1], q, strict=True)])
        if step == 0.0:
            continue
        if lengths[-1] + step >= distance:
            part = (distance - lengths[-1]) / step
            a, b, c, d, e, f = (x + part * (y - x) for x, y in zip(places[-1], q, strict=True))
            places.append((a, b, c, d, e, f))
            lengths.append(distance)
            break
        places.append(q)
        lengths.append(lengths[-1] + step)
    if lengths[-1] < _MIN_LENGTH:
        return Done("the arm has not come from anywhere")
    plan = BacktrackPlan(tuple(places), tuple(lengths), reaction, limits, space, state.time)
    first = backtrack_step(plan, ArmState(state.time, state.q))
    return first if isinstance(first, Done) else plan


def backtrack_step(plan: BacktrackPlan, state: ArmState) -> JointVelocity | Done:
    """Return what to do in this control cycle; the same for the same arguments.

    Args:
        plan: of this way back.
        state: the arm as measured.
    """
    reaction, limits = plan.reaction, plan.limits
    if not math.isfinite(sum(state.q)):
        return Done(f"joint positions must be finite, got {state.q} rad")
    segment, part, off = _nearest(plan.places, state.q)
    made = plan.lengths[segment] + part * (plan.lengths[segment + 1] - plan.lengths[segment])
    left = plan.lengths[-1] - made
    if left < 1e-3:
        return Done(
            "the way back is made", made, complete=plan.lengths[-1] >= min(reaction.distance, reaction.arm_distance)
        )
    if off > _MAX_DEVIATION:
        return Done(f"the arm is {off:.3f} rad off the way that it came", made)
    if not state.time - plan.start_time < reaction.time_budget:
        return Done(f"the time of {reaction.time_budget} s is over", made)
    target = _ahead(plan, made + min(left, 0.01))  # a centimetre ahead: corners are cut by less than that
    way = [b - a for a, b in zip(state.q, target, strict=True)]
    length = _bound(limits, way)
    leading = max(map(abs, way))
    speed = reaction.speed
    clipped: tuple[str, ...] = ()
    over = max(abs(value) / most for value, most in zip(way, limits.speed, strict=True)) / length
    for most, why in ((1.0 / over, "joint speed"), (reaction.arm_speed, "arm speed")):
        if speed > most:
            speed, clipped = most, (*clipped, why)
    # as in retreat.py: brake for the end, with what the leading joint can do
    braking = limits.braking * length / leading
    wait = braking * REACTION_TIME
    ending = math.sqrt(wait * wait + 2.0 * braking * left) - wait
    if speed > ending:
        speed, clipped = ending, (*clipped, "distance")
    wanted = [value * speed / length for value in way]
    if blocked := limits.blocked(state.q, state.qd, wanted):
        return Done(f"joint {blocked[0] + 1} is at its limit on the way back", made)
    if plan.space is not None and (why := plan.space.obstruction(state.q, wanted, limits.braking)):
        return Done(why, made)
    a, b, c, d, e, f = wanted
    return JointVelocity((a, b, c, d, e, f), reaction.acceleration, speed, made, clipped)


def _bound(limits: JointLimits, way: Sequence[float]) -> float:
    """Return an upper bound of how far a point of the bare arm moves when the joints turn by this [m]."""
    return sum(abs(turn) * reach for turn, reach in zip(way, limits.reach, strict=True))


def _nearest(places: Sequence[Joints], q: Joints) -> tuple[int, float, float]:
    """Return the segment nearest to q, the part of it that is behind, and the largest joint's distance [rad]."""
    best = (math.inf, 0, 0.0, 0.0)
    for i in range(len(places) - 1):
        here, there = places[i], places[i + 1]
        way = [b - a for a, b in zip(here, there, strict=True)]
        square = sum(w * w for w in way)
        part = sum(w * (x - a) for w, x, a in zip(way, q, here, strict=True)) / square
        part = min(1.0, max(0.0, part))
        gap = [x - a - part * w for x, a, w in zip(q, here, way, strict=True)]
        distance = sum(g * g for g in gap)
        if distance < best[0]:
            best = (distance, i, part, max(map(abs, gap)))
    return best[1], best[2], best[3]


def _ahead(plan: BacktrackPlan, length: float) -> list[float]:
    """Return the place at a length along the path [m]."""
    last = len(plan.places) - 2
    i = next((i for i in range(last) if plan.lengths[i + 1] >= length), last)
    part = min(1.0, (length - plan.lengths[i]) / (plan.lengths[i + 1] - plan.lengths[i]))
    return [a + part * (b - a) for a, b in zip(plan.places[i], plan.places[i + 1], strict=True)]
