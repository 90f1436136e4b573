"""Breaks: for each invariant one change of the guard that breaks it, to show that the explorer would find such a one.

Each names the actions that are left to the world, so that it is found within seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any
from unittest.mock import patch

from coneskin.robot.driver.messages import SetJointVelocity
from coneskin.robot.driver.values import SetSpeedSlider
from coneskin.robot.guard import arm_supervisor
from coneskin.robot.guard.activation import Activation, ActivationStep
from coneskin.robot.guard.arm_supervisor import ArmSupervisor
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.motion.setpoint_stream import MotionStream
from coneskin.robot.guard.phase import Act, Phase
from coneskin.robot.guard.signals.journal import EventName, emit
from coneskin.robot.stop.standstill import StandstillWatch
from coneskin.robot.stop.state_age import StateAge
from coneskin.robot.stop.stop_monitor import StopMonitor
from coneskin.skin.detection.stream import TouchStream

from .explorer import Exploration, explore
from .guard_world import PROGRESS, GuardWorld, Settings

_ALWAYS = ("wait", "wait for a change", "a program moves", "unlock")
_SETTINGS, _TWO = Settings(), Settings(most_wrong=2)
_MOTION = (0.1, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Break:
    """One change of the guard.

    Attributes:
        owner, name, becomes: what is changed, and the function that is given what was there.
        words: what that is, for people.
        actions: that the world is left, beside waiting and a program that moves.
        settings: of the world.
    """

    owner: Any
    name: str
    becomes: Callable[[Any], Any]
    words: str
    actions: tuple[str, ...]
    settings: Settings = _SETTINGS


def _then(after: Callable[..., None]) -> Callable[[Any], Any]:
    """Return what makes a method do something more afterwards."""

    def become(was: Any) -> Any:
        def method(self: Any, *args: Any) -> Any:
            found = was(self, *args)
            after(self, *args)
            return found

        return method

    return become


def _instead(value: Any) -> Callable[[Any], Any]:
    return lambda _: lambda *_: value


def _older_clock(was: Any) -> Any:
    """What a fresh state was before: one whose time is the latest so far."""

    def feed(self: Any, state: Any) -> float:
        measured_at: float = was(self, state)
        latest = getattr(self, "latest", -math.inf)
        self.newest = self.newest._replace(stepped=0.0)
        if state.controller_time <= latest:
            self.newest = self.newest._replace(fresh_at=self.latest_at)
        else:
            self.latest, self.latest_at = state.controller_time, state.time
        return measured_at

    return feed


def _any_stop(was: Any) -> Any:
    def reset(self: Any, block: Any, out: Any) -> None:
        number = self._arm.supervision.stop
        was(self, block._replace(payload=b"%d %s" % (number, block.payload.split()[1])), out)

    return reset


def _no_acknowledgement(was: Any) -> Any:
    def release(self: Any, number: int, out: Any) -> None:
        was(self, number, out)
        emit(out, EventName.ACTIVATED, 0.0, request=0)

    return release


def _at_once(was: Any) -> Any:
    def release(self: Any, now: float, blockers: Any, out: Any) -> ActivationStep:
        return ActivationStep.RELEASE if self.number == 1 else was(self, now, blockers, out)

    return release


def _inward(was: Any) -> Any:
    def stream(self: Any, motion: Any, *args: Any) -> None:
        update = motion.update

        def turned(here: Any, contacts: Any) -> Any:
            step = update(here, contacts)
            return step._replace(qd=tuple(-v for v in step.qd)) if hasattr(step, "_replace") else _turn(step)

        motion.update = turned
        was(self, motion, *args)

    return stream


def _turn(step: Any) -> Any:
    return replace(step, qd=tuple(-v for v in step.qd)) if hasattr(step, "qd") else step


def _move(_: Any, state: Any, out: Any) -> None:
    if state.stopped_by_safety:
        out.append(SetJointVelocity(_MOTION, 1.0))


def _numbered(was: Any) -> Any:
    def change(state: Any, cue: Any, *args: Any, **more: Any) -> Any:
        then, act = was(state, cue, *args, **more)
        return replace(then, stop=then.stop + (act is Act.STOP)), act

    return change


def _raise(*_: Any) -> None:
    raise KeyError("suspended")


_TOUCH = ("touch one", "mend one")
BREAKS: dict[str, Break] = {
    "touched": Break(ArmSupervisor, "touch", _instead(None), "a touch is not heard", _TOUCH),
    "first": Break(
        *(ArmSupervisor, "stop_for_touch"),
        lambda was: lambda self, link, level, out: emit(out, EventName.MESSAGE, 0.0) or was(self, link, level, out),
        *("an event is put out before the stop", _TOUCH),
    ),
    "still": Break(
        *(ArmSupervisor, "_latch"),
        _then(lambda _, state, out: out.append(SetJointVelocity(_MOTION, 1.0))),
        *("a latched arm is moved", _TOUCH),
    ),
    "safety": Break(
        *(ArmSupervisor, "sample", _then(_move)),
        *("an arm that the controller holds is moved", ("safety wrong", "mend safety")),
    ),
    "contact": Break(
        *(MotionStream, "__init__", _inward, "a retreat goes inward", _TOUCH),
        Settings("retreat"),
    ),
    "latches": Break(
        *(StandstillWatch, "begin"),
        lambda was: lambda self, now, duration: was(self, now, math.inf),
        *("a watch never ends", _TOUCH),
    ),
    "reset": Break(
        *(GuardCore, "_reset", _any_stop, "a reset forgives any stop", (*_TOUCH, "reset another stop")),
    ),
    "release": Break(
        *(GuardCore, "_suspend"),
        _then(lambda self, block, out: self._arm.release(self._activation.number, out)),
        *("a release goes out although nobody has reset", (*_TOUCH, "suspended")),
    ),
    "acknowledged": Break(
        *(ArmSupervisor, "release", _no_acknowledgement, "active without an acknowledgement", ("reset",)),
    ),
    "bounded": Break(
        *(StateAge, "feed", _older_clock),
        *("a fresh state is one later than all before", ("clock steps back", "clock steps ahead")),
    ),
    "counted": Break(arm_supervisor, "transition", _numbered, "a stop has two numbers", _TOUCH),
    "fault": Break(
        *(TouchStream, "silence", _instead([]), "a silent skin is untouched", ("skin mute", "mend the skin")),
    ),
    "escalates": Break(
        StopMonitor, "next_paths", _instead([]), "one stop path is enough", ("all paths fail", *_TOUCH), _TWO
    ),
    "answered": Break(
        *(
            Activation,
            "poll",
            lambda was: (
                lambda self, now, blockers, out: (
                    ActivationStep.WAIT if self.resetting else was(self, now, blockers, out)
                )
            ),
        ),
        *("a reset is never over", (*_TOUCH, "reset")),
    ),
    "slider": Break(
        *(ArmSupervisor, "_stands"),
        lambda was: lambda self, *args: args[-1].append(SetSpeedSlider(1.0)) or was(self, *args),
        *("a standing arm's slider is raised", ("all paths fail", "mend the arm", *_TOUCH)),
        _TWO,
    ),
    "raises": Break(GuardCore, "_suspend", lambda _: _raise, "a suspension raises", ("suspended",)),
    PROGRESS: Break(
        *(ArmSupervisor, "blockers"),
        lambda was: lambda self, now: [*was(self, now), *(["no"] if self.phase is Phase.LATCHED else [])],
        *("no reset is accepted", (*_TOUCH, "reset")),
    ),
}


@contextmanager
def broken(name: str) -> Iterator[Break]:
    """Break an invariant for the length of a ``with``."""
    change = BREAKS[name]
    with patch.object(change.owner, change.name, change.becomes(getattr(change.owner, change.name))):
        yield change


def find(name: str) -> Exploration:
    """Break an invariant, and explore until that is found, or to the end."""
    with broken(name) as change:
        world = GuardWorld(change.settings, only=frozenset({*_ALWAYS, *change.actions}))
        return explore(world, PROGRESS, stop_at_first=True)
