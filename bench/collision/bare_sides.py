"""What a reaction presses where no skin sees: bodies behind bare strips, at the elbow and the wrists, and thumbs.

    python -m bench bare-sides [--collisions 2000] [--parallel 2] [--keep FILE] [--bare-side allowed|stop|fast] [--json]
    python -m bench bare-sides --case 123 --way comply

An arm with a skin of wrap 300 on one tube, in the physics engine. In every other turn it stands, else it runs into what
touches it. Behind it, as seen from the touch, is a body that no skin sees: a wall, a post or a hand on a spring, at the
bare strip, at the elbow or at a wrist. Or a hand grips it, with the thumb on the strip. The links are hard.

beyond: greatest force of one contact from the first standstill on, less a bare stop's in the same case and time. way:
the same of the way of a surface into what does not move by itself. pushed: beyond, behind an arm that complies, over
the push. The exit code is 0 only if no reaction is --most-n and --most-mm beyond a bare stop.
"""

from __future__ import annotations

import argparse
import json
import math
import random
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from bench.report import commit, head, quantile, show
from coneskin.geometry.pose import Vector
from coneskin.impact.simulation.collision_run import CollisionRun
from coneskin.robot.arm.kinematics import link_poses, point_jacobian
from coneskin.robot.arm.model import Joints
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.vectors import added, dot, minus, scaled
from coneskin.robot.arm.workspace import arm_parts
from coneskin.robot.guard.signals.journal import EventName
from coneskin.robot.reaction.retreat import plan_retreat, retreat_step
from coneskin.robot.reaction.types import ArmState, ContactOnLink, Done, Reaction
from coneskin.scene.build import SensorOnArm, place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import BodyScene, Scene
from tests.support.bare_parts import bare_parts_of
from tests.support.scenes import commissioned

from .cases import ARM_MODELS, RUN_UP, RUN_UP_ACCELERATION, SPEED_RANGE, STIFFNESS_RANGE, scene_text

WAYS = ("stop", "retreat", "comply")
PLACES = ("strip", "elbow", "wrist 1", "wrist 3", "thumb")
BEHIND = ("wall", "post", "hand")
WRAP = math.radians(300.0)
STANDING = 0.01  # rad/s
LONGEST = 3.0  # s
MET = 1.0  # N behind a bare stop, from which on the body was in the arm's way before: such a case is left out
SETTLED = 2.5  # s after the first contact, in every way alike: a grip that closes later presses a bare stop as well
AT_REST = 0.8  # s after it, from which on a latched arm at rest among hands at rest has nothing more to show
REST = 0.1, 0.02, 1e-5  # s in which no force changes by more than this [N], no joint and no hand by that [rad, m]


@dataclass(frozen=True)
class Case:
    """Case that a seed gives: the arm, its motion, what touches it, and what is behind it."""

    arm: str
    link: str
    start: Joints
    qd: Joints
    bodies: tuple[BodyScene, ...]
    place: str
    behind: str
    push: float

    def scene(self, kind: str, bare_side: str) -> Scene:
        reaction = f'kind = "{kind}"\nbare_side = "{bare_side}"'
        return _scene(self.arm, self.link, reaction)


@dataclass(frozen=True)
class Row:
    """Outcome of one case in one way; forces [N] and ways [m] of touch and what is behind, from standstill on."""

    seed: int
    way: str
    place: str
    behind: str
    moving: bool
    push: float
    forces: tuple[float, ...]
    depths: tuple[float, ...]
    moved: float
    why: str
    commit: str = "unknown"


@cache
def _scene(arm: str, link: str, reaction: str) -> Scene:
    text = scene_text(arm, reaction, (link,)).replace("xyz_mm", f"wrap_deg = {math.degrees(WRAP):g}\nxyz_mm")
    return commissioned(parse_scene(text))


@cache
def _skin(arm: str, link: str) -> SensorOnArm:
    return place_on_arm(_scene(arm, link, 'kind = "stop"'))[0]


def draw(seed: int) -> Case:
    rng = random.Random(f"bare side {seed}")
    while (found := _try(rng, PLACES[seed % len(PLACES)], BEHIND[seed // 5 % 3], seed // 15 % 2 == 1)) is None:
        pass
    return found


def _try(rng: random.Random, place: str, behind: str, moving: bool) -> Case | None:
    arm, link = rng.choice(ARM_MODELS), rng.choice(("upper_arm", "forearm", "forearm"))
    model, skin, angle = arm_model(arm), _skin(arm, link), rng.uniform
    lift, elbow = math.radians(angle(-150.0, -30.0)), math.radians(rng.choice((-1.0, 1.0)) * angle(35.0, 140.0))
    q: Joints = (angle(-3.1, 3.1), lift, elbow, angle(-3.1, 3.1), angle(-3.1, 3.1), angle(-3.1, 3.1))
    cone, poses = skin.frustum, link_poses(model, q)
    u, phi = angle(0.12, 0.88) * cone.frustum.slant, math.radians(angle(115.0, 185.0))  # the strip is behind that
    pose = poses[skin.link]
    point, normal = pose.apply(cone.point(u, phi)), pose.rotate(cone.normal(phi))
    qd: Joints = (0.0,) * 6
    if moving:
        raw = [angle(-1.0, 1.0) for _ in range(6)]
        rows = point_jacobian(model, q, skin.link, cone.point(u, phi))
        velocity = [sum(j * v for j, v in zip(row, raw, strict=True)) for row in rows]
        along = sum(n * v for n, v in zip(normal, velocity, strict=True))
        if along < 0.6 * math.hypot(*velocity):
            return None
        speed = math.exp(angle(math.log(SPEED_RANGE[0]), math.log(0.4)))
        a, b, c, d, e, f = (speed / along * value for value in raw)
        qd = (a, b, c, d, e, f)
        if any(abs(v) > 0.9 * most for v, most in zip(qd, model.joint_speed, strict=True)):
            return None
    contact = ContactOnLink(skin.link, cone.point(u, phi), cone.normal(phi))
    plan = plan_retreat(model, ArmState(0.0, q), [contact], Reaction("retreat"))
    step = plan if isinstance(plan, Done) else retreat_step(plan, ArmState(0.0, q))
    if isinstance(step, Done):
        return None
    way = RUN_UP - 0.5 * max(map(abs, qd)) / RUN_UP_ACCELERATION if moving else 0.0
    a, b, c, d, e, f = (x - way * v for x, v in zip(q, qd, strict=True))
    start: Joints = (a, b, c, d, e, f)
    push = math.exp(angle(math.log(5.0), math.log(60.0)))
    stiffness = math.exp(angle(*map(math.log, STIFFNESS_RANGE)))
    size = angle(0.02, 0.05)
    middle = added(point, scaled(normal, size - (0.0 if moving else 2e-4)))
    if place == "thumb":
        across = pose.rotate(cone.normal(phi + math.pi))
        far = pose.apply(cone.point(u, (phi + math.pi) % math.tau))
        other = minus(added(far, scaled(across, size + angle(0.01, 0.04))), middle)
        grip = BodyScene("grip", middle, other, size, mass=0.6, stiffness=stiffness, force=push, delay=angle(0.05, 0.3))
        return Case(arm, link, start, qd, (grip,), place, "thumb", push)
    spot = _spot(arm, link, place, q, step.qd, u, phi)
    if spot is None:
        return None
    there, outward, number, local = spot
    before = link_poses(model, start)[number].apply(local)
    run_up = max(0.0, dot(minus(before, there), outward))
    if run_up > 0.04:
        return None
    at = added(there, scaled(outward, run_up + angle(0.002, 0.015)))
    person = BodyScene("person", middle, radius=size, mass=1.2, stiffness=stiffness, force=push, delay=0.02)
    if behind == "wall":
        body = BodyScene("wall", at, scaled(outward, -1.0), radius=0.04)
    elif behind == "post":
        axis = pose.rotate(cone.normal(phi + 0.5 * math.pi))
        body = BodyScene("post", added(at, scaled(outward, 0.02)), axis, radius=0.02, length=0.1)
    else:
        body = BodyScene("hand", added(at, scaled(outward, 0.03)), radius=0.03, mass=1.2, stiffness=stiffness)
    return Case(arm, link, start, qd, (person, body), place, behind, push)


def _spot(
    arm: str, link: str, place: str, q: Joints, away: Joints, u: float, phi: float
) -> tuple[Vector, Vector, int, Vector] | None:
    """Return a bare place that leads in the retreat: where, its outward normal, its link, and where in that frame."""
    model, skin = arm_model(arm), _skin(arm, link)
    here, then = link_poses(model, q), link_poses(model, [x + 0.1 * v for x, v in zip(q, away, strict=True)])
    if place == "strip":
        far = (phi + math.pi) % math.tau
        local, number = skin.frustum.point(u, far), skin.link
        outward = here[number].rotate(skin.frustum.normal(far))
    else:
        part = next(part for part in arm_parts(model) if part[0] == place)
        number, middle = part[1], scaled(added(part[2], part[3]), 0.5)
        axis = here[number].rotate(minus(part[3], part[2]))
        step = minus(then[number].apply(middle), here[number].apply(middle))
        step = minus(step, scaled(axis, dot(step, axis) / dot(axis, axis)))
        if (length := math.sqrt(dot(step, step))) < 0.003:
            return None  # it hardly moves
        outward = scaled(step, 1.0 / length)
        there = added(here[number].apply(middle), scaled(outward, 0.5 * model.d[4]))
        local = here[number].inverse().apply(there)
    there = here[number].apply(local)
    leads = dot(minus(then[number].apply(local), there), outward) > 0.002
    return (there, outward, number, local) if leads else None


def play(seed: int, way: str, bare_side: str) -> tuple[CollisionRun, Row]:
    """Run one case in one way."""
    case = draw(seed)
    scene = case.scene(way, bare_side)
    run = CollisionRun(scene, case.bodies, case.start, seed=seed, bare=bare_parts_of(scene), period=5)
    parts = len(run.plant.parts)
    forces, depths = [0.0] * parts, [0.0] * parts
    starts = run.plant.places
    stood = False
    seen = [0.0]  # when, the forces then, and where joints and hands were

    def program(_: object) -> tuple[Joints, float] | None:
        return (case.qd, RUN_UP_ACCELERATION) if any(case.qd) else None

    def look() -> bool:
        nonlocal stood, seen
        stood = stood or (run.meter.noticed and max(map(abs, run.plant.qd)) < STANDING)
        if not stood:
            return False
        now = []
        for part, (place, began) in enumerate(zip(run.plant.places, starts, strict=True)):
            mine = [contact for contact in run.plant.contacts if contact.part == part]
            now.append(sum(contact.force for contact in mine))
            forces[part] = max(forces[part], now[part])
            for contact in mine:
                gave = 0.0 if run.plant.parts[part].acts else float(contact.normal @ minus(place, began))
                depths[part] = max(depths[part], contact.depth + gave)
        since, (period, newtons, length) = run.now - run.meter.began, REST
        if not run.latched or since < AT_REST or since - seen[0] < period:
            return run.latched and since > SETTLED
        before, where = seen, [*run.plant.q, *(x for place in run.plant.places for x in place)]
        seen = [since, *now, *where]
        most = [newtons] * parts + [length] * len(where)
        return len(before) > 1 and all(abs(a - b) < c for a, b, c in zip(seen[1:], before[1:], most, strict=True))

    run.run(program, longest=LONGEST, after=LONGEST, look=look)
    moved = run.event(EventName.RETREATED)
    ends = [str(event.details["why"]) for event in run.events if "why" in event.details]
    row = Row(
        *(seed, way, case.place, case.behind, any(case.qd), round(case.push, 2)),
        tuple(round(force, 2) for force in forces),
        tuple(round(depth, 6) for depth in depths),
        moved.details["progress"] if moved else 0.0,
        ends[-1] if ends else "",
    )
    return run, row


def measure(seed: int, ways: list[str], bare_side: str, made_by: str) -> list[Row]:
    rows: list[Row] = []
    for way in ways:  # a bare stop first
        if way == "stop" or not in_the_way(rows[:1]):
            rows.append(play(seed, way, bare_side)[1])
    return [Row(**{**asdict(row), "commit": made_by}) for row in rows]


def in_the_way(stop: Sequence[Row]) -> bool:
    """Tell whether what is behind the arm presses a bare stop too: it was in the arm's way before it was touched."""
    return any(row.way == "stop" and row.place != "thumb" and row.forces[1] >= MET for row in stop)


def beyond(row: Row, stop: Row) -> tuple[float, float]:
    """Return force [N] and way [mm] beyond a bare stop's, of the worst contact."""
    force = max(a - b for a, b in zip(row.forces, stop.forces, strict=True))
    return force, 1e3 * max(a - b for a, b in zip(row.depths, stop.depths, strict=True))


def main() -> int:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--collisions", type=int, default=2000, help="cases, each in every way (%(default)s)")
    parser.add_argument("--from", type=int, default=0, dest="first", help="first seed (%(default)s)")
    parser.add_argument("--parallel", type=int, default=1)
    parser.add_argument("--keep", type=Path, metavar="FILE", help="add each outcome to this file; go on from it")
    parser.add_argument("--bare-side", default="allowed", choices=("allowed", "stop", "fast"))
    parser.add_argument("--most-n", type=float, default=20.0)
    parser.add_argument("--most-mm", type=float, default=2.0)
    parser.add_argument("--case", type=int, metavar="SEED", help="show one case")
    parser.add_argument("--way", default="comply", choices=WAYS, help="of that case")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    if args.case is not None:
        run, row = play(args.case, args.way, args.bare_side)
        print(draw(args.case), row, sep="\n")
        for event in run.events:
            print(f"  {event.time - run.meter.began:8.3f} s  {event.name:18} {event.details}")
        return 0
    found: dict[int, dict[str, Row]] = {}
    if args.keep and args.keep.exists():
        for line in args.keep.read_text(encoding="utf-8").splitlines():
            row = Row(**json.loads(line))
            found.setdefault(row.seed, {})[row.way] = row
    seeds = range(args.first, args.first + args.collisions)
    wanted = {seed: [way for way in WAYS if way not in found.get(seed, {})] for seed in seeds}
    left = {seed: ways for seed, ways in wanted.items() if ways and not in_the_way([*found.get(seed, {}).values()])}
    made_by = commit()
    with ProcessPoolExecutor(args.parallel) as pool:
        runs = [pool.submit(measure, seed, ways, args.bare_side, made_by) for seed, ways in left.items()]
        for done, future in enumerate(as_completed(runs), 1):
            for row in future.result():
                found.setdefault(row.seed, {})[row.way] = row
                if args.keep:
                    with args.keep.open("a", encoding="utf-8") as file:
                        print(json.dumps(asdict(row)), file=file)
            print(f"\r{done} of {len(runs)} cases   ", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    return table(found, args)


def table(found: dict[int, dict[str, Row]], args: argparse.Namespace) -> int:
    rows, bad = [], 0
    for way in WAYS[1:]:
        for place in (*PLACES, "all"):
            pairs = [(by[way], by["stop"]) for by in found.values() if way in by and place in (by[way].place, "all")]
            pairs = [(own, stop) for own, stop in pairs if not in_the_way([stop])]
            if not pairs:
                continue
            over = {own.seed: beyond(own, stop) for own, stop in pairs}
            newtons, ways = ([value[i] for value in over.values()] for i in (0, 1))
            worst = [seed for seed, (n, mm) in over.items() if n > args.most_n and mm > args.most_mm]
            ratios = [(own.forces[1] - stop.forces[1]) / own.push for own, stop in pairs if own.place != "thumb"]
            bad += len(worst) if place == "all" else 0
            cells = [len(pairs), sum(own.moved > 0.001 for own, _ in pairs)]
            cells += [round(value, 1) for value in (quantile(newtons, 0.5), quantile(newtons, 0.99), max(newtons))]
            cells += [round(value, 2) for value in (quantile(ways, 0.99), max(ways))]
            cells += [sum(value > args.most_n for value in newtons), sum(value > args.most_mm for value in ways)]
            more = round(max(ratios), 2) if ratios and way == "comply" else ""
            rows.append([f"{way}, {place}", *map(str, cells), str(len(worst)), str(more)])
            if args.json:
                print(json.dumps({"way": way, "place": place, "worst": sorted(over, key=lambda s: -over[s][0])[:3]}))
    print(head())
    columns = ["way, place", "cases", "moved", "beyond N: median", "p99", "worst", "way mm: p99", "worst"]
    show("Beyond a bare stop", [*columns, "> N", "> mm", "> both", "pushed"], rows)
    return 1 if bad else 0
