"""Whether a retreat helps where a motor is at its highest torque: retreats of bench `collision` from what is fixed.

    python -m bench collision-saturated FILE [--least-n 30]

FILE is that of ``collision.py --keep``. Each retreat from a wall, a post or a hand whose bare stop left a clamp of at
least --least-n is run again, and how much of its highest torque the most strained joint bears from the contacts as the
motion begins is compared with what became of the clamp. Collisions in which no motion began are left out.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from bench.report import head
from coneskin.impact.simulation.impact_outcome import CLAMP_TIME

from .newtons import rows_of
from .settled import settle

_KINDS = ("wall", "post", "hand")
_LIMIT = 0.99  # of its highest torque, from which on a motor is at its limit
_WORSE = 5.0  # N, as in collision.py


def main() -> None:
    """Run the retreats again, and print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kept", type=Path)
    parser.add_argument("--least-n", type=float, default=30.0, help="clamp of the bare stop [N] (%(default)s)")
    args = parser.parse_args()
    print(f"{head()}\n{'seed':>5} {'body':7}{'stop N':>8}{'retreat N':>11}  torque")
    found: list[tuple[float, float, float]] = []
    for seed, rows in sorted(rows_of(args.kept).items()):
        stop = rows.get("stop")
        if stop is None or not stop.met or stop.kind not in _KINDS or stop.clamp < args.least_n:
            continue
        clamp, _, share = settle(seed, "retreat", CLAMP_TIME)
        if not math.isnan(share):
            found.append((stop.clamp, clamp, share))
            print(f"{seed:5} {stop.kind:7}{stop.clamp:8.0f}{clamp:11.0f}{share:8.2f}", flush=True)
    for words, own in (
        (f"below {_LIMIT:g}", [row for row in found if row[2] < _LIMIT]),
        (f"from {_LIMIT:g} on", [row for row in found if row[2] >= _LIMIT]),
    ):
        worse = [clamp - stop for stop, clamp, _ in own if clamp - stop > _WORSE]
        less = sum(clamp < 0.5 * stop for stop, clamp, _ in own)
        most = f", at most by {max(worse):.0f} N" if worse else ""
        print(f"torque {words}: {len(own)} retreats, {len(worse)} worse{most}, {less} left less than half")
