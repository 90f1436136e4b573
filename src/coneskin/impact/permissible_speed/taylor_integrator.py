"""Integrator of a contact: Taylor series between events that are located on them.

The equations of ``two_mass_contact`` are polynomials between events: contact, bottoming out, closing of the layers, the
beginning and the end of braking, separation. There the Taylor coefficients follow from each other by products of
series, so that a step of order 18 costs little more than a dozen evaluations, and an event is a root of a polynomial
that is there already. No step of it is ever repeated, and none has to creep across a kink.

Where friction has had the time to end the fastest motion, as that of a body of grams that stays pressed, an implicit
step is tried (``collocation``), which is a polynomial, too, and events are located on it in the same way. Where the arm
stands and the vibration has died away the rest is its equilibrium.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .collocation import POINTS, collocate
from .contact_course import ContactCourse, Stretch
from .contact_state import ContactState
from .polynomial import evaluate, first_fall, greatest
from .taylor_series import expand, reach
from .two_mass_contact import TwoMassContact

__all__ = ["HORIZON", "integrate"]

#: s after which a contact is no transient one any more; ISO/TS 15066, 5.5.5.3
HORIZON = 0.5
_TAIL = 1e-9  # of the last term of an implicit step, relative to the largest
_GAIN = 12.0  # times as long as one of the series an implicit step must be: so much more it costs
_FADED = 20.0  # the fastest motion is over when it has fallen by this exponent
_PATIENCE = 24  # steps without an event before an implicit one is tried
_MAX_STEPS = 2_000_000
_SETTLED = 1e-11  # of the force at rest, below which a vibration is over
_SETTLED_COARSE = 1e-4  # the same, where only peak and rest are asked for
_FREE, _SOFT, _HARD, _RELEASED = range(4)  #: apart; padding; bottomed out; receding faster than the padding follows

_Step = tuple[Sequence[Sequence[float]], float, tuple[float, float, float, float] | None]


def integrate(
    model: TwoMassContact, horizon: float = HORIZON, *, keep: bool = True, stop_above: float = math.inf
) -> ContactCourse:
    """Return the course of a contact from the first touch on.

    Args:
        model: of the contact.
        horizon: until when [s].
        keep: False to keep no stretches, only what is read off them.
        stop_above: peak force at which to look no further [N].

    Raises:
        ArithmeticError: the values are so far apart that two million steps do not reach the horizon.
    """
    return _Integration(model, horizon, keep, stop_above).run()


class _Integration:
    """State of one integration."""

    def __init__(self, model: TwoMassContact, horizon: float, keep: bool, stop_above: float) -> None:
        self.model, self.horizon, self.keep, self.stop_above = model, horizon, keep, stop_above
        arm, body, law = model.arm, model.body, model.law
        self.arm_mobility, self.body_mobility = 1.0 / arm.mass, 1.0 / body.mass  # 0 of an infinite mass
        self.law = law
        self.time = 0.0
        self.s, self.w, self.x, self.v = 0.0, arm.speed, 0.0, 0.0
        self.way, self.drive, self.braking = 0.0, arm.speed, 0.0  # p, p', -p''
        self.mode = _SOFT if arm.speed > 0.0 else _FREE
        self.closed, self.braked, self.stands = math.inf, math.inf, math.inf
        if model.closing_force == 0.0:
            self._close()
        self.peak = self.peak_time = self.deepest = self.impulse = self.last = 0.0
        self.stretches: list[Stretch] = []
        self.pace = self.faded = self.ahead = 0.0
        self.calm, self.patience = 0, _PATIENCE

    # one step

    def _state(self) -> ContactState:
        """Return the state; without contact no force and no slope of it."""
        law = self.law
        elastic, slope = 0.0, 0.0
        if self.mode == _SOFT:
            elastic, slope = law.soft * self.s, law.soft
        elif self.mode == _HARD:
            elastic, slope = law.end_force + law.hard * (self.s - law.end), law.hard
        return ContactState(self.s, self.w, self.x, self.v, self.way, self.drive, self.braking, elastic, slope)

    def _by_series(self, room: float) -> _Step:
        """Return the step of the Taylor series."""
        start = self._state()
        series = expand(self.model, start)
        self.pace = reach(series)
        h = min(self.pace, room)
        self.calm += 1
        self.faded += 0.5 * h * self._friction(start.elastic)
        return series, h, None

    def _friction(self, elastic: float) -> float:
        """Return the rate at which the fastest motion loses speed [1/s]."""
        pad, arm, body = self.law.loss * elastic, self.model.arm, self.model.body
        return (arm.damping + pad) / arm.mass + (body.damping + pad) / body.mass

    def _by_collocation(self, room: float) -> _Step | None:
        """Return a step of many times the length, where the fastest motion has died away; None where it has not."""
        if self.mode not in (_SOFT, _HARD) or (not self.ahead and (self.calm < self.patience or self.faded < _FADED)):
            return None
        start = self._state()
        tried = self.ahead or _GAIN * self.pace  # shorter ones cost more than the series
        while (h := min(tried, room)) >= _GAIN * self.pace:
            found = collocate(self.model, start, h)
            better = 0.85 * h * (_TAIL / max(found.tail, 1e-30)) ** (1.0 / POINTS) if found else 0.1 * h
            if found and found.tail <= _TAIL:
                self.ahead = max(min(better, 4.0 * h), h if h < tried else 0.0)
                return found.series, h, found.end
            tried = min(better, 0.5 * h)
        if self.pace < room:
            self.ahead, self.calm, self.patience = 0.0, 0, 2 * self.patience
        return None

    def _bounds(
        self, s: Sequence[float], w: Sequence[float], f: Sequence[float]
    ) -> list[tuple[str, Sequence[float], float]]:
        """Return what ends the mode: a name, a series, and the factor with which it falls below 0."""
        law = self.law
        if self.mode == _FREE:
            return [("touch", _shifted(s, 0.0), -1.0)]
        found: list[tuple[str, Sequence[float], float]] = []
        if self.mode == _SOFT:
            found += [("part", s, 1.0), ("bottom", _shifted(s, -law.end), -1.0)]
        elif self.mode == _HARD:
            found.append(("rise", _shifted(s, -law.end), 1.0))
        else:
            found += [("part", s, 1.0), ("follow", _shifted(w, 1.0 / law.loss), -1.0)]
        if law.loss and self.mode != _RELEASED:
            found.append(("release", _shifted(w, 1.0 / law.loss), 1.0))
        if math.isinf(self.closed):
            found.append(("close", _shifted(f, -self.model.closing_force), -1.0))
        return found

    def run(self) -> ContactCourse:
        steps = 0
        while self.time < self.horizon and self.peak <= self.stop_above:
            if self._settled():
                break
            if (steps := steps + 1) > _MAX_STEPS:
                raise ArithmeticError(f"{_MAX_STEPS} steps end at {self.time:g} s of {self.horizon:g} s")
            self._step()
        return self._outcome()

    def _step(self) -> None:
        end = min(t for t in (self.horizon, self.braked, self.stands) if t > self.time)
        room = end - self.time
        series, h, after = self._by_collocation(room) or self._by_series(room)
        s, w, x, v, f = series
        event = ""
        for name, bound, sign in self._bounds(s, w, f):
            at = first_fall([sign * c for c in bound], h)
            if at is not None and (at < h or not event):
                h, event = at, name
        if event:
            after, self.calm, self.faded, self.patience, self.ahead = None, 0, 0.0, _PATIENCE, 0.0
        self._note(s, f, h)
        if self.keep:
            self.stretches.append(Stretch(self.time, h, tuple(s), tuple(w), tuple(x), tuple(v), tuple(f)))
        self.s, self.w, self.x, self.v = after or (evaluate(s, h), evaluate(w, h), evaluate(x, h), evaluate(v, h))
        self.last = max(0.0, evaluate(f, h))
        self.way += h * (self.drive - 0.5 * self.braking * h)
        self.drive -= self.braking * h
        self.time = end if h == room else self.time + h
        self._switch(event)
        if self.time == self.stands:
            self.drive = self.braking = 0.0
            self.stands = math.inf
            if not self.arm_mobility:
                self.w = -self.v
        elif self.time == self.braked and self.drive > 0.0:
            self.braking = self.model.arm.deceleration
            self.stands = self.time + self.drive / self.braking

    def _switch(self, event: str) -> None:
        """Go into the mode that follows on an event, exactly at its bound."""
        law = self.law
        if event in ("touch", "part"):
            self.s = 0.0
            self.mode = _SOFT if event == "touch" else _FREE
            if event == "touch" and law.loss and 1.0 + law.loss * self.w <= 0.0:
                self.mode = _RELEASED
        elif event in ("bottom", "rise"):
            self.s = law.end
            self.mode = _HARD if event == "bottom" else _SOFT
        elif event == "release":
            self.mode = _RELEASED
        elif event == "follow":
            self.mode = _SOFT if self.s <= law.end else _HARD
        elif event == "close":
            self._close()

    def _close(self) -> None:
        """Start the reaction's clock."""
        self.closed = self.time
        self.braked = self.time + self.model.arm.reaction
        if self.braked == self.time:
            self.braking = self.model.arm.deceleration
            self.stands = self.time + self.drive / self.braking

    def _note(self, s: Sequence[float], f: Sequence[float], h: float) -> None:
        at, force = greatest(f, h)
        if force > self.peak:
            self.peak, self.peak_time = force, self.time + at
        self.deepest = max(self.deepest, greatest(s, h)[1])
        self.impulse += h * evaluate([c / (n + 1) for n, c in enumerate(f)], h)

    # the end

    def _settled(self) -> bool:
        """Tell whether nothing is left but the equilibrium: the arm stands, and so little moves that no force shows."""
        if self.drive > 0.0 or self.mode not in (_SOFT, _HARD):
            return False
        force, s = self.model.static(self.way)
        law, arm, body = self.law, self.model.arm, self.model.body
        if force <= 0.0 or (s > law.end) != (self.mode == _HARD):
            return False
        slope = law.hard if self.mode == _HARD else law.soft
        off, x = self.s - s, (force / body.support if body.support and self.body_mobility else 0.0)
        energy = 0.5 * slope * off * off
        if self.arm_mobility:
            lag = self.way - self.s - self.x - (self.way - s - x)
            energy += 0.5 * arm.stiffness * lag * lag + 0.5 * (self.w + self.v) ** 2 / self.arm_mobility
        if self.body_mobility:
            energy += 0.5 * body.support * (self.x - x) ** 2 + 0.5 * self.v**2 / self.body_mobility
        if math.sqrt(2.0 * energy * slope) > (_SETTLED if self.keep else _SETTLED_COARSE) * force:
            return False
        self.impulse += force * (self.horizon - self.time)
        if self.keep:
            left = self.horizon - self.time
            self.stretches.append(Stretch(self.time, left, (s,), (0.0,), (x,), (0.0,), (force,)))
        self.last, self.time = force, self.horizon
        return True

    def _outcome(self) -> ContactCourse:
        arm = self.model.arm
        distance = math.inf if arm.speed > 0.0 else 0.0
        braking = arm.speed * arm.reaction + arm.speed**2 / (2.0 * arm.deceleration)
        if self.drive == 0.0:
            distance = self.way
        elif math.isfinite(self.braked):
            before = max(0.0, self.braked - self.time) * self.drive
            distance = self.way + before + self.drive**2 / (2.0 * arm.deceleration)
        elif math.isfinite(self.model.way_to_close):  # so slow a contact closes the layers later, as if at rest
            distance = self.model.way_to_close + braking
        rest = self.model.static(distance)[0]
        return ContactCourse(
            peak=self.peak,
            peak_time=self.peak_time,
            deepest=self.deepest,
            last=self.last,
            rest=rest,
            impulse=self.impulse,
            closed=self.closed,
            braked=self.braked,
            stopping_distance=distance,
            end=self.time,
            stretches=tuple(self.stretches),
        )


def _shifted(series: Sequence[float], by: float) -> list[float]:
    return [series[0] + by, *series[1:]]
