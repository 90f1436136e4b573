"""State of the robot as the primary and the secondary interface send it ten times a second: sub-packages. Pure.

A sub-package is its length with these four bytes, its kind, and its fields; all numbers are big endian. What is not
simulated has the value of an arm at rest. Sub-packages 5 (kinematics) and 6 (configuration) come once, in the first
state, as they never change here; the others in each.

Source: Universal Robots, "Client Interface" (primary and secondary, version 5.x); the sizes are those of a recorded
packet in the tests of Universal Robots' own client library.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterable

from coneskin.robot.arm.model import ArmModel
from coneskin.robot.sim.machine.safety import MOVING, RobotMode, SafetyMode
from coneskin.robot.sim.motion.arm import JOINT_ACCELERATION
from coneskin.robot.sim.runtime.controller import Controller
from coneskin.robot.sim.urscript.values import values_of

from .client_messages import pack

__all__ = ["ROBOT_STATE", "encode_first_state", "encode_state", "robot_type"]

ROBOT_STATE = 16  #: kind of a packet that holds the state
_MODE, _JOINTS, _TOOL, _BOARD, _CARTESIAN, _KINEMATICS, _CONFIGURATION = 0, 1, 2, 3, 4, 5, 6
_FORCES, _ADDITIONAL, _CALIBRATION, _SAFETY, _TOOL_LINE, _TOOL_OUTPUTS = 7, 8, 9, 10, 11, 12
_CONTROL_MODE_POSITION = 0
_JOINT_RUNNING, _JOINT_OFF, _JOINT_IDLE = 253, 239, 255  # modes of a joint
_TOOL_RUNNING = 253  # mode of the tool
#: size of an arm -> its number as robot type
_TYPES = {"UR5": 1, "UR7": 1, "UR10": 2, "UR3": 3, "UR16": 4, "UR20": 7, "UR30": 8, "UR15": 9}
_SUBTYPE = {3: 0, 5: 3}  # major version of the software -> sub-type, as recorded from 5.24
_BOX, _BOARD_VERSION = 4, 6  # of an e-Series control box, as recorded
_DEFAULTS = (math.radians(60.0), math.radians(80.0), 0.25, 1.2, 0.25)  # joint and tool v and a, and the radius to them


def robot_type(model: ArmModel) -> int:
    """Return the number of an arm's size in the client interface; 0 where it has none."""
    return _TYPES.get(model.name.removesuffix("e"), 0)


def encode_state(controller: Controller) -> bytes:
    """Return the packet of the present state."""
    return pack(ROBOT_STATE, b"".join(_changing(controller)))


def encode_first_state(controller: Controller) -> bytes:
    """Return the packet of the present state, with kinematics and configuration: what a new client gets first."""
    model, version = controller.arm.model, controller.options.version
    return pack(ROBOT_STATE, b"".join((*_changing(controller), _kinematics(model), _configuration(model, version[0]))))


def _sub(kind: int, body: bytes) -> bytes:
    return struct.pack(">IB", 5 + len(body), kind) + body


def _changing(c: Controller) -> Iterable[bytes]:
    arm = c.arm
    running, paused = c.runtime.word != "STOPPED", c.runtime.paused
    powered = c.robot_mode is not RobotMode.POWER_OFF
    stopped = c.safety in (SafetyMode.ROBOT_EMERGENCY_STOP, SafetyMode.SYSTEM_EMERGENCY_STOP)
    flags = (True, True, powered, stopped, c.safety is SafetyMode.PROTECTIVE_STOP, running and not paused, paused)
    scaling = c.speed_scaling if c.safety in MOVING else 0.0
    time = round(c.timestamp * 1e6)
    mode = struct.pack(">Q7BBBddd", time, *flags, c.robot_mode, _CONTROL_MODE_POSITION, c.slider, scaling, 1.0)
    last = b"" if c.options.version[0] == 3 else bytes(1)  # a byte that CB3 does not have, here and below
    yield _sub(_MODE, mode + last)
    of_joint = {RobotMode.RUNNING: _JOINT_RUNNING, RobotMode.IDLE: _JOINT_IDLE}.get(c.robot_mode, _JOINT_OFF)
    joints = (
        struct.pack(">dddffffB", q, target, qd, current, 48.0 * powered, 30.0, 0.0, of_joint)
        for q, target, qd, current in zip(arm.measured.q, arm.q, arm.measured.qd, c.currents, strict=True)
    )
    yield _sub(_JOINTS, b"".join(joints))
    yield _sub(_TOOL, struct.pack(">BBddfBffB", 1, 1, 0.0, 0.0, 0.0, 0, 0.0, 30.0, _TOOL_RUNNING))
    t = c.terminals
    inputs = struct.pack(">IIBBdd", t.digital_inputs, c.digital_outputs, *t.input_domains[:2], *t.analog_inputs[:2])
    outputs = struct.pack(">BBdd", *t.output_domains, *map(t.analog_output, (0, 1)))
    rest = struct.pack(">ffffBBBIBB", 30.0, 48.0, 0.5, 0.1, c.safety, 0, 0, 0, 1, 1) + bytes(1)
    yield _sub(_BOARD, inputs + outputs + rest)
    yield _sub(_CARTESIAN, struct.pack(">12d", *values_of(arm.tcp_pose(arm.measured.q)), *values_of(arm.tcp)))
    yield _sub(_FORCES, bytes(56))
    yield _sub(_ADDITIONAL, struct.pack(">BBB", 0, 1, 0) + last)
    yield _sub(_CALIBRATION, bytes(48))
    yield _sub(_SAFETY, bytes(38))  # "used by Universal Robots software only"
    if not last:
        return  # a tool without an interface
    yield _sub(_TOOL_LINE, struct.pack(">?iiiff", False, 115200, 0, 1, 1.5, 3.5))
    yield _sub(_TOOL_OUTPUTS, struct.pack(">BBB", 0, 1, 1))


def _kinematics(model: ArmModel) -> bytes:
    table = struct.pack(">24d", *model.theta, *model.a, *model.d, *model.alpha)
    checksum = (zlib.crc32(table[8 * i :: 48]) for i in range(6))  # one for each joint
    return _sub(_KINEMATICS, struct.pack(">6I", *checksum) + table + struct.pack(">I", 0))


def _configuration(model: ArmModel, major: int) -> bytes:
    turn = 2.0 * math.pi  # a joint without end is reported with the range of the others
    limits = [max(-turn, min(turn, q)) for pair in zip(model.joint_lower, model.joint_upper, strict=True) for q in pair]
    motion = [value for speed in model.joint_speed for value in (speed, JOINT_ACCELERATION)]
    table = (*model.a, *model.d, *model.alpha, *model.theta)
    numbers = struct.pack(">53d", *limits, *motion, *_DEFAULTS, *table)
    box = struct.pack(">iiii", _BOARD_VERSION, _BOX, robot_type(model), _SUBTYPE.get(major, 3))
    return _sub(_CONFIGURATION, numbers + box)
