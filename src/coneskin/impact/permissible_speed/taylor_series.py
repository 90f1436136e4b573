"""Taylor series of a contact, and how far they reach.

Between events the equations are polynomials, so that the coefficients follow from each other by products of series.

Source of the length: Jorba and Zou, "A software package for the numerical integration of ODEs by means of high-order
Taylor methods", Experimental Mathematics 14 (2005).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import mul
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .contact_state import ContactState
    from .two_mass_contact import TwoMassContact

__all__ = ["expand", "reach"]

_ORDER = 18
_TOLERANCE = 1e-14  # of the last coefficients of a step, relative to the largest


def expand(model: TwoMassContact, start: ContactState) -> tuple[list[float], ...]:
    """Return the coefficients of compression [m], rate [m/s], place [m], speed [m/s] and force [N], lowest power first.

    Args:
        model: of the contact.
        start: state around which they are taken; without a slope of the force there is no contact.
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
            a1 = -start.braking if n == 0 else 0.0
        a2 = m2 * (f[n] - k2 * x[n] - c2 * v[n]) if m2 else 0.0
        s.append(w[n] / (n + 1))
        x.append(v[n] / (n + 1))
        w.append((a1 - a2) / (n + 1))
        v.append(a2 / (n + 1))
    return s, w, x, v, f


def reach(series: Sequence[Sequence[float]]) -> float:
    """Return how far series reach [s]: until the last two terms of the first four would count."""
    longest = math.inf
    for terms in series[:4]:
        scale = max(abs(terms[0]), abs(terms[1]) * 1e-9, 1e-12)
        for power in (_ORDER, _ORDER - 1):
            if last := abs(terms[power]):
                longest = min(longest, (_TOLERANCE * scale / last) ** (1.0 / power))
    return longest
