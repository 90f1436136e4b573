"""Integrator of a contact: Taylor series between events that are located on them.

The equations of ``two_mass_contact`` are polynomials between events: contact, bottoming out, closing of the layers, the
beginning and the end of braking, separation. There the Taylor coefficients follow from each other by products of
series, so that a step of order 18 costs little more than a dozen evaluations, and an event is a root of a polynomial
that is there already. No step is ever repeated, and none has to creep across a kink. Where the arm stands and the
vibration has died away the rest is its equilibrium.

Source of the step's length: Jorba and Zou, "A software package for the numerical integration of ODEs by means of
high-order Taylor methods", Experimental Mathematics 14 (2005).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import mul

from .contact_course import ContactCourse, Stretch
from .polynomial import evaluate, first_fall, greatest
from .two_mass_contact import TwoMassContact

__all__ = ["HORIZON", "integrate"]

#: s after which a contact is no transient one any more; ISO/TS 15066, 5.5.5.3
HORIZON = 0.5
_ORDER = 18
_TOLERANCE = 1e-14  # of the last coefficients of a step, relative to the largest
_MAX_STEPS = 2_000_000
_SETTLED = 1e-11  # of the force at rest, below which a vibration is over
_SETTLED_COARSE = 1e-4  # the same, where only peak and rest are asked for
_FREE, _SOFT, _HARD, _RELEASED = range(4)  #: apart; padding; bottomed out; receding faster than the padding follows


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
        self.arm_mobility = 0.0 if math.isinf(arm.mass) else 1.0 / arm.mass
        self.body_mobility = 0.0 if math.isinf(body.mass) else 1.0 / body.mass
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

    # one step

    def _series(self) -> tuple[list[float], list[float], list[float], list[float], list[float]]:
        """Return the Taylor coefficients of compression, rate, place, speed and force."""
        arm, body, law = self.model.arm, self.model.body, self.law
        m1, m2, k2, c2 = self.arm_mobility, self.body_mobility, body.support, body.damping
        k1, c1, loss = arm.stiffness, arm.damping, law.loss
        s, w, x, v = [self.s], [self.w], [self.x], [self.v]
        way = (self.way, self.drive, -0.5 * self.braking)
        drive = (self.drive, -self.braking)
        touching = self.mode in (_SOFT, _HARD)
        slope = law.soft if self.mode == _SOFT else law.hard
        e = [law.soft * self.s if self.mode == _SOFT else law.end_force + law.hard * (self.s - law.end)]
        f: list[float] = []
        for n in range(_ORDER):
            if touching:
                if n:
                    e.append(slope * s[n])
                f.append(e[n] + loss * sum(map(mul, e, reversed(w))) if loss else e[n])
            else:
                f.append(0.0)
            if m1:
                p_n, d_n = way[n] if n < 3 else 0.0, drive[n] if n < 2 else 0.0
                a1 = m1 * (k1 * (p_n - s[n] - x[n]) + c1 * (d_n - w[n] - v[n]) - f[n])
            else:
                a1 = -self.braking if n == 0 else 0.0
            a2 = m2 * (f[n] - k2 * x[n] - c2 * v[n]) if m2 else 0.0
            s.append(w[n] / (n + 1))
            x.append(v[n] / (n + 1))
            w.append((a1 - a2) / (n + 1))
            v.append(a2 / (n + 1))
        return s, w, x, v, f

    def _length(self, s: Sequence[float], w: Sequence[float], x: Sequence[float], v: Sequence[float]) -> float:
        """Return the length of a step [s]: until the last two terms would count."""
        longest = math.inf
        for series in (s, w, x, v):
            scale = max(abs(series[0]), abs(series[1]) * 1e-9, 1e-12)
            for power in (_ORDER, _ORDER - 1):
                if last := abs(series[power]):
                    longest = min(longest, (_TOLERANCE * scale / last) ** (1.0 / power))
        return longest

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
        s, w, x, v, f = self._series()
        end = min(t for t in (self.horizon, self.braked, self.stands) if t > self.time)
        room = end - self.time
        h = min(self._length(s, w, x, v), room)
        event = ""
        for name, series, sign in self._bounds(s, w, f):
            at = first_fall([sign * c for c in series], h)
            if at is not None and (at < h or not event):
                h, event = at, name
        if h >= room:
            h = room
        self._note(s, f, h)
        if self.keep:
            self.stretches.append(Stretch(self.time, h, tuple(s), tuple(w), tuple(x), tuple(v), tuple(f)))
        self.s, self.w, self.x, self.v = evaluate(s, h), evaluate(w, h), evaluate(x, h), evaluate(v, h)
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
