"""Random foams whose force is off their table, random contacts on them, and scipy's Radau as a judge of both."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from coneskin.impact.permissible_speed.limits_file import BodyRegion, ForceLimits, MeasuredReaction
from coneskin.impact.permissible_speed.speed_map import contact_at
from coneskin.impact.permissible_speed.two_mass_contact import StruckBody, TwoMassContact
from coneskin.skin.materials import Padding

SPREAD, CLOSING_FORCE, HORIZON = 0.15, 0.5, 0.5
KINDS = ("softer", "stiffer", "softer, then stiffer", "waves")
_Law = Callable[[float], float]


def random_foam(chance: random.Random) -> Padding:
    """Return the table of a foam: a spring, perhaps one that buckles, and what densifies."""
    thick, first = chance.uniform(3e-3, 20e-3), chance.uniform(1e3, 30e3)
    buckled, power = chance.uniform(0.1, 1.0) * thick, chance.choice((1.0, 2.0, 4.0))

    def force(s: float) -> float:
        return first * buckled * math.tanh(s / buckled) / (1.0 - (s / thick) ** power)

    depths, step = [0.06 * thick], 0.08 * thick
    while depths[-1] < chance.uniform(0.7, 0.9) * thick:
        while force(depths[-1] + step) > 2.0 * force(depths[-1]):
            step *= 0.7
        depths.append(depths[-1] + step)
    return Padding(table=tuple((s, force(s)) for s in depths), spread=SPREAD, loss=chance.uniform(0.0, 1.0))


def off(padding: Padding, kind: str, chance: random.Random, deepest: float) -> _Law:
    """Return the force over depth of a foam that is off its table."""
    depths, forces = (np.array([0.0, *values]) for values in zip(*padding.table, strict=True))
    waves = [(chance.uniform(1.0, 12.0) / depths[-1], chance.uniform(0.0, 6.3)) for _ in range(3)]

    def law(s: float) -> float:
        if s <= 0.0:
            return 0.0
        table = float(np.interp(s, depths, forces)) + padding.hard_stiffness * max(0.0, s - float(depths[-1]))
        if kind == "waves":
            share = sum(math.sin(rate * s + phase) for rate, phase in waves) / len(waves)
        elif kind == "softer, then stiffer":
            share = math.tanh(40.0 * (s / deepest - 0.97))
        else:
            share = {"softer": -1.0, "stiffer": 1.0}.get(kind, 0.0)
        return table * (1.0 + SPREAD * share)

    return law


def judge(contact: TwoMassContact, foam: _Law, loss: float) -> tuple[float, float, float]:
    """Return peak force, the greater of last and rest [N], and the greatest depth [m], by scipy's Radau."""
    arm, body = contact.arm, contact.body
    tissue = body.tissue

    depths = np.linspace(0.0, 0.03, 3001)  # of a foam in series with the tissue
    totals = depths + np.array([foam(s) for s in depths]) / tissue

    def depth(total: float) -> float:
        return float(np.interp(total, totals, depths))

    def force(total: float, rate: float) -> float:
        s = depth(total)
        share = s / total if total > 0.0 else 0.0
        return max(0.0, foam(s) * (1.0 + loss * share * rate))

    def drive(t: float, since: float) -> tuple[float, float]:
        late = min(max(0.0, t - since), arm.speed / arm.deceleration)
        way = arm.speed * (min(t, since) + late) - 0.5 * arm.deceleration * late**2
        return way, arm.speed - arm.deceleration * late

    def slope(t: float, y: Any, since: float) -> list[float]:
        place, rate, x, v = y
        f = force(place - x, rate - v)
        way, speed = drive(t, since)
        a1 = (arm.stiffness * (way - place) + arm.damping * (speed - rate) - f) / arm.mass
        a2 = 0.0 if math.isinf(body.mass) else (f - body.support * x - body.damping * v) / body.mass
        return [rate, a1, v, a2]

    def closes(_: float, y: Any, __: float) -> float:
        return force(y[0] - y[2], y[1] - y[3]) - CLOSING_FORCE

    closes.terminal = True  # type: ignore[attr-defined]
    t, y, since, peak, deepest, last = 0.0, [0.0, arm.speed, 0.0, 0.0], math.inf, 0.0, 0.0, 0.0
    while t < HORIZON:
        stands = since + arm.speed / arm.deceleration
        end = min(limit for limit in (HORIZON, since, stands) if limit > t)
        found = solve_ivp(
            slope, (t, end), y, "Radau", rtol=1e-6, atol=1e-9, args=(since,), max_step=5e-3,
            events=closes if math.isinf(since) else None,
        )  # fmt: skip
        forces = [force(a - c, b - d) for a, b, c, d in zip(*found.y, strict=True)]
        peak, last = max(peak, *forces), forces[-1]
        deepest = max(deepest, *(depth(a - c) for a, c in zip(found.y[0], found.y[2], strict=True)))
        t, y = float(found.t[-1]), found.y[:, -1].tolist()
        if math.isinf(since) and found.status == 1:
            since = t + arm.reaction
    rest = 0.0
    if math.isfinite(since) and (body.support > 0.0 or math.isinf(body.mass)):
        way = drive(math.inf, since)[0]
        yielding = 1.0 / arm.stiffness + (0.0 if math.isinf(body.mass) else 1.0 / body.support)
        total = brentq(lambda s: s + force(s, 0.0) * yielding - way, 0.0, way, xtol=1e-12)
        rest = force(float(total), 0.0)
    return peak, max(last, rest), deepest


def random_case(chance: random.Random) -> tuple[Padding, BodyRegion, Callable[[float, Padding], TwoMassContact]]:
    """Return foam, region, and what makes the contact at a speed on a padding."""
    foam = random_foam(chance)
    clamped = chance.random() < 0.3
    mass = math.inf if clamped else chance.uniform(0.6, 40.0)
    support = 0.0 if clamped else chance.choice((0.0, chance.uniform(5e3, 50e3)))
    body = StruckBody(mass, chance.choice((math.inf, chance.uniform(20e3, 150e3))), support)
    transient = chance.uniform(80.0, 300.0)
    region = BodyRegion("one", body, ForceLimits(transient, transient * chance.uniform(0.5, 1.0)))
    lever, heavy = math.exp(chance.uniform(math.log(0.1), math.log(1.0))), chance.uniform(2.0, 40.0)
    measured = MeasuredReaction(chance.uniform(5e-3, 30e-3), chance.uniform(4.0, 20.0), "random", 17.0)
    return foam, region, lambda speed, padding: contact_at(speed, lever, heavy, region, measured, padding)
