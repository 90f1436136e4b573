"""``coneskin impact``: the arm of a scene makes its motion and meets its bodies, in the physics engine.

The same collision with each way to protect the body: the scene's guard, the guard with each reaction, the controller's
own force limit imitated, and nothing. In virtual time; nothing that moves is real.

example:
  coneskin impact scene.toml
  coneskin impact scene.toml --ways "guard,stop,nothing" --json

The scene needs an [arm], a [motion], skins and at least one [[body]] in the way of a skin (docs/do/impact.md).

Exit code: 0 if the arm met a body and the guard noticed it; 1 otherwise.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import SceneError
from coneskin.core.text import finite

if TYPE_CHECKING:
    from coneskin.impact.simulation.impact_outcome import ImpactOutcome
    from coneskin.scene.values.scene import Scene

_REACTION_NAMES = ("stop", "retreat", "comply", "slow")
_NO_GUARD = ("force limit", "nothing")
_STOP_WAYS = ("guard", *_REACTION_NAMES, *_NO_GUARD)
_COLUMN_NAMES = (
    *(("peak", 1.0, "N"), ("clamp", 1.0, "N"), ("impulse", 1.0, "Ns")),
    *(("depth", 1e3, "mm"), ("noticed", 1e3, "ms"), ("standstill", 1e3, "ms")),
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of the command."""
    add = parser.add_argument
    add("scene", type=Path, metavar="SCENE", help="scene file, TOML")
    help_text = "what protects the body: guard (as the scene says), a reaction, force limit, nothing (default: all)"
    add("--ways", default=",".join(_STOP_WAYS), help=help_text)
    add("--seed", type=int, default=0, help="of the skins' noise (default 0)")
    add("--longest-s", type=float, default=20.0, metavar="T", help="for which to look on (default 20)")
    add("--json", action="store_true", help="print one JSON object")


def run(args: argparse.Namespace) -> int:
    """Run the collision in each way, and print the forces."""
    from coneskin.scene.commissioning_record import with_commissioning
    from coneskin.scene.reader import load_scene

    scene = load_scene(args.scene)
    ways = [way.strip() for way in args.ways.split(",")]
    _check(scene, ways)
    scenes = {way: with_commissioning(_with_reaction(scene, way), time.time()) for way in ways}
    found = {way: _collide(scenes[way], way, args) for way in ways}
    if args.json:
        print(json.dumps({way: finite(asdict(outcome)) for way, outcome in found.items()}))
    else:
        _print(scenes, found)
    guarded = [outcome for way, outcome in found.items() if way not in _NO_GUARD]
    return 0 if all(outcome.peak > 0.0 and not math.isnan(outcome.noticed) for outcome in guarded) else 1


def _check(scene: Scene, ways: list[str]) -> None:
    """Refuse a scene in which nothing can be met, and ways that do not exist."""
    problems = [f"--ways: {way!r} is none of {', '.join(_STOP_WAYS)}" for way in ways if way not in _STOP_WAYS]
    needed = {
        "an [arm] that moves": scene.arm,
        "a [motion] to make": scene.motion,
        "a [[link]] with a [[link.sensor]]": scene.sensors,
        "a [[body]] to run into": scene.bodies,
    }
    problems += [f"an impact needs {name}: see docs/do/impact.md" for name, part in needed.items() if not part]
    if problems:
        raise SceneError(problems, scene.name)


def _with_reaction(scene: Scene, way: str) -> Scene:
    """Return the scene with the reaction of a way; as it is where the way is none."""
    if way not in _REACTION_NAMES:
        return scene
    return replace(scene, reaction=replace(scene.default_reaction, kind=way), rules=())


def _collide(scene: Scene, way: str, args: argparse.Namespace) -> ImpactOutcome:
    from coneskin.impact.simulation.collision_run import CollisionRun, follow_waypoints

    assert scene.motion is not None
    motion = scene.motion
    protection = "guard" if way in ("guard", *_REACTION_NAMES) else way
    first, *rest = motion.waypoints
    run = CollisionRun(scene, scene.bodies, first, protection=protection, seed=args.seed)
    return run.run(follow_waypoints(rest, motion.speed, motion.acceleration), longest=args.longest_s)


def _print(scenes: dict[str, Scene], found: dict[str, ImpactOutcome]) -> None:
    from coneskin.scene.build import withheld_motion

    for way, scene in scenes.items():
        if way not in _NO_GUARD and (why := withheld_motion(scene)):
            print(f"{way}: the arm only stops where it would move away: {why}")
    if not any(outcome.peak > 0.0 for outcome in found.values()):
        print("the skin met no body on the way: bare parts of the arm meet nothing in this simulation")
        return
    speed = max(outcome.approach for outcome in found.values())
    print(f"the surfaces meet at {speed:.2f} m/s")
    print(f"{'':14}" + "".join(f"{f'{name} {unit}':>15}" for name, _, unit in _COLUMN_NAMES))
    for way, outcome in found.items():
        cells = (factor * getattr(outcome, name) for name, factor, _ in _COLUMN_NAMES)
        print(f"{way:14}" + "".join(f"{'never' if math.isnan(cell) else f'{cell:.1f}':>15}" for cell in cells))
    print(
        "clamp: force 0.5 s after the first contact. Simulated, with assumed servos and padding: no safety assessment."
    )
