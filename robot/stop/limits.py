"""Limits of the monitoring: how long a silence may last, and what counts as a standstill."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MonitoringLimits:
    """Limits that a guard keeps.

    Attributes:
        skin_silence: longest time without a valid frame of a sensor, and longest lag behind the device's clock [s].
        clock_drift: largest difference in speed of the device's clock and this computer's, as a ratio.
        stuck_frames: frames in which the drive currents or the supply show no noise at all, from which on the device
            counts as stuck; 0 where its readings truly have no noise.
        arm_silence: longest age of the controller's newest state [s].
        escalate: without a slowdown for this long after a stop, the next stop path is used [s].
        standstill: joint speed below which the arm stands [rad/s].
        program_silence: longest time for which the program that guards may be suspended [s]; a third more for a
            silence of driver process or guard watchdog, and for a request on its way.
        settle: time for which all preconditions must hold before the guard becomes active [s].
    """

    skin_silence: float = 0.05
    clock_drift: float = 1e-4
    stuck_frames: int = 1000
    arm_silence: float = 0.05
    escalate: float = 0.025
    standstill: float = 0.01
    settle: float = 0.1
    program_silence: float = 0.15

    @property
    def process_silence(self) -> float:
        """Longest time without a heartbeat of driver process or guard watchdog, or until a request is void [s]."""
        return self.program_silence * 4.0 / 3.0

    def stop_budget(self, speed: float, deceleration: float) -> float:
        """Return the time within which an arm should stand after a stop: braking, and four times ``escalate`` [s].

        The speed is that of the leading joint [rad/s], the deceleration that of the stop [rad/s2].
        """
        return speed / deceleration + 4.0 * self.escalate
