"""Push-in figure: how far the arm's surface moves towards a body after the two have touched, beside a bare stop.

    python -m bench push-in [--collisions 2000] [--reactions retreat,slow] [--parallel 2] [--keep FILE] [--json]
    python -m bench push-in --case 123 --reactions retreat [--picture out.png]

Random collisions (push_in_cases.py), the same ones in each reaction, in virtual time: the guard's core reads the
bytes of a virtual skin, and an arm of bounded acceleration obeys its commands as late as was measured. What touches is
a stiff pad at a place that is true whatever the skin reads (tests.support.pressing_body).

For each contact: the way of the surface at the true place towards the body, after the two touched, at its largest; a
collision counts with its worst contact. Excess: the same less what a bare stop does in the same collision. The exit
code is 0 only if no excess is above --most-mm.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path

from bench.report import head, quantile
from coneskin.robot.arm.models import arm_model
from coneskin.robot.guard.phase import Phase
from coneskin.robot.reaction.types import Reaction
from tests.support.collision_rig import CollisionRig

from .push_in_cases import ALL_CASES, RandomCollision, case_of, draw

REACTIONS = {
    "stop": Reaction("stop"),
    "retreat": Reaction("retreat"),
    "comply": Reaction("comply"),
    "slow": Reaction("slow"),
}


_MODEL = "of the sheets; auto: the field where several bodies press, because they short a ladder out"


@dataclass(frozen=True)
class PushIn:
    """Outcome of one collision in one reaction.

    Attributes:
        seed: of the collision.
        case: its case.
        pushed_in: of each body [m].
        latched: the guard latched in the end.
        moved: the arm moved away, or went on slowly.
        why: the last reason that the guard gave.
    """

    seed: int
    case: str
    pushed_in: tuple[float, ...]
    latched: bool
    moved: bool
    why: str

    @property
    def worst(self) -> float:
        """Of the worst body [m]."""
        return max(self.pushed_in)

    def excess(self, stop: PushIn) -> float:
        """Return how much farther than in a bare stop the surface moved towards the worst body [mm]."""
        return 1e3 * max(own - bare for own, bare in zip(self.pushed_in, stop.pushed_in, strict=True))


def play(collision: RandomCollision, reaction: str, seed: int, sheets: str) -> CollisionRig:
    """Run one collision."""
    if sheets == "auto":
        sheets = "field" if len(collision.bodies) > 1 else "ladder"
    rig = CollisionRig(
        arm_model(collision.arm),
        collision.q,
        collision.qd,
        collision.skins,
        REACTIONS[reaction],
        seed=seed,
        heeds=collision.heeds,
        sheets=sheets,
    )
    rig.collide(collision.bodies)
    return rig


def measure(
    seed: int, reactions: Iterable[str], sheets: str, collision: RandomCollision | None = None
) -> dict[str, PushIn]:
    """Run a collision in each of these reactions: that of the seed, or the one that is given."""
    collision = collision or draw(seed)
    found = {}
    for reaction in reactions:
        rig = play(collision, reaction, seed, sheets)
        names = [event.name for event in rig.events]
        reasons = [str(event.details["why"]) for event in rig.events if event.details.get("why")]
        found[reaction] = PushIn(
            seed,
            collision.case,
            tuple(round(item.pushed_in, 6) for item in rig.pressing),
            rig.is_in(Phase.LATCHED),
            "retreating" in names or "speed_reduced" in names,
            reasons[-1] if reasons else "",
        )
    return found


#: seed -> reaction -> outcome
Found = dict[int, dict[str, PushIn]]


def measure_all(args: argparse.Namespace, reactions: list[str], found: Found) -> None:
    """Measure what --keep does not hold yet."""
    seeds = [seed for seed in range(args.collisions) if args.only in case_of(seed)]
    wanted = {seed: [name for name in reactions if name not in found.get(seed, {})] for seed in seeds}
    left = {seed: names for seed, names in wanted.items() if names}
    with ProcessPoolExecutor(args.parallel) as pool:
        runs = {pool.submit(measure, seed, names, args.model): seed for seed, names in left.items()}
        for done, run in enumerate(as_completed(runs), 1):
            seed = runs[run]
            found.setdefault(seed, {}).update(run.result())
            if args.keep:
                row = {name: asdict(outcome) for name, outcome in run.result().items()}
                with args.keep.open("a") as file:
                    print(json.dumps(row), file=file)
            print(f"\r{done} of {len(left)} collisions   ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)


def read(path: Path) -> Found:
    """Return what --keep has written."""
    found: Found = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        for reaction, row in json.loads(line).items():
            row["pushed_in"] = tuple(row["pushed_in"])
            found.setdefault(row["seed"], {})[reaction] = PushIn(**row)
    return found


def summary(found: Found, reaction: str, case: str) -> dict[str, object] | None:
    """Return one line of the table [mm]."""
    both = [(row[reaction], row["stop"]) for row in found.values() if reaction in row and "stop" in row]
    both = [(own, stop) for own, stop in both if case in (own.case, "all")]
    if not both:
        return None
    ways = [1e3 * own.worst for own, _ in both]
    over = {own.seed: own.excess(stop) for own, stop in both}
    worst = sorted(over, key=lambda seed: -over[seed])[:3]
    return {
        "reaction": reaction,
        "case": case,
        "count": len(both),
        "moved": sum(own.moved for own, _ in both),
        "median": quantile(ways, 0.5),
        "p99": quantile(ways, 0.99),
        "worst": max(ways),
        "excess_median": quantile(list(over.values()), 0.5),
        "excess_p99": quantile(list(over.values()), 0.99),
        "excess_worst": max(over.values()),
        "above_2": sum(value > 2.0 for value in over.values()),
        "above_5": sum(value > 5.0 for value in over.values()),
        "not_latched": sum(not own.latched for own, _ in both),
        "worst_seeds": [seed for seed in worst if over[seed] > 2.0],
    }


def table(found: Found, reactions: list[str], as_json: bool) -> float:
    """Print the table; return the worst excess [mm]."""
    highest = 0.0
    if not as_json:
        names = ("count", "moved", *("median", "p99", "worst") * 2)
        columns = "".join(f"{name:>8}" for name in names)
        print(f"{'mm towards the body':30}{'':16}{'surface':>24}{'excess over the stop':>24}")
        print(f"{'reaction, case':30}{columns}{'> 2':>6}{'> 5':>6}  worst seeds")
    for reaction in reactions:
        for case in (*ALL_CASES, "all"):
            line = summary(found, reaction, case)
            if line is None:
                continue
            highest = max(highest, float(line["excess_worst"]))  # type: ignore[arg-type]
            if as_json:
                print(json.dumps(line))
                continue
            numbers = [line[key] for key in ("median", "p99", "worst", "excess_median", "excess_p99", "excess_worst")]
            cells = "".join(f"{value:8.1f}" for value in numbers)
            seeds = " ".join(map(str, line["worst_seeds"]))  # type: ignore[call-overload]
            print(
                f"{reaction + ', ' + case:30}{line['count']:8}{line['moved']:8}{cells}"
                f"{line['above_2']:6}{line['above_5']:6}  {seeds}"
            )
    return highest


def show(seed: int, reaction: str, args: argparse.Namespace) -> None:
    """Print the course of one collision, and draw it."""
    collision = draw(seed)
    rig = play(collision, reaction, seed, args.model)
    heeds = "heeds" if collision.heeds else "does not heed"
    print(f"{seed}: {collision.case}, {collision.arm}, {reaction}; what moves it {heeds} the slider")
    for item in rig.pressing:
        print(f"  {item.body}\n    pushed in {1e3 * item.pushed_in:.1f} mm, touched from {item.began:.3f} s on")
    for event in rig.events:
        if event.time >= rig.began - 0.01:
            print(f"  {event.time - rig.began:7.3f} s  {event.name:16} {event.details}")
    if args.picture:
        draw_picture(rig, args.picture, f"{collision.case}, {collision.arm}, {reaction}, seed {seed}")


def draw_picture(rig: CollisionRig, path: Path, title: str) -> None:
    """Draw how far the surface moved towards each body, and the force."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5), layout="constrained")
    ways, forces = figure.subplots(2, 1, sharex=True)
    for number, item in enumerate(rig.pressing, 1):
        times = [time for time, _, _ in item.path]
        ways.plot(times, [1e3 * way for _, way, _ in item.path], label=f"body {number}, {item.body.sensor}")
        forces.plot(times, [force for _, _, force in item.path])
    for event in rig.events:
        if event.time >= rig.began and event.name in ("stopping", "retreating", "latched", "speed_reduced"):
            ways.axvline(event.time - rig.began, color="0.8", linewidth=0.8)
            ways.text(event.time - rig.began, 0.02, event.name, rotation=90, transform=ways.get_xaxis_transform())
    ways.set(title=title, ylabel="towards the body [mm]")
    forces.set(xlabel="since the collision began [s]", ylabel="force [N]")
    ways.legend()
    figure.savefig(path)


def main() -> int:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--collisions", type=int, default=2000, help="in each reaction (%(default)s)")
    parser.add_argument("--reactions", default=",".join(REACTIONS), help="(%(default)s)")
    parser.add_argument("--model", default="auto", choices=("auto", "ladder", "field"), help=_MODEL)
    parser.add_argument("--only", default="", metavar="WORD", help="only cases with this in their name")
    parser.add_argument("--parallel", type=int, default=1)
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each collision to this file; go on from it")
    parser.add_argument("--most-mm", type=float, default=2.0, help="excess that is allowed [mm] (%(default)g)")
    parser.add_argument("--case", type=int, metavar="SEED", help="show one collision")
    parser.add_argument("--picture", type=Path, help="of that collision")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    reactions = args.reactions.split(",")
    if unknown := set(reactions) - set(REACTIONS):
        parser.error(f"reactions must be of {', '.join(REACTIONS)}, got {', '.join(unknown)}")
    if args.case is not None:
        show(args.case, reactions[0] if args.reactions != ",".join(REACTIONS) else "retreat", args)
        return 0
    if "stop" not in reactions:
        reactions.insert(0, "stop")
    if not args.json:
        print(f"{head()}\n{args.collisions} collisions, the same in each reaction; sheets: {args.model}\n")
    found = read(args.keep) if args.keep and args.keep.exists() else {}
    measure_all(args, reactions, found)
    return 1 if table(found, reactions, args.json) > args.most_mm else 0
