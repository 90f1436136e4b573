"""Guarded session: it starts the processes of a scene, records what they do, and gives the arm to a program.

    with guard("scene.toml") as g:
        g.arm.move_j(q, speed=1.0, acceleration=2.0)     # raises Collision when the skin is touched

Processes: this one records and waits; the guard's loop, the arm's driver and a virtual skin are children, each on a
channel. The death of a child shows as the end of its channel, and ends in a stopped arm.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import RobotConnectionError, RobotRefused, SceneError, SkinConnectionError
from coneskin.robot.guard.signals.journal import EventName, GuardEvent, stopping_contact
from coneskin.scene.commissioning_record import with_commissioning
from coneskin.scene.reader import load_scene
from coneskin.scene.required_packages import require_packages
from coneskin.scene.settings import resolved_settings
from coneskin.scene.summary import missing_parts
from coneskin.scene.values.scene import Scene

from .child_processes import ChildProcesses
from .event_log import EventLog, discard_recording, new_recording
from .guard_monitor import GuardMonitor
from .outcome import activation_error, await_outcome, braking_time, exit_error, reasons, stands, stop_error

if TYPE_CHECKING:
    import socket

    from .ur_rtde_names import UrRtdeArm

_START_TIMEOUT = 20.0  # s for the children to start and the guard to become active
_REASON_TIMEOUT = 5.0  # s for the guard to report why the driver process ended


def guard(
    scene: Scene | Path | str,
    *,
    recording: Path | str | None = None,
    on_event: Callable[[GuardEvent], None] | None = None,
    start_timeout: float = _START_TIMEOUT,
    pressed_by: socket.socket | None = None,
) -> Session:
    """Guard an arm, or watch a skin, while a ``with`` lasts.

    Args:
        scene: a scene, or the path of its file.
        recording: file to record to; by default a new one in the folder that the scene names, if it names one.
        on_event: called for each event, from the thread that records.
        start_timeout: how long the guard may take to become active [s].
        pressed_by: line from physics that presses the scene's virtual skin: ``LivePlant.skin``; closed on entering.

    Raises:
        SceneError: the scene has mistakes, or nothing to guard with.
        RobotRefused: on entering, where the guard does not become active in time; the reasons are listed.
        RobotConnectionError: on entering, where the controller cannot be reached.
        SkinConnectionError: on entering, where the port cannot be opened.
    """
    read = scene if isinstance(scene, Scene) else load_scene(scene)
    return Session(read, None if recording is None else Path(recording), on_event, start_timeout, pressed_by)


class Session:
    """Guarded run, made by ``guard`` and entered in a ``with``, or begun with ``open``.

    Attributes:
        scene: of the run.
        recording: the file that is recorded to, or None.
        pressed_by: line from what presses the virtual skin, or None; it may be set until the session is entered.
    """

    def __init__(
        self,
        scene: Scene,
        recording: Path | None,
        on_event: Callable[[GuardEvent], None] | None,
        start_timeout: float,
        pressed_by: socket.socket | None = None,
    ) -> None:
        if missing := missing_parts(scene):
            raise SceneError(missing, scene.name)
        require_packages(scene)
        self.scene = with_commissioning(scene, time.time())
        self.recording = recording
        self._made = False  # the recording's folder
        self._on_event = on_event
        self._start_timeout = start_timeout
        self.pressed_by = pressed_by
        self._log = EventLog()
        self._monitor: GuardMonitor | None = None
        self._processes = ChildProcesses()
        self._arm: UrRtdeArm | None = None
        self._resets = 0  # asked for so far
        self._owner = os.getpid()

    @property
    def events(self) -> list[GuardEvent]:
        """Events so far, in order; a copy."""
        return list(self._log.events)

    @property
    def began(self) -> float:
        """When the run began, on the clock of the events [s]: the zero of the times that commands print."""
        return self._log.began

    @property
    def arm(self) -> UrRtdeArm:
        """Arm for the program.

        Raises:
            RobotRefused: the scene has none.
        """
        if self._arm is None and self._processes.guard is None:
            raise RobotRefused("nothing is guarded yet: enter the guard with a `with`")
        if self._arm is None and self.scene.arm is not None:
            raise RobotRefused(f"{self.scene.name} says control = external in [arm]: another program moves the arm")
        if self._arm is None:
            raise RobotRefused(f"{self.scene.name} has no [arm]")
        return self._arm

    def open(self) -> Session:
        """Begin the run, as entering a ``with`` does, for a program that ends with ``close``.

        A program that ends without it ends the run as well: the other processes stop the arm.

        Raises:
            RobotRefused, RobotConnectionError, SkinConnectionError: as ``guard``.
        """
        return self.__enter__()

    def __enter__(self) -> Session:
        try:
            self._open()
            self._await_activation()
            if self._processes.skin is not None:
                self._processes.skin.note_script()
        except BaseException:
            self.close()
            if self._made and self.recording is not None and not self._log.activated:
                discard_recording(self.recording)
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop the arm, end the children and close the recording; may be called again.

        In a forked copy of the program, which leaves the ``with`` too, nothing happens: all of it is the program's.

        Raises:
            KeyboardInterrupt: a person has interrupted meanwhile; all of it is done nevertheless.
        """
        if os.getpid() == self._owner:
            _defer_interrupts(self._close)

    def _close(self) -> None:
        self._processes.end(lambda: stands(self._log.events))
        if self._arm is not None:
            self._arm.close()
        if self._monitor is not None:
            self._monitor.close()
        self._log.close()
        self._processes.close()

    def reset(self, timeout: float = 5.0, stop: int | None = None) -> None:
        """Let the arm move again after a collision or a fault: call it because a person has looked.

        Args:
            timeout: for the guard to become active [s].
            stop: number of the stop that the person has looked at (``Collision.number``); by default the newest one
                that latched the arm and was reported to this program. A newer one is not forgiven.

        Raises:
            RobotRefused: something is still wrong; the reasons are listed.
            RobotConnectionError: the guard hangs, or is gone.
        """
        self.check_guard()
        stop = self.latched_stop if stop is None else stop
        if stop == 0:
            raise RobotRefused("reset refused: no stop that has latched the arm was reported to this program")
        self._resets += 1
        request, seen = self._resets, len(self._log.events)
        assert self._processes.guard is not None
        self._processes.guard.send(b"reset %d %d" % (stop, request))
        answers = (EventName.ACTIVATED, EventName.REFUSED)
        event = self._log.wait_for(answers, timeout, seen, lambda event: event.details.get("request") == request)
        if event is None or event.name != EventName.ACTIVATED:
            listed = ["the guard did not become active in time"] if event is None else reasons(event)
            line = self._describe_line(listed)
            raise RobotRefused(f"reset refused: {'; '.join([*([line] if line else []), *listed])}")

    @property
    def latched_stop(self) -> int:
        """Number of the newest stop that has latched the arm and was reported to this program; 0 before the first."""
        events = reversed(self._log.events)
        return next((int(event.details["stop"]) for event in events if event.name == EventName.LATCHED), 0)

    def touch(self, u: float, phi: float, force: float = 5.0, duration: float = 0.3, sensor: str | int = "") -> float:
        """Touch the scene's virtual skin now.

        Args:
            u: slant distance from end 1 [m].
            phi: azimuth [rad].
            force: [N].
            duration: [s]; less where the arm moves away from the touch.
            sensor: its name or its id; by default the first.

        Returns:
            when the touch begins, on the clock of the events [s].

        Raises:
            SensorError: there is no such sensor, the place is off it, or a value cannot be.
            SkinConnectionError: the scene's skin is not virtual, or is gone.
        """
        if self._processes.skin is None:
            raise SkinConnectionError("only a virtual skin can be touched by a program")
        return self._processes.skin.touch(u, phi, force, duration, sensor)

    def check_guard(self) -> None:
        """Raise where the guard hangs, or is gone. What it has stopped does not matter here.

        Raises:
            RobotConnectionError: a process is gone, or sends nothing.
            ConeSkinError: what ended the guard.
        """
        for event in self._log.events[self._since_activation() :]:
            if event.name == EventName.GUARD_EXITED:
                raise exit_error(event)
        if self._monitor is not None and self._monitor.lost:
            raise RobotConnectionError(self._monitor.lost)
        if self._log.ended and not any(event.name == EventName.ENDING for event in self._log.events[-20:]):
            raise RobotConnectionError("the guard's process has ended; the arm is stopped by the other processes")

    def wait_for(self, names: tuple[str, ...], timeout: float, after: int = 0) -> GuardEvent | None:
        """Return the first event of one of these names from position ``after`` on; None after the timeout [s]."""
        return self._log.wait_for(names, timeout, after)

    def check(self, stopped: bool = False) -> None:
        """Raise what has happened: a collision, a fault, or the end of a process.

        Args:
            stopped: the driver process has said that the guard stopped the arm; the guard's own report may be late.

        Raises:
            Collision: the skin was touched and the arm has reacted.
            RobotRefused: a fault has stopped the arm.
            RobotConnectionError: a process is gone, or the guard hangs.
        """
        since = self._since_activation()
        stop = self.wait_for((EventName.STOPPING,), 1.0 if stopped else 0.0, after=since)
        self.check_guard()
        if stop is None:
            return
        outcome = await_outcome(self._log, since, braking_time(self.scene))
        contact = stopping_contact(stop, self._log.events)
        latched = [event for event in self._log.events[since:] if event.name == EventName.LATCHED]
        raise stop_error(stop, contact, outcome, str(latched[-1].details["why"]) if latched else "")

    def _since_activation(self) -> int:
        """Return the position after the newest activation, searched from the end: it is asked at each command."""
        events = self._log.events
        return next((at + 1 for at in range(len(events) - 1, -1, -1) if events[at].name == EventName.ACTIVATED), 0)

    def _take_event(self, event: GuardEvent) -> None:
        """Take what touches a virtual skin off it as soon as the arm moves away; a push is what an arm gives way to."""
        away = event.name == EventName.RETREATING and event.details.get("how") != "push"
        if away and self._processes.skin is not None:
            self._processes.skin.release()
        if self._on_event is not None:
            self._on_event(event)

    def _describe_line(self, reasons: Sequence[str]) -> str:
        """Return what is wrong with the skin's line, given why the guard waits or refuses."""
        return self._log.line.describe(self.scene, reasons, time.monotonic())

    # ---- how it starts

    def _open(self) -> None:
        scene = self.scene
        start: dict[str, Any] = {"scene": scene.text, "name": scene.name, "folder": str(scene.folder.resolve())}
        start["commissioning"] = asdict(scene.commissioning) if scene.commissioning else None
        if self.recording is None and scene.recording is not None:
            self.recording, self._made = new_recording(scene.recording.folder), True
        virtual = scene.source is not None and scene.source.kind == "virtual"
        heard = self._take_event if virtual else self._on_event
        self._log = EventLog(self.recording, heard, scene.recording, scene.arm_label)
        self._log.open({**start, "resolved": resolved_settings(scene)} if self.recording is not None else start)
        channel = self._processes.start(scene, start, self._log.note_truth, self.pressed_by)
        if self._processes.skin is not None:
            self._log.physics = self._processes.skin.physics
        program = self._processes.program
        if scene.arm is not None and program is not None:
            from .ur_rtde_names import UrRtdeArm

            self._arm = UrRtdeArm(program, self.check, scene.arm.arm_model, scene.arm.host)
        self._monitor = GuardMonitor(self._log, channel, self._processes.watchdogs, self._describe_line)

    def _await_activation(self) -> None:
        end = time.monotonic() + self._start_timeout
        while time.monotonic() < end:
            event = self.wait_for((EventName.ACTIVATED, EventName.GUARD_EXITED), 0.2)
            if event is not None and event.name == EventName.ACTIVATED:
                return
            driver = self._processes.children.get("driver")
            if event is not None or self._log.ended or (driver is not None and driver.poll() is not None):
                # waiting longer for the activation would not help, but the guard may still report why
                self.wait_for((EventName.FAULT, EventName.GUARD_EXITED), _REASON_TIMEOUT)
                break
        self.check_guard()
        raise activation_error(self._log.events, self._describe_line)


def _defer_interrupts(job: Callable[[], None]) -> None:
    """Do a job to its end, which it must have, and raise only then the interrupt of a person, or of SIGTERM."""
    noted: list[int] = []
    before = {}
    if threading.current_thread() is threading.main_thread():  # interrupts are raised, and can be caught, in it alone
        for number in (signal.SIGINT, signal.SIGTERM):
            if callable(handler := signal.getsignal(number)):  # the default of the system is left alone
                before[number] = handler
                signal.signal(number, lambda number, _: noted.append(number))
    try:
        job()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if noted:
        raise KeyboardInterrupt
