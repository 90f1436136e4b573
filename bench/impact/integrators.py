"""Integrators of a contact: error against run time, ours and scipy's Radau and LSODA, all in one run.

    python -m bench impact-integrators              # a table, some minutes
    python -m bench impact-integrators --quick      # one case

Error: of the peak force and of the force at the end, relative to the peak, against 60 digits (``impact_reference``).
scipy's are given what the purpose-made one has: they are restarted at each event, which they locate themselves
(``solve_ivp`` with terminal events), and try tolerances from 1e-3 to 1e-9; of those that reach an error the fastest
counts.
Time: of the processor, the lesser of two runs.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import mpmath as mp
from scipy.integrate import solve_ivp

from bench.report import head, show
from coneskin.impact.permissible_speed.taylor_integrator import integrate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.skin.materials import Padding

from .reference import closed_form, reference

HAND_BODY = StruckBody(0.6, tissue=75e3, support=20e3, damping=2.0 * 0.3 * math.sqrt(20e3 * 0.6))
SERVO_RATE = 2.0 * math.pi * 16.0
SCIPY_METHODS = ("Radau", "LSODA")
TOLERANCES = tuple(10.0**-n for n in (3, 5, 7, 9))


def driven(speed: float, mass: float = 8.0) -> DrivenArm:
    """An arm on its servo that brakes 12 ms after the layers close."""
    return DrivenArm(speed, mass, mass * SERVO_RATE**2, 2.0 * mass * SERVO_RATE, 0.012, 3.0)


CASES: dict[str, tuple[TwoMassContact, float]] = {
    "free hand, soft, 0.2 m/s": (TwoMassContact(driven(0.2), replace(HAND_BODY, support=0.0, damping=0.0)), 0.1),
    "held hand, braked to rest": (TwoMassContact(driven(0.2), HAND_BODY), 0.5),
    "held hand, bottoms out": (TwoMassContact(driven(0.5), HAND_BODY), 0.5),
    "wall, 1e6 N/m": (TwoMassContact(driven(0.5), StruckBody(math.inf)), 0.1),
    "wall, 1e7 N/m": (TwoMassContact(driven(0.5), StruckBody(math.inf), Padding(hard_stiffness=1e7)), 0.1),
    "free 1 kg, 1e7 N/m, 2 m/s": (TwoMassContact(driven(2.0), StruckBody(1.0), Padding(hard_stiffness=1e7)), 0.05),
    "free 1 g, 1e7 N/m, 5 m/s": (TwoMassContact(driven(5.0), StruckBody(1e-3), Padding(hard_stiffness=1e7)), 0.01),
    "held 0.1 kg, 1e7 N/m": (
        TwoMassContact(driven(0.5), StruckBody(0.1, support=50e3, damping=20.0), Padding(hard_stiffness=1e7)),
        0.1,
    ),
    **{
        f"{1e3 * body:g} g under 1 t, {name}": (
            TwoMassContact(
                driven(speed, 1e3), StruckBody(body, 75e3, 20e3, damping), Padding(hard_stiffness=1e7, loss=loss)
            ),
            0.1,
        )
        for body, name, speed, damping, loss in (
            (3e-3, "1 m/s", 1.0, 10.0, 0.3),
            (1e-3, "0.1 m/s", 0.1, 1.0, 0.3),
            (3e-3, "nearly undamped", 0.3, 0.1, 0.0),
        )
    },
}


def by_scipy(contact: TwoMassContact, horizon: float, method: str, tolerance: float) -> tuple[float, float]:
    """Return peak force and force at the horizon by one of scipy's, restarted at each event."""
    arm, body, law = contact.arm, contact.body, contact.law
    m1 = 0.0 if math.isinf(arm.mass) else 1.0 / arm.mass
    m2 = 0.0 if math.isinf(body.mass) else 1.0 / body.mass
    state = {"mode": "soft", "braked": math.inf, "stands": math.inf, "closed": False}
    drive = [0.0, 0.0, arm.speed, 0.0]  # since when; p, p', braking then

    def force(s: float, w: float) -> float:
        if state["mode"] == "free":
            return 0.0
        begin, first, rate = law.pieces[state["mode"] == "hard"]
        e = first + rate * (s - begin)
        return e * (1.0 + law.loss * w)

    def slope(t: float, y: Sequence[float]) -> list[float]:
        s, w, x, v = y
        since = t - drive[0]
        p = drive[1] + since * (drive[2] - 0.5 * drive[3] * since)
        d = drive[2] - drive[3] * since
        f = force(s, w)
        a1 = m1 * (arm.stiffness * (p - s - x) + arm.damping * (d - w - v) - f) if m1 else -drive[3]
        a2 = m2 * (f - body.support * x - body.damping * v)
        return [w, a1 - a2, v, a2]

    def event(of: Callable[[Sequence[float]], float], direction: float) -> Any:
        def found(_: float, y: Sequence[float]) -> float:
            return of(y)

        found.terminal = True  # type: ignore[attr-defined]
        found.direction = direction  # type: ignore[attr-defined]
        return found

    def peaks(t: float, y: Sequence[float]) -> float:
        """Growth of the force: with damping, it is greatest before the compression is."""
        k = {"free": 0.0, "soft": law.pieces[0][2], "hard": law.pieces[1][2]}[str(state["mode"])]
        bare = force(y[0], 0.0)
        return k * y[1] * (1.0 + law.loss * y[1]) + bare * law.loss * slope(t, y)[1]

    peaks.direction = -1.0  # type: ignore[attr-defined]
    t, y, peak, last = 0.0, [0.0, arm.speed, 0.0, 0.0], 0.0, 0.0
    while t < horizon:
        end = min(limit for limit in (horizon, state["braked"], state["stands"]) if limit > t)
        names, events = [], []
        if state["mode"] == "soft":
            names, events = (
                ["hard", "free"],
                [event(lambda y: y[0] - law.pieces[1][0], 1.0), event(lambda y: y[0], -1.0)],
            )
        elif state["mode"] == "hard":
            names, events = ["soft"], [event(lambda y: y[0] - law.pieces[1][0], -1.0)]
        else:
            names, events = ["soft"], [event(lambda y: y[0], 1.0)]
        if not state["closed"]:
            names.append("close")
            events.append(event(lambda y: force(y[0], y[1]) - contact.closing_force, 1.0))
        events.append(peaks)
        found = solve_ivp(slope, (t, end), y, method=method, rtol=tolerance, atol=1e-4 * tolerance, events=events)
        peak = max([peak, *(force(a, b) for a, b in zip(found.y[0], found.y[1], strict=True))])
        peak = max([peak, *(force(*state_then[:2]) for state_then in found.y_events[-1])])
        before, t, y = t, float(found.t[-1]), found.y[:, -1].tolist()
        last = force(y[0], y[1])
        since = t - drive[0]
        drive = [
            t,
            drive[1] + since * (drive[2] - 0.5 * drive[3] * since),
            drive[2] - drive[3] * since,
            drive[3],
        ]
        happened = next((n for n, times in zip(names, found.t_events, strict=False) if len(times)), "")
        if happened == "close":
            state["closed"], state["braked"] = True, t + arm.reaction
        elif happened:
            y[0] = {
                "hard": law.pieces[1][0],
                "free": 0.0,
                "soft": 0.0 if state["mode"] == "free" else law.pieces[1][0],
            }[happened]
            state["mode"] = happened
        elif t == state["braked"]:
            drive[3], state["stands"] = arm.deceleration, t + drive[2] / arm.deceleration
        elif t == state["stands"]:
            drive[2] = drive[3] = 0.0
            if not m1:
                y[1] = -y[3]
        if t <= before and not happened:
            break
    return peak, last


def timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Return what it gives, and the lesser processor time of two runs [s]."""
    best, found = math.inf, None
    for _ in range(2):
        begin = time.process_time()
        found = work()
        best = min(best, time.process_time() - begin)
    return found, best


def error(peak: float, last: float, exact: dict[str, Any]) -> float:
    """Return the larger error of peak and last force, relative to the peak."""
    return float(max(abs(peak - exact["peak"]), abs(last - exact["force"])) / exact["peak"])


def compare(name: str, contact: TwoMassContact, horizon: float) -> list[str]:
    """Return a row: ours as it comes and as exact as it can, and the others' time over ours for an error."""
    exact = reference(contact, horizon)
    row = [name, f"{float(exact['peak']):.6g}"]
    for tolerance in (1e-6, 1e-13):
        course, spent = timed(lambda t=tolerance: integrate(contact, horizon, tolerance=t))
        row += [f"{1e3 * spent:.2f}", f"{error(course.peak, course.last, exact):.0e}"]
    ours = float(row[2]) * 1e-3
    for method in SCIPY_METHODS:
        points = []
        for tolerance in TOLERANCES:
            try:
                (peak, last), spent = timed(lambda t=tolerance, m=method: by_scipy(contact, horizon, m, t))
            except (ValueError, ArithmeticError):
                continue
            points.append((error(peak, last, exact), spent))
        times = ([spent for missed, spent in points if missed <= wanted] for wanted in (1e-3, 1e-6))
        row.append(" / ".join(f"{min(each) / ours:.1f}" if each else "never" for each in times))
    return row


def check_reference() -> None:
    """Hold the reference against the closed form of two free masses on a spring of two pieces."""
    padding = Padding(2e-3, 10e3, 1e6, 0.0)
    contact = TwoMassContact(DrivenArm(0.4, 8.0), StruckBody(2.0), padding)
    mass = 1 / (1 / mp.mpf(8) + 1 / mp.mpf(2))
    exact = closed_form(0.4, mass, 10e3, 1e6, mp.mpf(10e3) * mp.mpf(2e-3) / mp.mpf(10e3))
    found = reference(contact, 0.02)["peak"]
    ours = integrate(contact, 0.02).peak
    off, ours_off = float(abs(found / exact - 1)), float(abs(ours / exact - 1))
    print(f"reference against the closed form: {off:.1e}; ours: {ours_off:.1e}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one case only")
    args = parser.parse_args()
    print(head("scipy", "mpmath", "numpy"))
    check_reference()
    rows = [compare(name, *case) for name, case in list(CASES.items())[: 1 if args.quick else None]]
    columns = ["case", "peak N", "ours ms", "error", "to 1e-13 ms", "error", *SCIPY_METHODS]
    show("error of peak and last force; scipy's time by ours for an error of 1e-3 / 1e-6", columns, rows)
