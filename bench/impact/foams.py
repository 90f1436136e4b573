"""Permissible speeds over foams that are not what their table says: how many contacts press more than the limits.

    python -m bench impact-foams [--cases 500] [--seed 0]

A random foam stiffens from 3 to 20 mm on as foams do; its table is read off at some depths. The foam that is met is the
table's, off by the spread of 15 % at every depth: softer, stiffer, softer until the deepest point and stiffer there, or
in waves. Arm, body, lever, reaction and limits are random. The judge is scipy's Radau with a model of its own.
"""

from __future__ import annotations

import argparse
import random

from bench.report import head, quantile, show
from coneskin.impact.permissible_speed.speed_map import _speed_within_spread, permissible_speed
from tests.support.foams import KINDS, judge, off, random_case

TRUSTED_COUNT = 60  #: cases that are also judged at the speed of a table that is taken as exact


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=500)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    print(head("scipy"))
    chance = random.Random(args.seed)
    shares: dict[str, list[float]] = {kind: [] for kind in KINDS}
    slower, plain = [], 0
    for number in range(args.cases):
        foam, region, at = random_case(chance)
        speed = _speed_within_spread(lambda v, padding, at=at: [at(v, padding)], foam, region.limits)
        if speed <= 0.0:
            continue
        kind = KINDS[number % len(KINDS)]
        contact = at(speed, foam)
        deepest = judge(contact, off(foam, "softer", chance, 1.0), foam.loss)[2]
        law = off(foam, kind, chance, deepest)
        peak, lasting, _ = judge(contact, law, foam.loss)
        shares[kind].append(max(peak / region.limits.transient, lasting / region.limits.lasting))
        if number >= TRUSTED_COUNT:
            continue
        trusting = permissible_speed(lambda v, at=at, foam=foam: [at(v, foam)], region.limits)
        slower.append(speed / trusting)
        peak, lasting, _ = judge(at(trusting, foam), law, foam.loss)
        plain += peak > region.limits.transient or lasting > region.limits.lasting
    rows = [
        [kind, len(own), sum(share > 1.0 for share in own), f"{quantile(own, 0.5):.2f}", f"{max(own, default=0.0):.3f}"]
        for kind, own in shares.items()
    ]
    show("force over its limit, with a foam 15 % off its table", ["foam", "cases", "over", "median", "most"], rows)
    print(f"with a table that is trusted: {plain} of {len(slower)} over")
    print(f"speed over that of a trusted table: median {quantile(slower, 0.5):.2f}, least {min(slower):.2f}")
