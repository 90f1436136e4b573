"""Implicit step of a contact: collocation at Radau points, for where its fastest motion has died away.

A light body that a heavy arm presses swings or creeps within microseconds, and from then on follows the arm. A Taylor
series still has to step at its pace; this one does not: it is L-stable, and as long as the slow rest is smooth. The
equations are quadratic, so that Newton's method needs two or three turns.

Source of the method: Hairer and Wanner, "Solving Ordinary Differential Equations II", section IV.5 (Radau IIA).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from .contact_state import ContactState
    from .two_mass_contact import TwoMassContact

__all__ = ["POINTS", "Collocation", "collocate"]

#: of a step; its order is 2 POINTS - 1
POINTS = 8
_MAX_TURNS = 8
_LEAST = 1e-12  # m
_CONVERGED = 1e-10  # a change of this share of compression or place leaves its square of an error


@dataclass(frozen=True, slots=True)
class Collocation:
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


def collocate(model: TwoMassContact, start: ContactState, length: float) -> Collocation | None:
    """Return the step of a length [s], in contact throughout; None where Newton's method finds none.

    Args:
        model: of the contact.
        start: state at the beginning, with padding and body touching.
        length: of the step [s].
    """
    import numpy as np

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
        size = max(_LEAST, abs(start.s), float(np.abs(start.x + dx).max()))
        if length * float(np.abs(change).max()) <= _CONVERGED * size:
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
    return Collocation(series, (start.s + float(ds[-1]), float(w[-1]), start.x + float(dx[-1]), float(v[-1])), tail)


@cache
def _rule() -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Return points in (0, 1], matrix of integrals up to them, and what gives powers and last term of gains there."""
    import numpy as np
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
