"""A movement as one URScript program, for an arm that nobody but the controller moves for us. Pure.

Each program sent to the controller replaces the one that runs, and the arm brakes in between. So the whole way is
worked out beforehand and sent at once: short speedj commands, one after the other, each with its own time, and a stopj.
It ends by itself, whatever becomes of the guard and of the network.
"""

from __future__ import annotations

from collections.abc import Sequence

from .commands import STILL, ArmState, ContactOnLink, Done, RetreatProgram
from .movement import Movement
from .ur_models import Joints

__all__ = ["SEGMENT", "retreat_program"]

SEGMENT = 0.02  #: s of one speedj: the direction turns by less than 1 deg in it at 150 mm/s
_CYCLE = 0.002
_MOST = 400  # of them: 8 s, 40 kB


def retreat_program(
    movement: Movement, state: ArmState, contacts: Sequence[ContactOnLink], deceleration: float
) -> RetreatProgram | Done:
    """Work out the whole of a movement.

    Args:
        movement: what to do; it is asked as if the arm followed, and must not keep anything from one step to the next.
        state: the arm, standing.
        contacts: the touches.
        deceleration: of the stopj at the end [rad/s2].
    """
    lines: list[str] = []
    q, qd, time = state.q, STILL, state.time
    while len(lines) < _MOST:
        step = movement.step(ArmState(time, q, qd), contacts)
        if isinstance(step, Done):
            break
        speeds = ", ".join(f"{value:.5f}" for value in step.qd)
        lines.append(f"  speedj([{speeds}], {step.acceleration:.3f}, {SEGMENT})\n")
        for _ in range(round(SEGMENT / _CYCLE)):
            qd = _ramped(qd, step.qd, step.acceleration * _CYCLE)
            q = _six([angle + _CYCLE * speed for angle, speed in zip(q, qd, strict=True)])
        time += SEGMENT
    else:
        step = Done("the program would become too long")
    if not lines:
        return step
    text = f"def coneskin_retreat():\n{''.join(lines)}  stopj({deceleration:.3f})\nend\n"
    return RetreatProgram(text, SEGMENT * len(lines), step.progress, step.reason)


def _ramped(qd: Joints, wanted: Joints, most: float) -> Joints:
    """Joint speeds one cycle later: in proportion, the leading joint by no more than this [rad/s]."""
    gap = max(abs(b - a) for a, b in zip(qd, wanted, strict=True))
    share = min(1.0, most / gap) if gap else 1.0
    return _six([a + share * (b - a) for a, b in zip(qd, wanted, strict=True)])


def _six(values: Sequence[float]) -> Joints:
    a, b, c, d, e, f = values
    return a, b, c, d, e, f
