"""Live loop of the guard: one thread in a process of its own that joins source, core and arm.

Order of work after each wake: read the skin, decide, send the command. Only then it reports to the recorder. Whatever
may stall (disk, terminal, driver) is on the other side of a channel that never makes it wait. The skin alone wakes the
loop: all else waits for its next look, at most 2 ms, because each wake costs more than what is done in it.
"""

from __future__ import annotations

import gc
import json
import select
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from coneskin.core.channel import Channel, wait_readable
from coneskin.core.errors import ConeSkinError, SkinTimeout
from coneskin.core.process_watch import ProcessWatch, load
from coneskin.core.recording.block import Block, encode_block
from coneskin.robot.driver.liveness import BEAT_PERIOD, SETPOINT_SILENCE
from coneskin.robot.driver.messages import (
    DatedVelocity,
    EndReaction,
    Heartbeat,
    Release,
    SetJointVelocity,
    Shutdown,
    StopProgram,
)
from coneskin.robot.driver.protocol import (
    HeartbeatWriter,
    PayloadReader,
    ProgramStarter,
    SetpointWriter,
    SpeedSlider,
    StopConnections,
)
from coneskin.robot.driver.values import JointVelocitySetpoint, SetpointProgram, StopPath, UseStopPath
from coneskin.skin.sources.source import Source, SourceReopening

from .companion_monitor import HELPER_NAMES
from .controller_heartbeat import heartbeat_count
from .core import MIN_STALL, GuardCore
from .phase import Phase
from .signals.journal import BlockKind, Command, GuardEvent, Output, encode_command, encode_loss

if TYPE_CHECKING:
    from _typeshed import HasFileno


@dataclass(slots=True)
class GuardPorts:
    """Connections of the loop. None for what the scene does not have.

    Attributes:
        session: the process that records and shows.
        source: of the skin's bytes, open.
        reader: of the controller's state, open.
        driver: the driver process, where it moves the arm.
        stops: connections for stops that do not need the driver process, open.
        slider: of the controller's speed, open.
        watchdog: the guard watchdog, where another program moves the arm.
        second: the second one, which is told that the guard lives, and only says that it does.
        heartbeat: writer of the count that the controller's own watchdog waits for, open.
        setpoints: the reader once more, where it carries setpoints.
        reopen: begins to open a source that is gone again. None where it is gone for good.
        absent: connection of a stop path that the guard does without -> why.
        program: the process that guards, where it can be watched.
        helpers: those of driver or watchdogs, likewise, by the names here.
    """

    session: Channel
    source: Source | None
    reader: PayloadReader | None = None
    driver: Channel | None = None
    stops: StopConnections | None = None
    slider: SpeedSlider | None = None
    watchdog: Channel | None = None
    second: Channel | None = None
    heartbeat: HeartbeatWriter | None = None
    setpoints: SetpointWriter | None = None
    reopen: Callable[[Source], SourceReopening] | None = None
    absent: Mapping[str, str] = field(default_factory=dict)
    program: ProcessWatch | None = None
    helpers: Mapping[str, ProcessWatch] = field(default_factory=dict)


class _Outbox:
    """Sink that sends a command as soon as the core has decided it, and keeps what to tell the recorder."""

    __slots__ = ("_clock", "_ports", "events", "sent", "since")

    def __init__(self, ports: GuardPorts, clock: Callable[[], float]) -> None:
        self._ports, self._clock, self.since = ports, clock, clock()  # since: what is decided now was read then [s]
        self.sent: list[Block] = []  # commands, of the times at which they were sent
        self.events: list[GuardEvent] = []

    def append(self, output: Output, /) -> None:
        """Take an output of the core."""
        if isinstance(output, GuardEvent):
            self.events.append(output)
            return
        taken, now = self._send(output), self._clock()
        process = "driver" if self._ports.watchdog is None else "watchdog"
        self.sent.append(Block(BlockKind.COMMAND, now, encode_command(output, process, taken)))
        if isinstance(output, StopProgram):
            time.sleep(_HANDOVER_TIME)

    def _send(self, output: Command) -> bool:
        ports = self._ports
        if isinstance(output, SetpointProgram) and self._clock() - self.since > SETPOINT_SILENCE:
            return False  # this process was held up meanwhile: the arm was stopped, and nobody looked at its skin
        if isinstance(output, (StopProgram, SetJointVelocity, EndReaction, Release)):  # first the one that is in haste
            channel = ports.driver if ports.watchdog is None else ports.watchdog
            sent = DatedVelocity(self.since, output) if isinstance(output, SetJointVelocity) else output
            return channel is not None and channel.send(sent.encode())
        if isinstance(output, UseStopPath):
            if output.path is StopPath.WATCHDOG:
                return ports.watchdog is not None and ports.watchdog.send(StopProgram(output.deceleration).encode())
            if output.path is StopPath.SLIDER:
                return ports.slider is not None and ports.slider.set(0.0)
            return ports.stops is not None and ports.stops.use(*output)
        if isinstance(output, JointVelocitySetpoint):
            return ports.setpoints is not None and ports.setpoints.write(output)
        if isinstance(output, SetpointProgram):
            return isinstance(ports.stops, ProgramStarter) and ports.stops.follow(output)
        return ports.slider is not None and ports.slider.set(output.fraction)


#: s for which the guard leaves its processor after a stop: whom it has woken mostly waits for that one
_HANDOVER_TIME = 5e-5
_HEARTBEAT_BYTES = Heartbeat().encode()
_SESSION_GONE_TIMEOUT = 0.8  # s that the arm has to stand when there is nobody left to tell; then watchdogs take over
#: what can be lost -> the attribute of ``GuardPorts``; of what is not here, it has the same name
_PORT_ATTRIBUTES = {"skin": "source", "controller": "reader"}
_LATE_TIME = 2.0 * BEAT_PERIOD  # s without a heartbeat, from which on it is asked why
_QUESTION_PERIOD = 0.25  # s between two questions whether the controller takes stops
_TICK_PERIOD = 0.002  # s between two looks at the clocks where nothing else happens
_LOOK_PERIOD = 0.0015  # s between two looks at what is no skin, where frames come: every second one of 1 kHz
_REPORT_PERIOD = 0.01  # s between two reports to the session where nothing was decided
_SUSPENSION_TIME = 1.0  # s between two rounds, from which on nobody has guarded; the driver process waits half of it
_FLUSH_TIMEOUT = 1.0  # s that the recorder has to take what waits for it
_SHUTDOWN_TIMEOUT = 3.0  # s that the arm has to stand when the guard is told to end
_MAX_READY = 16  # descriptors that one wait reports; the next one reports the others
#: bits of what can be read
_SKIN: Final = 1
_READER: Final = 2
_DRIVER: Final = 4
_WATCHDOG: Final = 8
_SLIDER: Final = 16
_HEARTBEAT: Final = 32
_STOPS: Final = 64
_SESSION: Final = 128
_SECOND: Final = 256


#: of monotonic seconds that count the computer's sleep as well, where the system has such a clock
_BOOT_CLOCK: Final = getattr(time, "CLOCK_BOOTTIME", None)


def _boot_time() -> float:
    return time.monotonic() if _BOOT_CLOCK is None else time.clock_gettime(_BOOT_CLOCK)


class GuardLoop:
    """Loop of one core on its ports.

    Args:
        clock: monotonic seconds.
        sleepless_clock: the same, which goes on while the computer sleeps.
    """

    def __init__(
        self,
        core: GuardCore,
        ports: GuardPorts,
        clock: Callable[[], float] = time.monotonic,
        sleepless_clock: Callable[[], float] = _boot_time,
    ) -> None:
        self._core = core
        self._ports = ports
        self._clock = clock
        self._sleepless_clock = sleepless_clock
        self._round = clock(), sleepless_clock()  # when the newest one began
        #: the skin has no descriptor that tells that it has bytes
        self._blind = ports.source is not None and ports.source.fileno() is None
        self._watched: dict[int, HasFileno] = {}
        self._bits: dict[int, int] = {}  # of these descriptors
        self._epolls: list[Any] = (
            [select.epoll(), select.epoll()] if hasattr(select, "epoll") else []
        )  # the skin's last
        self._look_at = 0.0  # when is looked at what is no skin
        self._quit = False
        self._fed = False  # anything, in this step
        self._beat = -BEAT_PERIOD
        self._heard = dict.fromkeys(ports.helpers, clock())
        self._asked = self._clock()  # when the controller was last asked whether it takes stops
        self._count = 0  # sent last
        self._out: list[Block] = []  # made bytes of together, which is quicker than one by one
        self._report_at = 0.0  # when the session is told next
        self._outbox = _Outbox(ports, clock)
        self._gone: Source | None = None  # the skin's source, where it may be opened again
        self._reopening: SourceReopening | None = None

    def stop(self) -> None:
        """Stop the arm, see it stand, and leave ``run``. May be called from a signal handler."""
        self._quit = True

    def run(self) -> None:
        """Serve until told to end, or until the session is gone. The arm is stopped before this returns."""
        self._open()
        gc.collect()
        gc.freeze()
        gc.disable()  # nothing here lives longer than a frame
        try:
            while not self._quit:
                self.poll(_TICK_PERIOD)
            self._end()
        finally:
            self._report()
            gc.enable()
            self._close()

    def _open(self) -> None:
        ports = self._ports
        helpers = (ports.driver, _DRIVER), (ports.watchdog, _WATCHDOG), (ports.second, _SECOND)
        controller = (ports.reader, _READER), (ports.slider, _SLIDER), (ports.heartbeat, _HEARTBEAT)
        stops = [(sock, _STOPS) for sock in (ports.stops.sockets().values() if ports.stops else ())]
        for item, bit in ((ports.session, _SESSION), *helpers, *controller, *stops):
            self._watch(item, bit)
        if ports.source is not None:
            self._watch_skin(ports.source)
        for what, why in ports.absent.items():
            self._feed(BlockKind.ABSENT, encode_loss(what, why))

    def _watch_skin(self, source: Source) -> None:
        self._blind = source.fileno() is None
        if not self._blind:
            self._watch(source, _SKIN)  # type: ignore[arg-type]

    def _watch(self, item: HasFileno | None, bit: int) -> None:
        if item is not None:
            number = item.fileno()
            self._watched[number], self._bits[number] = item, bit
            if self._epolls:
                self._epolls[bit == _SKIN].register(number, select.EPOLLIN)

    def _forget(self, item: object) -> None:
        for number in [number for number, watched in self._watched.items() if watched is item]:
            del self._watched[number], self._bits[number]
            for epoll in self._epolls:
                with suppress(OSError):  # it is closed, or in the other one
                    epoll.unregister(number)

    def _wait(self, timeout: float) -> int:
        """Wait for the skin, or without epoll for anything, or for the timeout [s]; return the bits of what came."""
        if self._epolls:
            return _SKIN if self._epolls[1].poll(0.0 if self._blind else timeout, 1) else 0
        return self._bits_of(item.fileno() for item in wait_readable(list(self._watched.values()), timeout))

    def _bits_of(self, numbers: Iterable[int]) -> int:
        return sum({self._bits[number] for number in numbers})

    def _close(self) -> None:
        if self._reopening is not None:
            self._reopening.stop()
        for epoll in self._epolls:
            epoll.close()

    def poll(self, timeout: float) -> None:
        """Wait for the skin, or for the timeout [s], and serve what has come."""
        ready = self._wait(timeout)
        ports = self._ports
        before, sleepless_before = self._round
        self._round = now, sleepless = self._clock(), self._sleepless_clock()
        self._outbox.since = now
        if now - before > MIN_STALL or sleepless - sleepless_before > _SUSPENSION_TIME:
            self._note_overrun(now, now - before, sleepless - sleepless_before)
        stopping, skin = self._core.phase.stopping, ports.source if ready & _SKIN or self._blind else None
        if skin is not None and not stopping:
            self._read_skin(skin)
        if self._epolls and (not ready or now >= self._look_at):
            self._look_at = now + _LOOK_PERIOD
            ready |= self._bits_of(number for number, _ in self._epolls[0].poll(0, _MAX_READY))
        if ready & _READER and stopping:  # states that wait may show that the stop under way works
            self._read(ports.reader, "controller", BlockKind.ARM)
            ready &= ~_READER
        if skin is not None and stopping:
            self._read_skin(skin)
        if ready & ~_SKIN:
            self._read_others(ready)
        if self._gone is not None and self._core.phase is Phase.LATCHED:
            self._open_skin_again(self._gone)
        if ports.heartbeat is not None and (count := heartbeat_count(now)) != self._count:
            self._count = count
            ports.heartbeat.write(count)
        if now - self._beat >= BEAT_PERIOD:
            self._send_heartbeat(now)
            self._look_at_processes()
        if not self._fed:
            self._feed(BlockKind.TICK, b"")
        self._fed = False
        if now >= self._report_at:
            self._report()

    def _read_others(self, ready: int) -> None:
        """Serve what is ready and no skin."""
        ports = self._ports
        # read before what announces the ends of a program that they show, and fed after it
        states = self._payloads(ports.reader, "controller") if ready & _READER else []
        if states or ready & _DRIVER:
            self._read_channel(ports.driver, "driver")
        if ready & _WATCHDOG:
            self._read_channel(ports.watchdog, "watchdog")
        if ready & _SECOND:
            self._read_channel(ports.second, "second")
        for state in states:
            self._feed(BlockKind.ARM, state)
        if ready & _SLIDER:
            self._read(ports.slider, "slider", BlockKind.SLIDER)
        if ready & _HEARTBEAT:
            self._read(ports.heartbeat, "heartbeat", BlockKind.ECHO)
        if ready & _STOPS and ports.stops is not None:
            self._drain(ports.stops)
        if ready & _SESSION:
            self._read_session(ports.session)

    def _note_overrun(self, now: float, late: float, asleep: float) -> None:
        """Report how late this round is, to the core as well where nobody has guarded meanwhile."""
        if late > MIN_STALL:
            self._record(Block(BlockKind.OVERRUN, now, json.dumps({"late": late}).encode()))
        if asleep > _SUSPENSION_TIME:
            self._feed(BlockKind.SUSPENDED, b"%.3f" % asleep)

    def _read_session(self, session: Channel) -> None:
        for message in session.receive():
            if message.startswith(b"reset "):
                self._feed(BlockKind.RESET, message.removeprefix(b"reset "))
            elif message == b"quit":
                self._quit = True
        if session.closed:
            self._quit = True
            self._forget(session)  # its end would be ready for ever

    def _report(self) -> None:
        """Tell the session what went in and came out: at once where anything was decided, else together with more."""
        self._report_at = self._clock() + _REPORT_PERIOD
        if self._out:
            self._ports.session.send(b"".join([encode_block(block) for block in self._out]))
            self._out.clear()

    def _read_channel(self, channel: Channel | None, name: str) -> None:
        if channel is None:  # lost in this round
            return
        for message in channel.receive():
            self._heard[name] = self._clock()
            if name != "second" or message.startswith(b"alive"):
                self._feed(BlockKind.DRIVER, message)
        if channel.closed:
            self._lose(name, f"{HELPER_NAMES[name]} has ended", channel)

    def _send_heartbeat(self, now: float) -> None:
        self._beat = now
        if self._ports.stops is not None and now - self._asked >= _QUESTION_PERIOD:
            self._asked = now
            self._ports.stops.ask()
        for channel in (self._ports.driver, self._ports.watchdog, self._ports.second):
            if channel is not None:
                channel.send(_HEARTBEAT_BYTES)

    def _look_at_processes(self) -> None:
        """Tell the core whether the program is suspended, and whether a helper that is late waits for a processor."""
        program = self._ports.program
        if program is not None:
            self._feed(BlockKind.PROGRAM, b"suspended" if program.suspended() else b"")
        for name, helper in self._ports.helpers.items():
            if self._beat - self._heard[name] > _LATE_TIME and helper.waits(self._beat):
                self._feed(BlockKind.HELD_UP, f"{load()}\n{name}".encode())

    def _read_skin(self, source: Source) -> None:
        try:
            data = source.read(_TICK_PERIOD if self._blind else 0.0)
        except SkinTimeout:
            return
        except ConeSkinError as exc:
            self._lose("skin", str(exc), source)
            return
        self._feed(BlockKind.SKIN, data)

    def _open_skin_again(self, source: Source) -> None:
        """Open a skin that is gone, while the arm stands latched. A person's reset has to follow."""
        ports, reopening = self._ports, self._reopening
        if reopening is None:
            self._reopening = ports.reopen(source) if ports.reopen is not None else None
        elif reopening.done:
            self._gone = self._reopening = None
            if reopening.opened:
                ports.source = source
                self._watch_skin(source)
                self._feed(BlockKind.REOPENED, b"skin")
            else:
                why = f"{source.name} is gone and could not be opened again: start the guard anew"
                self._feed(BlockKind.LOST, encode_loss("skin", why))

    def _read(self, reader: PayloadReader | None, what: str, kind: BlockKind) -> None:
        """Feed what has come over a connection of the controller."""
        for payload in self._payloads(reader, what):
            self._feed(kind, payload)

    def _payloads(self, reader: PayloadReader | None, what: str) -> list[bytes]:
        """Return what has come over a connection of the controller, unless it was lost in this round."""
        try:
            return [] if reader is None else reader.read()
        except ConeSkinError as exc:
            self._lose(what, str(exc), reader)
            return []

    def _drain(self, stops: StopConnections) -> None:
        for name, sock, why in stops.drain():
            self._forget(sock)
            sock.close()
            self._feed(BlockKind.LOST, encode_loss(name, why))
        if not stops.sockets() and self._ports.heartbeat is not None:
            # nothing is left that stops a servoj, but the controller's own watchdog in a program that has its lines
            self._forget(self._ports.heartbeat)
            self._ports.heartbeat.close()
            self._ports.heartbeat = None

    def _feed(self, kind: BlockKind, payload: bytes) -> None:
        """Feed the core, which sends its commands at once. Then record all of it."""
        self._fed = True
        block = tuple.__new__(Block, (kind, self._clock(), payload))  # quicker than Block()
        outbox = self._outbox
        self._core.feed(block, outbox)
        self._record(block)
        if outbox.sent or outbox.events:
            self._report_at = 0.0  # at once
            for sent in outbox.sent:
                self._record(sent)
            for event in outbox.events:
                self._record(event.block())
            outbox.sent.clear()
            outbox.events.clear()

    def _record(self, block: Block) -> None:
        self._out.append(block)

    def _lose(self, what: str, why: str, item: object) -> None:
        self._forget(item)
        if what == "skin":
            self._blind, self._gone = False, self._ports.source if self._ports.reopen is not None else None
        setattr(self._ports, _PORT_ATTRIBUTES.get(what, what), None)
        self._feed(BlockKind.LOST, encode_loss(what, why))
        if what == "controller" and (driver := self._ports.driver) is not None:
            # it would connect again by itself, and its program start with whatever command is still there
            driver.close()
            self._lose("driver", "the driver process must not connect to the controller again by itself", driver)

    def _end(self) -> None:
        """Stop the arm and see it stand."""
        self._feed(BlockKind.LOST, b"session\nthe guard was told to end")
        end = self._clock() + (_SESSION_GONE_TIMEOUT if self._ports.session.closed else _SHUTDOWN_TIMEOUT)
        while (self._core.phase.stopping or self._core.phase is Phase.RETREATING) and self._clock() < end:
            self.poll(_TICK_PERIOD)
        if not (self._core.phase.stopping or self._core.phase is Phase.RETREATING):
            for channel in (self._ports.watchdog, self._ports.second):
                if channel is not None:
                    channel.send(Shutdown().encode())
        self._report()
        self._ports.session.finish(_FLUSH_TIMEOUT)
