"""Outbox of the guard's loop: it sends a command as soon as the core has decided it."""

from __future__ import annotations

from coneskin.robot.driver.messages import StopProgram
from coneskin.robot.driver.setpoint import JointVelocitySetpoint, SetpointProgram, SetSpeedSlider
from coneskin.robot.driver.stop_path import StopPath, UseStopPath

from .ports import GuardPorts
from .signals.journal import GuardEvent
from .signals.outputs import Output

__all__ = ["Outbox"]

_OWN_COMMANDS = (UseStopPath, JointVelocitySetpoint, SetpointProgram, SetSpeedSlider)


class Outbox:
    """Sink that sends a command as soon as the core has decided it, and keeps the rest for the recorder."""

    __slots__ = ("_ports", "events", "sent")

    def __init__(self, ports: GuardPorts) -> None:
        self._ports = ports
        self.sent: list[bytes] = []
        self.events: list[GuardEvent] = []

    def append(self, output: Output, /) -> None:
        """Take an output of the core."""
        ports = self._ports
        if isinstance(output, GuardEvent):
            self.events.append(output)
        elif isinstance(output, _OWN_COMMANDS):
            self._send_own(ports, output)
        else:
            message = output.encode()
            name, channel = (b"driver", ports.driver) if ports.watchdog is None else (b"watchdog", ports.watchdog)
            taken = channel is not None and channel.send(message)
            self.sent.append(name + (b"\n" if taken else b", not sent\n") + message)

    def _send_own(
        self, ports: GuardPorts, output: UseStopPath | JointVelocitySetpoint | SetpointProgram | SetSpeedSlider
    ) -> None:
        """Send a command over a connection of the guard's own."""
        if isinstance(output, UseStopPath):
            name = output.path.value
            if output.path is StopPath.WATCHDOG:
                taken = ports.watchdog is not None and ports.watchdog.send(StopProgram(output.deceleration).encode())
            elif output.path is StopPath.SLIDER:
                taken = ports.slider is not None and ports.slider.set(0.0)
            else:
                taken = ports.stops is not None and ports.stops.use(*output)
            text = "sent" if taken else "not sent"
        elif isinstance(output, JointVelocitySetpoint):
            taken = ports.setpoints is not None and ports.setpoints.write(output)
            name, text = ("setpoint" if taken else "setpoint, not sent"), str(tuple(output))
        elif isinstance(output, SetpointProgram):
            taken = ports.stops is not None and ports.stops.follow(output)
            name, text = ("follow" if taken else "follow, not sent"), str(tuple(output))
        else:
            taken = ports.slider is not None and ports.slider.set(output.fraction)
            name, text = ("slider" if taken else "slider, not sent"), str(output.fraction)
        self.sent.append(f"{name}\n{text}".encode())
