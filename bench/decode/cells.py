"""Cells of bench `decode`: errors of single discs over the Cramer-Rao bound."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tests.support.field.converter_plant import ConverterPlant

from .plants import (
    DIFFERENCE_STEP,
    RADII,
    RELATIVE_STEP,
    SHEETS,
    STIFFNESSES,
    Case,
    SolvedPlants,
    disc_cases,
    radius_at,
    solve_bare,
)
from .runs import LEARNED_FRAMES, Sitting, decode

PRIOR_RADIUS, PRIOR_CONDUCTANCE = 0.5, 1.0  # standard deviation of the logarithms


def varied(plants: SolvedPlants, case: Case) -> list[np.ndarray]:
    """Return Y of a disc, then its derivatives: by u and s [1/m], ln a, ln g, ln Ru, ln Rl."""
    plant, patch = SHEETS[case.sheet], case.patches[0]
    turn = DIFFERENCE_STEP / radius_at(plant, patch.u)
    g = plant.conductance(patch)

    def at(**changes: float) -> np.ndarray:
        moved = replace(patch, **{k: v for k, v in changes.items() if k in ("u", "phi", "along", "across")})
        sheet = replace(plant, **{k: v for k, v in changes.items() if k in ("upper", "lower")})
        siemens = changes.get("g", g)
        ka = math.inf if math.isinf(siemens) else moved.across * math.sqrt(siemens * (sheet.upper + sheet.lower))
        return plants.admittance(sheet, (replace(moved, ka=ka),))

    middle = at()
    out = [middle]
    for name, step, unit in (("u", DIFFERENCE_STEP, DIFFERENCE_STEP), ("phi", turn, DIFFERENCE_STEP)):
        value = getattr(patch, name)
        out.append((at(**{name: value + step}) - at(**{name: value - step})) / (2.0 * unit))
    wide = patch.along * (1.0 + RELATIVE_STEP)
    out.append((at(along=wide, across=wide) - middle) / RELATIVE_STEP)
    out.append(np.zeros((4, 4)) if math.isinf(g) else (at(g=g * (1.0 + RELATIVE_STEP)) - middle) / RELATIVE_STEP)
    for name in ("upper", "lower"):
        out.append((at(**{name: getattr(plant, name) * (1.0 + RELATIVE_STEP)}) - middle) / RELATIVE_STEP)
    return out


def bound(
    circuit: ConverterPlant, solved: list[np.ndarray], sheet_noise: tuple[float, float], frames: int = 1
) -> np.ndarray:
    """Return the smallest covariance of (u, s) from some frames [m^2], shape (2, 2).

    Args:
        circuit: the electronics.
        solved: of `varied`.
        sheet_noise: how well the resistances of the sheets are known, as ratios.
        frames: of the touch.
    """
    middle = circuit.exact(solved[0])
    step = 1e-6  # the circuit is smooth: its own differences lose nothing
    columns = []
    for derivative in solved[1:]:
        scale = step * np.abs(solved[0]).max() / max(np.abs(derivative).max(), 1e-300)
        columns.append((circuit.exact(solved[0] + scale * derivative) - middle) / scale)
    columns.append(middle)  # the supply carries all of them
    slopes = np.array(columns).T
    information = frames * slopes.T @ slopes / (circuit.noise**2 + 1.0 / 12.0)
    priors = (0.0, 0.0, PRIOR_RADIUS**-2, PRIOR_CONDUCTANCE**-2, *(1.0 / s**2 for s in sheet_noise), 0.0)
    information += np.diag(priors)
    unit = np.sqrt(np.diag(information))
    return np.asarray(np.linalg.inv(information / np.outer(unit, unit))[:2, :2] / np.outer(unit, unit)[:2, :2])


MATCHED_RATIO = 2.2  # of the larger untouched drive current
BASELINE_DRIFTS = (0.0, 3e-3, 1e-2)  # ratio; standard deviation of the drift of each sheet since it was learned
CELL_FRAMES = 2  # of a touch; with the second comes its place, and by then the currents may have drifted, as told
DRIFT_DRAWS = 6  # drawn at each place; the draws of the noise are shared out among them
ELLIPSE_CHI2 = 5.991  # chi-squared of two degrees of freedom at 95 %


@dataclass
class Cell:
    """Errors of many frames in one cell.

    Attributes:
        sheet, electronics, radius, ka, baseline: of the cell.
        bound: square root of the mean of the bounds' traces [m].
        rms: of the errors [m].
        inside: part of the truths in the 95 % ellipse; NaN where there is none.
        interval: 95 % interval of that part; the frames of a place are no independent draws of it.
        frames: that were decoded, of ``of``.
    """

    sheet: str
    electronics: str
    radius: float
    ka: float
    baseline: float
    bound: float
    rms: float
    inside: float
    interval: tuple[float, float]
    frames: int
    of: int


def electronics(sheet: str) -> dict[str, ConverterPlant]:
    """Return the electronics that a sheet is measured with."""
    plant = SHEETS[sheet]
    mean = 0.5 * (plant.radius1 + plant.radius2)
    if plant.radius1 != plant.radius2:
        mean = (plant.radius2 - plant.radius1) / math.log(plant.radius2 / plant.radius1)
    squares = plant.slant / (plant.wrap * mean)
    drive = 2.5 / min(plant.upper * squares, plant.lower / squares)
    return {
        "12 bit, 20 mA": ConverterPlant(),
        "12 bit, matched": ConverterPlant(full_scale=MATCHED_RATIO * drive),
        "16 bit, matched": ConverterPlant(bits=16, full_scale=MATCHED_RATIO * drive),
    }


def measure(
    plants: SolvedPlants,
    sheet: str,
    name: str,
    baselines: tuple[float, ...],
    places: int,
    draws: int,
    radii: tuple[float, ...] = RADII,
    stiffnesses: tuple[float, ...] = STIFFNESSES,
) -> list[Cell]:
    """Measure the cells of one sensor and one electronics."""
    circuit, plant = electronics(sheet)[name], SHEETS[sheet]
    rng = np.random.default_rng(11)
    still = circuit.exact(plants.admittance(plant, ()))
    sittings: list[Sitting] = []
    keys: list[tuple[float, float, float, np.ndarray, tuple[float, float]]] = []
    for radius in radii:
        for ka in stiffnesses:
            for case in disc_cases(sheet, radius, ka, places):
                solved, patch = varied(plants, case), case.patches[0]
                exact = circuit.exact(solved[0])
                for baseline in baselines:
                    alone = [math.sqrt((circuit.noise**2 + 1.0 / 12.0) / LEARNED_FRAMES) / still[k] for k in (5, 8)]
                    known = math.hypot(alone[0], baseline), math.hypot(alone[1], baseline)
                    least = bound(circuit, solved, known, CELL_FRAMES)
                    drifts = min(DRIFT_DRAWS, draws) if baseline else 1
                    for _ in range(drifts):
                        off = rng.normal(0.0, baseline, 2) if baseline else np.zeros(2)
                        before = replace(plant, upper=plant.upper * (1.0 + off[0]), lower=plant.lower * (1.0 + off[1]))
                        untouched = circuit.exact(solve_bare(before))
                        touches = circuit.counts(np.repeat(exact[None], draws // drifts, 0), CELL_FRAMES, rng)
                        learned = circuit.counts(untouched, LEARNED_FRAMES, rng)
                        sittings.append(Sitting(plant, circuit, learned, touches, baseline))
                        keys.append((radius, ka, baseline, least, (patch.u, patch.phi)))
    answers = [decode(sitting) for sitting in sittings]
    return _gather(sheet, name, keys, answers)


def _gather(sheet: str, name: str, keys: list, answers: list[dict[str, np.ndarray]]) -> list[Cell]:
    cells: dict[tuple[float, float, float], list[int]] = {}
    for number, key in enumerate(keys):
        cells.setdefault(key[:3], []).append(number)
    found = []
    for (radius, ka, baseline), numbers in cells.items():
        trace = math.sqrt(np.mean([np.trace(keys[n][3]) for n in numbers]))
        errors, held = [], []
        places: dict[tuple[float, float], list[np.ndarray]] = {}
        for n in numbers:
            u, phi = keys[n][4]
            answer = {k: v[:, -1] for k, v in answers[n].items() if v.ndim == 2}
            seen = answer["touched"]
            du = answer["u"][seen] - u
            ds = radius_at(SHEETS[sheet], u) * (answer["phi"][seen] - phi)
            errors.append(du**2 + ds**2)
            uu, us, ss = (answer[k][seen] for k in ("uu", "us", "ss"))
            determinant = uu * ss - us * us
            with np.errstate(invalid="ignore", divide="ignore"):
                held.append((ss * du**2 - 2 * us * du * ds + uu * ds**2) / determinant)
            places.setdefault((u, phi), []).append(held[-1] < ELLIPSE_CHI2)
        squares, distances = np.concatenate(errors), np.concatenate(held)
        rms = math.sqrt(squares.mean()) if squares.size else math.nan
        inside = float(np.mean(distances < ELLIPSE_CHI2)) if np.isfinite(distances).any() else math.nan
        interval = spread_of([np.concatenate(part) for part in places.values()])
        of = sum(answers[n]["touched"].shape[0] for n in numbers)
        found.append(Cell(sheet, name, radius, ka, baseline, trace, rms, inside, interval, squares.size, of))
    return found


def spread_of(places: list[np.ndarray]) -> tuple[float, float]:
    """Return the 95 % interval of a part (Wilson), where the frames of each place may hang together.

    As many frames count as independent as explain how far the parts of the places differ.

    Args:
        places: of each, which frames are of that part.
    """
    frames = np.concatenate(places)
    count, part = frames.size, float(frames.mean()) if frames.size else math.nan
    if not count:
        return 0.0, 1.0
    alone = part * (1.0 - part) / count
    if alone and len(places) > 1:
        means, share = np.array([p.mean() for p in places]), np.array([p.size for p in places]) / count
        between = float((share**2 * (means - part) ** 2).sum()) * len(places) / (len(places) - 1)
        count /= max(1.0, between / alone)
    z = 1.96
    middle = (part + 0.5 * z * z / count) / (1.0 + z * z / count)
    half = z * math.sqrt(part * (1.0 - part) / count + 0.25 * (z / count) ** 2) / (1.0 + z * z / count)
    return middle - half, middle + half
