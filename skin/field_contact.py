"""From a force on the skin to the contact between its layers, and how that contact looks from the electrodes.

The foam under the upper layer is a standard linear solid: a part of its give comes at once, the rest with a relaxation
time. The layers meet when it has given as much as the threshold force (0.5 N in the paper) presses it in the end.
Beyond, a round body touches over a radius that grows with the cube root of the force (Hertz), and the conductance per
area grows with the pressure, as of any rough layer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coneskin.errors import FieldError

from .circuit import Contact, Matrix
from .field_disc import Disc, centre_distance
from .field_model import FieldModel
from .field_patch import Patch, solve_patch
from .field_shape import disc
from .field_sheet import SectorSheet

if TYPE_CHECKING:
    from .field_coupling import Coupling
    from .sensor import Sensor

__all__ = ["FieldContacts", "Foam", "Layers", "Touch", "settled"]


class Touch(NamedTuple):
    """A round contact between the layers.

    Attributes:
        radius: [m]; 0 where the layers do not touch.
        conductance: per area [S/m^2].
    """

    radius: float
    conductance: float

    @property
    def siemens(self) -> float:
        """Conductance of the whole contact, spreading in the sheets not included [S]."""
        return self.conductance * math.pi * self.radius * self.radius


@dataclass(frozen=True, slots=True)
class Foam:
    """A viscoelastic substrate, a standard linear solid.

    Attributes:
        relaxation_time: of the delayed part at constant force [s].
        delayed: part of the final give that comes late, 0 to below 1.

    Raises:
        FieldError: a value out of range.
    """

    relaxation_time: float = 0.02
    delayed: float = 0.5

    def __post_init__(self) -> None:
        if not (math.isfinite(self.relaxation_time) and self.relaxation_time > 0.0):
            raise FieldError(f"relaxation_time must be positive and finite [s], got {self.relaxation_time!r}")
        if not 0.0 <= self.delayed < 1.0:
            raise FieldError(f"delayed must be in [0, 1), got {self.delayed!r}")

    def advance(self, state: float, force: float, time: float) -> float:
        """The delayed part's state [N] after a constant force has acted; exact for any step.

        Args:
            state: before; 0 at rest.
            force: on the skin [N].
            time: for how long [s].
        """
        return force + (state - force) * math.exp(-time / self.relaxation_time)

    def seated(self, state: float, force: float) -> float:
        """The force that would in the end press the foam as far as it is now [N]."""
        return force + self.delayed * (state - force)

    def delay(self, force: float, threshold: float) -> float:
        """Time from a sudden force to the moment at which the layers meet [s]; inf below the threshold."""
        if force <= threshold:
            return math.inf
        if (1.0 - self.delayed) * force >= threshold:
            return 0.0
        return self.relaxation_time * math.log(self.delayed * force / (force - threshold))


@dataclass(frozen=True, slots=True)
class Layers:
    """How the two layers touch under a force.

    Attributes:
        threshold_force: at which they meet [N]; the paper measured 0.5 N.
        radius_at_newton: radius of the contact at 1 N above that [m].
        conductance_at_newton: per area at 1 N above the threshold [S/m^2].
        pressure_exponent: conductance per area ~ pressure^this; 0.95 for elastic rough contact.

    Raises:
        FieldError: a value is negative or not finite.
    """

    threshold_force: float = 0.5
    radius_at_newton: float = 4e-3
    conductance_at_newton: float = 200.0
    pressure_exponent: float = 0.95

    def __post_init__(self) -> None:
        for name in ("threshold_force", "radius_at_newton", "conductance_at_newton", "pressure_exponent"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise FieldError(f"{name} must be 0 or more and finite, got {value!r}")

    def touch(self, force: float) -> Touch:
        """Contact under a seated force [N]."""
        beyond = force - self.threshold_force
        if not beyond > 0.0:
            return Touch(0.0, 0.0)
        root = beyond ** (1.0 / 3.0)
        # pressure = F / (pi a^2) ~ F^(1/3)
        return Touch(self.radius_at_newton * root, self.conductance_at_newton * root**self.pressure_exponent)


def settled(target: float, before: float, time: float, time_constant: float) -> float:
    """Potential of a line some time after its drive was switched [V]: what is left of the potential before decays."""
    return target + (before - target) * math.exp(-time / time_constant)


class FieldContacts:
    """Contact model of the virtual skin that takes any script.

    Contacts that overlap are joined into one of the same area and conductance at their common centre. A single contact
    cut by an edge is solved as a patch, to about 1e-4 of the supply; beside others it is shrunk into the sheet.

    Args:
        point_radius: of a contact that has none of its own [m].
        tolerance: of the potentials, relative to the supply.

    Raises:
        FieldError: point_radius is not positive.
    """

    def __init__(self, point_radius: float = 1e-3, tolerance: float = 1e-9) -> None:
        if not (math.isfinite(point_radius) and point_radius > 0.0):
            raise FieldError(f"point_radius must be positive and finite [m], got {point_radius!r}")
        self.point_radius = point_radius
        self.tolerance = tolerance

    def admittance(self, sensor: Sensor, contacts: Sequence[Contact]) -> Matrix:
        """The 4 x 4 matrix Y [S] in the order A, B, C, D.

        Raises:
            FieldError: a conductance is negative or NaN, or a contact's middle is not finite.
        """
        sheet = SectorSheet.of_frustum(sensor.frustum)
        model = FieldModel(sheet, sensor.upper_sheet_ohms, sensor.lower_sheet_ohms, self.tolerance)
        y = model.admittance(self.coupling(model, contacts))[0]
        return tuple(tuple(float(value) for value in row) for row in y)

    def coupling(self, model: FieldModel, contacts: Sequence[Contact]) -> Coupling:
        """The six numbers of a scene of contacts."""
        sheet = model.sheet
        for contact in contacts:
            if not contact.conductance >= 0.0:
                raise FieldError(f"conductance of a contact must be 0 or more [S], got {contact.conductance!r}")
        discs = [
            Disc(
                c.u,
                c.phi,
                c.radius or self.point_radius,
                c.conductance / (math.pi * (c.radius or self.point_radius) ** 2),
            )
            for c in contacts
            if c.conductance > 0.0
        ]
        if not discs:
            return model.discs([Disc(0.5 * sheet.width, 0.5 * sheet.wrap, 1e-3 * min(sheet.width, sheet.arc), 0.0)])
        discs = _joined(sheet, discs)
        if len(discs) == 1:
            one = discs[0]
            inside = 0.0 <= one.u <= sheet.width and 0.0 <= one.phi <= sheet.wrap
            if not inside or one.radius > _room(sheet, one):
                return solve_patch(model, Patch(one.u, one.phi, disc(one.radius), one.conductance), 32, 7)
        else:
            discs = _joined(sheet, [_shrunk(sheet, d) for d in discs])
        return model.discs(discs)


def _room(sheet: SectorSheet, one: Disc) -> float:
    return float(sheet.edge_distances(one.u, one.phi).min())


def _shrunk(sheet: SectorSheet, one: Disc) -> Disc:
    """A disc of the same conductance inside the sheet."""
    x_margin, y_margin = 1e-3 * sheet.width, 1e-3 * sheet.wrap
    u = min(max(one.u, x_margin), sheet.width - x_margin)
    phi = min(max(one.phi, y_margin), sheet.wrap - y_margin)
    moved = replace(one, u=u, phi=phi)
    radius = min(one.radius, 0.9 * _room(sheet, moved))
    return replace(moved, radius=radius, conductance=one.conductance * (one.radius / radius) ** 2)


def _joined(sheet: SectorSheet, discs: list[Disc]) -> list[Disc]:
    """Join overlapping discs until none overlaps."""
    done: list[Disc] = []
    for new in discs:
        joined = new
        again = True
        while again:
            again = False
            for other in done:
                if _apart(sheet, joined, other) <= 1.001 * (joined.radius + other.radius):
                    done.remove(other)
                    joined = _join(joined, other)
                    again = True
                    break
        done.append(joined)
    return done


def _apart(sheet: SectorSheet, first: Disc, second: Disc) -> float:
    u1, phi1, u2, phi2 = (np.array([v]) for v in (first.u, first.phi, second.u, second.phi))
    return float(centre_distance(sheet, u1, phi1, u2, phi2)[0])


def _join(first: Disc, second: Disc) -> Disc:
    areas = first.radius**2, second.radius**2
    weights = [a * min(d.conductance, 1e30) for a, d in zip(areas, (first, second), strict=True)]
    total = sum(weights)
    part = weights[1] / total
    u, phi = (1.0 - part) * first.u + part * second.u, (1.0 - part) * first.phi + part * second.phi
    return Disc(u, phi, math.sqrt(sum(areas)), total / sum(areas))
