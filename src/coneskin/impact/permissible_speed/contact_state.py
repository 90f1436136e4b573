"""State in which a step of the integrator begins."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["ContactState"]


@dataclass(frozen=True, slots=True)
class ContactState:
    """State of a contact, in one of the straight pieces of its force.

    Attributes:
        s: compression [m].
        w: its rate [m/s].
        x: place of the body [m].
        v: speed of the body [m/s].
        way: of the controller's surface [m].
        drive: its speed [m/s].
        braking: its deceleration [m/s^2].
        elastic: force of the compression at rest [N].
        slope: of that force over the compression [N/m].
    """

    s: float
    w: float
    x: float
    v: float
    way: float
    drive: float
    braking: float
    elastic: float
    slope: float
