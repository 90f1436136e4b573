"""Journal of a guard: the kinds of block that it records, its events, and the sink of all that it puts out.

Everything that goes into a guard is recorded, and everything that comes out. What goes in is enough to run the guard
again: ``GuardCore.feed`` is fed the same blocks, live and in a replay.

A program that is frozen for long makes its guard's channel run full. Inputs and commands are then left out of the
recording, but no event is: a program that goes on has to know of a collision.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeAlias

from coneskin.core.errors import RecordingError
from coneskin.core.recording.block import Block, decode_blocks, encode_block
from coneskin.core.text import read_json
from coneskin.robot.driver.values import JointVelocitySetpoint, SetpointProgram, SetSpeedSlider, UseStopPath

if TYPE_CHECKING:
    from coneskin.robot.driver.messages import EndReaction, Release, SetJointVelocity, StopProgram

#: ``why`` of a stop for a touch; what else is there stops the arm without a ``Collision``
TOUCH_CAUSE = "touch"
#: ends the ``why`` of an arm that is latched under a program that no stop has ended
SLIDER_HOLDS = "the speed slider at 0 alone holds a program that runs: end the program before anyone raises the slider"


class BlockKind(IntEnum):
    """Kinds of block. 1 to 9, and from 30 on, go into the guard, 10 to 19 come out of it."""

    SKIN = 1  #: bytes of the skin's stream, as they were read
    ARM = 2  #: payload of a state, for the driver's ``decode_state``
    TICK = 3  #: nothing: time has passed
    DRIVER = 4  #: a status report of the driver process, or of the guard watchdog
    RESET = 5  #: a manual reset: the number of the stop that it forgives, and its own, in decimal digits
    LOST = 6  #: a source, a connection or a process is gone; the payload says which and why
    SLIDER = 7  #: payload of the speed slider, for the driver's ``decode_speed_fraction``
    PROGRAM = 8  #: a look at the program that guards: empty, or "suspended"
    ABSENT = 9  #: a stop path that is not there from the start; the payload says which connection and why
    EVENT = 10  #: a GuardEvent, JSON
    COMMAND = 11  #: a command as it was sent: to whom, a line feed, its bytes
    HEADER = 20  #: JSON: the scene and the versions
    OVERRUN = 21  #: JSON: how late the loop was
    SURFACE = 22  #: heights of a mesh below a sensor, see ``coneskin.scene.build``
    TRUTH = 23  #: JSON: with what a virtual skin was touched, whether it was noticed or not; the force of a contact
    ECHO = 30  #: payload of the heartbeat's connection, for the driver's ``decode_heartbeat``
    SUSPENDED = 31  #: for how long the loop did nothing [s], by a clock that goes on while the computer sleeps
    REOPENED = 32  #: what was lost is open again; the payload says which: the skin
    HELD_UP = 33  #: this computer does not let a process beside the guard run: its load in words, a line feed, which


class EventName(StrEnum):
    """Names of everything that a guard, or the session around it, reports.

    The last six are about the guard and not from it, so that a replay does not make them (``SESSION_EVENTS``).

    Attributes:
        meaning: what has happened, in a sentence for people. ``for name in EventName`` gives all of them.
    """

    meaning: str

    def __new__(cls, value: str, meaning: str = "") -> EventName:
        """Make a name with its meaning."""
        name = str.__new__(cls, value)
        name._value_, name.meaning = value, meaning
        return name

    WAITING = "waiting", "The guard cannot become active yet. `reasons` lists why."
    ACTIVATED = "activated", "The guard reacts from now on."
    NOT_COMMISSIONED = "not_commissioned", "The arm only stops, although its scene lets it move away. `what` says why."
    CONTACT = "contact", "A touch has begun."
    CONTACT_LOCATED = "contact_located", "The place of a touch has become certain."
    CONTACT_EXTENDED = "contact_extended", "The touch is not one disc: its middle and its line are estimated."
    TOUCH_ENDED = "touch_ended", "A touch is over."
    FAULT = "fault", "Something is wrong with the skin, the arm or a process."
    STOPPING = "stopping", "A stop was sent. `why` says what for."
    DECELERATING = "decelerating", "The measured speed has begun to fall."
    STOP_FAILED = "stop_failed", "Every stop path was used, and the arm does not stand."
    STANDSTILL = "standstill", "The arm was measured standing."
    ESCALATED = "escalated", "A further stop path was used."
    RETREATING = "retreating", "A motion away from the touch has begun."
    MOTION_LIMITED = "motion_limited", "The motion away is slower than set. `by` lists the limits."
    RETREATED = "retreated", "The motion away is over."
    SPEED_REDUCED = "speed_reduced", "The speed slider was lowered because of a touch."
    SPEED_LIMITED = "speed_limited", "The speed slider was set so that surfaces keep their permissible speeds."
    RESUMED = "resumed", "The speed slider is back where it was."
    LATCHED = "latched", "The arm stands and waits for a manual reset."
    REFUSED = "refused", "A reset was refused. `reasons` lists why."
    RESET = "reset", "A person has reset the guard."
    MESSAGE = "message", "A remark for people."
    ENDING = "ending", "The guard was told to end."
    GUARD_EXITED = "guard_exited", "The guard's process has ended."
    GUARD_UNRESPONSIVE = "guard_unresponsive", "The guard sends no heartbeat."
    GUARD_RESPONSIVE = "guard_responsive", "The guard's heartbeat is back."
    FALLBACK_STOP = "fallback_stop", "A guard watchdog has stopped the arm without the guard."
    RECORDING_GAP = "recording_gap", "Blocks are missing from the recording."
    SKIN_LINE = "skin_line", "The guard waits for a skin, and its bytes are wrong. `what` says how."


#: events that tell where a touch is
CONTACT_EVENTS = frozenset({EventName.CONTACT, EventName.CONTACT_LOCATED, EventName.CONTACT_EXTENDED})
INPUTS = frozenset(kind for kind in BlockKind if kind < BlockKind.EVENT or kind >= BlockKind.ECHO)
#: events about the guard, not from it, which a replay does not make
SESSION_EVENTS = frozenset(
    {
        *(EventName.GUARD_EXITED, EventName.GUARD_UNRESPONSIVE, EventName.GUARD_RESPONSIVE),
        *(EventName.FALLBACK_STOP, EventName.RECORDING_GAP, EventName.SKIN_LINE),
    }
)


_PLACE_DIGITS = 5  # decimals of a body's place [m]: 0.01 mm
_CONTACT_EVENTS = frozenset({EventName.CONTACT, EventName.CONTACT_LOCATED})


class GuardEvent(NamedTuple):
    """Event of a run, for people and programs.

    Attributes:
        name: what happened.
        time: host clock [s].
        details: numbers and words that belong to it, in SI units and radians.
    """

    name: EventName
    time: float
    details: dict[str, Any]

    def block(self) -> Block:
        """Return the block that records it. Floats keep every bit."""
        return Block(BlockKind.EVENT, self.time, json.dumps([self.name, self.details]).encode())


def stopping_contact(stop: GuardEvent, events: Sequence[GuardEvent]) -> GuardEvent | None:
    """Return the event of the contact that a stop was made for, once its place was certain where it has become so.

    Args:
        stop: an event "stopping".

    Returns:
        an event "contact_located" or "contact". None where the stop was made for something else.
    """
    contact = stop.details.get("contact")
    if not isinstance(contact, dict):  # a recording may hold anything
        return None
    number = contact.get("number")
    same = [event for event in events if event.name in _CONTACT_EVENTS and event.details.get("number") == number]
    return max(same, key=lambda event: event.name == EventName.CONTACT_LOCATED, default=None)


def force_block(time: float, force: float, places: Sequence[Sequence[float]] = ()) -> Block:
    """Return the block that records which force physics found between the arm and what it meets.

    Args:
        time: host clock [s].
        force: sum of all contacts [N].
        places: of the scene's bodies then, in the base frame [m], part by part: a grip has two.
    """
    facts: dict[str, Any] = {"contact_force_N": force}
    if places:
        facts["bodies_m"] = [[round(value, _PLACE_DIGITS) for value in place] for place in places]
    return Block(BlockKind.TRUTH, time, json.dumps(facts).encode())


def body_places(payload: bytes) -> tuple[tuple[float, float, float], ...]:
    """Return the places in what ``force_block`` has recorded [m]. None for another truth, and for nonsense."""
    try:
        found = tuple((float(x), float(y), float(z)) for x, y, z in _truth(payload, "bodies_m", ()))
    except (ValueError, TypeError):
        return ()
    return found if all(math.isfinite(value) for place in found for value in place) else ()


def contact_force(payload: bytes) -> float | None:
    """Return the force in what ``force_block`` has recorded [N]. None for another truth, and for nonsense."""
    force = _truth(payload, "contact_force_N", None)
    known = isinstance(force, int | float) and math.isfinite(force) and force >= 0.0
    return float(force) if known else None


def _truth(payload: bytes, name: str, default: Any) -> Any:
    try:
        return read_json(payload).get(name, default)
    except (ValueError, AttributeError):
        return default


def decode_event(block: Block) -> GuardEvent:
    """Return the event in a block.

    Raises:
        RecordingError: the block holds none.
    """
    try:
        text, details = read_json(block.payload)
        name = EventName(text)
        if block.kind != BlockKind.EVENT or not isinstance(details, dict):
            raise ValueError(f"kind {block.kind}")
    except (ValueError, TypeError) as exc:
        raise RecordingError(
            f"a block of {block.time:.6f} s holds no event that this version of coneskin knows: {exc}"
        ) from exc
    return GuardEvent(name, block.time, details)


def encode_loss(what: str, why: str) -> bytes:
    """Return the payload of a block that says which port is gone or missing, and why. Half letters are written out."""
    return f"{what}\n{why}".encode("utf-8", "backslashreplace")


def decode_loss(payload: bytes) -> tuple[str, str]:
    """Return which port such a payload means, and why it is gone."""
    what, _, why = payload.decode("utf-8", "replace").partition("\n")
    return what, why


def describe_way(details: Mapping[str, Any], verb: str = "retreated") -> str:
    """Return in words how far a motion away went, from the details of the event ``retreated``.

    Its progress counts from where the touch began. An arm that brakes for longer than it moves away afterwards ends on
    the other side of that.
    """
    progress = 1e3 * float(details["progress"])
    if details.get("how") == "push":
        return f"gave way {progress:.1f} mm"
    braking = details.get("braking")
    if braking is None:
        return f"{verb} {progress:.1f} mm"
    went = 1e3 * float(braking)
    return f"went {went:.1f} mm on while it braked and then {went + progress:.1f} mm back"


_OWN_NAMES = {JointVelocitySetpoint: "setpoint", SetpointProgram: "follow", SetSpeedSlider: "slider"}
#: to the driver process, and over connections of the guard's own
Command: TypeAlias = (
    "StopProgram | SetJointVelocity | EndReaction | Release"
    " | UseStopPath | SetpointProgram | JointVelocitySetpoint | SetSpeedSlider"
)
Output: TypeAlias = "Command | GuardEvent"


def encode_command(output: Command, process: str, taken: bool = True) -> bytes:
    """Return the payload of the block that records a command.

    Args:
        process: that takes what goes over no connection of the guard's own: "driver" or "watchdog".
        taken: it was sent.
    """
    note = "" if taken else ", not sent"
    if isinstance(output, UseStopPath):
        return f"{output.path.value}\n{'sent' if taken else 'not sent'}".encode()
    if isinstance(output, JointVelocitySetpoint | SetpointProgram | SetSpeedSlider):
        return f"{_OWN_NAMES[type(output)]}{note}\n{tuple(output)}".encode()
    return f"{process}{note}\n".encode() + output.encode()


class Outputs(Protocol):
    """Sink of outputs, in order: a list, or something that sends a command as soon as it is there."""

    def append(self, output: Output, /) -> None:
        """Take one output."""


def emit(out: Outputs, name: EventName, time: float, **details: Any) -> None:
    """Put an event out, of a host time [s]."""
    out.append(GuardEvent(name, time, details))


class RecordingOverflowFilter:
    """Filter for ``Channel.overflow``, where each message consists of whole blocks of a recording."""

    def __init__(self) -> None:
        self._gap = 0, 0.0, 0.0  # blocks that were left out, since when, until when [s]

    def shorten(self, message: bytes) -> bytes:
        """Return the events in a message. The rest of it is counted."""
        kept = []
        for block in decode_blocks(message):
            if block.kind == BlockKind.EVENT:
                kept.append(encode_block(block))
                continue
            count, since, _ = self._gap
            self._gap = count + 1, since if count else block.time, block.time
        return b"".join(kept)

    def notice(self) -> bytes:
        """Return the event that says what was left out since the last one. Empty where nothing was."""
        count, since, until = self._gap
        if not count:
            return b""
        what = f"{count} blocks of {until - since:.3f} s are not recorded: the program did not read them"
        details = {"what": what, "blocks": count, "since": since, "until": until}
        self._gap = 0, 0.0, 0.0
        return encode_block(GuardEvent(EventName.RECORDING_GAP, until, details).block())


_BURST_EVENTS = 10  # events of a kind that come as they are
_CLEAR_TIME = 10.0  # s without one, after which they do so again
_FIRST_INTERVAL = 1.0  # s until the first count; the next ones take twice as long
_MAX_INTERVAL = 600.0  # s


@dataclass(slots=True)
class _Kind:
    """Events of one kind that came one upon the other."""

    newest: float  # when the last one came [s]
    reported: float  # when the last one was put out [s]
    sent: int = 0
    held: int = 0  # since then
    interval: float = _FIRST_INTERVAL
    details: dict[str, Any] = field(default_factory=dict)


class EventFolding:
    """Folding of the events of one guard that repeat themselves, by their name and what they are about.

    The first come as they are, then one with a count, at growing intervals: a loose plug made 410 000 events in
    a night, which bury the event that matters and fill the disk. None is lost: the next one counts those held back.

    Attributes:
        due: host time at which the next count is [s].
    """

    def __init__(self) -> None:
        self._kinds: dict[tuple[EventName, str], _Kind] = {}
        self.due = math.inf

    def emit(self, out: Outputs, name: EventName, about: str, now: float, **details: Any) -> None:
        """Put an event out, of a host time [s], or hold it back and count it.

        Args:
            about: what it is about: with the name, the kind.
            **details: of the event. The newest are reported.
        """
        kind = self._kinds.get((name, about))
        if kind is None or (now - kind.newest >= _CLEAR_TIME and not kind.held):
            kind = self._kinds[name, about] = _Kind(now, now)
        kind.newest = now
        if kind.sent < _BURST_EVENTS:
            kind.sent += 1
            kind.reported = now
            emit(out, name, now, **details)
            return
        kind.held += 1
        kind.details = details
        self.due = min(self.due, kind.reported + kind.interval)

    def poll(self, now: float, out: Outputs) -> None:
        """Report the counts that are due at a host time [s]."""
        for (name, _), kind in self._kinds.items():
            if kind.held and now >= kind.reported + kind.interval:
                emit(out, name, now, **kind.details, count=kind.held)
                kind.held, kind.reported = 0, now
                kind.interval = min(2.0 * kind.interval, _MAX_INTERVAL)
        self.due = min((kind.reported + kind.interval for kind in self._kinds.values() if kind.held), default=math.inf)

    def flush(self, now: float, out: Outputs) -> None:
        """Report every count, and begin anew: what comes now matters."""
        for (name, _), kind in self._kinds.items():
            if kind.held:
                emit(out, name, now, **kind.details, count=kind.held)
        self._kinds.clear()
        self._due = math.inf
