"""What becomes of a worse clamp: collisions of bench `collision` in which a reaction was worse than a stop, later.

    python -m bench collision-settled FILE [--most-n 5] [--until 1.5]

FILE is that of ``collision.py --keep``. The clamp is the force 0.5 s after the first contact; hands that grip may
still close then. So each collision whose clamp was more than --most-n above a bare stop's is run again, with the stop
and with the reaction, until --until seconds after the contact, and both forces are compared then as well. ``torque`` is
how much of its highest torque the most strained joint bears from the contacts as a motion away begins.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from bench.report import head, show
from coneskin.core.recording.block import Block
from coneskin.impact.simulation.collision_run import CollisionRun
from coneskin.impact.simulation.impact_outcome import CLAMP_TIME
from coneskin.robot.arm.inertia import arm_inertia
from coneskin.robot.guard.signals.journal import BlockKind, EventName, decode_event

from .cases import RUN_UP_ACCELERATION, draw
from .newtons import REACTIONS, rows_of


def settle(seed: int, way: str, until: float) -> tuple[float, float, float]:
    """Return the clamp, the force at ``until`` [N], and the share of a joint's highest torque; NaN without a motion."""
    impact = draw(seed)
    highest, shares = arm_inertia(impact.arm).torque, [math.nan]

    def note(block: Block) -> None:
        if block.kind == BlockKind.EVENT and decode_event(block).name == EventName.RETREATING:
            shares.append(max(abs(own) / most for own, most in zip(run.plant.external, highest, strict=True)))

    run = CollisionRun(impact.scene(way), [impact.body], impact.start, seed=seed, note=note)
    outcome = run.run(lambda _: (impact.qd, RUN_UP_ACCELERATION), longest=1.0 + until, after=until - CLAMP_TIME)
    return outcome.clamp, run.plant.force, shares[min(1, len(shares) - 1)]


def main() -> None:
    """Run again what was worse, and print both forces."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kept", type=Path)
    parser.add_argument("--most-n", type=float, default=5.0)
    parser.add_argument("--until", type=float, default=1.5, help="after the first contact [s] (%(default)s)")
    args = parser.parse_args()
    print(head())
    table = []
    still, count = 0, 0
    for seed, rows in sorted(rows_of(args.kept).items()):
        stop = rows.get("stop")
        ways = [way for way in REACTIONS[1:] if stop and way in rows and rows[way].met]
        for way in [way for way in ways if stop and rows[way].clamp - stop.clamp > args.most_n]:
            (before, rest, _), (clamp, force, share) = settle(seed, "stop", args.until), settle(seed, way, args.until)
            count, still = count + 1, still + (force - rest > args.most_n)
            forces = (f"{newtons:.0f}" for newtons in (before, clamp, rest, force))
            table.append([seed, rows[way].kind, way, *forces, f"{share:.2f}"])
    columns = ["seed", "body", "way", "stop N", "way N", "later: stop N", "way N", "torque"]
    show(f"clamp {CLAMP_TIME:g} s and force {args.until:g} s after the contact", columns, table)
    print(f"{count} clamps were worse by more than {args.most_n:g} N, {still} still are after {args.until:g} s")
