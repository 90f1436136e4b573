"""Presses by more than one contact in bench `decode`: is any certain place far from what presses?"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import islice

import numpy as np

from tests.support.field.flat_plant import FlatPlant, PressedPatch

from .cells import electronics
from .plants import SEVERAL_KINDS, SHEETS, Case, SolvedPlants, disc_cases, several_cases
from .runs import LEARNED_FRAMES, Sitting, decode

PRESS_FRAMES = 100
MAX_NORMAL_ERROR = math.radians(20.0)
_AT_ONCE = 500  # presses that are decoded together


@dataclass
class Several:
    """Presses of one kind.

    Attributes:
        kind: of the press.
        cases: how many.
        touched: of them that were a touch.
        any_off: with a valid frame whose normal is more than 20 deg off any contact's.
        all_off: ... off all of them.
        valid: with any valid frame.
        worst: numbers of the cases that are off.
    """

    kind: str
    cases: int
    touched: int
    any_off: int
    all_off: int
    valid: int
    worst: list[int]


def off_normals(plant: FlatPlant, phi: np.ndarray, patches: tuple[PressedPatch, ...]) -> np.ndarray:
    """Return the angles between the normals at places and those at the contacts [rad], shape (contacts, ...)."""
    part = ((plant.radius2 - plant.radius1) / plant.slant) ** 2
    turns = np.array(
        [phi - (p.phi if 0.0 <= p.phi <= plant.wrap else np.clip(p.phi, 0.0, plant.wrap)) for p in patches]
    )
    return np.arccos(np.clip(part + (1.0 - part) * np.cos(turns), -1.0, 1.0))


def measure(plants: SolvedPlants, count: int, electric: str, first: int = 0) -> list[Several]:
    """Measure so many presses, of every kind on every sensor in turn, from a number on."""
    rng = np.random.default_rng(5)
    found = {k: Several(k, 0, 0, 0, 0, 0, []) for k in SEVERAL_KINDS}
    learned = {}
    for name, plant in SHEETS.items():
        circuit = electronics(name)[electric]
        learned[name] = circuit, circuit.counts(circuit.exact(plants.admittance(plant, ())), LEARNED_FRAMES, rng)
    cases = list(islice(several_cases(first + count), first, None))
    for start in range(0, count, _AT_ONCE):
        part = cases[start : start + _AT_ONCE]
        by_sheet: dict[str, list[int]] = {}
        for number, case in enumerate(part):
            by_sheet.setdefault(case.sheet, []).append(number)
        for name, numbers in by_sheet.items():
            circuit, untouched = learned[name]
            exact = np.array([circuit.exact(plants.of(part[n])) for n in numbers])
            answer = decode(Sitting(SHEETS[name], circuit, untouched, circuit.counts(exact, PRESS_FRAMES, rng)))
            for row, n in enumerate(numbers):
                _count(found[part[n].kind], part[n], {k: v[row] for k, v in answer.items()}, first + start + n)
    return list(found.values())


def _count(into: Several, case: Case, said: dict[str, np.ndarray], number: int) -> None:
    off = off_normals(SHEETS[case.sheet], said["phi"], case.patches) > MAX_NORMAL_ERROR
    valid = said["valid"]
    into.cases += 1
    into.touched += bool(said["touched"].any())
    into.valid += bool(valid.any())
    into.any_off += bool((valid & off.any(axis=0)).any())
    into.all_off += bool((valid & off.all(axis=0)).any())
    if (valid & off.any(axis=0)).any():
        into.worst.append(number)


@dataclass
class Power:
    """How often contacts are told from one disc.

    Attributes:
        what: the contacts.
        electronics: of the sensor.
        frames: that were averaged.
        share: of the touches that are called not one disc.
        valid: of the touches whose place is certain.
        of: touches.
    """

    what: str
    electronics: str
    frames: int
    share: float
    valid: float
    of: int


def power(plants: SolvedPlants, places: int, draws: int) -> list[Power]:
    """Measure the power against two fingers 20 mm apart, the false alarms of one disc, and ellipses."""
    plant, found = SHEETS["UR5e"], []
    rng = np.random.default_rng(6)
    still = plants.admittance(plant, ())
    groups = {
        "two discs of 5 mm, 20 mm apart": _pairs(plant, places),
        "one disc": [
            c for radius in (3e-3, 15e-3) for ka in (1.0, math.inf) for c in disc_cases("UR5e", radius, ka, places)
        ],
        "ellipse 20 x 8 mm, ka 3": _ellipses(places),
    }
    for electric, frames in (
        ("12 bit, matched", 50),
        ("12 bit, 20 mA", 50),
        ("16 bit, matched", 1),
        ("16 bit, matched", 20),
    ):
        circuit = electronics("UR5e")[electric]
        for what, cases in groups.items():
            exact = np.repeat(np.array([circuit.exact(plants.of(case)) for case in cases]), draws, axis=0)
            untouched = circuit.counts(circuit.exact(still), LEARNED_FRAMES, rng)
            answer = decode(Sitting(plant, circuit, untouched, circuit.counts(exact, frames, rng)))
            share, valid = (float(answer[word][:, -1].mean()) for word in ("notone", "valid"))
            found.append(Power(what, electric, frames, share, valid, len(exact)))
    return found


def _pairs(plant: FlatPlant, places: int) -> list[Case]:
    found = []
    for k in range(places):
        turn, u, phi = math.pi * k / places, 0.06 + 0.12 * (k * 0.618 % 1.0), 1.0 + 4.0 * (k * 0.382 % 1.0)
        half_u, half_phi = 0.01 * math.cos(turn), 0.01 * math.sin(turn) / plant.radius1
        pair = tuple(PressedPatch.disc(u + s * half_u, phi + s * half_phi, 5e-3, 1.0 + k % 3) for s in (-1.0, 1.0))
        found.append(Case("pair", "UR5e", pair))
    return found


def _ellipses(places: int) -> list[Case]:
    return [
        Case(
            "ellipse",
            "UR5e",
            (PressedPatch(0.12, 1.0 + 4.0 * (k * 0.382 % 1.0), 0.02, 0.008, 3.0, math.pi * k / places),),
        )
        for k in range(places)
    ]
