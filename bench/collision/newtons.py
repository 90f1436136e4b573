"""Worth of the guard in newtons: random collisions in the physics engine, guarded, force-limited and unprotected.

    python -m bench collision [--collisions 500] [--parallel 2] [--keep FILE] [--picture out.png] [--json]
    python -m bench collision --case 123 --way retreat

Random collisions (bench/collision/cases.py), the same ones in each way: the guard with each of its reactions, the
controller's own force limit imitated (impact.simulation.force_limit), and nothing. Force arises from the motion: MuJoCo
moves the arm and the bodies, the padding makes the force, the skin's bytes reach the guard, its stop changes the motion
(coneskin.impact.simulation.collision_run), in virtual time with the latencies that were measured.

peak: greatest force on the body. clamp: force 0.5 s after the first contact. worse: collisions whose clamp is more than
--most-n above a bare stop's. missed: a body felt more than 5 N and nothing was sent to stop the arm. The exit code is 0
only if the guard missed none and no reaction is worse.

One run takes 0.25 s (force limit, nothing) to 1 s of one core: 2000 collisions in all six ways a good hour of two idle
cores. Each finished collision is in the file of --keep; the same line goes on from it, and the table names the commits.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from bench.report import commit, head, quantile
from coneskin.impact.simulation.collision_run import CollisionRun
from coneskin.skin.materials import Padding

from .cases import BODY_KINDS, RUN_UP_ACCELERATION, draw

REACTIONS = ("stop", "retreat", "comply", "slow")
WAYS = (*REACTIONS, "force limit", "nothing")
_FELT_FORCE = 5.0  # N from which on a collision that nothing noticed counts as missed
_LEAST, _FEW = 0.3, 5  # N that the picture shows for nothing; collisions below which it shows no median
_SPEED_BANDS = ((0.0, 0.25), (0.25, 0.5), (0.5, 1.0), (1.0, 2.0))  # m/s


@dataclass(frozen=True)
class Row:
    """Outcome of one collision in one way; fields as of `ImpactOutcome`, what was drawn, and the commit that ran it."""

    seed: int
    way: str
    kind: str
    arm: str
    drawn: float
    peak: float
    clamp: float
    impulse: float
    depth: float
    approach: float
    noticed: float
    standstill: float
    commit: str = "unknown"

    @property
    def met(self) -> bool:
        """Whether the two touched as they were to: not while the arm still ran up, and not at all."""
        return self.peak > 0.0 and self.approach > 0.5 * self.drawn

    @property
    def missed(self) -> bool:
        """Whether a body felt it and nothing stopped the arm."""
        return self.peak > _FELT_FORCE and math.isnan(self.noticed)


def play(seed: int, way: str) -> tuple[CollisionRun, Row]:
    """Run one collision in one way."""
    impact = draw(seed)
    protection = "guard" if way in REACTIONS else way
    scene = impact.scene(way if way in REACTIONS else "stop")
    run = CollisionRun(scene, [impact.body], impact.start, protection=protection, seed=seed)
    outcome = run.run(lambda _: (impact.qd, RUN_UP_ACCELERATION), longest=0.9)
    numbers = {name: round(value, 6) for name, value in asdict(outcome).items()}
    return run, Row(seed, way, impact.body.kind, impact.arm, round(impact.approach, 4), **numbers)


def measure(seed: int, ways: list[str], made_by: str) -> list[Row]:
    """Run one collision in several ways, by a commit."""
    return [replace(play(seed, way)[1], commit=made_by) for way in ways]


def rows_of(kept: Path) -> dict[int, dict[str, Row]]:
    """Return the rows of a file of --keep, by seed and way."""
    found: dict[int, dict[str, Row]] = {}
    for line in kept.read_text(encoding="utf-8").splitlines():
        row = Row(**json.loads(line))
        found.setdefault(row.seed, {})[row.way] = row
    return found


def measure_all(args: argparse.Namespace, ways: list[str]) -> dict[int, dict[str, Row]]:
    """Measure what --keep does not hold yet; each row keeps the commit that was checked out when its run began."""
    made_by, began = commit(), time.monotonic()
    found: dict[int, dict[str, Row]] = {}
    if args.keep and args.keep.exists():
        text = args.keep.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        if whole != text:  # the run was ended while it wrote its last line
            args.keep.write_text(whole, encoding="utf-8")
        found = rows_of(args.keep)
    wanted = {seed: [way for way in ways if way not in found.get(seed, {})] for seed in range(args.collisions)}
    left = {seed: names for seed, names in wanted.items() if names}
    with ProcessPoolExecutor(args.parallel) as pool:
        runs = [pool.submit(measure, seed, names, made_by) for seed, names in left.items()]
        for done, run in enumerate(as_completed(runs), 1):
            for row in run.result():
                found.setdefault(row.seed, {})[row.way] = row
                if args.keep:
                    with args.keep.open("a") as file:
                        print(json.dumps(asdict(row)), file=file)
            left_min = (time.monotonic() - began) / done * (len(runs) - done) / 60.0
            words = f"\r{done} of {len(runs)} collisions, {left_min:.0f} min left   "
            print(words, end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return found


def summary(rows: list[tuple[Row, Row | None]], most: float) -> dict[str, object]:
    """Return one line of the table, from outcomes and those of a bare stop in the same collisions."""
    own = [row for row, _ in rows]
    stood = [row.standstill for row in own if not math.isnan(row.standstill)]
    over = {row.seed: row.clamp - stop.clamp for row, stop in rows if stop is not None}
    worst = sorted(over, key=lambda seed: -over[seed])[:3]
    line: dict[str, object] = {"count": len(own)}
    for name, factor in (("peak", 1.0), ("clamp", 1.0), ("impulse", 1.0), ("depth", 1e3)):
        values = [factor * getattr(row, name) for row in own]
        line |= {f"{name}_median": quantile(values, 0.5), f"{name}_p95": quantile(values, 0.95)}
        line[f"{name}_worst"] = max(values)
    return line | {
        "bottomed": sum(row.depth > Padding().thickness for row in own),
        "standstill_median_ms": 1e3 * quantile(stood, 0.5) if stood else math.nan,
        "still_moving": len(own) - len(stood),
        "missed": sum(row.missed for row in own),
        "worse": sum(value > most for value in over.values()),
        "worst_excess": max(over.values(), default=math.nan),
        "worst_seeds": [seed for seed in worst if over[seed] > most],
    }


def lines_of(found: dict[int, dict[str, Row]], most: float) -> list[dict[str, object]]:
    """Return the lines of the table: each way, in each kind of body and band of speed, and in all."""
    table = []
    for way in WAYS:
        pairs = [(row[way], row.get("stop")) for row in found.values() if way in row and row[way].met]
        cases = [(kind, [pair for pair in pairs if pair[0].kind == kind]) for kind in BODY_KINDS]
        cases += [
            (f"{low:g} to {high:g} m/s", [pair for pair in pairs if low <= pair[0].approach < high])
            for low, high in _SPEED_BANDS
        ]
        for case, chosen in (*cases, ("all", pairs)):
            if chosen:
                table.append({"way": way, "case": case, **summary(chosen, most)})
    return table


def show(table: list[dict[str, object]]) -> None:
    """Print the table."""
    print(f"{'':26}{'peak N':>24}{'clamp N':>24}{'impulse Ns':>12}{'depth mm':>14}{'stood':>8}{'still':>7}")
    print(
        f"{'way, case':26}" + f"{'median':>8}{'p95':>8}{'worst':>8}" * 2 + f"{'median':>12}{'median':>7}{'worst':>7}",
        end="",
    )
    print(f"{'ms':>8}{'moves':>7}{'count':>7}{'missed':>7}{'worse':>6}  worst seeds")
    for line in table:
        names = ("peak_median", "peak_p95", "peak_worst", "clamp_median", "clamp_p95", "clamp_worst")
        cells = "".join(f"{line[name]:8.0f}" for name in names)
        cells += f"{line['impulse_median']:12.1f}{line['depth_median']:7.1f}{line['depth_worst']:7.1f}"
        cells += f"{line['standstill_median_ms']:8.0f}{line['still_moving']:7}{line['count']:7}"
        seeds = " ".join(map(str, line["worst_seeds"]))  # type: ignore[call-overload]
        print(f"{line['way'] + ', ' + line['case']:26}{cells}{line['missed']:7}{line['worse']:6}  {seeds}")  # type: ignore[operator]


def best(table: list[dict[str, object]]) -> None:
    """Print which reaction leaves the smallest clamping force and the smallest peak, case by case."""
    print("\nbest reaction (median of the clamp; of the peak)")
    for case in dict.fromkeys(str(line["case"]) for line in table):
        own = [line for line in table if line["case"] == case and line["way"] in REACTIONS]
        if own:
            clamp = min(own, key=lambda line: line["clamp_median"])  # type: ignore[arg-type,return-value]
            peak = min(own, key=lambda line: line["peak_median"])  # type: ignore[arg-type,return-value]
            words = (
                f"{clamp['way']!s:10} {clamp['clamp_median']:6.0f} N   {peak['way']!s:10} {peak['peak_median']:6.0f}"
            )
            print(f"  {case:20}{words} N")


def draw_picture(found: dict[int, dict[str, Row]], path: Path) -> None:
    """Draw peak and clamping force over the speed, for each way."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.5), layout="constrained")
    axes = figure.subplots(1, 2, sharex=True, sharey=True)
    for way, colour in zip(WAYS, ("C0", "C2", "C4", "C1", "C7", "C3"), strict=True):
        rows = [row[way] for row in found.values() if way in row and row[way].met]
        for axis, name in zip(axes, ("peak", "clamp"), strict=True):
            speeds, forces = [row.approach for row in rows], [max(_LEAST, getattr(row, name)) for row in rows]
            axis.scatter(speeds, forces, s=5, color=colour, alpha=0.35, linewidths=0)
            bands = [[getattr(row, name) for row in rows if low <= row.approach < high] for low, high in _SPEED_BANDS]
            at = [math.sqrt(max(low, 0.1) * high) for low, high in _SPEED_BANDS]
            middles = [max(_LEAST, quantile(band, 0.5)) if len(band) >= _FEW else math.nan for band in bands]
            axis.plot(at, middles, color=colour, marker="o", label=way)
    for axis, title in zip(axes, ("peak force", "force 0.5 s after the first contact"), strict=True):
        axis.set(title=title, xlabel="speed at contact [m/s]", xscale="log", yscale="log")
    axes[0].set_ylabel("force [N]")
    handles, labels = axes[1].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=len(labels), title="median of each", fontsize="small"
    )
    figure.savefig(path, dpi=110)


def show_case(seed: int, way: str) -> None:
    """Print the course of one collision."""
    run, row = play(seed, way)
    print(draw(seed))
    print(row)
    for event in run.events:
        print(f"  {event.time - run.meter.began:8.3f} s  {event.name:18} {event.details}")


def main() -> int:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--collisions", type=int, default=500, help="each in every way (%(default)s)")
    parser.add_argument("--ways", default=",".join(WAYS), help="(%(default)s)")
    parser.add_argument("--parallel", type=int, default=1)
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each outcome to this file; go on from it")
    parser.add_argument("--most-n", type=float, default=5.0, help="clamp above a bare stop's that is allowed [N]")
    parser.add_argument("--case", type=int, metavar="SEED", help="show one collision")
    parser.add_argument("--way", default="stop", choices=WAYS, help="of that collision")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    if args.case is not None:
        show_case(args.case, args.way)
        return 0
    ways = args.ways.split(",")
    if unknown := set(ways) - set(WAYS):
        parser.error(f"ways must be of {', '.join(WAYS)}, got {', '.join(unknown)}")
    found = measure_all(args, ways)
    table = lines_of(found, args.most_n)
    if args.json:
        for line in table:
            print(json.dumps(line))
    else:
        runs = sum(len(row) for row in found.values())
        away = sum(not row.met for rows in found.values() for row in rows.values())
        made = Counter(row.commit for rows in found.values() for row in rows.values())
        print(f"{head()}: of this table; the runs were made at {', '.join(f'{at} ({n})' for at, n in made.items())}")
        print(f"{len(found)} collisions, {runs} runs, {away} that brushed past and are left out\n")
        show(table)
        best(table)
    if args.picture:
        draw_picture(found, args.picture)
    guarded = [line for line in table if line["way"] in REACTIONS and line["case"] == "all"]
    return 1 if any(line["missed"] or line["worse"] for line in guarded) else 0
