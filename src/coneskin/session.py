"""A guarded session: starts the processes that a scene needs, records what they do, and gives the arm to a program.

    with guard("scene.toml") as g:
        g.arm.move_j(q, speed=1.0, acceleration=2.0)     # raises Collision when the skin is touched

Processes: this one records and waits; the guard's loop, the owner of ur_rtde and a virtual skin are children, each on a
channel. A child that dies is seen as the end of its channel, and ends in a stopped arm.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from .arm_proxy import ArmProxy
from .errors import RobotConnectionError, RobotRefused, SceneError, SkinConnectionError
from .last_resort import LastResort, keeping
from .robot.channel import Channel, pair, spawn
from .robot.journal import GuardEvent
from .robot.owner_messages import encode_json
from .robot.ur_models import model
from .run_log import RunLog, new_recording
from .scene import Scene, load
from .scene_facts import lacks
from .uninterrupted import uninterrupted
from .verdict import NOT_SEEN, STANDS, STILL_LEAVING, braking_time, death, reasons, stands, stop_error

if TYPE_CHECKING:
    from .skin_proxy import SkinProxy

__all__ = ["Session", "guard"]

_START = 20.0  # s for the children to be there and everything to be sound
_END = 6.0  # s for the guard to stop the arm and end


def guard(
    scene: Scene | Path | str,
    *,
    recording: Path | None = None,
    on_event: Callable[[GuardEvent], None] | None = None,
    start_timeout: float = _START,
) -> Session:
    """Guard an arm, or watch a skin, while a ``with`` lasts.

    Args:
        scene: a scene, or the path of its file.
        recording: file to record to; by default a new one in the folder that the scene names, if it names one.
        on_event: called for each event, from the thread that records.
        start_timeout: how long the guard may take to arm [s].

    Raises:
        SceneError: the scene has mistakes, or nothing to guard with.
        RobotRefused: on entering, where the guard does not arm in time; the reasons are listed.
        RobotConnectionError: on entering, where the controller cannot be reached.
        SkinConnectionError: on entering, where the port cannot be opened.
    """
    return Session(scene if isinstance(scene, Scene) else load(scene), recording, on_event, start_timeout)


class Session:
    """One guarded run; see ``guard``.

    Attributes:
        scene: what is there.
        recording: the file that is recorded to, or None.
    """

    def __init__(
        self,
        scene: Scene,
        recording: Path | None,
        on_event: Callable[[GuardEvent], None] | None,
        start_timeout: float,
    ) -> None:
        if missing := lacks(scene):
            raise SceneError(missing, scene.name)
        self.scene = scene
        self.recording = recording
        self._on_event = on_event
        self._start_timeout = start_timeout
        self._log = RunLog(None, None)
        self._children: dict[str, subprocess.Popen[bytes]] = {}
        self._guard: Channel | None = None
        self._skin: SkinProxy | None = None
        self._lifelines: list[Channel] = []  # to the children besides the guard, which end when these do
        self._arm: ArmProxy | None = None

    @property
    def events(self) -> list[GuardEvent]:
        """What has happened so far, in order."""
        return self._log.events

    @property
    def arm(self) -> ArmProxy:
        """The arm, for the program.

        Raises:
            RobotRefused: the scene has none.
        """
        if self._arm is None and self._guard is None:
            raise RobotRefused("nothing is guarded yet: enter the guard with a `with`")
        if self._arm is None and self.scene.arm is not None:
            raise RobotRefused(f"{self.scene.name} says arm.control = foreign: another program moves the arm")
        if self._arm is None:
            raise RobotRefused(f"{self.scene.name} has no [arm]")
        return self._arm

    def __enter__(self) -> Session:
        try:
            self._open()
            self._await_armed()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(self, kind: type[BaseException] | None, exc: BaseException | None, tb: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Stop the arm, end the children and close the recording; may be called again.

        Raises:
            KeyboardInterrupt: a person has interrupted meanwhile; all of it is done nevertheless.
        """
        uninterrupted(self._close)

    def _close(self) -> None:
        if self._guard is not None:
            self._guard.send(b"quit")
        for name in ("guard", "owner", "keeper", "skin"):
            child = self._children.pop(name, None)
            if child is None:
                continue
            if name != "guard":  # the others end when their channels do, after the guard has stopped the arm
                for channel in self._lifelines:
                    channel.close()
            try:
                child.wait(_END)
            except subprocess.TimeoutExpired:
                if name == "keeper" and not stands(self.events):
                    continue  # it is still stopping the arm, and ends when that stands
                child.kill()
                child.wait()
        self._log.close()
        if self._guard is not None:
            self._guard.close()

    def reset(self, timeout: float = 5.0) -> None:
        """Let the arm move again after a collision or a fault: call it because a person has looked.

        Raises:
            RobotRefused: something is still wrong; the reasons are listed.
            RobotConnectionError: the guard hangs, or is gone.
        """
        self.check_guard()
        seen = len(self.events)
        assert self._guard is not None
        self._guard.send(b"reset")
        event = self.wait_for(("armed", "refused", "message"), timeout, after=seen)
        if event is None or event.name != "armed":
            why = "the guard did not arm in time" if event is None else "; ".join(reasons(event))
            raise RobotRefused(f"reset refused: {why}")

    def touch(self, u: float, phi: float, force: float = 5.0, duration: float = 0.3, sensor: str | int = "") -> float:
        """Touch the scene's virtual skin now.

        Args:
            u: slant distance from end 1 [m].
            phi: azimuth [rad].
            force: [N].
            duration: [s].
            sensor: its name or its id; by default the first.

        Returns:
            when the touch begins, on the clock of the events [s].

        Raises:
            SensorError: there is no such sensor, the place is off it, or a value cannot be.
            SkinConnectionError: the scene's skin is not virtual, or is gone.
        """
        if self._skin is None:
            raise SkinConnectionError("only a virtual skin can be touched by a program")
        return self._skin.touch(u, phi, force, duration, sensor)

    def check_guard(self) -> None:
        """Raise where nobody guards: the guard hangs, or is gone. What it has stopped is no matter here.

        Raises:
            RobotConnectionError: a process is gone, or says nothing.
            ConeSkinError: what the guard died of.
        """
        for event in self.events[self._since_armed() :]:
            if event.name == "died":
                raise death(event)
        if self._log.lost:
            raise RobotConnectionError(self._log.lost)
        if self._log.ended and not any(event.name == "ending" for event in self.events[-20:]):
            raise RobotConnectionError("the guard's process has ended; what it leaves behind stops the arm")

    def wait_for(self, names: tuple[str, ...], timeout: float, after: int = 0) -> GuardEvent | None:
        """The first event of one of these names from position ``after`` on; None after the timeout [s]."""
        return self._log.wait_for(names, timeout, after)

    def check(self, stopped: bool = False) -> None:
        """Raise what has happened: a collision, a fault, or the end of a process.

        Args:
            stopped: the owner has said that the guard stopped the arm; the guard's own word may be a moment behind.

        Raises:
            Collision: the skin was touched and the arm has reacted.
            RobotRefused: a fault has stopped the arm.
            RobotConnectionError: a process is gone, or the guard hangs.
        """
        since = self._since_armed()
        stop = self.wait_for(("stopping",), 1.0 if stopped else 0.0, after=since)
        self.check_guard()
        if stop is None:
            return
        outcome = self._outcome(since)
        contact = self.wait_for(("contact_placed",), 0.0, after=since) or self.wait_for(("contact",), 0.0, after=since)
        raise stop_error(stop, contact, outcome)

    def _since_armed(self) -> int:
        """Position after the newest "armed"; found from the end, because a program asks with each of its commands."""
        events = self.events
        return next((at + 1 for at in range(len(events) - 1, -1, -1) if events[at].name == "armed"), 0)

    def _outcome(self, since: int) -> str:
        """What has become of the newest stop, as far as it is known in time."""
        patience = braking_time(self.scene)
        end = time.monotonic() + patience + _END
        while True:
            newest = max(i for i, event in enumerate(self.events) if i >= since and event.name == "stopping")
            if self.wait_for(("standstill", "latched"), patience, after=newest) is None:
                return NOT_SEEN
            latched = self.wait_for(("latched",), max(end - time.monotonic(), 0.0), after=newest)
            if not any(event.name == "stopping" for event in self.events[newest + 1 :]):
                return STANDS if latched else STILL_LEAVING
            if time.monotonic() >= end:
                return NOT_SEEN

    # ---- how it starts

    def _open(self) -> None:
        scene = self.scene
        assert scene.source is not None
        start = {"scene": scene.text, "name": scene.name, "folder": str(scene.folder.resolve())}
        if self.recording is None and scene.recording is not None:
            self.recording = new_recording(scene.recording.folder)
        self._log = RunLog(self.recording, self._on_event)
        self._log.open(start)
        port = scene.source.port
        if scene.source.kind == "virtual":
            from .skin_proxy import SkinProxy

            self._skin = SkinProxy(start, [item.sensor for item in scene.sensors])
            self._children["skin"] = self._skin.process
            self._lifelines.append(self._skin.channel)
            port = self._skin.port()
        resort = None
        ours, theirs = pair()
        ends = [theirs]
        if scene.arm is not None:
            guard_end, other_guard_end = pair()
            program_end, other_program_end = pair()
            channel = Channel(program_end)
            self._lifelines.append(channel)
            ends.append(guard_end)
            owned = scene.arm.control == "owner"
            name = "owner" if owned else "keeper"
            self._children[name] = spawn(f"coneskin.robot.{name}", other_guard_end, other_program_end)
            channel.send(encode_json({**keeping(scene), "watchdog_hz": scene.arm.watchdog_hz}))
            if owned:
                self._arm = ArmProxy(channel, self.check, model(scene.arm.model))
            else:
                resort = LastResort(scene)
        self._guard = Channel(ours)
        self._children["guard"] = spawn("coneskin.guard_process", *ends)
        self._guard.send(encode_json({**start, "port": port}))
        self._log.listen(self._guard, resort)

    def _await_armed(self) -> None:
        end = time.monotonic() + self._start_timeout
        while time.monotonic() < end:
            event = self.wait_for(("armed", "died"), 0.2)
            if event is not None and event.name == "armed":
                return
            owner = self._children.get("owner")
            if event is not None or self._log.ended or (owner is not None and owner.poll() is not None):
                break  # waiting longer would not help
        self.wait_for(("fault",), 0.5)
        self.check_guard()
        waiting = next((event for event in reversed(self.events) if event.name == "waiting"), None)
        faults = [str(event.details["what"]) for event in self.events if event.name in ("fault", "died")]
        waited_for = reasons(waiting) if waiting else []
        listed = list(dict.fromkeys([*faults, *waited_for])) or ["its process sent nothing"]
        raise RobotRefused("the guard did not arm:\n" + "\n".join(f"  {line}" for line in listed))
