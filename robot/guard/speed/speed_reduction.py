"""Speed reduction: the reaction that lowers the controller's speed slider while the skin is touched. Pure.

The slider slows whatever moves the arm, except a stream of servo setpoints. So its value alone is not trusted: the
measured speed of the touched surface has to fall, or to be low anyway, within the budget of a stop, and to stay so.
What moves into the touch is stopped, at once where it is fast (``contact_supervision``). So is an arm whose motors
show that something holds it while its setpoints go on (``joint_current``). A person who moves the slider meanwhile has
priority: the guard does not put it back.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.values import ControllerState, SetSpeedSlider, StopPath
from coneskin.robot.guard.signals.journal import EventName, Outputs, emit
from coneskin.robot.reaction.types import ContactOnLink, Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.stop_monitor import STANDSTILL_SAMPLES

if TYPE_CHECKING:  # a scene without a slow reaction does not load it
    from coneskin.robot.guard.signals.joint_current import OutsideTorque, ResistanceMonitor
    from coneskin.robot.reaction.contact_supervision import ContactApproach

CLEAR_TIME = 0.5  #: s without a touch after which the arm goes on at the speed it had
_MAX_SPEED_RATIO = 0.9  # ratio; speed after the reduction to speed at the touch
_SLIDER_TOLERANCE = 0.02  # ratio; allowed difference of the slider from its setting
_MAX_SLIDER_AGE = 0.5  # s, or as long as the controller may be silent; it is read 50 times a second


class _ReducedSpeedTouch:
    """One touch during which the arm is slow. No dataclass: compiled, that would load the classes of its fields."""

    def __init__(
        self,
        top: list[float],
        slider: tuple[float, float],
        times: tuple[float, float],
        slow: float,
        approach: ContactApproach,
        torque: OutsideTorque,
        resistance: ResistanceMonitor,
    ) -> None:
        #: largest speeds of the touched surface around it [m/s]: where its place was not certain, so that it was
        #: a bound, and where it was
        self.top = top
        self.before, self.fraction = slider  # where the slider was, and where it is to be
        self.deadline, self.end = times  # by when the arm must be slower, until when the touch may last [s]
        self.slow = slow  # speed of the surface below which the arm counts as slow [m/s]
        self.approach, self.torque, self.resistance = approach, torque, resistance
        self.held = ""  # why the arm counts as held by something
        self.free_since: float | None = None
        self.newest = -math.inf  # when the newest sample was measured [s]
        self.fast = 0  # samples in a row

    def sample(self, time: float, speed: float, certain: bool = True) -> None:
        """Take the speed of the touched surface as measured at a time [s, m/s]. ``certain`` where it is no bound."""
        top, self.newest = self.top, time
        if time < self.deadline and speed > top[certain]:
            top[certain] = speed  # it may still have been speeding up
        self.fast = self.fast + 1 if speed > max(_MAX_SPEED_RATIO * top[certain], self.slow) else 0

    def touched(self, now: float, touched: bool) -> None:
        """Say whether anything touches."""
        if touched:
            self.free_since = None
        elif self.free_since is None:
            self.free_since = now

    def trouble(self, now: float, slider: float | None) -> str:
        """Return why the arm has to be stopped after all, by where the slider is. Empty where it has not."""
        if self.newest >= self.deadline and self.fast >= STANDSTILL_SAMPLES:  # late states show what was, not what is
            return "the arm did not become slower"
        if self.free_since is not None:
            return ""
        if now >= self.deadline and slider is not None and slider > self.fraction + _SLIDER_TOLERANCE:
            return f"the speed slider is at {slider:.0%} again while the skin is touched"
        return "the touch lasts too long" if now >= self.end else ""

    def puts_back(self, slider: float | None) -> bool:
        """Tell whether the slider is where it was set, or not yet seen there, so that no person has moved it since."""
        if slider is None:
            return False
        return min(abs(slider - self.fraction), abs(slider - self.before)) <= _SLIDER_TOLERANCE

    def over(self, now: float) -> bool:
        """Tell whether the arm may go on as before."""
        return self.free_since is not None and now - self.free_since >= CLEAR_TIME


class SpeedReduction:
    """Reaction "slow" of one arm: it lowers the speed slider, monitors the effect and puts it back.

    Args:
        used: True where a reaction of the scene slows the arm.
        silence: longest time for which the controller may be silent [s].

    Attributes:
        slider: where the controller's speed slider was last. None where that is not known.
        now: the touch that is under way, or None.
    """

    def __init__(self, model: ArmModel, used: bool, silence: float) -> None:
        self._model = model
        self._max_age = max(_MAX_SLIDER_AGE, silence)
        if used:  # here, so that no touch waits for it
            from coneskin.robot.guard.signals.joint_current import OutsideTorque, ResistanceMonitor
            from coneskin.robot.reaction.contact_supervision import ContactApproach

            self._approach_of, self._torque_of, self._monitor_of = ContactApproach, OutsideTorque, ResistanceMonitor
            # at any speed and acceleration: none was learned
            self._tolerance = None if model.currents is None else model.currents.max_unexplained
        self.slider: float | None = None
        self._read_at = -math.inf
        self.now: _ReducedSpeedTouch | None = None
        self._last: tuple[float, _ReducedSpeedTouch] | None = None  # when it was over, and what
        self._halted_from: float | None = None  # where the slider was before a stop put it to 0

    def feed(self, time: float, slider: float | None) -> None:
        """Take where the slider is, as read at a time [s]. None where it cannot be read any more."""
        self.slider, self._read_at = slider, time

    def known(self, time: float) -> float | None:
        """Return the position of the slider. None where it is not known at a time [s]."""
        return self.slider if time - self._read_at <= self._max_age else None

    def begin(
        self,
        time: float,
        state: ControllerState | None,
        reaction: Reaction,
        limits: MonitoringLimits,
        contacts: Sequence[ContactOnLink],
        out: Outputs,
    ) -> bool:
        """Reduce the speed. Return False where the arm has to be stopped instead.

        That is where it moves into the touch too fast, or where the position of the slider, or the state of the arm, is
        not known. The arm has the time of a stop to become slower.

        Args:
            time: host time [s].
            state: of the arm, the newest.
            reaction: its kind is "slow".
        """
        before, top = self.known(time), [0.0, 0.0]
        if before is None or state is None:
            return False
        approach = self._approach_of(self._model, state.q, state.qd, reaction.deceleration, reaction.press)
        approach.update(state.q, state.qd, contacts)
        if approach.exceeded[0]:
            return False
        if self._last is not None and time - self._last[0] < CLEAR_TIME:  # slider and speed may not yet be as before
            last = self._last[1]
            top = list(last.top)
            if last.puts_back(before):  # else a person has moved it since
                before = last.before
        times = time + limits.stop_budget(state.speed, reaction.deceleration), time + reaction.time_budget
        slider = before, min(before, reaction.slow_to)
        torque = self._torque_of(self._model)
        resistance = self._monitor_of(self._model, torque, True, self._tolerance)
        self.now = _ReducedSpeedTouch(top, slider, times, reaction.slow_speed, approach, torque, resistance)
        out.append(SetSpeedSlider(self.now.fraction))
        emit(out, EventName.SPEED_REDUCED, time, slider=self.now.fraction, before=before)
        return True

    def sample(self, state: ControllerState, measured_at: float, contacts: Sequence[ContactOnLink]) -> None:
        """Take a state, when it was measured [s], and the touches there are by their newest frames."""
        if (touch := self.now) is None:
            return
        touch.approach.update(state.q, state.qd, contacts)
        touch.sample(measured_at, *touch.approach.speed)
        if contacts and not touch.held:
            touch.torque.feed(state, False)
            if touch.torque.now is not None:
                touch.held = touch.resistance.resistance(state.q, contacts)

    def poll(self, time: float, fair: float, touched: bool) -> str:
        """Return why the arm has to be stopped after all, as `ArmSupervisor.poll` says. Empty where it has not."""
        if (touch := self.now) is None:
            return ""
        touch.touched(time, touched)
        if touch.approach.exceeded[0]:
            return f"while slow, the surface would move {1e3 * touch.approach.exceeded[1]:.1f} mm into the touch"
        if touch.held:
            return f"while slow, {touch.held}"
        if self.known(fair) is None:
            return "the controller does not report its speed slider any more"
        return touch.trouble(time, self.slider)

    def put_back(self, time: float, out: Outputs) -> None:
        """End it: put the slider back where it was, unless a stop needs it at 0 or a person was seen to move it."""
        touch, self.now = self.now, None
        if touch is not None and self._halted_from is None and touch.puts_back(self.slider):
            out.append(SetSpeedSlider(touch.before))
            self.slider, self._last = touch.before, (time, touch)

    def note_stop(self, used: Collection[StopPath]) -> None:
        """Take the paths of a stop. Where the slider was, which one of them puts to 0, is kept until ``release``."""
        if StopPath.SLIDER not in used:
            return
        before = self.slider if self.now is None else self.now.before
        if self._halted_from is None and before is not None and before > _SLIDER_TOLERANCE:
            self._halted_from = before

    @property
    def halted(self) -> bool:
        """True where a stop has put the slider to 0, and it is still there."""
        return self._halted_from is not None and self.slider is not None and self.slider <= _SLIDER_TOLERANCE

    def release(self, out: Outputs) -> None:
        """Put a slider that a stop has put to 0 back where it was, unless a person has moved it since."""
        halted, before, self._halted_from = self.halted, self._halted_from, None
        if before is not None and halted:
            out.append(SetSpeedSlider(before))
            self.slider = before
