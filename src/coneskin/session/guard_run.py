"""Run of a guard in its process: it opens what the scene names, and serves until it is told to end."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import socket
import struct
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from coneskin.core.channel import Channel
from coneskin.core.child_process import Lifeline
from coneskin.core.errors import RobotRefused
from coneskin.core.process_watch import ProcessWatch
from coneskin.core.recording.block import encode_block
from coneskin.robot.guard.loop import GuardLoop, GuardPorts
from coneskin.scene.build import build_core, encode_surfaces, place_on_arm
from coneskin.scene.values.scene import Scene
from coneskin.skin.sources.kinds import is_simulated, open_source
from coneskin.skin.sources.source import SourceReopening

_LOCK_TIMEOUT = 3.0  # s for the guard of a program that was killed to stop its arm and end
_CREDENTIALS = struct.Struct("3i")  # ucred of unix(7): process, user, group
_LOCK_PERIOD = 0.05  # s


@contextlib.contextmanager
def _arm_lock(
    host: str,
    timeout: float = _LOCK_TIMEOUT,
    wait: Callable[[float], None] = time.sleep,
    clock: Callable[[], float] = time.monotonic,
) -> Iterator[None]:
    """Lock the arm of one controller, which another guard may take a time [s] to leave; on Linux alone."""
    if sys.platform != "linux":
        yield
        return
    end, name = clock() + timeout, f"\0coneskin guard of {_address(host)}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as sock:
        while True:
            try:
                sock.bind(name)
                sock.listen(1)  # so that who is refused can ask whose it is
                break
            except OSError as exc:
                if exc.errno != errno.EADDRINUSE:  # a system without such names has no lock
                    break
            if clock() >= end:
                raise RobotRefused(
                    f"another guard on this computer has the arm at {host}, {_holder(name)}: end that program, or that "
                    "coneskin guard, first"
                )
            wait(_LOCK_PERIOD)
        yield


def _holder(name: str) -> str:
    """Return who holds a lock, as the system knows it: its name alone says nothing, because any user can take it."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as sock:
        try:
            sock.connect(name)
            pid, uid, _ = _CREDENTIALS.unpack(sock.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size))
        except OSError:
            return "or a program that is none and has taken its name (see it in /proc/net/unix)"
    return f"process {pid} of user {uid}{'' if uid == os.getuid() else ', who is not you'}"


def _address(host: str) -> str:
    """Return the address of a host, so that two names of one controller are one arm."""
    try:
        return socket.gethostbyname(host)
    except OSError:
        return host  # the driver says what is wrong with it


def run_guard(
    scene: Scene,
    start: dict[str, Any],
    session: Channel,
    others: Sequence[Channel],
    lifeline: Lifeline,
    stack: contextlib.ExitStack,
) -> None:
    """Open what a scene names, and guard it until the guard is to end.

    Args:
        start: what the program has said; it names the port.
        others: those to the driver process, or to the guard watchdogs; none without an arm.

    Raises:
        ConeSkinError: something cannot be opened, or is not what the scene says.
    """
    placed = place_on_arm(scene)
    core = build_core(scene, placed)
    for block in encode_surfaces(placed, time.monotonic()):
        session.send(encode_block(block))
    assert scene.source is not None
    source = stack.enter_context(open_source(scene.source.kind, scene.source.settings, start["port"]))
    ports = GuardPorts(session, source, reopen=None if is_simulated(scene.source.kind) else SourceReopening)
    if scene.arm is not None:
        from coneskin.robot.driver.protocol import HeartbeatDriver, SetpointDriver, SliderDriver, require

        if scene.arm.control == "internal":
            (ports.driver,) = others
        else:
            ports.watchdog, ports.second = others
        ports.program = ProcessWatch(os.getppid())
        ports.helpers = {name: ProcessWatch(pid) for name, pid in start["helpers"].items()}
        driver, host, needs = scene.arm.driver, scene.arm.host, core.needs
        stack.enter_context(_arm_lock(host))
        driver.check_model(scene.arm.arm_model, host)
        if needs.setpoints:
            ports.reader = ports.setpoints = stack.enter_context(require(driver, SetpointDriver).setpoint_writer(host))
        else:
            ports.reader = stack.enter_context(driver.state_reader(host))
        ports.stops = stack.enter_context(driver.stop_connections(host))
        if needs.slider:
            ports.slider = stack.enter_context(require(driver, SliderDriver).speed_slider(host))
        elif needs.stops_by_slider:
            try:
                ports.slider = stack.enter_context(require(driver, SliderDriver).speed_slider(host, claim=False))
            except RobotRefused as exc:  # a program has it
                ports.absent = {"slider": str(exc)}
        if needs.heartbeat is not None:
            try:
                ports.heartbeat = stack.enter_context(require(driver, HeartbeatDriver).heartbeat_writer(host))
            except RobotRefused as exc:  # a program has the register
                if needs.heartbeat:
                    raise
                ports.absent = {**ports.absent, "heartbeat": str(exc)}
    lifeline.hold()
    loop = GuardLoop(core, ports)
    signal.signal(signal.SIGTERM, lambda *_: loop.stop())
    loop.run()
