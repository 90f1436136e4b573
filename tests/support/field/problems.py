"""The two-sheet sensor as a boundary value problem, in terms that every solver understands.

Two sheets of resistance Ru (upper) and Rl (lower) [ohm per square] cover the annular sector
r between r1 and r2, 0 <= theta <= theta0. Inside each contact disc a current j = g (u - v) [A/m^2]
flows from the upper potential u to the lower potential v:

    lap u = Ru j,   lap v = -Rl j.

Electrodes: B on the arc r = r1 and A on the arc r = r2 of the upper sheet; D on theta = 0 and C on theta = theta0 of
the lower sheet; no current crosses the other edges. The whole is a reciprocal four-port.

Every peer returns the same thing: the 3 x 3 matrix G of the energies of three fields ("modes"),

    mode 0: B at 1 V, the other electrodes at 0;
    mode 1: C at 1 V, the other electrodes at 0;
    mode 2: C and D at 1 V, A and B at 0,

that is G[i, j] = current that the electrodes of mode j deliver when mode i is applied. The fourth field is a constant
and has no energy. `port_solution` turns G into what the electronics see. Row 2 is the current through the contacts, so
a peer can compute it there without the cancellation that the difference of two electrode currents suffers.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Order of the electrodes in every vector and matrix.
ELECTRODES = ("A", "B", "C", "D")


@dataclass(frozen=True, slots=True)
class CircularPatch:
    """A circular contact: centre (r [m], theta [rad]), radius [m], conductance g [S/m^2], inf for a perfect bond."""

    r: float
    theta: float
    radius: float
    conductance: float


@dataclass(frozen=True, slots=True)
class EllipticPatch:
    """A rectangle or an ellipse of contact: centre, two half-axes [m], the first turned from e_r by `turn` [rad]."""

    shape: str
    r: float
    theta: float
    along: float
    across: float
    turn: float
    conductance: float

    @property
    def radius(self) -> float:
        """Radius of the circle around it [m]."""
        return math.hypot(self.along, self.across) if self.shape == "rectangle" else max(self.along, self.across)


@dataclass(frozen=True, slots=True)
class Problem:
    """One sensor with its contacts; the guide electrodes see `load` [ohm] to ground, inf when they float."""

    name: str
    r1: float
    r2: float
    theta0: float
    upper: float
    lower: float
    discs: tuple[CircularPatch, ...]
    load: float = math.inf
    patches: tuple[EllipticPatch, ...] = ()

    @property
    def contacts(self) -> list[tuple[str, CircularPatch | EllipticPatch]]:
        """Discs and patches with the names that meshes give them."""
        discs: list[tuple[str, CircularPatch | EllipticPatch]] = [(f"disc{i}", d) for i, d in enumerate(self.discs)]
        return discs + [(f"patch{i}", p) for i, p in enumerate(self.patches)]

    @property
    def inner(self) -> float:
        """Smaller of the two radii [m]."""
        return min(self.r1, self.r2)

    @property
    def outer(self) -> float:
        """Larger of the two radii [m]."""
        return max(self.r1, self.r2)

    @property
    def perfect(self) -> bool:
        """True where any contact is a perfect bond."""
        return any(math.isinf(c.conductance) for _, c in self.contacts)


def standard_problems() -> list[Problem]:
    """Return the three problems that the error against run time is measured on.

    The first is the sensor of the paper's simulations with its 15 mm contact at (150 mm, 30 deg); the radii
    and the wrap are not in the paper and are those that its figures suggest.
    """
    half_pi = math.pi / 2

    def disc(r: float, theta: float, radius: float, ka: float, resistance: float) -> CircularPatch:
        return CircularPatch(r, theta, radius, (ka / radius) ** 2 / resistance)

    return [
        Problem("paper", 0.1, 0.2, half_pi, 1000.0, 1000.0, (disc(0.15, math.radians(30), 0.015, 3.0, 2000.0),)),
        Problem("unequal", 0.1, 0.2, half_pi, 1000.0, 200.0, (disc(0.16, math.radians(55), 0.012, 3.0, 1200.0),)),
        Problem("edge", 0.1, 0.2, half_pi, 1000.0, 5000.0, (disc(0.115, math.radians(50), 0.012, 5.0, 6000.0),)),
    ]


def hard_problems() -> list[Problem]:
    """Return sensors where a series or a mesh has to work: narrow gaps, a slit ring, a speck, a thin layer."""

    def one(name: str, lower: float, *discs: tuple[float, float, float, float], **changes: float) -> Problem:
        shape = {"r1": 0.1, "r2": 0.2, "theta0": 1.5} | changes
        contacts = tuple(
            CircularPatch(r, t, a, math.inf if math.isinf(ka) else (ka / a) ** 2 / (1000.0 + lower))
            for r, t, a, ka in discs
        )
        return Problem(name, shape["r1"], shape["r2"], shape["theta0"], 1000.0, lower, contacts)

    a = 0.012
    problems = [
        one(f"gap {gap:g} a at {edge}, Rl/Ru {lower / 1000:g}, ka {ka:g}", lower, (r + gap * a, t, a, ka))
        for gap in (0.1, 0.01)
        for edge, r, t in (("B", 0.1 + a, 0.7), ("A", 0.2 - a - 2 * gap * a, 0.8))
        for lower in (100.0, 1000.0, 10000.0)
        for ka in (4.0, math.inf)
    ]
    for gap in (0.1, 0.01):
        beside = math.asin(a * (1 + gap) / 0.15)
        problems.append(one(f"gap {gap:g} a at D, Rl/Ru 10, ka 4", 10000.0, (0.15, beside, a, 4.0)))
        apart = 2 * math.asin(a * (1 + gap / 2) / 0.15)
        pair = ((0.15, 0.5, a, 4.0), (0.15, 0.5 + apart, a, 2.0))
        problems.append(one(f"two discs {gap:g} a apart, Rl/Ru 3", 3000.0, *pair))
    problems.append(one("slit ring, 6.283 rad", 2000.0, (0.14, 3.0, 0.02, 3.0), theta0=6.283))
    problems.append(one("speck, a = W/1000", 2000.0, (0.14, 0.6, 1e-4, 3.0)))
    problems.append(one("stiff contact, ka 40", 2000.0, (0.14, 0.6, a, 40.0)))
    problems.append(one("feeble contact, ka 1e-3", 2000.0, (0.14, 0.6, a, 1e-3)))
    problems.append(one("sheets 1e4", 1e7, (0.14, 0.6, a, 3.0)))
    problems.append(one("sheets 1e-4", 0.1, (0.14, 0.6, a, 3.0)))
    problems.append(one("width 0.01 r1", 2000.0, (0.1005, 0.02, 3e-4, 3.0), r2=0.101, theta0=0.05))
    return problems


def general_problems() -> list[Problem]:
    """Return contacts that are no whole discs: the multipole solution does not apply, the general method must.

    The first three measure its error against run time; the others cut a disc at each edge and in a corner.
    """

    def patch(name: str, *shape: float, lower: float, ka: float = 3.0) -> Problem:
        r, theta, along, across, turn = shape
        conductance = (ka / across) ** 2 / (1000.0 + lower)
        made = EllipticPatch(name, r, theta, along, across, turn, conductance)
        return Problem(f"{name}, Rl/Ru {lower / 1000:g}", 0.1, 0.2, 1.5, 1000.0, lower, (), patches=(made,))

    places = {
        "B": (0.104, 0.7, 0.012),
        "A": (0.197, 0.7, 0.012),
        "D": (0.15, 0.03, 0.015),
        "C": (0.14, 1.5, 0.01),
        "corner of A and C": (0.195, 1.46, 0.015),
    }
    clipped = [
        Problem(f"clipped by {edge}, Rl/Ru {lower / 1000:g}", 0.1, 0.2, 1.5, 1000.0, lower, (disc,))
        for edge, (r, t, a) in places.items()
        for lower in (1000.0, 4000.0)
        for disc in (CircularPatch(r, t, a, (3 / a) ** 2 / (1000.0 + lower)),)
    ]
    shapes = [
        patch("rectangle", 0.15, 0.6, 0.015, 0.010, 0.4, lower=2000.0),
        patch("ellipse", 0.15, 0.6, 0.020, 0.010, 1.0, lower=2000.0),
    ]
    return [*shapes, clipped[1], clipped[0], *clipped[2:]]


def random_problems(count: int = 120, seed: int = 20) -> Iterator[Problem]:
    """Yield seeded random sensors over the range that the reference covers.

    Ratio of the radii 1.05 to 6 (either end the narrow one), wrap 0.3 to 2 pi, sheets 1e-2 to 1e2, discs up
    to 0.8 of the room to the nearest edge, ka 0.1 to 10. Of every ten sensors one has a perfect bond and two have two
    or three contacts; every second sensor has loaded guides.
    """
    draw = random.Random(seed)
    for index in range(count):
        ratio = math.exp(draw.uniform(math.log(1.05), math.log(6.0)))
        inner = math.exp(draw.uniform(math.log(0.02), math.log(0.2)))
        radii = (inner, inner * ratio) if draw.random() < 0.5 else (inner * ratio, inner)
        theta0 = draw.uniform(0.3, 2 * math.pi)
        sheets = math.exp(draw.uniform(math.log(1e-2), math.log(1e2)))
        upper = 1000.0 / math.sqrt(sheets)
        lower = 1000.0 * math.sqrt(sheets)
        kind = index % 10
        wanted = {3: 2, 7: draw.choice((2, 3))}.get(kind, 1)
        discs: list[CircularPatch] = []
        while len(discs) < wanted:
            r = draw.uniform(inner, inner * ratio)
            theta = draw.uniform(0.0, theta0)
            room = _room(r, theta, inner, inner * ratio, theta0)
            for other in discs:
                apart = abs(other.r * np.exp(1j * other.theta) - r * np.exp(1j * theta))
                room = min(room, float(apart) - other.radius)
            # A disc much smaller than the sheet only costs the reference elements: bound it from below.
            limit = 0.05 * min(inner * (ratio - 1), inner * theta0)
            if room < 2 * limit:
                continue
            radius = draw.uniform(limit, 0.8 * room)
            ka = math.exp(draw.uniform(math.log(0.1), math.log(10.0)))
            conductance = (ka / radius) ** 2 / (upper + lower) if kind != 5 else math.inf
            discs.append(CircularPatch(r, theta, radius, conductance))
        loaded = (index + index // 10) % 2 == 1
        load = math.exp(draw.uniform(math.log(1e3), math.log(1e7))) if loaded else math.inf
        yield Problem(f"random-{index:03d}", *radii, theta0, upper, lower, tuple(discs), load)


def _room(r: float, theta: float, inner: float, outer: float, theta0: float) -> float:
    """Return the distance [m] from a point of the flat sector to its nearest edge."""
    straight = (r * math.sin(min(angle, math.pi / 2)) for angle in (theta, theta0 - theta))
    return min(r - inner, outer - r, *straight)
