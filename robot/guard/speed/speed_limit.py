"""Limit of the speed with which the surfaces of an arm may move towards what they could strike. Pure.

One sample says how far down the speed slider must go: the slider scales a motion and leaves the lever of a patch
(``permissible_speeds``) as it is. A motion is judged where it will be when the slider can have an effect. That is
further on, and faster where it still speeds up, but not faster than its program was seen to go at that slider.

The slider goes down at once. It goes up again only after motion that would have allowed it, and never beyond where a
person has put it. Each time that it has to go down again, twice as much motion is needed. So it comes to rest where a
program repeats itself. Where it has no effect the arm is stopped.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from coneskin.robot.arm.model import ArmModel, Joints
from coneskin.robot.driver.values import ControllerState, SetSpeedSlider
from coneskin.robot.guard.signals.journal import EventName, Outputs, emit

from .permissible_speeds import PermissibleSpeeds, SurfaceSpeeds

_READ_TOLERANCE = 0.01  # of the slider; between what was set and what is read
_READ_DELAY = 0.5  # s after which it must show what was set


class _SliderSetting:
    """Setting of one slider.

    Attributes:
        ceiling: where a person has put it.
        fraction: where the guard has put it. None where that has not, or a person has moved it since.
        set_at: when that was [s].
    """

    def __init__(self) -> None:
        self.ceiling = 1.0
        self.fraction: float | None = None
        self.set_at = -math.inf
        self._expected: list[float] = []  # what may be read, the oldest first, until the newest is
        self._late: list[float] = []  # what may still arrive after a person's setting

    @property
    def shown(self) -> bool:
        """True where the slider was read where the guard has put it."""
        return self.fraction is not None and len(self._expected) == 1

    def feed(self, now: float, slider: float) -> bool:
        """Take where the slider is at a time [s]. Return whether a person has moved it there."""
        self.set_at = min(self.set_at, now)  # where it resumes, from now on
        if self.fraction is None:
            if now - self.set_at <= _READ_DELAY and any(abs(slider - value) <= _READ_TOLERANCE for value in self._late):
                self.fraction, self._expected, self._late = slider, [slider], []  # it was under way to the controller
                return False
            moved, self.ceiling = abs(slider - self.ceiling) > _READ_TOLERANCE, slider
            return moved
        shown = [number for number, value in enumerate(self._expected) if abs(slider - value) <= _READ_TOLERANCE]
        if shown:
            del self._expected[: shown[-1]]
        if shown and (len(self._expected) == 1 or now - self.set_at <= _READ_DELAY):
            return False
        self._late = self._expected[1:]
        self.ceiling, self.fraction = slider, None
        return True

    def set(self, now: float, fraction: float, slider: float) -> None:
        """Note that the guard sets the slider, which was read last at ``slider``."""
        if self.fraction is None:
            self._expected = [slider]
        self._expected.append(fraction)
        self.fraction, self.set_at = fraction, now

    def resume(self) -> None:
        """Note that a stop may have put the slider to 0, and that it is put back now."""
        if self.fraction is not None:
            self._expected, self.set_at = [0.0, self.fraction], math.inf

    def found(self, slider: float) -> float | None:
        """Return where to put the slider back to, from ``slider``. None where it is not where the guard has put it."""
        if self.fraction is None or all(abs(slider - value) > _READ_TOLERANCE for value in self._expected):
            return None
        return self.ceiling


_SPEED_MARGIN = 0.9  # of the permissible speed, to which the slider goes
_GROWTH_RATIO = 1.05  # ratio; from which on an arm speeds up
_STEADY_RATIO = 1.02  # ratio; up to which it does not
_STEADY_TIME = 0.04  # s for which it must not, to tell how fast the program goes
_FALL_RATIO = 0.98  # ratio; below, a speed falls
_SLIDER_LEAD = 0.06  # s that the slider takes to have an effect
_GROWTH_WINDOW = 0.02  # s over which the growth is taken
_FALL_TIME = 0.3  # s for which a speed above the limit may fall after the slider was set
_SPEED_TOLERANCE = 1.05  # of the permissible speed; above, after the patience, the arm is stopped
_HOLD_TIME = 2.0  # s of motion after which the slider may go up again, the first time
_MAX_HOLD_TIME = 64.0  # s
_STEP_UP = 1.2  # ratio; smaller ones are not worth it
_MIN_SLIDER = 0.01  # of the slider
_MIN_SPEED = 0.02  # rad/s of the leading joint, below which an arm counts as not moving
_SLIDER_MEMORY = 3.0 * _FALL_TIME  # s; an arm that obeys is then as slow as the highest slider since lets its joints be
_JOINT_MARGIN = 1.25  # of that speed


class _Excess(NamedTuple):
    """Motion that would be above the limit."""

    since: float  # [s]
    top: float  # highest ratio since
    judged_at: float  # when it was judged last whether the speed falls [s]
    ratio: float  # then


class _Demand(NamedTuple):
    """What motion since the slider was set would have needed."""

    looked_at: float = math.inf  # [s]
    moved: float = 0.0  # [s]
    ratio: float = 0.0  # highest, at full slider


class SpeedLimit:
    """Limit of one arm.

    Args:
        speeds: that are permissible.

    Attributes:
        speeds: that are permissible.
        setting: of the slider.
    """

    def __init__(self, model: ArmModel, speeds: PermissibleSpeeds) -> None:
        self.speeds = speeds
        self._surfaces = SurfaceSpeeds(model, speeds)
        self._joint_speed = model.joint_speed
        self._fastest = max(model.joint_speed)
        self.setting = _SliderSetting()
        self._sliders: deque[tuple[float, float]] = deque()  # time, and where the slider is from then on
        self._before: deque[tuple[float, Joints]] = deque()
        self._excess: _Excess | None = None
        self._demand = _Demand()
        self._asked: float | None = None  # rad/s of the leading joint, for which the program asks at full slider
        self._steady_since = math.inf
        self._hold = _HOLD_TIME, False  # s of motion until the slider may go up again, and whether it has

    def sample(self, state: ControllerState, slider: float | None, out: Outputs) -> str:
        """Take a measured state. Return why the arm must be stopped, empty where it must not.

        Args:
            slider: where the controller's speed slider is. None where that is not known.
            out: takes the slider's setting, and an event.
        """
        now = state.time
        self._note_slider(now, slider, out)
        ahead = self._ahead(now, state)
        ratio, name = self._surfaces.ratio([q + _SLIDER_LEAD * v for q, v in zip(state.q, ahead, strict=True)], ahead)
        if ratio <= 1.0:
            self._excess = None
            self._relax(now, ratio, state.speed, out)
            return ""
        self._demand = _Demand()
        if slider is None:
            return f"{name} moves at {ratio:.0%} of the permissible speed, and the speed slider is not known"
        if self._disobeys(now, state.qd):
            return f"{name} moves at {ratio:.0%} of the permissible speed, and faster than the speed slider allows"
        if self._excess is None:
            self._excess = _Excess(now, ratio, now, ratio)
            self._lower(now, slider, ratio, ahead, state.speed, name, out)
            return ""
        since, top, judged_at, then = self._excess
        top = max(top, ratio)
        if now - judged_at >= _SLIDER_LEAD:
            if ratio > _FALL_RATIO * then:  # it was not enough
                self._lower(now, slider, ratio, ahead, state.speed, name, out)
            judged_at, then = now, ratio
        self._excess = _Excess(since, top, judged_at, then)
        if now - since > _FALL_TIME:
            measured = self._surfaces.ratio(state.q, state.qd)[0]
            falls = measured < _FALL_RATIO * top
            if measured > _SPEED_TOLERANCE and (not falls or now - since > 3.0 * _FALL_TIME):
                return f"{name} moves at {measured:.0%} of the permissible speed, and the speed slider has no effect"
        return ""

    def forget(self) -> None:
        """Forget what was measured: the arm stood, and moves again."""
        self._before.clear()
        self._demand = _Demand()
        self._excess = self._asked = None
        self.setting.resume()

    def end(self, now: float, slider: float | None, out: Outputs) -> None:
        """Put the slider back where it was found, from where it is, unless a stop or a person has moved it since."""
        setting = self.setting
        found = None if slider is None else setting.found(slider)
        if found is not None and slider is not None:
            setting.fraction = None
            out.append(SetSpeedSlider(found))
            emit(out, EventName.SPEED_LIMITED, now, slider=found, before=slider, sensor="", ratio=0.0, found=found)

    # ---- what is measured

    def _note_slider(self, now: float, slider: float | None, out: Outputs) -> None:
        sliders = self._sliders
        if slider is None:
            sliders.clear()
            return
        if not sliders or sliders[-1][1] != slider:
            sliders.append((now, slider))
        while len(sliders) > 1 and now - sliders[1][0] >= _SLIDER_MEMORY:
            sliders.popleft()
        if self.setting.feed(now, slider):  # a person wants it so: begin anew
            self._hold, self._demand = (_HOLD_TIME, False), _Demand()
        fraction, ceiling = self.setting.fraction, self.setting.ceiling
        if fraction is not None and fraction > ceiling:  # it crossed the person's setting on its way
            self._set(now, ceiling, slider, "", 0.0, out)

    @property
    def _highest(self) -> float:
        """Highest slider that may still have an effect."""
        return max(self.setting.fraction or 0.0, max((slider for _, slider in self._sliders), default=0.0))

    def _ahead(self, now: float, state: ControllerState) -> Sequence[float]:
        """Return the joint speeds that there will be when the slider can have an effect, where they grow [rad/s]."""
        qd, leading, before = state.qd, state.speed, self._before
        before.append((now, qd))
        while now - before[0][0] > _GROWTH_WINDOW and len(before) > 1 and now - before[1][0] >= _GROWTH_WINDOW:
            before.popleft()
        since = now - before[0][0]
        if not 0.5 * _GROWTH_WINDOW <= since <= 3.0 * _GROWTH_WINDOW:
            self._steady_since = math.inf
            return qd
        change = [_SLIDER_LEAD * (v - old) / since for v, old in zip(qd, before[0][1], strict=True)]
        self._note_program(now, leading, max(map(abs, change)))
        ahead = [v + dv if abs(v + dv) > abs(v) else v for v, dv in zip(qd, change, strict=True)]
        if self._asked is not None:
            slider = self._sliders[-1][1] if self.setting.fraction is None else self.setting.fraction
            most, top = max(leading, self._asked * slider), max(map(abs, ahead))
            if top > most:
                share = (most - leading) / (top - leading)
                ahead = [v + share * (new - v) for v, new in zip(qd, ahead, strict=True)]
        return ahead

    def _note_program(self, now: float, leading: float, change: float) -> None:
        """Learn how fast the program goes at full slider, wherever it goes at a steady speed."""
        highest = self._highest
        if highest <= 0.0:
            self._asked = None
            return
        if self._asked is not None and leading > _STEADY_RATIO * self._asked * highest:
            self._asked = None  # faster than ever: nobody knows how fast it will be
        if leading < _MIN_SPEED or change > (_STEADY_RATIO - 1.0) * leading:
            self._steady_since = math.inf
            return
        self._steady_since = min(self._steady_since, now)
        if now - self._steady_since >= _STEADY_TIME:
            self._asked = max(self._asked or 0.0, leading / highest)

    def _disobeys(self, now: float, qd: Joints) -> bool:
        """Tell whether a joint turns faster than the slider has let it for a while. Short strokes show only here."""
        if now - self._sliders[0][0] < _SLIDER_MEMORY:
            return False
        top = self._highest
        return any(
            abs(v) > _JOINT_MARGIN * top * most + _MIN_SPEED for v, most in zip(qd, self._joint_speed, strict=True)
        )

    # ---- what is done

    def _lower(
        self, now: float, slider: float, ratio: float, ahead: Sequence[float], speed: float, name: str, out: Outputs
    ) -> None:
        """Put the slider down, and farther where the arm still speeds up, as its program may, or as it was seen to."""
        setting = self.setting
        before = slider if setting.fraction is None else min(slider, setting.fraction)
        share, top = _SPEED_MARGIN / ratio, max(map(abs, ahead))
        if top > _GROWTH_RATIO * speed:
            share *= top / max(top, (self._asked or self._fastest) * before)
        fraction = min(slider, max(_MIN_SLIDER, share * before))
        hold, raised = self._hold
        if raised:
            self._hold = min(_MAX_HOLD_TIME, 2.0 * hold), False
        self._set(now, fraction, slider, name, ratio, out)

    def _relax(self, now: float, ratio: float, speed: float, out: Outputs) -> None:
        """Let the slider go up again after motion that would have allowed it. A standing arm says nothing."""
        setting = self.setting
        before, (looked_at, moved, demand), hold = setting.fraction, self._demand, self._hold[0]
        if before is None or not setting.shown:
            self._demand = _Demand()
            return
        if speed >= _MIN_SPEED:
            moved += min(max(0.0, now - looked_at), _GROWTH_WINDOW)
            demand = max(demand, ratio / max(_MIN_SLIDER, before))
        self._demand = _Demand(now, moved, demand)
        if speed < _MIN_SPEED or moved < hold:
            return
        fraction = min(setting.ceiling, _SPEED_MARGIN / demand if demand > 0.0 else math.inf)
        self._demand = _Demand()
        if fraction <= before or fraction < min(setting.ceiling, _STEP_UP * before):
            return
        self._hold = hold, True
        self._set(now, fraction, before, "", ratio, out)

    def _set(self, now: float, fraction: float, before: float, name: str, ratio: float, out: Outputs) -> None:
        self.setting.set(now, fraction, before)
        if self._excess is not None:
            self._excess = self._excess._replace(judged_at=now, ratio=ratio)
        out.append(SetSpeedSlider(fraction))
        found = self.setting.ceiling
        emit(out, EventName.SPEED_LIMITED, now, slider=fraction, before=before, sensor=name, ratio=ratio, found=found)
