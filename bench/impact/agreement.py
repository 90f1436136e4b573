"""Agreement of the contact's model with MuJoCo: peak force, impulse and compression in random pushes.

    python -m bench impact-agreement [--pushes 200] [--first 0] [--by-mass | --permissible] [--list]

In MuJoCo six joints with servos and torque limits move an arm; the model has one mass on one servo. Both get the same
padding, body, reaction time and deceleration; the guard has no part in it. Where the model holds is said beforehand, by
what it leaves out of the push (bench/impact/neglected.py), and not by what MuJoCo answers. --by-mass: the servo is that
of ``coneskin permissible``, which knows the mass alone. --permissible: with the extra way that it takes, too, at worst
of all directions of the joints. What matters then is that no peak is far below MuJoCo's. The exit code is 0 only if all
for which the model holds agree; with --permissible, only if no peak is more than 5 % too low.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from dataclasses import dataclass

from bench.report import head, quantile
from coneskin.impact.simulation.mujoco_plant import MujocoPlant
from coneskin.impact.simulation.scene_description import SheetOnLink
from coneskin.scene.values.scene import BodyScene

from .neglected import CHANGE_LIMIT, Neglected, neglected
from .pushes import DAMPING_RATIO, HORIZON, LINK, LINK_CONE, MODEL, RADIUS, Push, draw_push

AGREED_SHARE = 0.05
_CYCLE, _STEP = 5e-4, 1e-4  # s from one target to the next; of the engine


@dataclass(frozen=True)
class Comparison:
    """One push in the model and in MuJoCo.

    Attributes:
        seed: of it.
        errors: of peak, impulse and compression: the model over MuJoCo, less 1.
        bottoms: whether the padding bottoms out in the model.
        left_out: of the model.
    """

    seed: int
    errors: tuple[float, float, float]
    bottoms: bool
    left_out: Neglected

    @property
    def worst(self) -> float:
        """Greatest of the three."""
        return max(map(abs, self.errors))


def compare(seed: int, by_mass: bool, permissible: bool) -> Comparison | None:
    """Return the comparison of a seed; None where it gives no push."""
    push = draw_push(seed)
    if push is None:
        return None
    straight = push.course(by_mass=by_mass or permissible)
    left_out = neglected(push, straight)  # before the engine is asked
    courses = [straight, push.course(extra=push.extra())] if permissible else [straight]
    answers = [max(values) for values in zip(*((c.peak, c.impulse, c.deepest) for c in courses), strict=True)]
    engine = _engine(push, straight.braked)
    peak, impulse, deepest = (said / found - 1.0 for said, found in zip(answers, engine, strict=True))
    return Comparison(seed, (peak, impulse, deepest), answers[2] > push.padding.thickness, left_out)


def _engine(push: Push, braked: float) -> tuple[float, float, float]:
    """Return peak [N], impulse [N s] and compression [m] of a push in MuJoCo."""
    body = push.body
    hand = BodyScene("hand", push.ball, radius=RADIUS, mass=body.mass, stiffness=body.support, damping=DAMPING_RATIO)
    qd = [0.0] * 6
    qd[push.joint] = push.rate
    plant = MujocoPlant(MODEL, [SheetOnLink("one", LINK, LINK_CONE)], [hand], push.padding, push.q, qd, step=_STEP)
    target = list(push.q)
    for step in range(round(HORIZON / _CYCLE)):
        before, _ = push.turned(step * _CYCLE, braked)
        after, _ = push.turned((step + 1) * _CYCLE, braked)
        target[push.joint] = push.q[push.joint] + before
        qd[push.joint] = (after - before) / _CYCLE
        plant.update(target, qd, _CYCLE)
    return plant.peak, plant.impulse, plant.deepest


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pushes", type=int, default=200, help="(%(default)s)")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="(%(default)s)")
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--by-mass", action="store_true", help="with the servo of `coneskin permissible`")
    kinds.add_argument("--permissible", action="store_true", help="and with the extra way that it takes")
    parser.add_argument("--list", action="store_true", help="print each push")
    args = parser.parse_args()
    found: list[Comparison] = []
    seed = args.first
    while len(found) < args.pushes:
        if (one := compare(seed, args.by_mass, args.permissible)) is not None:
            found.append(one)
            if args.list:
                show(one)
        seed += 1
    print(head("mujoco", "numpy"))
    print(f"{len(found)} pushes by a UR5e's forearm, seeds {args.first} to {seed - 1}; the model over MuJoCo, less 1")
    columns = (("count", 6), ("within 5 %", 12), ("peak: median", 14), ("95 %", 8), ("worst", 8))
    print(
        " " * 44 + "".join(f"{name:>{w}}" for name, w in (*columns, ("impulse: worst", 16), ("compression: worst", 20)))
    )
    held = [one for one in found if one.left_out.holds]
    line(f"holds: what is left out changes under {CHANGE_LIMIT:.0%}", held)
    line("... padding does not bottom out", [one for one in held if not one.bottoms])
    line("... padding bottoms out", [one for one in held if one.bottoms])
    line("does not hold", [one for one in found if not one.left_out.holds])
    reasons = Counter(one.left_out.reason for one in found if not one.left_out.holds)
    for reason, _ in reasons.most_common():
        line(f"... {reason}", [one for one in found if one.left_out.reason == reason])
    low = [one.errors[0] for one in found if one.errors[0] < -AGREED_SHARE]
    worst = abs(min(low, default=0.0))
    print(f"peak more than {AGREED_SHARE:.0%} below MuJoCo's: {len(low)} of {len(found)}, at most {worst:.1%}")
    if args.permissible:
        return 1 if low else 0
    return 0 if all(one.worst <= AGREED_SHARE for one in held) else 1


def line(name: str, rows: list[Comparison]) -> None:
    """Print a line of the table."""
    if not rows:
        return
    peaks = [abs(one.errors[0]) for one in rows]
    within = sum(one.worst <= AGREED_SHARE for one in rows)
    median = quantile([one.errors[0] for one in rows], 0.5)
    impulse, deepest = (max(abs(one.errors[n]) for one in rows) for n in (1, 2))
    print(
        f"{name:44}{len(rows):>6}{within:>12}{median:>+14.1%}{quantile(peaks, 0.95):>8.1%}{max(peaks):>8.1%}"
        f"{impulse:>16.1%}{deepest:>20.1%}"
    )


def show(one: Comparison) -> None:
    """Print one push: errors, and what was said beforehand."""
    own = one.left_out
    errors = " ".join(f"{error:+8.1%}" for error in one.errors)
    joints = "   -  " if math.isnan(own.joints) else f"{own.joints:6.1%}"
    said = f"joints {joints}  way {own.way:7.1%}  most {own.most:7.1%}  torque {own.torque:5.2f}"
    print(f"{one.seed:4} {errors}   {said}  {own.reason or 'holds'}", flush=True)
