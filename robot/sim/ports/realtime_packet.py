"""Packet of the realtime interface, which a controller sends in every cycle: numbers at fixed places. Pure.

A packet is its length with these four bytes, then doubles; version by version it grew at its end. What is not
simulated is zero.

Source: Universal Robots, "Client Interface", sheet of the realtime client.
"""

from __future__ import annotations

import struct

from coneskin.robot.sim.machine.options import Version
from coneskin.robot.sim.machine.safety import RobotMode
from coneskin.robot.sim.runtime.controller import Controller
from coneskin.robot.sim.urscript.values import values_of

__all__ = ["encode_realtime", "realtime_size"]

_ZEROS3, _ZEROS6 = (0.0,) * 3, (0.0,) * 6
#: first version of PolyScope 5, and of CB3, with packets of so many bytes
_SIZES = (((5, 10), (3, 15), 1220), ((5, 9), (3, 14), 1140), ((5, 4), (3, 10), 1116))
_SMALLEST = 1108  # bytes; of older ones, whose packets end with the speed of the elbow


def realtime_size(version: Version) -> int:
    """Return the length of a packet of that version [bytes]."""
    return next((size for e, cb3, size in _SIZES if version >= (cb3 if version[0] == 3 else e)), _SMALLEST)


def encode_realtime(c: Controller) -> bytes:
    """Return the packet of the present cycle."""
    arm = c.arm
    measured, powered = arm.measured, c.robot_mode is not RobotMode.POWER_OFF
    pose, twist = values_of(arm.tcp_pose(measured.q)), arm.measured_twist()
    target_pose, target_twist = values_of(arm.tcp_pose()), arm.twist()
    modes = (253.0 if c.robot_mode is RobotMode.RUNNING else 255.0,) * 6
    volts = 48.0 * powered
    values = (
        *(c.timestamp, *arm.q, *arm.qd, *arm.qdd, *_ZEROS6, *_ZEROS6),  # targets: q, qd, qdd, current, torque
        *(*measured.q, *measured.qd, *c.currents, *_ZEROS6),  # measured: q, qd, current; control current
        *(*pose, *twist, *_ZEROS6, *target_pose, *target_twist),  # tool: pose, speed and force, then both targets
        *(0.0, *((30.0,) * 6), 0.0, 0.0, float(c.robot_mode), *modes, float(c.safety)),  # inputs, temperatures, states
        *(*_ZEROS6, 0.0, 0.0, -9.81, *_ZEROS6),  # tool accelerometer between what is for internal use
        *(0.0 if c.safety != 1 else c.slider, 0.0, 0.0, 0.0),  # speed scaling, momentum
        *(48.0, volts, 0.5 * powered, *((volts,) * 6), float(c.digital_outputs), float(c.runtime)),
        *(*_ZEROS3, *_ZEROS3, float(c.safety)),  # elbow: position, speed; safety state
        *(0.0, 0.0, 0.0, c.payload, *c.payload_cog, *c.payload_inertia),
    )
    size = realtime_size(c.options.version)
    return struct.pack(f">i{(size - 4) // 8}d", size, *values[: (size - 4) // 8])
