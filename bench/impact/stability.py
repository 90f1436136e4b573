"""Stability of the contact's integrator: a grid of masses, speeds and losses at 10 MN/m, free and held.

    python -m bench impact-stability [--against 60]

Free: two masses, 1 g to 1 t each in steps of a third of a decade, and an arm that nothing slows down, at 0 to 5 m/s.
Nothing may become infinite, no energy may come of nothing, none may go without damping, and the momentum stays. Held:
the arm on its servo brakes, the body is on a spring, for 0.1 s; as many as --against says are compared with scipy's
Radau to 1e-9.
"""

from __future__ import annotations

import argparse
import itertools
import math
import random
import time
from collections.abc import Sequence

import numpy as np

from bench.report import head
from coneskin.impact.permissible_speed.taylor_integrator import integrate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.skin.materials import Padding
from tests.support.stored_energy import stored_energy

from .integrators import SERVO_RATE, by_scipy

MASSES = tuple(10.0 ** (n / 3.0) for n in range(-9, 10))  # kg
SPEEDS = (0.0, 1e-6, 1e-3, 1e-2, 0.1, 0.3, 1.0, 2.0, 5.0)  # m/s
LOSSES = (0.0, 0.3, 10.0)  # s/m
HARD, SUPPORT = 1e7, 20e3  # N/m


def free(masses: Sequence[float]) -> None:
    """Integrate two free masses over the grid, and print what becomes of energy and momentum."""
    gain = drift = shift = 0.0
    times: list[tuple[float, str]] = []
    for arm, body, speed, loss in itertools.product((*masses, math.inf), masses, SPEEDS, LOSSES):
        contact = TwoMassContact(DrivenArm(speed, arm), StruckBody(body), Padding(1e-3, 1e4, HARD, loss))
        begin = time.process_time()
        course = integrate(contact, 0.05)
        where = f"arm {arm:.3g} kg, body {body:.3g} kg, {speed:g} m/s, loss {loss:g} s/m"
        times.append((time.process_time() - begin, where))
        assert all(map(math.isfinite, (course.peak, course.impulse, course.deepest, course.last))), where
        if math.isinf(arm) or speed <= 0.0:
            continue
        for stretch in course.stretches:
            s, w, v = stretch.compression[0], stretch.rate[0], stretch.speed[0]
            energy = 0.5 * arm * (w + v) ** 2 + 0.5 * body * v**2 + stored_energy(contact.padding, s)
            change = energy / (0.5 * arm * speed**2) - 1.0
            gain = max(gain, change)
            drift = max(drift, -change if loss == 0.0 else 0.0)
            shift = max(shift, abs((arm * (w + v) + body * v) / (arm * speed) - 1.0))
    print(f"free: {len(times)} contacts, all finite")
    print(f"  energy: at most {gain:.1e} gained, {drift:.1e} lost without damping; momentum: at most {shift:.1e} off")
    print_times(times)


def held(masses: Sequence[float], against: int) -> None:
    """Integrate a driven arm against a held body over the grid, and some of them with scipy as well."""
    times: list[tuple[float, str]] = []
    contacts = []
    for arm, body, speed in itertools.product((*masses, math.inf), masses, (1e-3, 0.1, 1.0, 5.0)):
        servo = 0.0 if math.isinf(arm) else arm * SERVO_RATE
        driven = DrivenArm(speed, arm, servo * SERVO_RATE, 2.0 * servo, 0.012, 3.0)
        struck = StruckBody(body, support=SUPPORT, damping=0.6 * math.sqrt(SUPPORT * body))
        contact = TwoMassContact(driven, struck, Padding(1e-3, 1e4, HARD))
        begin = time.process_time()
        course = integrate(contact, 0.1)
        where = f"arm {arm:.3g} kg, body {body:.3g} kg, {speed:g} m/s"
        times.append((time.process_time() - begin, where))
        assert all(map(math.isfinite, (course.peak, course.impulse, course.deepest, course.last))), where
        contacts.append((contact, course.peak, course.last, where))
    print(f"held: {len(times)} contacts, all finite")
    print_times(times)
    off: list[tuple[float, str]] = []
    failed = 0
    for contact, peak, last, where in random.Random(1).sample(contacts, min(against, len(contacts))):
        try:
            found, rest = by_scipy(contact, 0.1, "Radau", 1e-9)
        except (ValueError, ArithmeticError):
            failed += 1
            continue
        off.append((max(abs(found - peak), abs(rest - last)) / max(peak, 1e-12), where))
    if off:
        median, (most, where) = float(np.median([one for one, _ in off])), max(off)
        print(
            f"  Radau to 1e-9, {len(off)} of them: peak and last force {median:.1e} apart (median), at most {most:.1e}"
        )
        print(f"  ({where}); Radau failed in {failed}")


def print_times(times: list[tuple[float, str]]) -> None:
    """Print how long they took."""
    spent = [one for one, _ in times]
    longest, where = max(times)
    print(f"  time: median {1e3 * float(np.median(spent)):.2f} ms, most {1e3 * longest:.1f} ms ({where})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=int, default=60, help="of the held ones, with scipy (%(default)s)")
    parser.add_argument("--quick", action="store_true", help="masses in steps of three decades")
    args = parser.parse_args()
    print(head("scipy", "numpy"))
    masses = MASSES[:: 9 if args.quick else 1]
    free(masses)
    held(masses, args.against)
