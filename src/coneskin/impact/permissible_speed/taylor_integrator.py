"""Integrator of a contact: Taylor series between events that are located on them.

The equations of ``two_mass_contact`` are polynomials between events: contact, the ends of the straight pieces of the
force, closing of the layers, the beginning and the end of braking, separation. There the Taylor coefficients follow
from each other by products of series, so that a step of order 18 costs little more than a dozen evaluations, and an
event is a root of a polynomial that is there already. No step of it is ever repeated, and none has to creep across a
kink.

A light body that a heavy arm presses swings or creeps within microseconds, and from then on follows the arm. Once
friction has ended that motion, an implicit step is tried: collocation at Radau points. It is L-stable, as long as the
slow rest is smooth, and a polynomial too, so events are located on it in the same way. Once the arm stands and the
vibration has died away, the rest is the equilibrium.

Sources: length of the Taylor steps, Jorba and Zou, "A software package for the numerical integration of ODEs by means
of high-order Taylor methods", Experimental Mathematics 14 (2005); implicit step, Hairer and Wanner, "Solving Ordinary
Differential Equations II", section IV.5 (Radau IIA).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .contact_course import ContactCourse, ContactState, Stretch, evaluate, first_fall, greatest
from .two_mass_contact import TwoMassContact

_SERIES_ORDER = 18
_SERIES_SHARE = 0.1  # of the tolerance, for the last coefficients of a step over the largest


def expand(model: TwoMassContact, start: ContactState) -> tuple[list[float], ...]:
    """Return the coefficients of compression [m], rate [m/s], place [m], speed [m/s] and force [N], lowest power first.

    They are taken around a state; without a slope of the force there is no contact in it.
    """
    arm, body = model.arm, model.body
    m1, m2, k2, c2 = 1.0 / arm.mass, 1.0 / body.mass, body.support, body.damping  # 0 of an infinite mass
    k1, c1, loss = arm.stiffness, arm.damping, model.law.loss
    s, w, x, v = [start.s], [start.w], [start.x], [start.v]
    way = (start.way, start.drive, -0.5 * start.braking)
    drive = (start.drive, -start.braking)
    touching, slope = start.slope > 0.0, start.slope
    e = [start.elastic]
    f: list[float] = []
    for n in range(_SERIES_ORDER):
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
            a1 = -start.braking if n == 0 else 0.0
        a2 = m2 * (f[n] - k2 * x[n] - c2 * v[n]) if m2 else 0.0
        s.append(w[n] / (n + 1))
        x.append(v[n] / (n + 1))
        w.append((a1 - a2) / (n + 1))
        v.append(a2 / (n + 1))
    return s, w, x, v, f


def reach(series: Sequence[Sequence[float]], tolerance: float) -> float:
    """Return how far series reach [s]: until the last two terms of the first four would count."""
    longest = math.inf
    for terms in series[:4]:
        scale = max(abs(terms[0]), abs(terms[1]) * 1e-9, 1e-12)
        for power in (_SERIES_ORDER, _SERIES_ORDER - 1):
            if last := abs(terms[power]):
                longest = min(longest, (_SERIES_SHARE * tolerance * scale / last) ** (1.0 / power))
    return longest


#: of a step; its order is 2 POINTS - 1
POINTS = 8
_MAX_TURNS = 8
_MIN_LENGTH = 1e-12  # m
_NEWTON_TOLERANCE = 1e-10  # a change of this share of compression or place leaves its square of an error


@dataclass(frozen=True, slots=True)
class _Collocation:
    """Step that was found.

    Attributes:
        series: polynomials of compression, rate, place, speed and force in the time since the beginning, lowest power
            first.
        end: compression, rate, place and speed at its end.
        tail: size of the last term, relative to the largest compression, place or force.
    """

    series: tuple[list[float], ...]
    end: tuple[float, float, float, float]
    tail: float


def _collocate(model: TwoMassContact, start: ContactState, length: float) -> _Collocation | None:
    """Return the step of a length [s], in contact throughout; None where Newton's method finds none."""
    arm, body, loss = model.arm, model.body, model.law.loss
    m1, m2 = 1.0 / arm.mass, 1.0 / body.mass  # 0 of an infinite one
    times, integral, powers, legendre = _rule()
    times, ahead = times * length, integral * length
    one, n = np.eye(POINTS), POINTS
    way = start.way + times * (start.drive - 0.5 * start.braking * times) - start.s - start.x
    drive = start.drive - start.braking * times
    support = body.support * ahead + body.damping * one
    servo = arm.stiffness * ahead + arm.damping * one if m1 else 0.0 * one
    matrix = np.empty((2 * n, 2 * n))
    matrix[:n, n:] = ahead @ (m1 * servo - m2 * support)
    matrix[n:, n:] = one + ahead @ (m2 * support)
    w, v = np.full(n, start.w), np.full(n, start.v)
    for _ in range(_MAX_TURNS):
        ds, dx = ahead @ w, ahead @ v
        elastic, lossy = start.elastic + start.slope * ds, 1.0 + loss * w
        force = elastic * lossy
        a2 = m2 * (force - body.support * (start.x + dx) - body.damping * v)
        if m1:
            a1 = m1 * (arm.stiffness * (way - ds - dx) + arm.damping * (drive - w - v) - force)
        else:
            a1 = np.full(n, -start.braking)
        pressed = (start.slope * lossy)[:, None] * ahead + loss * elastic[:, None] * one  # force over rate
        pushed = ahead @ pressed
        matrix[:n, :n] = one + ahead @ (m1 * servo) + (m1 + m2) * pushed
        matrix[n:, :n] = -m2 * pushed
        miss = np.concatenate((start.w + ahead @ (a1 - a2) - w, start.v + ahead @ a2 - v))
        try:
            change = np.linalg.solve(matrix, miss)
        except np.linalg.LinAlgError:
            return None
        w, v = w + change[:n], v + change[n:]
        size = max(_MIN_LENGTH, abs(start.s), float(np.abs(start.x + dx).max()))
        if length * float(np.abs(change).max()) <= _NEWTON_TOLERANCE * size:
            break
    else:
        return None
    ds, dx = ahead @ w, ahead @ v
    force = (start.elastic + start.slope * ds) * (1.0 + loss * w)
    begins = np.array([start.s, start.w, start.x, start.v, start.elastic * (1.0 + loss * start.w)])
    gains = np.stack((ds, w - start.w, dx, v - start.v, force - begins[4]))
    sizes = np.array([size, size / length, size, size / length, float(np.abs(force).max())])
    tail = float(np.max(np.abs(gains @ legendre) / sizes))
    terms = gains @ powers / length ** np.arange(1.0, POINTS + 1.0)
    series = tuple([float(first), *row] for first, row in zip(begins, terms.tolist(), strict=True))
    return _Collocation(series, (start.s + float(ds[-1]), float(w[-1]), start.x + float(dx[-1]), float(v[-1])), tail)


@cache
def _rule() -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return points in (0, 1], matrix of integrals up to them, and what gives powers and last term of gains there."""
    from numpy.polynomial import legendre

    ends = np.zeros(POINTS + 1)
    ends[-2:] = -1.0, 1.0
    points = np.sort(legendre.legroots(ends).real)
    for _ in range(3):
        points -= legendre.legval(points, ends) / legendre.legval(points, legendre.legder(ends))
    points[-1] = 1.0
    basis = legendre.legvander(points, POINTS - 1)
    sums = np.stack([legendre.legval(points, legendre.legint(row, lbnd=-1.0)) for row in np.eye(POINTS)], axis=1)
    integral = 0.5 * np.linalg.solve(basis.T, sums.T).T
    times = 0.5 * (points + 1.0)
    powers = np.linalg.inv(times[:, None] ** np.arange(1, POINTS + 1)).T
    whole = np.linalg.inv(legendre.legvander(np.concatenate(([-1.0], points)), POINTS))
    for array in (times, integral, powers, whole):
        array.setflags(write=False)
    return times, integral, powers, whole[-1, 1:]


#: s after which a contact is no transient one any more; ISO/TS 15066, 5.5.5.3
HORIZON = 0.5
_MIN_TAIL = 1e-9  # of the last term of an implicit step, relative to the largest: less changes nothing
_MIN_GAIN = 12.0  # times as long as one of the series an implicit step must be: so much more it costs
_FADED_EXPONENT = 20.0  # the fastest motion is over when it has fallen by this exponent, or to the tolerance
_STEPS_TO_IMPLICIT = 6  # steps without an event before an implicit one is tried
_MAX_STEPS = 2_000_000
_SETTLED_SHARE = 1e-11  # of the force at rest, below which a vibration is over, or a tenth of the tolerance
_SETTLED_COARSE = 1e-4  # of the force at rest, where only peak and rest are asked for
_FREE, _RELEASED = -1, -2  # apart; receding faster than the padding follows; 0 and up: in that piece of the force

_Step = tuple[Sequence[Sequence[float]], float, tuple[float, float, float, float] | None]


def integrate(
    model: TwoMassContact,
    horizon: float = HORIZON,
    *,
    keep: bool = True,
    stop_above: float = math.inf,
    tolerance: float = 1e-6,
) -> ContactCourse:
    """Return the course of a contact from the first touch on.

    Args:
        horizon: until when [s].
        keep: False to keep no stretches, only what is read off them.
        stop_above: peak force at which to look no further [N].
        tolerance: of forces and ways, relative to the largest; limits are known to a tenth.

    Raises:
        ArithmeticError: the values are so far apart that two million steps do not reach the horizon.
    """
    return _Integration(model, horizon, keep, stop_above, tolerance).run()


class _Integration:
    def __init__(self, model: TwoMassContact, horizon: float, keep: bool, stop_above: float, tolerance: float) -> None:
        self.model, self.horizon, self.keep, self.stop_above = model, horizon, keep, stop_above
        self.tolerance, self.max_tail = tolerance, max(tolerance, _MIN_TAIL)
        self.faded_exponent = min(-math.log(tolerance), _FADED_EXPONENT)
        self.settled_share = max(_SETTLED_SHARE, 0.1 * tolerance) if keep else _SETTLED_COARSE
        arm, body, law = model.arm, model.body, model.law
        self.arm_mobility, self.body_mobility = 1.0 / arm.mass, 1.0 / body.mass  # 0 of an infinite mass
        self.law = law
        self.time = 0.0
        self.s, self.w, self.x, self.v = 0.0, arm.speed, 0.0, 0.0
        self.way, self.drive, self.braking = 0.0, arm.speed, 0.0  # p, p', -p''
        self.mode = 0 if arm.speed > 0.0 else _FREE
        self.closed, self.braked, self.stands = math.inf, math.inf, math.inf
        if model.closing_force == 0.0:
            self._close()
        self.peak = self.peak_time = self.deepest = self.impulse = self.last = 0.0
        self.stretches: list[Stretch] = []
        self.pace = self.faded = self.ahead = 0.0
        self.calm, self.patience = 0, _STEPS_TO_IMPLICIT

    # one step

    def _state(self) -> ContactState:
        """Return the state; without contact no force and no slope of it."""
        elastic, slope = 0.0, 0.0
        if self.mode >= 0:
            begin, force, slope = self.law.pieces[self.mode]
            elastic = force + slope * (self.s - begin)
        return ContactState(self.s, self.w, self.x, self.v, self.way, self.drive, self.braking, elastic, slope)

    def _by_series(self, room: float) -> _Step:
        start = self._state()
        series = expand(self.model, start)
        self.pace = reach(series, self.tolerance)
        h = min(self.pace, room)
        self.calm += 1
        pad, arm, body = self.law.loss * start.elastic, self.model.arm, self.model.body
        slowing = (arm.damping + pad) / arm.mass + (body.damping + pad) / body.mass  # of the fastest motion [1/s]
        self.faded += 0.5 * h * slowing
        return series, h, None

    def _by_collocation(self, room: float) -> _Step | None:
        """Return a step of many times the length, where the fastest motion has died away; None where it has not."""
        if self.mode < 0 or (not self.ahead and (self.calm < self.patience or self.faded < self.faded_exponent)):
            return None
        start = self._state()
        tried = self.ahead or _MIN_GAIN * self.pace  # shorter ones cost more than the series
        while (h := min(tried, room)) >= _MIN_GAIN * self.pace:
            found = _collocate(self.model, start, h)
            better = 0.85 * h * (self.max_tail / max(found.tail, 1e-30)) ** (1.0 / POINTS) if found else 0.1 * h
            if found and found.tail <= self.max_tail:
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
        if self.mode >= 0:
            found.append(("rise" if self.mode else "part", _shifted(s, -law.pieces[self.mode][0]), 1.0))
            if self.mode + 1 < len(law.pieces):
                found.append(("sink", _shifted(s, -law.pieces[self.mode + 1][0]), -1.0))
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
            after, self.calm, self.faded, self.patience, self.ahead = None, 0, 0.0, _STEPS_TO_IMPLICIT, 0.0
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
            self.mode = 0 if event == "touch" else _FREE
            if event == "touch" and law.loss and 1.0 + law.loss * self.w <= 0.0:
                self.mode = _RELEASED
        elif event in ("sink", "rise"):
            self.s = law.pieces[self.mode + (event == "sink")][0]
            self.mode += 1 if event == "sink" else -1
        elif event == "release":
            self.mode = _RELEASED
        elif event == "follow":
            self.mode = law.piece_at(self.s)
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
        if self.drive > 0.0 or self.mode < 0:
            return False
        force, s = self.model.static(self.way)
        law, arm, body = self.law, self.model.arm, self.model.body
        if force <= 0.0 or law.piece_at(s) != self.mode:
            return False
        slope = law.pieces[self.mode][2]
        off, x = self.s - s, (force / body.support if body.support and self.body_mobility else 0.0)
        energy = 0.5 * slope * off * off
        if self.arm_mobility:
            lag = self.way - self.s - self.x - (self.way - s - x)
            energy += 0.5 * arm.stiffness * lag * lag + 0.5 * (self.w + self.v) ** 2 / self.arm_mobility
        if self.body_mobility:
            energy += 0.5 * body.support * (self.x - x) ** 2 + 0.5 * self.v**2 / self.body_mobility
        if math.sqrt(2.0 * energy * slope) > self.settled_share * force:
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
        if self.drive == 0.0:
            distance = self.way
        elif math.isfinite(self.braked):
            before = max(0.0, self.braked - self.time) * self.drive
            distance = self.way + before + self.drive**2 / (2.0 * arm.deceleration)
        elif math.isfinite(self.model.way_to_close):  # so slow a contact closes the layers later, as if at rest
            distance = self.model.way_to_close + arm.stopping_way
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
