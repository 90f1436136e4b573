"""Child processes of a session: the guard, the driver process or two guard watchdogs, and a virtual skin.

Each is on a channel. A child ends when its channel does, so that none outlives the session for long.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from coneskin.core.channel import Channel, encode_json, pair
from coneskin.core.child_process import spawn
from coneskin.robot.driver.messages import LEAVE
from coneskin.robot.driver.protocol import ProgramDriver, require
from coneskin.skin.sources.kinds import is_simulated

if TYPE_CHECKING:
    import socket

    from coneskin.scene.values.scene import Scene

    from .skin_client import SkinClient

_WATCHDOG_NAMES = ("watchdog", "second")
_END_TIMEOUT = 6.0  # s for the guard to stop the arm and end


class ChildProcesses:
    """Child processes of one session, started once and ended once.

    Attributes:
        children: by name: "guard", "driver" or "watchdog" and "second", "skin".
        guard: channel to the guard; None before the start.
        program: channel to the driver process, for the guarded program; None with external control.
        watchdogs: channels to the guard watchdogs.
        skin: client of the virtual skin; None where the skin is not virtual.
    """

    def __init__(self) -> None:
        self.children: dict[str, subprocess.Popen[bytes]] = {}
        self.guard: Channel | None = None
        self.program: Channel | None = None
        self.watchdogs: list[Channel] = []
        self.skin: SkinClient | None = None
        self._lifelines: list[Channel] = []  # to the children besides the guard, which end with them

    def start(
        self,
        scene: Scene,
        start: dict[str, Any],
        note_truth: Callable[[dict[str, Any]], None],
        pressed_by: socket.socket | None = None,
    ) -> Channel:
        """Start the processes that a scene needs, all at once, and return the channel to the guard.

        Args:
            start: the scene's text, name and folder, which the children read it from.
            note_truth: is told with what a virtual skin is touched; see ``SkinClient``.
            pressed_by: line from what presses the virtual skin.

        Raises:
            RobotConnectionError: a process cannot be started.
            SkinConnectionError: the process of the virtual skin does not answer.
        """
        assert scene.source is not None
        if is_simulated(scene.source.kind):
            from .skin_client import SkinClient

            self.skin = SkinClient(start, [item.sensor for item in scene.sensors], note_truth, pressed_by)
            self.children["skin"] = self.skin.process
            self._lifelines.append(self.skin.channel)
        ours, theirs = pair()
        ends = [theirs]
        if scene.arm is not None and scene.arm.control == "internal":
            module = require(scene.arm.driver, ProgramDriver).process
            self.program = self._start_helper("driver", module, scene, ends)
            self._lifelines.append(self.program)
        elif scene.arm is not None:
            for name in _WATCHDOG_NAMES:
                self.watchdogs.append(self._start_helper(name, "coneskin.robot.stop.guard_watchdog", scene, ends))
        self.guard = Channel(ours)
        self.children["guard"] = spawn("coneskin.session.guard_process", *ends)
        port = "" if self.skin is None else self.skin.port()  # the others start meanwhile
        helpers = {name: self.children[name].pid for name in ("driver", *_WATCHDOG_NAMES) if name in self.children}
        self.guard.send(encode_json({**start, "port": port, "helpers": helpers}))
        return self.guard

    def _start_helper(self, name: str, module: str, scene: Scene, ends: list[socket.socket]) -> Channel:
        """Start a process that stops the arm, and return the channel to it; its guard's end joins the others."""
        assert scene.arm is not None
        (guard_end, helper_end), (ours, theirs) = pair(), pair()
        ends.append(guard_end)
        self.children[name] = spawn(module, helper_end, theirs)
        channel, limits = Channel(ours), scene.monitoring_limits
        settings = {
            "driver": scene.arm.arm_model.driver,
            "host": scene.arm.host,
            "monitoring": asdict(limits),
            "deceleration": scene.default_reaction.deceleration,
            "held_braking": (scene.arm.model, scene.arm.payload, scene.arm.payload_xyz),
            "watchdog_hz": scene.arm.watchdog_hz,
            "request_lifetime": limits.process_silence,
            "second": name == _WATCHDOG_NAMES[1],
        }
        channel.send(encode_json(settings))
        return channel

    def end(self, stands: Callable[[], bool]) -> None:
        """End the children, the guard first; may be called again.

        Args:
            stands: tells whether the arm was last seen standing; until then a guard watchdog is not killed.
        """
        if self.guard is not None:
            self.guard.send(b"quit")
        for name in ("guard", "driver", *_WATCHDOG_NAMES, "skin"):
            child = self.children.pop(name, None)
            if child is None:
                continue
            if name != "guard":  # the others end when their channels do, after the guard has stopped the arm
                for channel in self._lifelines:
                    channel.close()
                for channel in self.watchdogs:
                    channel.send(LEAVE)
            try:
                child.wait(_END_TIMEOUT)
            except subprocess.TimeoutExpired:
                if name in _WATCHDOG_NAMES and not stands():
                    continue  # it is still stopping the arm, and ends when that stands
                child.kill()
                child.wait()

    def close(self) -> None:
        """Close the lines to guard, watchdogs and physics; may be called again."""
        for channel in self.watchdogs:
            channel.close()
        if self.skin is not None:
            self.skin.close()
        if self.guard is not None:
            self.guard.close()
