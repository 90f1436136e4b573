"""Child processes of a session: the guard, the driver process or the guard watchdog, and a virtual skin.

Each is on a channel. A child ends when its channel does, so that none outlives the session for long.
"""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from coneskin.core.channel import Channel, encode_json, pair
from coneskin.core.child_process import spawn
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.messages import REPORT_PERIOD, Heartbeat
from coneskin.robot.driver.registry import load_driver
from coneskin.skin.sources.kinds import is_simulated

from .guard_monitor import stop_settings

if TYPE_CHECKING:
    import socket

    from coneskin.scene.values.scene import Scene

    from .skin_client import SkinClient

__all__ = ["ChildProcesses"]

_END_TIMEOUT = 6.0  # s for the guard to stop the arm and end


class ChildProcesses:
    """Child processes of one session, started once and ended once.

    Attributes:
        children: by name: "guard", "driver" or "watchdog", "skin".
        guard: channel to the guard; None before the start.
        program: channel to the driver process, for the guarded program; None with external control.
        skin: client of the virtual skin; None where the skin is not virtual.
    """

    def __init__(self) -> None:
        self.children: dict[str, subprocess.Popen[bytes]] = {}
        self.guard: Channel | None = None
        self.program: Channel | None = None
        self.skin: SkinClient | None = None
        self._stopped = threading.Event()  # ends the heartbeat
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
            scene: with a source, and perhaps an arm.
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
        if scene.arm is not None:
            guard_end, other_guard_end = pair()
            program_end, other_program_end = pair()
            channel = Channel(program_end)
            self._lifelines.append(channel)
            ends.append(guard_end)
            internal = scene.arm.control == "internal"
            name = "driver" if internal else "watchdog"
            arm = arm_model(scene.arm.model)
            module = load_driver(arm.family).process if internal else "coneskin.robot.stop.guard_watchdog"
            self.children[name] = spawn(module, other_guard_end, other_program_end)
            lifetime = scene.monitoring_limits.process_silence
            driver_settings = {"watchdog_hz": scene.arm.watchdog_hz, "request_lifetime": lifetime}
            channel.send(encode_json({**stop_settings(scene), **driver_settings}))
            if internal:
                self.program = channel
        self.guard = Channel(ours)
        self.children["guard"] = spawn("coneskin.session.guard_process", *ends)
        port = "" if self.skin is None else self.skin.port()  # the others start meanwhile
        self.guard.send(encode_json({**start, "port": port}))
        arguments = (self.guard, self._stopped)
        threading.Thread(target=_send_heartbeat, args=arguments, name="coneskin heartbeat", daemon=True).start()
        return self.guard

    def note_script(self) -> None:
        """Note the script of a virtual skin, once it plays.

        Raises:
            SkinConnectionError: its process does not answer.
        """
        if self.skin is not None:
            self.skin.note_script()

    def end(self, stands: Callable[[], bool]) -> None:
        """End the children, the guard first; may be called again.

        Args:
            stands: tells whether the arm was last seen standing; until then a guard watchdog is not killed.
        """
        if self.guard is not None:
            self.guard.send(b"quit")
        for name in ("guard", "driver", "watchdog", "skin"):
            child = self.children.pop(name, None)
            if child is None:
                continue
            if name != "guard":  # the others end when their channels do, after the guard has stopped the arm
                for channel in self._lifelines:
                    channel.close()
            try:
                child.wait(_END_TIMEOUT)
            except subprocess.TimeoutExpired:
                if name == "watchdog" and not stands():
                    continue  # it is still stopping the arm, and ends when that stands
                child.kill()
                child.wait()

    def close(self) -> None:
        """End the heartbeat, and close the lines to guard and physics; may be called again."""
        self._stopped.set()
        if self.skin is not None:
            self.skin.close()
        if self.guard is not None:
            self.guard.close()


def _send_heartbeat(guard: Channel, stopped: threading.Event) -> None:
    """Send the heartbeat of this process to the guard until its channel ends, or until it is stopped."""
    message = Heartbeat().encode()
    while guard.send(message) and not stopped.wait(REPORT_PERIOD):
        pass
