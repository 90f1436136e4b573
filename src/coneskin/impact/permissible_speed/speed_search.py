"""Search for the permissible speed: the highest at which a contact keeps the limits of whoever is struck."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .taylor_integrator import integrate
from .two_mass_contact import TwoMassContact

__all__ = ["LEAST_SPEED", "TOP_SPEED", "ForceLimits", "keeps", "permissible_speed"]

#: m/s; no faster speed is looked at
TOP_SPEED = 5.0
#: m/s; below, no speed counts as permissible
LEAST_SPEED = 1e-3
_SPEED_TOLERANCE = 4e-3  # of the speed that is found


@dataclass(frozen=True, slots=True)
class ForceLimits:
    """Limits of the force on a body.

    Attributes:
        transient: of the peak within the first 0.5 s [N].
        lasting: of what is left then, and at rest [N].
    """

    transient: float
    lasting: float


def keeps(model: TwoMassContact, limits: ForceLimits) -> bool:
    """Tell whether a contact keeps limits."""
    distance = _stopping_distance(model)
    if model.static(distance)[0] > limits.lasting:
        return False  # known without a look at the course
    course = integrate(model, keep=False, stop_above=limits.transient)
    return course.peak <= limits.transient and max(course.last, course.rest) <= limits.lasting


def permissible_speed(
    at_speed: Callable[[float], Sequence[TwoMassContact]],
    limits: ForceLimits,
    least: float = LEAST_SPEED,
    top: float = TOP_SPEED,
) -> float:
    """Return the highest speed up to which contacts keep limits [m/s]; 0 where none of 1 mm/s or more does.

    Force grows with speed; so it is searched by halving, and what is returned was looked at and keeps them.

    Args:
        at_speed: makes the contacts at a speed [m/s], all of which must keep them.
        limits: to be kept.
        least: speed from which to look on [m/s]; where it does not keep them, from the lowest on.
        top: highest speed to look at [m/s].
    """

    def all_keep(speed: float) -> bool:
        return all(keeps(contact, limits) for contact in at_speed(speed))

    if all_keep(top):
        return top
    low, high = least, top
    if not all_keep(low):
        low, high = LEAST_SPEED, least
        if low == high or not all_keep(low):
            return 0.0
    while high > low * (1.0 + _SPEED_TOLERANCE):
        middle = math.sqrt(low * high)
        if all_keep(middle):
            low = middle
        else:
            high = middle
    return low


def _stopping_distance(model: TwoMassContact) -> float:
    """Return a lower bound of the way that the arm is driven into the body [m]: without the time to the closing."""
    arm = model.arm
    if math.isinf(arm.reaction):
        return 0.0
    return arm.speed * arm.reaction + arm.speed**2 / (2.0 * arm.deceleration)
