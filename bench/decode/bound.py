"""Cramer-Rao bound of bench `decode`: what any unbiased decoder can know of a disc's place from ten noisy counts.

The information is that of the plant's own counts, by differences of whole solutions. Unknown beside the place are the
contact's radius and conductance (priors .5 and 1 in their logarithms), the supply (none), and both sheets' resistances
as far as learning left them open.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from tests.support.field.converter_plant import ConverterPlant

from .plants import RELATIVE, SHEETS, STEP, Case, SolvedPlants, radius_at

PRIOR_RADIUS, PRIOR_CONDUCTANCE = 0.5, 1.0  # standard deviation of the logarithms


def varied(plants: SolvedPlants, case: Case) -> list[np.ndarray]:
    """Return Y of a disc, then its derivatives: by u and s [1/m], ln a, ln g, ln Ru, ln Rl."""
    plant, patch = SHEETS[case.sheet], case.patches[0]
    turn = STEP / radius_at(plant, patch.u)
    g = plant.conductance(patch)

    def at(**changes: float) -> np.ndarray:
        moved = replace(patch, **{k: v for k, v in changes.items() if k in ("u", "phi", "along", "across")})
        sheet = replace(plant, **{k: v for k, v in changes.items() if k in ("upper", "lower")})
        siemens = changes.get("g", g)
        ka = math.inf if math.isinf(siemens) else moved.across * math.sqrt(siemens * (sheet.upper + sheet.lower))
        return plants.admittance(sheet, (replace(moved, ka=ka),))

    middle = at()
    out = [middle]
    for name, step, unit in (("u", STEP, STEP), ("phi", turn, STEP)):
        value = getattr(patch, name)
        out.append((at(**{name: value + step}) - at(**{name: value - step})) / (2.0 * unit))
    wide = patch.along * (1.0 + RELATIVE)
    out.append((at(along=wide, across=wide) - middle) / RELATIVE)
    out.append(np.zeros((4, 4)) if math.isinf(g) else (at(g=g * (1.0 + RELATIVE)) - middle) / RELATIVE)
    for name in ("upper", "lower"):
        out.append((at(**{name: getattr(plant, name) * (1.0 + RELATIVE)}) - middle) / RELATIVE)
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
