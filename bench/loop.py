"""From a frame at the port to a stop on the wire, stage by stage, beside the floor of this machine in the same run.

    python bench/loop.py [--touches 500] [--rate-hz 1000]

A process writes frames to a pseudo-terminal and states to a socket, at a steady pace, and notes when. In turns of some
seconds each they are read by

    floor   a loop of poll, os.read and one send: what any Python program has to pay here
    guard   the guard's own loop with its core, as it runs live: pyserial's port, decode, detect, map, decide, send,
            record

The two take turns, so that a busy machine is busy for both. What it does not show: ur_rtde, the controller and the arm
(bench/reaction.py), a real serial adapter, and a machine with nothing else to do.
"""

import argparse
import array
import gc
import mmap
import os
import select
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from report import head, quantile

from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed import PlacedFrustum
from coneskin.robot.arm_reaction import ArmReaction, Phase
from coneskin.robot.channel import Channel, pair
from coneskin.robot.commands import Reaction
from coneskin.robot.contact import GuardedSensor
from coneskin.robot.guard_core import GuardCore
from coneskin.robot.guard_loop import GuardLoop, GuardPorts
from coneskin.robot.journal import Kind
from coneskin.robot.owner_messages import Note
from coneskin.robot.state_reader import RECIPE
from coneskin.robot.stop_watch import Way
from coneskin.robot.ur_models import model
from coneskin.robot.watch import Watch
from coneskin.skin.pseudo_terminal import open_raw_terminal
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.sensor import Sensor
from coneskin.skin.serial_port import SerialPort
from coneskin.skin.stream import Stream
from coneskin.skin.virtual import VirtualSkin
from coneskin.skin.wire import encode

SENSOR = Sensor(Frustum(0.0376, 0.0372, 0.26))
CYCLE = 160  # frames from one touch to the next: 30 touched, the others let the detector settle and the guard arm
TOUCHED = 30
CLOCK = time.monotonic


def main() -> None:
    """Run the turns and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--touches", type=int, default=500)
    parser.add_argument("--rate-hz", type=float, default=1000.0)
    parser.add_argument("--write", nargs=3, type=int, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.write:
        write_frames(args.rate_hz, *args.write)
        return
    print(head())
    each = 25
    turns = max(1, args.touches // each)
    seconds = each * CYCLE / args.rate_hz
    floor, guarded = Floor(), Guarded()
    for turn in range(turns):
        for reader in (floor, guarded):
            reader.turn(args.rate_hz, seconds)
        print(f"\r{100 * (turn + 1) // turns:3d} %", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print(f"{turns} turns of {seconds:.1f} s each at {args.rate_hz:g} frames/s, {len(guarded.whole)} touches\n")
    print(f"{'us':58}{'median':>9}{'p99':>9}{'p99.9':>9}{'worst':>10}")
    row("floor: written at the far end -> read", floor.wake)
    row("guard: written at the far end -> read", guarded.wake)
    row("floor: read -> sent", floor.sent)
    row("guard: read -> events (parse, decode, detect)", guarded.detect)
    row("guard: events -> stop decided and encoded", guarded.decide)
    row("guard: decided -> written to the owner of ur_rtde", guarded.send)
    row("guard: READ -> COMMAND WRITTEN, touches", guarded.react)
    row("guard: read -> done, frames without a touch", guarded.idle)
    row("floor: written at the far end -> sent", floor.whole)
    row("guard: written at the far end -> command written", guarded.whole)
    print(f"\nmissed touches: {guarded.missed}; commands without a touch: {guarded.extra}")


def row(name: str, seconds: list[float]) -> None:
    """One line of the table."""
    if not seconds:
        print(f"{name:58}{'-':>9}")
        return
    values = [1e6 * s for s in seconds]
    print(f"{name:58}" + "".join(f"{quantile(values, share):9.1f}" for share in (0.5, 0.99, 0.999)), end="")
    print(f"{max(values):10.1f}")


def write_frames(rate_hz: float, master: int, states: int, stamps: int) -> None:
    """The far end: frames, states and the times at which they were written, until the reader goes away."""
    touches = [
        ScriptedTouch((k * CYCLE + CYCLE - TOUCHED) / rate_hz, ((k + 1) * CYCLE) / rate_hz, 0.13, 1.0, rise=1e-4)
        for k in range(60)
    ]
    skin = VirtualSkin(SENSOR, touches, rate_hz=rate_hz, duration=60 * CYCLE / rate_hz)
    frames = [(due, encode(frame), frame.sequence) for due, frame in skin.frames()]
    with mmap.mmap(stamps, 0) as memory, memoryview(memory) as raw, raw.cast("d") as times:
        _write(frames, times, master, states)


def _write(frames: list[Any], times: memoryview, master: int, states: int) -> None:
    start = CLOCK() + 0.1
    try:
        for number, (due, data, sequence) in enumerate(frames):
            time.sleep(max(0.0, start + due - CLOCK()))
            times[sequence] = CLOCK()
            os.write(master, data)
            if number % 2 == 0:
                os.write(states, RECIPE.pack((due, (0.0, -1.5, 1.5, -1.5, -1.5, 0.0), (0.0,) * 6, 7, 1, 2)))
    except OSError:
        return


@dataclass
class Writer:
    """The far end as a process."""

    rate_hz: float

    def __enter__(self) -> "Writer":
        master, self.slave, self.path = open_raw_terminal()
        os.set_blocking(master, True)
        self.states, states = socket.socketpair()
        self.stamps = tempfile.TemporaryFile()
        self.stamps.write(bytes(8 * 65536))
        self.stamps.flush()
        descriptors = (master, states.fileno(), self.stamps.fileno())
        command = [sys.executable, __file__, "--rate-hz", str(self.rate_hz), "--write", *map(str, descriptors)]
        self.process = subprocess.Popen(command, pass_fds=descriptors)
        os.close(master)
        states.close()
        return self

    def written(self) -> dict[int, float]:
        """When each frame was written, by its sequence number."""
        self.stamps.seek(0)
        return {sequence: at for sequence, at in enumerate(array.array("d", self.stamps.read())) if at}

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
        for end in (self.states, self.stamps):
            end.close()
        os.close(self.slave)


@dataclass
class Floor:
    """poll, os.read, send."""

    wake: list[float] = field(default_factory=list)
    sent: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)

    def turn(self, rate_hz: float, seconds: float) -> None:
        """Read for some time."""
        ours, theirs = socket.socketpair()
        with Writer(rate_hz) as far:
            poll = select.poll()
            poll.register(far.slave, select.POLLIN)
            seen: list[tuple[int, float, float]] = []
            end = CLOCK() + seconds + 0.5
            gc.disable()
            while CLOCK() < end:
                if not poll.poll(100):
                    continue
                data = os.read(far.slave, 4096)
                read = CLOCK()
                ours.send(data[:9])
                seen.append((int.from_bytes(data[8:10], "little"), read, CLOCK()) if len(data) == 36 else (-1, 0, 0))
                theirs.recv(64)
            gc.enable()
            written = far.written()
        for sequence, read, sent in seen:
            if sequence in written:
                self.wake.append(read - written[sequence])
                self.sent.append(sent - read)
                self.whole.append(sent - written[sequence])
        ours.close()
        theirs.close()


class States:
    """The reader of the controller's state, on the far end's socket."""

    def __init__(self, sock: socket.socket) -> None:
        self._sock = sock
        sock.setblocking(False)

    def fileno(self) -> int:
        """For the loop's selector."""
        return self._sock.fileno()

    def read(self) -> list[bytes]:
        """Payloads that have come."""
        data = self._sock.recv(1 << 16)
        return [data[at : at + RECIPE.size] for at in range(0, len(data), RECIPE.size)]


@dataclass
class Guarded:
    """The guard's loop, with a stamp between its stages."""

    wake: list[float] = field(default_factory=list)
    detect: list[float] = field(default_factory=list)
    decide: list[float] = field(default_factory=list)
    send: list[float] = field(default_factory=list)
    react: list[float] = field(default_factory=list)
    idle: list[float] = field(default_factory=list)
    whole: list[float] = field(default_factory=list)
    missed: int = 0
    extra: int = 0

    def turn(self, rate_hz: float, seconds: float) -> None:
        """Guard for some time, resetting after each touch."""
        with Writer(rate_hz) as far, SerialPort(far.path) as port:
            stamps = Stamps()
            core = stamps.core()
            sides = [pair() for _ in range(2)]
            supervisor, owner = (Channel(a) for a, _ in sides)
            others = [b for _, b in sides]
            ports = GuardPorts(supervisor, stamps.source(port), States(far.states), stamps.owner(owner))  # type: ignore[arg-type]
            loop = GuardLoop(core, ports)
            loop._open()
            core.take(stamps.block(Kind.OWNER, Note("ready").encode()), [])
            end = CLOCK() + seconds + 0.5
            gc.disable()
            while CLOCK() < end:
                loop.step(0.002)
                for other in others:
                    drain(other)
                if core.phase is Phase.LATCHED and not core.unsound(CLOCK()):
                    core.take(stamps.block(Kind.RESET), [])
            gc.enable()
            loop._close()
            written = far.written()
            touched = {s for s in written if s % CYCLE == CYCLE - TOUCHED and s > CYCLE and written[s] < end - 0.05}
        for stamp in stamps.all:
            if stamp.sequence not in written:
                continue
            self.wake.append(stamp.read - written[stamp.sequence])
            if not stamp.sent:
                self.idle.append(stamp.done - stamp.read)
                continue
            for back in range(TOUCHED):
                touched.discard(stamp.sequence - back)
            if stamp.sequence % CYCLE < CYCLE - TOUCHED:
                self.extra += 1
            self.detect.append(stamp.events - stamp.read)
            self.decide.append(stamp.decided - stamp.events)
            self.send.append(stamp.sent - stamp.decided)
            self.react.append(stamp.sent - stamp.read)
            self.whole.append(stamp.sent - written[stamp.sequence])
        self.missed += len(touched)
        for other in others:
            other.close()
        supervisor.close()
        owner.close()


def drain(sock: socket.socket) -> None:
    """Throw away what has come."""
    sock.setblocking(False)
    try:
        while sock.recv(1 << 16):
            pass
    except BlockingIOError:
        pass


@dataclass(slots=True)
class Stamp:
    """The times of one frame."""

    sequence: int
    read: float
    events: float = 0.0
    decided: float = 0.0
    sent: float = 0.0
    done: float = 0.0
    armed: bool = False


class Stamps:
    """Wraps the stages of the loop with the clock."""

    def __init__(self) -> None:
        self.all: list[Stamp] = []
        self.now = Stamp(-1, 0.0)
        self.phase: Callable[[], Phase] = lambda: Phase.STARTING

    def block(self, kind: Kind, payload: bytes = b"") -> Any:
        """An input at this time."""
        from coneskin.skin.recording import Block

        return Block(kind, CLOCK(), payload)

    def core(self) -> GuardCore:
        """The guard's core; its stream and itself stamp when they are done."""
        arm, watch = model("UR5e"), Watch(0.5, 0.5, 0, 0.5, settle=0.01)
        stream = Stream([SENSOR])
        cone = PlacedFrustum(SENSOR.frustum)
        placed = GuardedSensor(SENSOR.name, "forearm", 3, lambda u, phi: (cone.point(u, phi), cone.normal(phi)))
        reaction = ArmReaction(arm, Reaction(kind="stop"), watch, (Way.OWNER,))
        core = GuardCore(Wrapped(stream, "feed", self._events), [placed], watch, reaction)  # type: ignore[arg-type]
        self.phase = lambda: core.phase
        return Wrapped(core, "take", self._decided)  # type: ignore[return-value]

    def source(self, port: SerialPort) -> Any:
        """The port; stamps when it has read."""
        return Wrapped(port, "read", self._read)

    def owner(self, channel: Channel) -> Any:
        """The channel; stamps when it has sent."""
        wrapped = Wrapped(channel, "send", lambda _: None)
        wrapped.send = self.send(channel)  # type: ignore[attr-defined]
        return wrapped

    def _read(self, data: bytes) -> None:
        now = CLOCK()
        newest = data[-36:]
        self.now = Stamp(int.from_bytes(newest[8:10], "little") if len(newest) == 36 else -1, now)
        self.now.armed = self.phase() is Phase.ARMED
        self.all.append(self.now)

    def _events(self, _: object) -> None:
        self.now.events = CLOCK()

    def _decided(self, _: object) -> None:
        if not self.now.done:
            self.now.done = CLOCK()

    def send(self, channel: Channel) -> Callable[[bytes], bool]:
        """The channel's send, with stamps before and after a stop."""

        def sent(message: bytes) -> bool:
            if message[:1] != b"S" or self.now.sent:
                return channel.send(message)
            self.now.decided = CLOCK()
            taken = channel.send(message)
            self.now.sent = CLOCK()
            return taken

        return sent


class Wrapped:
    """An object one method of which tells somebody what it returned."""

    def __init__(self, inner: Any, name: str, tell: Callable[[Any], None]) -> None:
        method = getattr(inner, name)

        def wrapped(*arguments: Any) -> Any:
            result = method(*arguments)
            tell(result)
            return result

        self._inner = inner
        setattr(self, name, wrapped)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)


if __name__ == "__main__":
    main()
