"""Core of the guard: bytes, states and time go in, commands and events come out.

One machine without input or output of its own, so that a replay of a recording is the same run again, bit by bit. It
becomes active once nothing has stood against it for a while. From then on a touch or a fault makes the arm react and
latch (``arm_supervisor``). Without an arm it reports touches and faults.

A touch stops the arm before anything else is known of it: the place of the touch, its covariance and every event are
worked out after the command is out.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeVar

from coneskin.core.errors import RobotConnectionError
from coneskin.core.recording.block import Block
from coneskin.robot.driver.messages import StatusReport
from coneskin.robot.driver.protocol import HeartbeatDriver, SliderDriver, require
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.state_age import MAX_SUPERVISION_LAG
from coneskin.skin.detection.events import SkinEvent, SkinFault, TouchBegan, TouchEnded, TouchEvent
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.stream import TouchStream

from .activation import Activation, ActivationStep, ControllerNeeds
from .companion_monitor import CompanionMonitor
from .phase import Phase
from .signals.contact import Contact, GuardedSensor
from .signals.journal import BlockKind, EventFolding, EventName, Outputs, decode_loss, emit

if TYPE_CHECKING:
    from .arm_supervisor import ArmSupervisor
    from .controller_heartbeat import ControllerHeartbeat

#: kept, because each look at a member of an enumeration takes Python 3.11 0.2 us; one by one, because what is named
#: together is looked up in a dictionary where it is compiled
_STARTING_PHASE: Final = Phase.STARTING
_ACTIVE_PHASE: Final = Phase.ACTIVE
_SLOWED_PHASE: Final = Phase.SLOWED
_RETREATING_PHASE: Final = Phase.RETREATING
MIN_STALL: Final = 0.02  #: s between two looks, from which on the guard itself was held up


class _StallClock:
    """Clock on which the guard's own hold-ups are nobody's silence.

    While the guard is held up it hears nobody. What came meanwhile is read next, one input after the other. So for as
    long again the longest hold-up is taken off every silence, and not the sum: a guard that is held up again and again
    reads in between.
    """

    def __init__(self) -> None:
        self._held_up = -math.inf, 0.0, -math.inf  # newest look; longest hold-up, and until when that counts [s]

    def fair(self, now: float) -> float:
        """Return the time by which silences are judged at a host time [s]. To be asked continuously."""
        looked, longest, until = self._held_up
        stall = now - looked
        if MIN_STALL < stall < math.inf:
            longest = stall if now >= until else max(stall, longest)
            until = now + longest
        self._held_up = now, longest, until
        return now - longest if now < until else now


_Decoded = TypeVar("_Decoded")


class GuardCore:
    """Decisions of one guard.

    Args:
        stream: decodes and detects. It knows the sensors.
        sensors: where they are.
        arm: the arm under guard, or None.
        not_commissioned: why the arm only stops where its scene lets it move away. Empty where it does not.
    """

    def __init__(
        self,
        stream: TouchStream,
        sensors: Sequence[GuardedSensor],
        limits: MonitoringLimits,
        arm: ArmSupervisor | None = None,
        not_commissioned: str = "",
    ) -> None:
        self._stream = stream
        self._sensors = {sensor.name: sensor for sensor in sensors}
        self._limits = limits
        self._arm = arm
        self._not_commissioned = not_commissioned
        self._folding = EventFolding()
        self._companions = CompanionMonitor(limits, arm)
        self._clock = _StallClock()
        self._fair = 0.0  # host time of this input, on that clock [s]
        self._activation = Activation(limits.settle)
        self._faults: dict[str, str] = {}  # since the last reset: kind -> what is wrong
        self._lost: dict[str, str] = {}  # port that is gone -> why
        self._reopened = False  # the skin's port, and the guard has not been active since
        self._contacts: dict[str, Contact] = {}  # by sensor
        self._newest_number = 0
        self._extended = 0  # number of the newest touch that was reported as not one disc
        self._located: set[str] = set()  # sensors whose touch had a certain place in its newest event
        self._feeders: dict[int, Callable[[Block, Outputs], None]] = {
            BlockKind.SKIN: self._feed_skin,
            BlockKind.DRIVER: self._feed_report,
            BlockKind.RESET: self._reset,
            BlockKind.LOST: self._lose,
            BlockKind.PROGRAM: self._feed_program,
            BlockKind.HELD_UP: self._feed_hold_up,
            BlockKind.ABSENT: self._miss,
            BlockKind.SUSPENDED: self._suspend,
            BlockKind.REOPENED: self._reopen,
        }
        if arm is not None:
            self._feeders[BlockKind.ARM] = partial(self._feed_arm, arm)
            if isinstance(arm.driver, SliderDriver):  # asked once: a protocol's isinstance takes its time
                self._feeders[BlockKind.SLIDER] = partial(self._feed_slider, arm, arm.driver.decode_speed_fraction)
            if arm.heartbeat is not None:
                decode = require(arm.driver, HeartbeatDriver).decode_heartbeat
                self._feeders[BlockKind.ECHO] = partial(self._feed_echo, arm.heartbeat, decode)

    @property
    def phase(self) -> Phase:
        """Phase in which the guard is."""
        if self._arm is None:
            return Phase.ACTIVE if self._activation.number else Phase.STARTING
        return self._arm.phase

    @property
    def needs(self) -> ControllerNeeds:
        """What it needs of the arm's controller."""
        return ControllerNeeds() if self._arm is None else self._arm.needs

    def feed(self, block: Block, out: Outputs) -> None:
        """Take one input.

        Args:
            block: of a kind in ``journal.INPUTS``. Its time is the host's clock.
            out: takes commands and events as soon as they are decided. A command comes before the event that explains
                it, and before anything is computed that it does not need.
        """
        now = block[1]  # by its place: compiled, unpacking it takes an iterator
        self._fair = self._clock.fair(now)
        feeder = self._feeders.get(block[0])
        if feeder is not None:
            feeder(block, out)
        self._poll(now, out)

    def blockers(self, now: float) -> list[str]:
        """Return why the guard cannot become active, one line each. Empty where it can."""
        blockers = list(dict.fromkeys([*self._lost.values(), *self._faults.values(), *self._companions.blockers]))
        others = self._stream.unknown
        if self._reopened and others:
            expected = ", ".join(f"{d.sensor.device_id}/{d.sensor.sensor_id}" for d in self._stream.detectors)
            sent = ", ".join(f"{device}/{sensor}" for device, sensor in others)
            blockers.append(
                f"another device is on the skin's port: it sends as device/sensor {sent}, guarded was {expected}; plug "
                "in the one that was there"
            )
        waiting: dict[str, list[str]] = {}  # what is said of several sensors is said once
        for detector in self._stream.detectors:
            fault, age, what = detector.fault, detector.timing.age(now), ""
            if age == math.inf and fault in {None, Fault.SILENT}:
                what = "waits for its first valid frame; if none comes, check power and cable"
            elif age > self._limits.skin_silence:
                what = Fault.SILENT.value
                if fault is not None and fault is not Fault.SILENT:
                    what = f"no valid frame ({fault.value})"
            elif detector.touched:
                what = "it is touched, or its layers are stuck together"
            elif not detector.ready:
                what = fault.value if fault else "settling"
            if what:
                waiting.setdefault(what, []).append(detector.sensor.name)
        blockers += [f"{', '.join(names)}: {what}" for what, names in waiting.items()]
        return blockers if self._arm is None else blockers + self._arm.blockers(now)

    # ---- the skin

    def _feed_skin(self, block: Block, out: Outputs) -> None:
        guarded, now = self._arm is not None and self._arm.supervision.phase is _ACTIVE_PHASE, block[1]
        for event in self._stream.feed(block[2], now, partial(self._stop, out) if guarded else None, now - self._fair):
            self._feed_event(event, out)
        if self._contacts:
            self._update_contacts(now, out)

    def _stop(self, out: Outputs, name: str, level: float) -> None:
        """Stop the arm for a touch that begins. The event of the touch, which tells where it is, comes next."""
        assert self._arm is not None
        self._arm.stop_for_touch(self._sensors[name].link, level, out)

    def _feed_event(self, event: SkinEvent, out: Outputs) -> None:
        if isinstance(event, SkinFault):
            if self.phase is not Phase.STARTING or not event.sensor:  # until then ``blockers`` lists it
                self._add_fault(event.time, event.message, out, f"{event.sensor}: {event.fault.value}")
        elif isinstance(event, TouchEnded):
            self._contacts.pop(event.sensor, None)
            if self._arm is not None:
                self._arm.feed_contacts(event.time, tuple(self._contacts.values()), out)
            self._emit_touch(out, EventName.TOUCH_ENDED, event, {"sensor": event.sensor})
        else:
            self._feed_touch(event, out)

    def _feed_touch(self, event: TouchEvent, out: Outputs) -> None:
        """Take a touch that has begun or changed."""
        began = isinstance(event, TouchBegan)
        before = self._contacts.get(event.sensor)
        self._newest_number += began
        number = self._newest_number if began or before is None else before.number
        contact = self._contacts[event.sensor] = Contact(event, self._sensors[event.sensor], number)
        if self._arm is not None:
            self._arm.touch(event.time, contact, began, out)
        if began:
            self._emit_touch(out, EventName.CONTACT, event, contact.details())
        elif event.location_valid and event.sensor not in self._located:
            self._emit_touch(out, EventName.CONTACT_LOCATED, event, contact.details())
        if not event.location_valid and event.elongation is not None and number > self._extended:
            self._extended = number
            self._emit_touch(out, EventName.CONTACT_EXTENDED, event, contact.details())
        (self._located.add if event.location_valid else self._located.discard)(event.sensor)
        if began:
            self._activation.disturb()

    def _update_contacts(self, now: float, out: Outputs) -> None:
        """Give the arm what each touch's newest frame says. Events come only where something changes."""
        contacts = self._contacts
        for detector in self._stream.detectors:
            name, reading = detector.sensor.name, detector.reading_now
            if reading is not None and (before := contacts.get(name)) is not None:
                contacts[name] = Contact(reading, before.where, before.number)
        if self._arm is not None:
            self._arm.feed_contacts(now, tuple(contacts.values()), out)

    def _stale(self, now: float) -> str:
        """Return whose frames are too old to supervise a motion away by. Empty where none are."""
        for detector in self._stream.detectors:
            age = detector.timing.measured_age(now)
            if age > MAX_SUPERVISION_LAG:
                return (
                    f"{detector.sensor.name}: what it measured {1e3 * age:.0f} ms ago is too old to move away by "
                    f"({1e3 * MAX_SUPERVISION_LAG:.0f} ms at most; a busy computer needs fewer frames a second)"
                )
        return ""

    def _emit_touch(self, out: Outputs, name: EventName, event: TouchEvent, details: dict[str, Any]) -> None:
        """Report a touch. Repeated ones are counted where the program does not move an arm."""
        if self._arm is None or self._arm.phase in (Phase.STARTING, Phase.LATCHED):
            self._folding.emit(out, name, event.sensor, event.time, **details)
        else:
            emit(out, name, event.time, **details)

    # ---- the controller

    def _feed_arm(self, arm: ArmSupervisor, block: Block, out: Outputs) -> None:
        """Take a state of the arm, as it was sent."""
        what, decode = "the controller's state cannot be read", partial(arm.driver.decode_state, block.time)
        if (state := self._decode(block, what, decode, out)) is None:
            return
        joints, now, q, qd = arm.model.joints, state[0], state[2], state[3]
        powered, stopped, running = state[4], state[5], state[6]
        if len(q) != joints or len(qd) != joints or not math.isfinite(sum(q + qd)):
            self._add_fault(now, f"{what}: {joints} finite positions and speeds were expected", out, what)
            return
        arm.sample(state, out)
        if (stepped := arm.state_age.newest.stepped) and arm.phase is not Phase.STARTING:
            what = "the controller's clock has stepped"
            self._add_fault(now, f"{what} by {stepped:+.3f} s: do not set it while the arm is guarded", out, what)
        if stopped and arm.phase.watched:
            self._add_fault(now, "the controller's own safety system has stopped the arm", out)
        elif not powered and arm.phase.watched:
            self._add_fault(now, "the arm is not powered any more, or its brakes are closed", out)
        if ended := self._companions.program_ended(now, arm.state_age.newest.measured_at, running):
            self._add_fault(now, ended, out)
        heartbeat = arm.heartbeat  # does the program end by itself where no packet reaches the controller?
        if heartbeat is None:
            return
        heartbeat.sample(now, running)
        if arm.phase not in (_ACTIVE_PHASE, _SLOWED_PHASE) or not (trouble := heartbeat.trouble(now)):
            return
        if heartbeat.required:
            self._add_fault(now, trouble, out)
        else:
            emit(out, EventName.MESSAGE, now, what=trouble)

    def _feed_slider(self, arm: ArmSupervisor, decode: Callable[[bytes], float], block: Block, out: Outputs) -> None:
        fraction = self._decode(block, "the speed slider cannot be read", decode, out)
        if fraction is not None:
            arm.speed_reduction.feed(block.time, fraction)

    def _feed_echo(
        self, heartbeat: ControllerHeartbeat, decode: Callable[[bytes], int], block: Block, out: Outputs
    ) -> None:
        """Take the program's answer to the heartbeat."""
        count = self._decode(block, "the program's answer to the heartbeat cannot be read", decode, out)
        if count is not None:
            heartbeat.feed(count)

    def _decode(self, block: Block, what: str, decode: Callable[[bytes], _Decoded], out: Outputs) -> _Decoded | None:
        """Return what the controller has sent. None, after a fault that says ``what``, where it is unreadable."""
        try:
            return decode(block[2])
        except RobotConnectionError as exc:
            self._add_fault(block.time, f"{what}: {exc}", out, what)
            return None

    # ---- processes and ports

    def _feed_report(self, block: Block, out: Outputs) -> None:
        """Take a report of the driver process, or of a guard watchdog."""
        if self._arm is None:
            return
        report = StatusReport.decode(block.payload)
        self._companions.hear_helper(block.time, second=report.text == "second")
        match report.kind:
            case "ready":
                self._arm.backup_ready = True
            case "released":
                if report.text.isdecimal() and self._activation.acknowledged(int(report.text)):
                    self._activate(block.time, out)
            case "restarts" | "restarted" as restart:
                self._companions.restart(block.time, restart == "restarted")
            case "remark":
                emit(out, EventName.MESSAGE, block.time, what=report.text)
            case "error":
                self._companions.doubt_driver(block.time)
                self._add_fault(block.time, report.text, out)

    def _feed_program(self, block: Block, _: Outputs) -> None:
        self._companions.hear_program(block.time, suspended=bool(block.payload))

    def _feed_hold_up(self, block: Block, out: Outputs) -> None:
        """Take that this computer does not let the driver process, or a guard watchdog, run."""
        load, _, name = block.payload.decode("ascii", "replace").partition("\n")
        if what := self._companions.hold_up_helper(block.time, load, name):
            self._folding.emit(out, EventName.MESSAGE, f"held up {name}", block.time, what=what)

    def _lose(self, block: Block, out: Outputs) -> None:
        """Take that a port is gone: the arm stops."""
        what, why = decode_loss(block.payload)
        self._lost[what] = why
        self._companions.lose(what, block.time)
        if self._arm is not None:
            if what == "slider":
                self._arm.speed_reduction.feed(block.time, None)
            self._arm.fault(block.time, why, out)
        if what == "session":
            self._folding.flush(block.time, out)
            if self._arm is not None:
                self._arm.end(block.time, out)
        emit(out, EventName.ENDING if what == "session" else EventName.FAULT, block.time, what=why)

    def _miss(self, block: Block, out: Outputs) -> None:
        """Take that there is no such stop path in this run."""
        what, why = decode_loss(block.payload)
        self._companions.lose(what, block.time)
        emit(out, EventName.MESSAGE, block.time, what=f"a stop path is missing, {what}: {why}")

    def _reopen(self, block: Block, out: Outputs) -> None:
        """Take a skin that is open again. Only the reset of a latched arm makes the guard active with it."""
        latched = self._arm is not None and self._arm.phase is Phase.LATCHED
        if block.payload != b"skin" or "skin" not in self._lost or not latched:
            return
        del self._lost["skin"]
        self._stream.reconnect(block.time)
        self._reopened = True
        emit(out, EventName.MESSAGE, block.time, what="the skin's port is open again; a reset is needed")

    def _suspend(self, block: Block, out: Outputs) -> None:
        """Stop an arm that nobody has guarded for a while: what came meanwhile is lost, or is too old."""
        if self.phase is not Phase.STARTING:
            seconds = block.payload.decode("ascii", "replace")
            what = "the guard did nothing for a while: the computer slept, or froze or overloaded it"
            self._add_fault(block.time, f"{what} ({seconds} s)", out, what)

    # ---- what is decided

    def _add_fault(self, now: float, what: str, out: Outputs, kind: str = "") -> None:
        """React to a fault, once until the next reset.

        One that repeats itself in other words or numbers has a kind, and is counted. Without one, it lasts.
        """
        known = (kind or what) in self._faults
        if known and not kind:
            return
        self._faults[kind or what] = what
        if not known and self._arm is not None:
            self._arm.fault(now, what, out)
        self._folding.emit(out, EventName.FAULT, kind or what, now, what=what)

    def _reset(self, block: Block, out: Outputs) -> None:
        """Take a manual reset, which forgives one stop: the one that a person has looked at."""
        numbers = block.payload.split()
        stop, request = map(int, numbers) if len(numbers) == 2 and all(map(bytes.isdigit, numbers)) else (0, 0)
        newest = 0 if self._arm is None else self._arm.supervision.stop
        blockers = []
        if self._arm is None or self.phase is not Phase.LATCHED:
            blockers.append(f"nothing to reset: the guard is {self.phase.value}")
        elif stop != newest:
            blockers.append(f"it is for stop {stop}, and stop {newest} has latched the arm: look at that first")
        elif self._activation.resetting:
            blockers.append("a reset is under way already")
        else:
            self._faults.clear()
            blockers = self.blockers(block.time)
        if blockers:
            emit(out, EventName.REFUSED, block.time, what="reset", request=request, reasons=blockers)
            return
        self._stream.forget_faults()
        self._activation.reset(block.time, request)
        emit(out, EventName.RESET, block.time, stop=stop, request=request)

    def _poll(self, now: float, out: Outputs) -> None:
        """Decide what only the passing of time shows."""
        if now >= self._folding.due:
            self._folding.poll(now, out)
        fair = self._fair
        for event in self._stream.silence(fair, self._limits.skin_silence):
            self._feed_event(event, out)
        arm = self._arm
        if arm is not None:
            if arm.phase is not _STARTING_PHASE and (trouble := arm.state_age.trouble(fair)):
                self._add_fault(now, trouble, out)
            for why, paths in self._companions.poll(fair):  # silent: stop by a path that does not need it
                if arm.phase is not Phase.STARTING:
                    self._add_fault(now, why, out)
                    if paths:
                        arm.lose(paths, now, for_good=False)
            if arm.phase is _RETREATING_PHASE and (stale := self._stale(now) or arm.state_age.stale(now)):
                arm.abandon_motion(now, stale, out)  # what supervises it is too old
            arm.poll(now, fair, out)
        if self.phase is not _STARTING_PHASE and not self._activation.resetting:
            return
        blockers = self.blockers(now)
        if self.phase not in (Phase.STARTING, Phase.LATCHED):
            blockers.append("something has moved the arm, or its standstill is not confirmed")
        step = self._activation.poll(now, blockers, out)
        if step is ActivationStep.RELEASE and arm is None:
            self._activate(now, out)
        elif step is ActivationStep.RELEASE and arm is not None:
            arm.release(self._activation.number, out)
        elif step is ActivationStep.WITHDRAW and arm is not None:
            arm.withdraw(out)

    def _activate(self, now: float, out: Outputs) -> None:
        self._reopened = False
        if self._arm is not None:
            self._arm.activate()
        self._folding.flush(now, out)
        emit(out, EventName.ACTIVATED, now, request=self._activation.end())
        if self._not_commissioned:
            emit(out, EventName.NOT_COMMISSIONED, now, what=self._not_commissioned)
        for one in self._stream.detectors:
            if one.altered:
                emit(out, EventName.MESSAGE, now, what=f"no place on {one.sensor.name} is certain: {one.altered}")
