"""Plants of bench `decode`: sensors, contacts drawn by a seed, and their four-ports, kept in a file once solved."""

from __future__ import annotations

import json
import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.support.field.flat_plant import FlatPlant, PressedPatch

RADII = (1e-3, 3e-3, 7.5e-3, 15e-3)  # m
STIFFNESSES = (0.3, 1.0, 3.0, math.inf)  # ka
EDGE_MARGIN = 2e-3  # m; of a disc to the edges, beyond a twentieth of its radius
DIFFERENCE_STEP = 2.5e-4  # m; of a place, for its derivative
RELATIVE_STEP = 1e-3  # of a sheet's resistance, a conductance; likewise
PAIR_ORDER = 3  # degree of the elements where a normal within a degree is all that counts

SHEETS = {
    "UR5e": FlatPlant(0.0375, 0.0375, 0.24, math.radians(350), 1000.0, 1000.0),
    "UR5e 360": FlatPlant(0.0375, 0.0375, 0.24, math.radians(360), 1000.0, 1000.0),
    "paper": FlatPlant(0.025, 0.05, 0.1, math.radians(360), 1000.0, 1000.0),
    "cone": FlatPlant(0.03, 0.06, 0.15, math.radians(340), 1000.0, 1000.0),
}


@dataclass(frozen=True)
class Case:
    """Contacts on a sensor, and what a decoder is to find.

    Attributes:
        kind: what they are, for the tables.
        sheet: name of the sensor.
        patches: the contacts.
        order: degree of the elements.
    """

    kind: str
    sheet: str
    patches: tuple[PressedPatch, ...]
    order: int = 5


class SolvedPlants:
    """Four-ports by their sheets and contacts; solved once, then read from a file of lines.

    Args:
        path: of the file; made where it is missing.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._known: dict[str, list[float]] = {}
        self.solved = 0
        if path.exists():
            for line in path.read_text().splitlines():
                key, values = json.loads(line)
                self._known[key] = values

    def admittance(self, plant: FlatPlant, patches: Sequence[PressedPatch]) -> np.ndarray:
        """Return Y of A, B, C, D [S]."""
        if not patches:
            return solve_bare(plant)
        key = repr((plant, tuple(patches)))
        if key not in self._known:
            self._known[key] = _solve(plant, patches).ravel().tolist()
            self.solved += 1
            with self._path.open("a") as file:
                file.write(json.dumps([key, self._known[key]]) + "\n")
        return np.array(self._known[key]).reshape(4, 4)

    def of(self, case: Case) -> np.ndarray:
        """Return Y of a case."""
        return self.admittance(replace(SHEETS[case.sheet], order=case.order), case.patches)


def _solve(plant: FlatPlant, patches: Sequence[PressedPatch]) -> np.ndarray:
    """Return Y; once in thousands of cases a mesh misses too much of a rim, and other elements do not."""
    for finer, more in ((1.0, 0), (0.83, 1), (0.7, 2), (0.5, 2), (0.35, 2), (0.93, 1), (1.25, 2)):
        try:
            return replace(plant, size=finer * plant.size, order=plant.order + more).admittance(patches)
        except RuntimeError as error:
            failure = error
    raise failure


def solve_bare(plant: FlatPlant) -> np.ndarray:
    """Return Y without a contact: the sheets are two resistors; log of the radii where they differ."""
    r1, r2 = plant.radius1, plant.radius2
    mean = r1 if r1 == r2 else (r2 - r1) / math.log(r2 / r1)
    squares = plant.slant / (plant.wrap * mean)
    y = np.zeros((4, 4))
    for first, siemens in ((0, 1.0 / (plant.upper * squares)), (2, squares / plant.lower)):
        y[first : first + 2, first : first + 2] = siemens * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return y


def radius_at(plant: FlatPlant, u: float) -> float:
    """Return the radius of the circle at u [m]."""
    return plant.radius1 + (plant.radius2 - plant.radius1) * u / plant.slant


def disc_cases(sheet: str, radius: float, ka: float, count: int) -> list[Case]:
    """Return discs all over a sensor, whole."""
    plant, rng = SHEETS[sheet], random.Random(f"disc {sheet} {radius} {ka}")
    found = []
    for _ in range(count):
        room = 1.05 * radius + EDGE_MARGIN
        u = rng.uniform(room, plant.slant - room)
        edge = math.asin(min(1.0, room / _turn_radius(plant, u))) / _share(plant)
        phi = rng.uniform(edge, plant.wrap - edge)
        found.append(Case(f"disc {1e3 * radius:g} mm, ka {ka:g}", sheet, (PressedPatch.disc(u, phi, radius, ka),)))
    return found


def _share(plant: FlatPlant) -> float:
    """Return the flat angle over the azimuth; tiny for a cylinder, whose edges are parallel."""
    return max(abs(plant.radius2 - plant.radius1) / plant.slant, 1e-6)


def _turn_radius(plant: FlatPlant, u: float) -> float:
    return radius_at(plant, u) / _share(plant)


def shape_cases(sheet: str, count: int) -> list[Case]:
    """Return single contacts that are no whole discs, in turn: 30 mm discs, ellipses, clipped by an end, by D."""
    plant, rng = SHEETS[sheet], random.Random(f"shape {sheet}")
    found = []
    for number in range(count):
        ka = math.exp(rng.uniform(math.log(0.7), math.log(10.0)))
        u, phi = rng.uniform(0.25, 0.75) * plant.slant, rng.uniform(0.3, 0.7) * plant.wrap
        kind = ("disc 30 mm", "ellipse 20 x 10 mm", "clipped by B", "clipped by D")[number % 4]
        if kind == "disc 30 mm":
            room = 0.031
            patch = PressedPatch.disc(rng.uniform(room, plant.slant - room), phi, 0.03, ka)
        elif kind == "ellipse 20 x 10 mm":
            patch = PressedPatch(u, phi, 0.02, 0.01, ka, rng.uniform(0.0, math.pi))
        elif kind == "clipped by B":
            patch = PressedPatch.disc(rng.uniform(0.1, 0.9) * 0.01, phi, 0.01, ka)
        else:
            patch = PressedPatch.disc(u, rng.uniform(0.1, 0.9) * 0.01 / radius_at(plant, u), 0.01, ka)
        found.append(Case(kind, sheet, (patch,)))
    return found


SEVERAL_KINDS = (
    "seam press",
    "palm over seam",
    "grip",
    "clamp",
    "two fingers",
    "three fingers",
    "four fingers",
    "palm",
    "polygon",
    "arc",
)


def several_cases(count: int) -> Iterator[Case]:
    """Yield presses by more than one contact: 60 mm apart or over the seam, ka >= .7, sensors and kinds in turn."""
    names = list(SHEETS)
    for number in range(count):
        rng = random.Random(f"several {number}")
        kind, sheet = SEVERAL_KINDS[number % len(SEVERAL_KINDS)], names[number // len(SEVERAL_KINDS) % len(names)]
        while (patches := _several(kind, SHEETS[sheet], rng)) is None:
            pass
        yield Case(kind, sheet, tuple(patches), PAIR_ORDER)


def _several(kind: str, plant: FlatPlant, rng: random.Random) -> list[PressedPatch] | None:
    """Return the contacts of a kind; None where they do not fit, or overlap."""
    radius = math.exp(rng.uniform(math.log(2e-3), math.log(12e-3)))

    def disc(u: float, phi: float, share: float = 1.0) -> PressedPatch:
        return PressedPatch.disc(u, phi, share * radius, math.exp(rng.uniform(math.log(0.7), math.log(6.0))))

    u = rng.uniform(0.015, plant.slant - 0.015)
    around = radius_at(plant, u)
    if kind == "seam press":  # one body whose middle lies within its radius of the seam: each side is clipped
        gap = (2.0 * math.pi - plant.wrap) * around  # of the sheet, which the body bridges
        offset = rng.uniform(-0.9, 0.9) * radius
        ka = math.exp(rng.uniform(math.log(0.7), math.log(6.0)))
        places = (offset - 0.5 * gap, plant.wrap * around + 0.5 * gap + offset)
        sides = [PressedPatch.disc(u, s / around, radius, ka) for s in places]
        kept = [
            p
            for p, inward in zip(sides, (places[0], plant.wrap * around - places[1]), strict=True)
            if inward > -0.93 * radius
        ]
        fits = radius + 1e-3 < u < plant.slant - radius - 1e-3
        return kept if len(kept) == 2 and fits else None
    if kind == "palm over seam":
        edge = math.radians(rng.uniform(5.0, 60.0))
        found = [disc(u, edge), disc(u, plant.wrap - edge * rng.uniform(0.7, 1.0))]
    elif kind in ("grip", "clamp"):
        other = u if kind == "grip" else rng.uniform(0.015, plant.slant - 0.015)
        phi = rng.uniform(0.2, plant.wrap - 0.2)
        opposite = (phi + math.pi + rng.uniform(-0.3, 0.3)) % (2.0 * math.pi)
        found = [disc(u, phi), disc(other, opposite, rng.uniform(0.6, 1.4))]
    elif kind == "palm":  # two pads at 60 to 90 mm, and the hollow of the hand between them touches nothing
        apart, turn = rng.uniform(0.06, 0.09), rng.uniform(0.0, math.pi)
        phi = rng.uniform(0.0, plant.wrap)
        found = [
            disc(u + side * 0.5 * apart * math.cos(turn), phi + side * 0.5 * apart * math.sin(turn) / around)
            for side in (-1.0, 1.0)
        ]
    elif kind in ("polygon", "arc"):  # round a place that nothing touches, of any weights: unequal ones in every third
        count, turn = rng.randint(3, 8), rng.uniform(0.0, 2.0 * math.pi)
        span = 2.0 * math.pi * (1.0 if kind == "polygon" else rng.uniform(0.4, 0.9))
        apart, spread = math.exp(rng.uniform(math.log(0.013), math.log(0.1))), rng.choice((0.0, 0.0, 1.0))
        phi, ka = rng.uniform(0.0, plant.wrap), math.exp(rng.uniform(math.log(0.05), math.log(6.0)))
        ring = [(u + apart * math.cos(a), phi + apart * math.sin(a) / around) for a in _angles(count, turn, span)]
        found = [PressedPatch.disc(*place, 0.5 * radius, ka * math.exp(rng.uniform(-spread, spread))) for place in ring]
        return found if _fit(plant, found) else None
    else:
        found = [
            disc(rng.uniform(0.015, plant.slant - 0.015), rng.uniform(0.0, plant.wrap))
            for _ in range({"two": 2, "three": 3, "four": 4}[kind.split()[0]])
        ]
    return found if _fit(plant, found) and _spread(plant, found) >= (0.0 if "seam" in kind else 0.06) else None


def _angles(count: int, turn: float, span: float) -> list[float]:
    return [turn + span * n / count for n in range(count)]


def _fit(plant: FlatPlant, patches: Sequence[PressedPatch]) -> bool:
    """Tell whether whole discs lie on the sheet, a millimetre apart from its edges and from each other."""
    for number, p in enumerate(patches):
        room = p.along + 1e-3
        if not room < p.u < plant.slant - room:
            return False
        around = radius_at(plant, max(0.0, p.u - room) if plant.radius2 > plant.radius1 else p.u)
        if not 1.1 * room / around < p.phi < plant.wrap - 1.1 * room / around:
            return False
        if any(distance(plant, p, other) < 1.1 * (p.along + other.along) + 1e-3 for other in patches[:number]):
            return False
    return True


def _spread(plant: FlatPlant, patches: Sequence[PressedPatch]) -> float:
    """Return the smallest distance of any two [m]."""
    return min(distance(plant, a, b) for n, a in enumerate(patches) for b in patches[:n])


def distance(plant: FlatPlant, a: PressedPatch, b: PressedPatch) -> float:
    """Return the distance in the flat sheet, nearly [m]."""
    around = radius_at(plant, 0.5 * (a.u + b.u))
    return math.hypot(a.u - b.u, around * (a.phi - b.phi))
