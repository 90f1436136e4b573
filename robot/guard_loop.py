"""The live loop: one thread in a process of its own that joins source, core and arm.

Order of work after each wake: read the skin, decide, send the command; only then tell the recorder. Whoever stalls
beside it (disk, terminal, ur_rtde) is on the other side of a channel that never makes it wait.
"""

from __future__ import annotations

import gc
import json
import selectors
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from coneskin.errors import ConeSkinError, SkinTimeout
from coneskin.skin.recording import Block, encode_block
from coneskin.skin.source import Source

from .channel import Channel
from .follower import FollowerProgram, Steer
from .guard_core import GuardCore
from .journal import GuardEvent, Kind
from .outputs import Output
from .owner_messages import BEAT, Alive, Farewell, Stop
from .phase import Phase
from .slowing import Slider
from .stop_watch import Use, Way

if TYPE_CHECKING:  # opened for it where the scene has an arm
    from .foreign import ForeignStops
    from .speed_slider import SpeedSlider
    from .state_reader import StateReader
    from .steering import Steering

__all__ = ["GuardLoop", "GuardPorts"]

_ALIVE = Alive().encode()
_OURS = (Use, Steer, FollowerProgram, Slider)
_PORTS = {"skin": "source", "controller": "reader", "slider": "slider", "keeper": "keeper", "owner": "owner"}
_TICK = 0.002  # s between two looks at the clocks where nothing else happens
_OVERRUN = 0.02  # s between two rounds from which on the loop says that it was held up
_LAST_WORDS = 1.0  # s that the recorder has to take what waits for it
_ENDING = 3.0  # s that the arm has to stand when the guard is told to end


@dataclass(slots=True)
class GuardPorts:
    """What the loop is connected to; None for what the scene does not have.

    Attributes:
        supervisor: the process that records and shows.
        source: of the skin's bytes, open.
        reader: of the controller's state, open.
        owner: of ur_rtde.
        foreign: stops that do not need ur_rtde, open.
        slider: of the controller's speed, open.
        keeper: the process that stops the arm when this one is gone, where there is no owner to do so.
        steering: the reader once more, where it carries speeds to a follower program.
    """

    supervisor: Channel
    source: Source | None
    reader: StateReader | None = None
    owner: Channel | None = None
    foreign: ForeignStops | None = None
    slider: SpeedSlider | None = None
    keeper: Channel | None = None
    steering: Steering | None = None


class _Outbox:
    """Sends a command as soon as the core has decided it, and keeps the rest for the recorder."""

    __slots__ = ("_ports", "events", "sent")

    def __init__(self, ports: GuardPorts) -> None:
        self._ports = ports
        self.sent: list[bytes] = []
        self.events: list[GuardEvent] = []

    def append(self, output: Output, /) -> None:
        """Take what comes out of the core."""
        ports = self._ports
        if isinstance(output, GuardEvent):
            self.events.append(output)
        elif isinstance(output, _OURS):
            self._append_ours(ports, output)
        else:
            message = output.encode()
            taken = ports.owner is not None and ports.owner.send(message)
            self.sent.append((b"owner\n" if taken else b"owner, not sent\n") + message)

    def _append_ours(self, ports: GuardPorts, output: Use | Steer | FollowerProgram | Slider) -> None:
        """What goes through connections of the guard's own."""
        if isinstance(output, Use):
            name = output.way.value
            if output.way is Way.KEEPER:
                taken = ports.keeper is not None and ports.keeper.send(Stop(output.deceleration).encode())
            else:
                taken = ports.foreign is not None and ports.foreign.use(*output)
            text = "sent" if taken else "not sent"
        elif isinstance(output, Steer):
            taken = ports.steering is not None and ports.steering.steer(output)
            name, text = ("steer" if taken else "steer, not sent"), str(output.values)
        elif isinstance(output, FollowerProgram):
            taken = ports.foreign is not None and ports.foreign.run(output.text)
            name, text = ("script" if taken else "script, not sent"), output.text
        else:
            taken = ports.slider is not None and ports.slider.set(output.fraction)
            name, text = ("slider" if taken else "slider, not sent"), str(output.fraction)
        self.sent.append(f"{name}\n{text}".encode())


class GuardLoop:
    """Runs a core on its ports.

    Args:
        core: decides.
        ports: what it is connected to.
        clock: monotonic seconds.
    """

    def __init__(self, core: GuardCore, ports: GuardPorts, clock: Callable[[], float] = time.monotonic) -> None:
        self._core = core
        self._ports = ports
        self._clock = clock
        self._selector = selectors.DefaultSelector()
        self._quit = False
        self._took = False  # anything, in this step
        self._beat = -BEAT
        self._out: list[bytes] = []
        self._outbox = _Outbox(ports)

    def stop(self) -> None:
        """End: stop the arm, see it stand, and leave ``run``. May be called from a signal handler."""
        self._quit = True

    def run(self) -> None:
        """Serve until told to end, or until the supervisor is gone; the arm is stopped before this returns."""
        self._open()
        gc.collect()
        gc.freeze()
        gc.disable()  # nothing here lives longer than a frame
        before = self._clock()
        try:
            while not self._quit:
                self.step(_TICK)
                now = self._clock()
                if now - before > _OVERRUN:
                    self._record(Block(Kind.OVERRUN, now, json.dumps({"late": now - before}).encode()))
                before = now
            self._end()
        finally:
            gc.enable()
            self._close()

    def _open(self) -> None:
        ports = self._ports
        for item in (ports.supervisor, ports.owner, ports.keeper, ports.reader, ports.slider):
            if item is not None:
                self._selector.register(item, selectors.EVENT_READ)
        if ports.source is not None and (descriptor := ports.source.fileno()) is not None:
            self._selector.register(descriptor, selectors.EVENT_READ, "skin")
        for sock in ports.foreign.sockets().values() if ports.foreign else ():
            self._selector.register(sock, selectors.EVENT_READ, "foreign")

    def _close(self) -> None:
        self._selector.close()

    def step(self, timeout: float) -> None:
        """Wait for input, or for the timeout [s], and serve it."""
        ports = self._ports
        ready = {key.data or key.fileobj for key, _ in self._selector.select(timeout)}
        arm_first = self._core.phase.stopping  # states that wait may show that the stop under way works
        if arm_first and ports.reader is not None and ports.reader in ready:
            self._read_arm(ports.reader)
        if ports.source is not None and ("skin" in ready or ports.source.fileno() is None):
            self._read_skin(ports.source)
        if not arm_first and ports.reader is not None and ports.reader in ready:
            self._read_arm(ports.reader)
        if ports.slider is not None and ports.slider in ready:
            self._read_slider(ports.slider)
        for channel in (ports.owner, ports.keeper):
            if channel is not None and channel in ready:
                self._hear(channel)
        if self._clock() - self._beat >= BEAT:
            self._live()
        if "foreign" in ready and ports.foreign is not None:
            self._drain(ports.foreign)
        if ports.supervisor in ready:
            for message in ports.supervisor.receive():
                if message == b"reset":
                    self._take(Kind.RESET, b"")
                elif message == b"quit":
                    self._quit = True
        if ports.supervisor.closed:
            self._quit = True
            self._forget(ports.supervisor)  # its end would be ready for ever
        if not self._took:
            self._take(Kind.TICK, b"")
        self._took = False
        self._tell()

    def _tell(self) -> None:
        if self._out:
            self._ports.supervisor.send(b"".join(self._out))
            self._out.clear()

    def _hear(self, channel: Channel) -> None:
        for message in channel.receive():
            self._take(Kind.OWNER, message)
        if channel.closed:
            owner = channel is self._ports.owner
            name, what = ("owner", "owns ur_rtde") if owner else ("keeper", "watches the guard")
            self._lose(name, f"the process that {what} has ended", channel)

    def _live(self) -> None:
        self._beat = self._clock()
        for channel in (self._ports.owner, self._ports.keeper):
            if channel is not None:
                channel.send(_ALIVE)

    def _read_skin(self, source: Source) -> None:
        try:
            data = source.read(0.0 if source.fileno() is not None else _TICK)
        except SkinTimeout:
            return
        except ConeSkinError as exc:
            self._lose("skin", str(exc), source.fileno())
            return
        self._take(Kind.SKIN, data)

    def _read_arm(self, reader: StateReader) -> None:
        try:
            for payload in reader.read():
                self._take(Kind.ARM, payload)
        except ConeSkinError as exc:
            self._lose("controller", str(exc), reader)

    def _read_slider(self, slider: SpeedSlider) -> None:
        try:
            for payload in slider.read():
                self._take(Kind.SLIDER, payload)
        except ConeSkinError as exc:
            self._lose("slider", str(exc), slider)

    def _drain(self, foreign: ForeignStops) -> None:
        for name, sock in foreign.drain():
            self._forget(sock)
            sock.close()
            why = f"the controller has closed the {name} connection, which a stop may need"
            self._take(Kind.LOST, f"{name}\n{why}".encode())

    def _take(self, kind: Kind, payload: bytes) -> None:
        """Feed the core, which sends its commands at once; then note all of it for the recorder."""
        self._took = True
        block = Block(kind, self._clock(), payload)
        outbox = self._outbox
        self._core.take(block, outbox)
        self._record(block)
        if outbox.sent or outbox.events:
            done = self._clock()
            for line in outbox.sent:
                self._record(Block(Kind.COMMAND, done, line))
            for event in outbox.events:
                self._record(event.block())
            outbox.sent.clear()
            outbox.events.clear()

    def _record(self, block: Block) -> None:
        self._out.append(encode_block(block))

    def _lose(self, what: str, why: str, fileobj: object) -> None:
        self._forget(fileobj)
        setattr(self._ports, _PORTS[what], None)
        self._take(Kind.LOST, f"{what}\n{why}".encode())
        if what == "controller" and (owner := self._ports.owner) is not None:
            # ur_rtde would connect again by itself, and its program start with whatever command is still there
            owner.close()
            self._lose("owner", "ur_rtde must not connect to the controller again by itself", owner)

    def _forget(self, fileobj: object) -> None:
        with suppress(KeyError, ValueError, OSError):
            self._selector.unregister(fileobj)  # type: ignore[arg-type]

    def _end(self) -> None:
        """Stop the arm and see it stand."""
        self._take(Kind.LOST, b"supervisor\nthe guard was told to end")
        end = self._clock() + _ENDING
        while (self._core.phase.stopping or self._core.phase is Phase.RETREATING) and self._clock() < end:
            self.step(_TICK)
        if self._ports.keeper is not None and not (self._core.phase.stopping or self._core.phase is Phase.RETREATING):
            self._ports.keeper.send(Farewell().encode())
        self._tell()
        self._ports.supervisor.finish(_LAST_WORDS)
