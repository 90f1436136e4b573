"""The guard: bytes, states and time go in, commands and events come out.

One machine without input or output of its own, so that a replay of a recording is the same run again, bit by bit.
It arms itself once everything has been sound for a while; a touch or a fault then makes the arm react and latch
(``arm_reaction``). Without an arm it reports touches and faults.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from coneskin.errors import RobotConnectionError
from coneskin.skin.events import Event, SkinFault, Touch, TouchBegan, TouchEnded
from coneskin.skin.recording import Block
from coneskin.skin.stream import Stream

from .arming import Arming
from .contact import Contact, GuardedSensor
from .journal import Kind
from .outputs import Outputs, tell
from .owner_messages import Note
from .phase import Phase
from .stop_watch import Way
from .watch import Watch

if TYPE_CHECKING:
    from .arm_reaction import ArmReaction

__all__ = ["GuardCore"]

#: what can be lost -> the ways to stop that go with it
_WAYS: Mapping[str, frozenset[Way]] = {
    "owner": frozenset({Way.OWNER}),
    "script": frozenset({Way.SCRIPT, Way.PROTECTIVE}),
    "dashboard": frozenset({Way.DASHBOARD}),
    "keeper": frozenset({Way.KEEPER}),
}


class GuardCore:
    """See the module.

    Args:
        stream: decodes and detects; it knows the sensors.
        sensors: where they are.
        watch: the limits.
        arm: the arm under guard, or None.
    """

    def __init__(
        self, stream: Stream, sensors: Sequence[GuardedSensor], watch: Watch, arm: ArmReaction | None = None
    ) -> None:
        self._stream = stream
        self._sensors: Mapping[str, GuardedSensor] = {sensor.name: sensor for sensor in sensors}
        self._watch = watch
        self._arm = arm
        self._phase = Phase.STARTING
        self._contacts: dict[str, Contact] = {}
        self._faults: dict[str, str] = {}  # since the last reset
        self._lost: dict[str, str] = {}  # what is gone for good
        self._arming = Arming(watch.settle)
        self._played = False
        self._takers: Mapping[int, Callable[[Block, Outputs], None]] = {
            Kind.SKIN: self._take_skin,
            Kind.ARM: self._take_arm,
            Kind.OWNER: self._take_owner,
            Kind.RESET: self._take_reset,
            Kind.LOST: self._take_lost,
            Kind.SLIDER: self._take_slider,
        }

    @property
    def phase(self) -> Phase:
        """Where the guard is."""
        return self._phase if self._arm is None else self._arm.phase

    @property
    def needs_slider(self) -> bool:
        """Whether a reaction may use the controller's speed slider."""
        return self._arm is not None and self._arm.needs_slider

    @property
    def steers(self) -> bool:
        """Whether a reaction may move an arm that another program moves."""
        return self._arm is not None and self._arm.steers

    def take(self, block: Block, out: Outputs) -> None:
        """Take one input.

        Args:
            block: of a kind in ``journal.INPUTS``; its time is the host's clock.
            out: takes what to send and what happened, as soon as it is decided; a command comes before the event that
                explains it, and before anything is computed that it does not need.
        """
        taker = self._takers.get(block.kind)
        if taker is not None:
            taker(block, out)
        self._look(block.time, out)

    def unsound(self, now: float) -> list[str]:
        """Why the guard cannot arm, one line each; empty where it can."""
        wrong = [*self._lost.values(), *self._faults.values()]
        for detector in self._stream.detectors:
            name = detector.sensor.name
            if detector.age(now) > self._watch.skin_silence:
                wrong.append(f"{name}: no valid frame" + (f" ({detector.fault.value})" if detector.fault else ""))
            elif detector.touched:
                wrong.append(f"{name}: it is touched, or its layers are stuck together")
            elif not detector.ready:
                wrong.append(f"{name}: {detector.fault.value if detector.fault else 'settling'}")
        return wrong if self._arm is None else wrong + self._arm.unsound(now)

    # ---- what comes in

    def _take_skin(self, block: Block, out: Outputs) -> None:
        for event in self._stream.feed(block.payload, block.time):
            self._skin_event(event, out)

    def _skin_event(self, event: Event, out: Outputs) -> None:
        if isinstance(event, SkinFault):
            if self.phase is not Phase.STARTING or not event.sensor:  # until then ``unsound`` says it, and no longer
                self._fault(event.time, event.message, out)
            return
        assert isinstance(event, Touch)
        if isinstance(event, TouchEnded):
            self._contacts.pop(event.sensor, None)
            self._locate()
            tell(out, "touch_ended", event.time, sensor=event.sensor)
            return
        began = isinstance(event, TouchBegan)
        where, before = self._sensors[event.sensor], self._contacts.get(event.sensor)
        if self._arm is not None:
            self._arm.touch(event.time, where.link, event.level, began, out)
        if began:
            self._arming.disturb()
        contact = self._contacts[event.sensor] = Contact(event, where, *where.place(event.u, event.phi))
        self._locate()
        if began:
            tell(out, "contact", event.time, **contact.details())
        elif event.location_valid and not (before and before.touch.location_valid):
            tell(out, "contact_placed", event.time, **contact.details())

    def _locate(self) -> None:
        if self._arm is not None:
            self._arm.locate([item.on_link() for item in self._contacts.values()])

    def _take_arm(self, block: Block, out: Outputs) -> None:
        if self._arm is None:
            return
        try:
            state = self._arm.decode_state(block.time, block.payload)
        except RobotConnectionError as exc:
            self._fault(block.time, f"the controller's state cannot be read: {exc}", out)
            return
        self._arm.sample(state, out)
        if state.stopped_by_safety and self.phase.watched:
            self._fault(block.time, "the controller's own safety system has stopped the arm", out)
        elif not state.running and self.phase.watched:
            self._fault(block.time, "the arm is not powered any more, or its brakes are closed", out)
        self._watch_program(block.time, state.playing, out)

    def _watch_program(self, now: float, playing: bool, out: Outputs) -> None:
        """The program of ur_rtde ends by itself when its owner hangs, and nobody else may have noticed."""
        if self._arm is None or not self._arm.owned or not self.phase.watched:
            self._played = False
        elif playing:
            self._played = True
        elif self._played:
            self._played = False
            self._fault(now, "the program of ur_rtde has ended on the controller: is its owner hung?", out)

    def _take_owner(self, block: Block, out: Outputs) -> None:
        if self._arm is None:
            return
        note = Note.decode(block.payload)
        if note.kind == "ready":
            self._arm.owner_ready = True
        elif note.kind == "error":
            self._arm.lose(_WAYS["owner"], block.time, for_good=False)
            self._fault(block.time, note.text, out)

    def _take_lost(self, block: Block, out: Outputs) -> None:
        what, _, why = block.payload.decode("utf-8", "replace").partition("\n")
        self._lost[what] = why
        if self._arm is not None:
            self._arm.owner_ready &= what not in ("owner", "keeper")
            self._arm.lose(_WAYS.get(what, frozenset()), block.time)
            if what == "slider":
                self._arm.slow_down.note(block.time, None)
        self._react(block.time, why, out)
        tell(out, "ending" if what == "supervisor" else "fault", block.time, what=why)

    def _take_slider(self, block: Block, out: Outputs) -> None:
        if self._arm is None:
            return
        try:
            self._arm.slow_down.note(block.time, self._arm.decode_slider(block.payload))
        except RobotConnectionError as exc:
            self._fault(block.time, f"the speed slider cannot be read: {exc}", out)

    def _take_reset(self, block: Block, out: Outputs) -> None:
        if self.phase is not Phase.LATCHED or self._arm is None:
            tell(out, "message", block.time, what=f"nothing to reset: the guard is {self.phase.value}")
            return
        if self._arming.resetting:
            return  # what comes of it will be told
        self._faults.clear()
        if wrong := self.unsound(block.time):
            tell(out, "refused", block.time, what="reset", reasons=wrong)
            return
        self._stream.forget_faults()
        self._arming.reset(block.time)
        tell(out, "reset", block.time)

    # ---- what is decided

    def _look(self, now: float, out: Outputs) -> None:
        """What only the passing of time shows."""
        for event in self._stream.silence(now, self._watch.skin_silence):
            self._skin_event(event, out)
        arm = self._arm
        if arm is not None:
            if arm.phase is not Phase.STARTING and arm.silent(now):
                self._fault(now, f"the controller has sent no state for {1e3 * self._watch.arm_silence:g} ms", out)
            arm.look(now, out)
        if self.phase is Phase.STARTING:
            if self._arming.starts(now, self.unsound(now), out):
                self._arm_now(now, out)
        elif self._arming.resetting:
            wrong = self.unsound(now)
            if self.phase is not Phase.LATCHED:
                wrong.append("something has moved the arm, or it is not seen to stand")
            if self._arming.settles(now, wrong, out):
                self._arm_now(now, out)

    def _arm_now(self, now: float, out: Outputs) -> None:
        if self._arm is None:
            self._phase = Phase.ARMED
        else:
            self._arm.arm(out)
        tell(out, "armed", now)

    def _fault(self, now: float, what: str, out: Outputs) -> None:
        if what in self._faults:
            return
        self._faults[what] = what
        self._react(now, what, out)
        tell(out, "fault", now, what=what)

    def _react(self, now: float, why: str, out: Outputs) -> None:
        if self._arm is not None:
            self._arm.fault(now, why, out)
