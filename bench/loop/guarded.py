"""Guard's own loop in bench `loop`, with its core as it runs live, and what became of each touch."""

from __future__ import annotations

import gc
import socket
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field

from coneskin.core.channel import Channel, pair
from coneskin.core.recording.block import Block
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.messages import StatusReport
from coneskin.robot.driver.values import StopPath
from coneskin.robot.guard.arm_supervisor import ArmSupervisor
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.loop import GuardLoop, GuardPorts
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.contact import GuardedSensor
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.robot.reaction.rules import RuleSet
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.ur.driver import UR_DRIVER
from coneskin.robot.ur.rtde_codec import STATE_RECIPE
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.timing import TimingLimits
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.sources.serial_port import SerialPort

from .far_end import CLOCK, CYCLE_FRAMES, SENSOR, TOUCHED_FRAMES, FarEnd
from .stamps import Stamp, stamps_of

SKIN_TIMEOUT = 0.5  # s; frames that the machine holds up are no matter here
RESET_PERIOD = 0.02  # s


class States:
    """Reader of the controller's state, on the far end's socket."""

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        sock.setblocking(False)

    def fileno(self) -> int:
        """Return the descriptor, for the loop's selector."""
        return self._sock.fileno()

    def read(self) -> list[bytes]:
        """Return the payloads that have come."""
        data = self._sock.recv(1 << 16)
        return [data[at : at + STATE_RECIPE.size] for at in range(0, len(data), STATE_RECIPE.size)]


@dataclass
class Guarded:
    """Guard's loop. What it records of itself tells when it has read and sent.

    Attributes:
        wake, react, idle, whole: times [s], as the table names them.
        answered: touches in which a stop was sent because of the touch.
        missed: touches of an active guard without a stop.
        inactive: touches that came while the guard was not active, by the reason for that.
        other: stops that no touch was the reason of, by their reason.
    """

    wake: list[float] = field(default_factory=list)
    react: list[float] = field(default_factory=list)
    idle: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)
    answered: int = 0
    missed: int = 0
    inactive: Counter[str] = field(default_factory=Counter)
    other: Counter[str] = field(default_factory=Counter)

    def turn(self, rate_hz: float, seconds: float) -> None:
        """Guard for some time, resetting after each touch."""
        with FarEnd(rate_hz) as far, SerialPort(far.path) as port:
            core, rounds = make_core(), list[float]()
            (ours, recorder), (end, arm) = pair(), pair()
            session, driver = Channel(ours), Channel(end)
            loop = GuardLoop(core, GuardPorts(session, port, States(far.states), driver), CLOCK)
            loop._open()
            core.feed(Block(BlockKind.DRIVER, CLOCK(), StatusReport("ready").encode()), [])
            over, reset_at, spoke, recorded = CLOCK() + seconds + 0.5, 0.0, 0.0, list[bytes]()
            gc.disable()
            while CLOCK() < over:
                loop.poll(0.002)
                rounds.append(CLOCK())
                if CLOCK() - spoke > 0.02:
                    spoke = CLOCK()
                    core.feed(Block(BlockKind.PROGRAM, spoke, b""), [])
                    acknowledged = StatusReport("released", str(core._activation.number))
                    core.feed(Block(BlockKind.DRIVER, spoke, acknowledged.encode()), [])
                recorded += drain(recorder)
                drain(arm)
                if core.phase is Phase.LATCHED and CLOCK() >= reset_at:  # refused until nothing stands against it
                    reset_at = CLOCK() + RESET_PERIOD
                    core.feed(Block(BlockKind.RESET, CLOCK(), b"%d 1" % core._arm.supervision.stop), [])
            gc.enable()
            loop._report()
            loop._close()
            recorded += drain(recorder)
            written = far.written()
        for channel in (session, driver, recorder, arm):
            channel.close()
        stamps = stamps_of(messages(b"".join(recorded)), rounds)
        for stamp in stamps:
            self._count(stamp, written)
        self._judge(stamps)

    def _count(self, stamp: Stamp, written: dict[int, float]) -> None:
        """Add the times of one read."""
        if not stamp.sequences or stamp.sequences[-1] not in written:
            return
        at = written[stamp.sequences[-1]]
        self.wake.append(stamp.read - at)
        if not stamp.sent:
            self.idle.append(stamp.done - stamp.read)
        elif stamp.why == "touch":
            self.react.append(stamp.sent - stamp.read)
            self.whole.append(stamp.sent - at)

    def _judge(self, stamps: list[Stamp]) -> None:
        """Say what became of each touch, and why each other stop was sent."""
        touches: dict[int, list[Stamp]] = {}
        for stamp in stamps:
            for sequence in stamp.sequences:
                if sequence % CYCLE_FRAMES >= CYCLE_FRAMES - TOUCHED_FRAMES:
                    touches.setdefault(sequence // CYCLE_FRAMES, []).append(stamp)
            if stamp.sent and stamp.why != "touch":
                self.other[stamp.why] += 1
        touches.pop(max(touches, default=0), None)  # the turn may have ended before it was answered
        for seen in touches.values():
            if any(stamp.why == "touch" for stamp in seen):
                self.answered += 1
            elif seen[0].active and not any(stamp.sent for stamp in seen):
                self.missed += 1
            else:
                self.inactive[seen[0].reason if not seen[0].active else seen[-1].reason] += 1


def make_core() -> GuardCore:
    """Return the guard's core with one sensor."""
    limits = MonitoringLimits(SKIN_TIMEOUT, SKIN_TIMEOUT, arm_silence=SKIN_TIMEOUT, settle=0.01)
    settings = DetectorSettings(timing=TimingLimits(late=SKIN_TIMEOUT))
    cone = PlacedFrustum(SENSOR.frustum)
    placed = GuardedSensor(SENSOR.name, "forearm", 3, lambda u, phi: (cone.point(u, phi), cone.normal(phi)))
    arm = ArmSupervisor(arm_model("UR5e"), UR_DRIVER, RuleSet(Reaction(kind="stop")), limits, (StopPath.DRIVER,))
    return GuardCore(TouchStream([SENSOR], settings), [placed], limits, arm)


def drain(sock: socket.socket) -> list[bytes]:
    """Return what has come."""
    sock.setblocking(False)
    found = []
    with suppress(BlockingIOError):
        while data := sock.recv(1 << 16):
            found.append(data)
    return found


def messages(data: bytes) -> bytes:
    """Return the contents of a channel's messages, without their lengths."""
    found, at = [], 0
    while at < len(data):
        length = int.from_bytes(data[at : at + 4], "little")
        found.append(data[at + 4 : at + 4 + length])
        at += 4 + length
    return b"".join(found)
