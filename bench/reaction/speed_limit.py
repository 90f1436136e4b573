"""The limit of the speed on programs of strokes, in lock-step: moves of the slider, and how far the limit is exceeded.

    python -m bench speed-limit [--seconds 120]

A mock arm goes to and fro between waypoints; a state each 2 ms, the slider is read each 20 ms, a command takes effect
20 ms later. Permissible speeds are invented: from 0.05 m/s for a lever of 0.1 m/rad to 0.3 m/s from 0.8 m/rad on.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Sequence

from bench.report import head
from coneskin.impact.simulation.collision_run import follow_waypoints
from coneskin.robot.driver.values import SetSpeedSlider
from coneskin.robot.guard.speed.permissible_speeds import PermissiblePatch, PermissibleSpeeds, SurfaceSpeeds
from coneskin.robot.guard.speed.speed_limit import SpeedLimit
from coneskin.robot.sim.mock_arm import MockArm
from coneskin.robot.ur.driver import UR_DRIVER
from tests.support.guard_rig import CONE, LINK, MODEL, START_Q

CYCLE_TIME = 0.002  # s
SLIDER_DELAY = 10  # cycles from a command to its effect
SLIDER = 10  # cycles between two readings of the slider
LEVERS, CURVE = (0.1, 0.2, 0.4, 0.8), (0.05, 0.1, 0.2, 0.3)
PATCHES = tuple(
    PermissiblePatch("front", LINK, CONE.point(u, phi), CONE.normal(phi), CURVE, CURVE)
    for u in (0.0, 0.26)
    for phi in [math.pi * n / 4 for n in range(8)]
)

Leg = tuple[Sequence[float], float, float]  # degrees from the start for each joint, rad/s, rad/s2


def strokes(turn: float, speed: float, acceleration: float) -> list[Leg]:
    """Return the legs of a program that turns the base to and fro [deg, rad/s, rad/s2]."""
    return [((turn,), speed, acceleration), ((0.0,), speed, acceleration)]


#: programs, each repeated for ever
PROGRAMS: dict[str, list[Leg]] = {
    "short, hard: 20 deg, 1 rad/s, 8 rad/s2": strokes(20.0, 1.0, 8.0),
    "60 deg, 1 rad/s, 2 rad/s2": strokes(60.0, 1.0, 2.0),
    "60 deg, 1 rad/s, 8 rad/s2": strokes(60.0, 1.0, 8.0),
    "120 deg, 0.7 rad/s, 8 rad/s2": strokes(120.0, 0.7, 8.0),
    "shoulder: 50 deg, 1 rad/s, 8 rad/s2": [((0, -50.0), 1.0, 8.0), ((0, 0), 1.0, 8.0)],
    "elbow and base: 90 deg, 0.8 rad/s": [((90.0, 0, 60.0), 0.8, 4.0), ((0, 0, 0), 0.8, 4.0)],
    "fast there, slow back: 90 deg, 1.2 and 0.25 rad/s": [((90.0,), 1.2, 6.0), ((0.0,), 0.25, 6.0)],
    "wrist, then base: 90 deg each": [((0, 0, 0, 0, 0, 90.0), 1.0, 6.0), ((60.0,), 1.2, 6.0), ((0,), 1.2, 6.0)],
}


def run(legs: Sequence[Leg], seconds: float) -> str:
    """Return a line of what the limit did to a program."""
    speeds = PermissibleSpeeds(LEVERS, PATCHES, (-7.0,) * 6, (7.0,) * 6)
    limit, surfaces = SpeedLimit(MODEL, speeds), SurfaceSpeeds(MODEL, speeds)
    arm, moves = MockArm(list(START_Q), [0.0] * 6), itertools.cycle(legs)
    program = None
    waiting: list[tuple[int, SetSpeedSlider]] = []
    slider, changes, ratios, ends = 1.0, [], [], []
    for step in range(round(seconds / CYCLE_TIME)):
        now = 100.0 + CYCLE_TIME * step
        while waiting and waiting[0][0] <= step:
            arm.feed(waiting.pop(0)[1])
        if step % SLIDER == 0:
            slider = arm.slider
        wanted = program(arm.q) if program is not None else None
        if wanted is None:
            ends.append(step)
            offsets, speed, acceleration = next(moves)
            goal = [q + math.radians(o) for q, o in itertools.zip_longest(START_Q, offsets, fillvalue=0.0)]
            program = follow_waypoints([goal], speed, acceleration)
            wanted = program(arm.q) or ([0.0] * 6, acceleration)
        arm.go(*wanted)
        state = UR_DRIVER.decode_state(now, arm.poll())
        ratios.append(surfaces.ratio(state.q, state.qd)[0])
        out: list[object] = []
        why = limit.sample(state, slider, out)  # type: ignore[arg-type]
        found = [item for item in out if isinstance(item, SetSpeedSlider)]
        waiting += [(step + SLIDER_DELAY, item) for item in found]
        changes += [step] * len(found)
        if why:
            return f"STOPPED after {CYCLE_TIME * step:.1f} s: {why}"
    late = len(ratios) // 2
    half = [end for end in ends if end >= late]
    per = sum(change >= late for change in changes) / max(1, len(half))
    return (
        f"{len(changes):7d} {per:9.2f} {max(ratios):9.3f} {1e3 * CYCLE_TIME * sum(r > 1.0 for r in ratios):9.0f}"
        f" {max(ratios[late:]):9.3f} {len(half):8d} {arm.slider:8.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=120.0, help="for which each program runs")
    seconds = parser.parse_args().seconds
    print(head())
    print(f"{'':50s} slider   ... per   highest  ms above   highest  strokes  slider")
    print(
        f"{f'over {seconds:g} s; later: in the second half':50s}"
        " moves    later     ratio         1     later    later  at end"
    )
    for name, legs in PROGRAMS.items():
        print(f"{name:50s} {run(legs, seconds)}", flush=True)
