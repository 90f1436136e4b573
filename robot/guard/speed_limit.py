"""Limit of the speed with which the surfaces of an arm may move towards what they could strike. Pure.

Each patch of a skin has a permissible speed along its outward normal. It depends on the lever: the speed of the patch
over that of the leading joint, which says how far the surface still goes while that joint brakes. The lever stays where
the speed slider scales a motion, so one look says how far down the slider must go. Where it has no effect the arm is
stopped. The slider goes up again only after a while of motion that would have allowed it, and never beyond where a
person has put it.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from operator import mul

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.compiled_kinematics import compile_contact
from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.driver.setpoint import SetSpeedSlider
from coneskin.robot.driver.state import ControllerState

from .journal import EventName
from .outputs import Outputs, emit

__all__ = ["PermissiblePatch", "PermissibleSpeeds", "SpeedLimit"]

_MARGIN = 0.9  # of the permissible speed, to which the slider goes
_UNKNOWN = 0.5  # the same, where the arm still speeds up: the program may ask for twice as much
_GROWTH = 1.05  # ratio; from which on an arm speeds up
_FALL = 0.98  # ratio; below, a speed falls
_LEAD = 0.06  # s; a speed that grows is judged by what it will be then; the slider takes as long to have an effect
_WINDOW = 0.02  # s over which the growth is taken
_PATIENCE = 0.3  # s for which a speed above the limit may fall after the slider was set
_TOLERANCE = 1.05  # of the permissible speed; above, after the patience, the arm is stopped
_HOLD = 2.0  # s of motion after which the slider may go up again
_STEP_UP = 1.2  # ratio; smaller ones are not worth it
_LEAST = 0.01  # of the slider
_SLOW = 0.02  # rad/s of the leading joint, below which an arm counts as not moving
_SLIDER_TOLERANCE = 0.02
_REMEMBERED = 3.0 * _PATIENCE  # s; an arm that obeys is then as slow as the highest slider since lets its joints be
_JOINT_MARGIN = 1.25  # of that speed


@dataclass(frozen=True, slots=True)
class PermissiblePatch:
    """Patch of a skin.

    Attributes:
        name: of its sensor.
        link: index of the link's DH frame.
        point: in that frame [m].
        normal: outward unit normal in that frame.
        curve: permissible speeds within the joint positions of the motion, for each lever [m/s].
        any_curve: in any position [m/s].
    """

    name: str
    link: int
    point: Vector
    normal: Vector
    curve: tuple[float, ...]
    any_curve: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PermissibleSpeeds:
    """Permissible speeds of one arm.

    Attributes:
        levers: [m/rad], rising.
        patches: of its skins.
        lowest: joint positions [rad] from which on the patches' own curves hold; empty where they never do.
        highest: joint positions [rad] up to which they do.
        between: factor by which a place between the patches may be faster than they are.
    """

    levers: tuple[float, ...]
    patches: tuple[PermissiblePatch, ...]
    lowest: tuple[float, ...] = ()
    highest: tuple[float, ...] = ()
    between: float = 1.0

    def covers(self, q: Sequence[float]) -> bool:
        """Tell whether the patches' own curves hold at joint positions [rad]."""
        if not self.lowest:
            return False
        return all(low <= at <= high for low, at, high in zip(self.lowest, q, self.highest, strict=True))


class SpeedLimit:
    """Limit of one arm.

    Args:
        model: the arm.
        speeds: that are permissible.
    """

    def __init__(self, model: ArmModel, speeds: PermissibleSpeeds) -> None:
        self._speeds = speeds
        self._links = [
            (link, compile_contact(model, link).place, [_Row(patch) for patch in speeds.patches if patch.link == link])
            for link in sorted({patch.link for patch in speeds.patches if patch.link > 0})
        ]
        self._before: deque[tuple[float, Joints]] = deque()
        self._ceiling = 1.0  # where a person has put the slider
        self._fraction: float | None = None  # where it was put by this; None where it was not
        self._set_at = -math.inf
        self._over_since: float | None = None
        self._top = 0.0  # highest ratio since then
        self._ratio_then = 0.0  # when the slider was set
        self._lowest = 0.0  # where the slider may be by this, as long as a person has not moved it
        self._joint_speed = model.joint_speed
        self._sliders: deque[tuple[float, float]] = deque()  # time, and where the slider is from then on
        self._demands: deque[tuple[float, float]] = deque()  # time of motion, ratio at full slider

    def ratio(self, q: Sequence[float], qd: Sequence[float]) -> tuple[float, str]:
        """Return the highest speed of a patch over what is permissible, and the patch's sensor.

        Args:
            q: joint positions [rad].
            qd: joint speeds [rad/s].
        """
        leading = max(map(abs, qd))
        if leading <= 0.0:
            return 0.0, ""
        speeds, worst, name = self._speeds, 0.0, ""
        inside = speeds.covers(q)
        for link, place, rows in self._links:
            twist: list[float] = []
            for point, axis in _FRAME:
                _, _, _, nx, ny, nz, *columns = place(*q, *point, *axis)
                vx, vy, vz = (sum(columns[3 * i + k] * qd[i] for i in range(link)) for k in range(3))
                twist += (vx, vy, vz, nx, ny, nz)
            flow = _flow(twist)
            for row in rows:
                speed = speeds.between * sum(map(mul, row.weights, flow))
                if speed > 0.0:
                    curve = row.patch.curve if inside else row.patch.any_curve
                    ratio = speed / max(1e-6, _interpolate(speeds.levers, curve, speed / leading))
                    if ratio > worst:
                        worst, name = ratio, row.patch.name
        return worst, name

    def sample(self, state: ControllerState, slider: float | None, out: Outputs) -> str:
        """Take a measured state; return why the arm must be stopped, empty where it must not.

        Args:
            state: of the arm.
            slider: where the controller's speed slider is; None where that is not known.
            out: takes the slider's setting, and an event.
        """
        now = state.time
        ahead = self._ahead(now, state.qd)
        ratio, name = self.ratio(state.q, ahead)
        self._note_person(now, slider)
        if ratio <= 1.0:
            self._over_since = None
            self._relax(now, ratio, state.speed, slider, out)
            return ""
        self._demands.clear()
        if slider is None:
            return f"{name} moves at {ratio:.0%} of the permissible speed, and the speed slider is not known"
        if self._disobeys(now, state.qd):
            return f"{name} moves at {ratio:.0%} of the permissible speed, and faster than the speed slider allows"
        if self._over_since is None:
            self._over_since, self._top = now, ratio
            self._lower(now, slider, slider, ratio, ahead, state.speed, name, out)
            return ""
        self._top = max(self._top, ratio)
        before = slider if self._fraction is None else min(slider, self._fraction)
        if now - self._set_at >= _LEAD and ratio > _FALL * self._ratio_then:  # it was not enough
            self._lower(now, before, slider, ratio, ahead, state.speed, name, out)
        if now - self._over_since > _PATIENCE:
            measured = self.ratio(state.q, state.qd)[0]
            falls = measured < _FALL * self._top
            if measured > _TOLERANCE and (not falls or now - self._over_since > 3.0 * _PATIENCE):
                return f"{name} moves at {measured:.0%} of the permissible speed, and the speed slider has no effect"
        return ""

    def forget(self) -> None:
        """Forget what was measured: the arm stood, and moves again."""
        self._before.clear()
        self._demands.clear()
        self._over_since = None

    def _ahead(self, now: float, qd: Joints) -> Sequence[float]:
        """Return the joint speeds that there will be when the slider can have an effect, where they grow [rad/s]."""
        before = self._before
        before.append((now, qd))
        while now - before[0][0] > _WINDOW and len(before) > 1 and now - before[1][0] >= _WINDOW:
            before.popleft()
        since = now - before[0][0]
        if not 0.5 * _WINDOW <= since <= 3.0 * _WINDOW:
            return qd
        ahead = [v + _LEAD * (v - old) / since for v, old in zip(qd, before[0][1], strict=True)]
        return [new if abs(new) > abs(v) else v for new, v in zip(ahead, qd, strict=True)]

    def _note_person(self, now: float, slider: float | None) -> None:
        """Take that a person has moved the slider."""
        sliders = self._sliders
        if slider is None:
            sliders.clear()
            return
        if not sliders or sliders[-1][1] != slider:
            sliders.append((now, slider))
        while len(sliders) > 1 and now - sliders[1][0] >= _REMEMBERED:
            sliders.popleft()
        if self._fraction is None:
            self._ceiling = slider
        elif slider < self._lowest - _SLIDER_TOLERANCE or (
            now - self._set_at > 0.5 and abs(slider - self._fraction) > _SLIDER_TOLERANCE
        ):
            self._ceiling, self._fraction = slider, None

    def _disobeys(self, now: float, qd: Joints) -> bool:
        """Tell whether a joint turns faster than the slider has let it for a while; short strokes show only here."""
        if now - self._sliders[0][0] < _REMEMBERED:
            return False
        top = max(self._fraction or 0.0, max(slider for _, slider in self._sliders))
        return any(abs(v) > _JOINT_MARGIN * top * most + _SLOW for v, most in zip(qd, self._joint_speed, strict=True))

    def _lower(
        self,
        now: float,
        fraction: float,
        slider: float,
        ratio: float,
        ahead: Sequence[float],
        speed: float,
        name: str,
        out: Outputs,
    ) -> None:
        """Put the slider down from a fraction; farther where the arm still speeds up, nobody knows to what."""
        grows = max(map(abs, ahead)) > _GROWTH * speed
        fraction = max(_LEAST, (_UNKNOWN if grows else _MARGIN) * fraction / ratio)
        self._fraction, self._set_at, self._ratio_then = min(fraction, slider), now, ratio
        self._lowest = self._fraction
        out.append(SetSpeedSlider(self._fraction))
        emit(out, EventName.SPEED_LIMITED, now, slider=self._fraction, before=slider, sensor=name, ratio=ratio)

    def _relax(self, now: float, ratio: float, speed: float, slider: float | None, out: Outputs) -> None:
        """Let the slider go up again after a while of motion that would have allowed it."""
        if (
            self._fraction is None
            or slider is None
            or speed < _SLOW
            or abs(slider - self._fraction) > _SLIDER_TOLERANCE
        ):
            self._demands.clear()
            return
        demands = self._demands
        demands.append((now, ratio / max(_LEAST, slider)))
        if now - demands[0][0] < _HOLD:
            return
        while now - demands[0][0] > _HOLD:
            demands.popleft()
        wanted = max(demand for _, demand in demands)
        fraction = min(self._ceiling, _MARGIN / wanted if wanted > 0.0 else math.inf)
        if fraction < min(self._ceiling, _STEP_UP * self._fraction) or fraction <= self._fraction:
            return
        before = self._lowest = self._fraction
        self._fraction, self._set_at = fraction, now
        demands.clear()
        out.append(SetSpeedSlider(fraction))
        emit(out, EventName.SPEED_LIMITED, now, slider=fraction, before=before, sensor="", ratio=ratio)


#: points and directions in a link's frame, at which its motion is read off
_FRAME = (
    ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
    ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
)


class _Row:
    """Patch with the weights that make its speed along the normal of the speeds of four points of its link."""

    def __init__(self, patch: PermissiblePatch) -> None:
        self.patch = patch
        x, y, z = patch.point
        self.weights = [share * n for share in (1.0 - x - y - z, x, y, z) for n in patch.normal]


def _flow(twist: Sequence[float]) -> list[float]:
    """Return the speeds of the four points along the axes of the frame of the link [m/s], as ``_Row`` weighs them."""
    axes = [twist[6 * number + 3 : 6 * number + 6] for number in range(3)]
    speeds = [twist[6 * number : 6 * number + 3] for number in range(4)]
    return [sum(map(mul, axis, speed)) for speed in speeds for axis in axes]


def _interpolate(levers: Sequence[float], curve: Sequence[float], lever: float) -> float:
    """Return a value of a curve that begins at 0; the curves bend downwards, so it is never above the curve."""
    if lever >= levers[-1]:
        return curve[-1]
    at = bisect_left(levers, lever)
    low, below = (levers[at - 1], curve[at - 1]) if at else (0.0, 0.0)
    return below + (curve[at] - below) * (lever - low) / (levers[at] - low)
