"""RTDE of the simulated controller: session of one client, and the values of the outputs. Bytes in, bytes out.

Rules that clients rely on: one reply for each request; no data before START; input recipes are numbered
1, 2, 3 ... on each connection; an input belongs to one connection at a time and keeps its value after it.

Outputs that need a dynamic model or sensors that are not simulated (currents, torques, forces, temperatures) hold
constants, which an arm at rest without load might show. The measured currents differ from the constant target currents
by what a fault line adds.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from typing import Any

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import link_pose, point_jacobian
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.inputs_outputs import INPUTS
from coneskin.robot.sim.machine.states import MOVING, SAFETY_BITS, Runtime, Version, has_since, joint_mode
from coneskin.robot.sim.motion.arm import SimulatedArm
from coneskin.robot.sim.urscript.values import Array, ScriptError, values_of
from coneskin.robot.ur import rtde_codec as wire

_ELBOW_FRAME = 2  # number of the frame at the elbow
_SIX_ZEROS = (0.0,) * 6  # six zeros, for any vector of that length
#: output -> constant value of a sensor that is not simulated, in the unit of RTDE
_CONSTANT_OUTPUTS: dict[str, wire.Value] = {
    "joint_temperatures": (30.0,) * 6,
    "actual_main_voltage": 48.0,
    "actual_robot_voltage": 48.0,
    "actual_robot_current": 0.5,
    "actual_joint_voltage": (48.0,) * 6,
    "actual_tool_accelerometer": (0.0, 0.0, -9.81),
    "target_gravity": (0.0, 0.0, -9.81),
    "io_current": 0.1,
    "tool_temperature": 30.0,
}

#: output that older controllers lack -> first minor version of PolyScope 5, and of CB3 (None: never)
_FIRST_VERSIONS: dict[str, tuple[int, int | None]] = {
    "actual_current_as_torque": (23, None),
    "ft_raw_wrench": (9, None),
    "wrench_calc_from_currents": (9, None),
    "payload": (5, 11),
    "payload_cog": (5, 11),
    "payload_inertia": (11, 15),
    "script_control_line": (6, None),
    "time_scale_source": (17, None),
}


def available(name: str, version: Version) -> bool:
    """Return whether a controller of that version has this output. The input registers are outputs too."""
    if name not in wire.VARIABLES or (name in INPUTS and not name.startswith("input_")):
        return False
    return has_since(version, *_FIRST_VERSIONS.get(name, (0, 0)))


class RtdeOutputs:
    """Values of one controller by name of the output; costly ones are computed once a cycle."""

    def __init__(self, controller: Controller) -> None:
        self._c = c = controller
        self._pose_at: tuple[object, object] = (None, None)
        self._pose: wire.Value = _SIX_ZEROS
        self._twist_at = -1
        self._twist: wire.Value = _SIX_ZEROS
        arm, c.rtde_value = c.arm, self.value
        self._getters: dict[str, Callable[[], wire.Value | Sequence[float]]] = {
            "timestamp": lambda: c.timestamp,
            "control_step": lambda: c.cycle,
            "actual_q": lambda: arm.measured.q,
            "target_q": lambda: arm.q,
            "actual_qd": lambda: arm.measured.qd,
            "target_qd": lambda: arm.qd,
            "target_qdd": lambda: arm.qdd,
            "actual_current": lambda: c.currents,
            "actual_TCP_pose": self._tcp_pose,
            "target_TCP_pose": lambda: (
                self._tcp_pose() if arm.measured.q is arm.q else tuple(values_of(arm.tcp_pose()))
            ),
            "actual_TCP_speed": self._tcp_speed,
            "target_TCP_speed": lambda: self._tcp_speed() if arm.measured.qd is arm.qd else tuple(arm.twist()),
            "tcp_offset": lambda: tuple(values_of(arm.tcp)),
            "runtime_state": lambda: int(c.runtime),
            "robot_mode": lambda: int(c.robot_mode),
            "safety_mode": lambda: int(c.safety),
            "safety_status": lambda: int(c.safety),
            "robot_status_bits": lambda: (  # 0 power on, 1 program running
                int(c.robot_mode is not wire.RobotMode.POWER_OFF) | int(c.runtime is Runtime.PLAYING) << 1
            ),
            "safety_status_bits": lambda: SAFETY_BITS[c.safety],
            "speed_scaling": lambda: c.speed_scaling if c.safety in MOVING else 0.0,
            "target_speed_fraction": lambda: c.slider,
            "actual_digital_output_bits": lambda: c.digital_outputs,
            "actual_digital_input_bits": lambda: c.terminals.digital_inputs,
            "standard_analog_input0": lambda: c.terminals.analog_inputs[0],
            "standard_analog_input1": lambda: c.terminals.analog_inputs[1],
            "tool_analog_input0": lambda: c.terminals.analog_inputs[2],
            "tool_analog_input1": lambda: c.terminals.analog_inputs[3],
            "standard_analog_output0": lambda: c.terminals.analog_output(0),
            "standard_analog_output1": lambda: c.terminals.analog_output(1),
            "analog_io_types": c.terminals.analog_types,
            "tool_analog_input_types": c.terminals.tool_types,
            "tool_output_voltage": lambda: c.terminals.tool_voltage,
            "tool_output_mode": lambda: c.terminals.tool_output_mode,
            "tool_digital_output0_mode": lambda: c.terminals.tool_drive_modes[0],
            "tool_digital_output1_mode": lambda: c.terminals.tool_drive_modes[1],
            "output_bit_registers0_to_31": lambda: c.terminals.output_bits & 0xFFFFFFFF,
            "output_bit_registers32_to_63": lambda: c.terminals.output_bits >> 32 & 0xFFFFFFFF,
            "joint_mode": lambda: (joint_mode(c.robot_mode),) * 6,
            "tool_mode": lambda: joint_mode(c.robot_mode),
            "elbow_position": lambda: link_pose(arm.model, arm.measured.q, _ELBOW_FRAME).translation,
            "elbow_velocity": lambda: elbow_velocity(arm),
            "actual_TCP_force": c.inputs.wrench,
            "tcp_force_scalar": lambda: math.hypot(*c.inputs.wrench()[:3]),
            "payload": lambda: c.payload,
            "payload_cog": lambda: c.payload_cog,
            "payload_inertia": lambda: c.payload_inertia,
        }

    def getter(self, name: str) -> Callable[[], wire.Value | Sequence[float]]:
        """Return a function that returns the present value of an output."""
        c = self._c
        if name in self._getters:
            return self._getters[name]
        register, _, digits = name.rpartition("_")
        if register == "output_bit_register":
            return lambda: c.terminals.output_bits >> int(digits) & 1
        if register in ("output_int_register", "output_double_register"):
            values: Sequence[float] = c.output_ints if register == "output_int_register" else c.output_doubles
            return lambda: values[int(digits)]
        if name in c.inputs.values and name.startswith("input_"):
            return lambda: c.inputs.values[name]
        kind = wire.VARIABLES[name]
        zero: wire.Value = (0.0,) * int(kind[6]) if kind.startswith("VECTOR") else 0
        constant = _CONSTANT_OUTPUTS.get(name, zero)
        return lambda: constant

    def value(self, name: str) -> Any:
        """Return the present value of an output to a program.

        Raises:
            ScriptError: the controller has none of that name.
        """
        if not available(name, self._c.options.version):
            raise ScriptError(f"RTDE has no output {name[:99]!r}")
        value = self.getter(name)()
        return Array(value) if isinstance(value, Sequence) else value

    def _tcp_pose(self) -> wire.Value:
        arm = self._c.arm
        q = arm.measured.q
        if self._pose_at[0] is not q or self._pose_at[1] is not arm.tcp:  # a moving arm makes a new list
            self._pose = tuple(values_of(arm.tcp_pose(q)))
            self._pose_at = (q, arm.tcp)
        return self._pose

    def _tcp_speed(self) -> wire.Value:
        if self._twist_at != self._c.cycle:
            self._twist = tuple(self._c.arm.measured_twist())
            self._twist_at = self._c.cycle
        return self._twist


def elbow_velocity(arm: SimulatedArm) -> Vector:
    """Return the measured velocity of the elbow in the base frame [m/s]."""
    q, qd, _ = arm.measured
    rows = point_jacobian(arm.model, q, _ELBOW_FRAME)
    x, y, z = (sum(a * b for a, b in zip(row, qd, strict=False)) for row in rows)
    return x, y, z


_MIN_FREQUENCY = 1e-3  # Hz
_MAX_NAMES = 1000  # of a recipe: their values fit into a packet
_MAX_RECIPES = 255  # of inputs; a packet has one byte for the number
BUGFIX_VERSION, BUILD_NUMBER = 0, 1  #: last two numbers of the controller's version


class RtdeSession:
    """State of one RTDE connection.

    Attributes:
        started: True while outputs are sent.
    """

    def __init__(self, controller: Controller, outputs: RtdeOutputs) -> None:
        self._c = controller
        self._outputs = outputs
        self._rest = b""
        self._inputs: list[wire.Recipe] = []
        self._recipe: wire.Recipe | None = None
        self._getters: list[tuple[Callable[[], object], bool]] = []
        self._every = 1
        self.started = False

    def receive(self, data: bytes) -> bytes:
        """Act on bytes of the client, and return the replies."""
        packets, self._rest = wire.split(self._rest + data)
        return b"".join([self._answer(packet) for packet in packets])

    def outputs(self) -> bytes:
        """Return the data packet of this cycle; empty if none is due."""
        if not self.started or self._recipe is None or self._c.cycle % self._every:
            return b""
        flat: list[float] = []
        for get, is_vector in self._getters:
            if is_vector:
                flat.extend(get())  # type: ignore[arg-type]
            else:
                flat.append(get())  # type: ignore[arg-type]
        return wire.pack(wire.PacketKind.DATA, self._recipe.pack_flat(flat))

    def close(self) -> None:
        """Release the inputs that the client owned; they keep their values."""
        owners = self._c.inputs.owners
        for name in [name for name, owner in owners.items() if owner is self]:
            del owners[name]

    def _answer(self, packet: wire.Packet) -> bytes:
        kind, payload = packet
        if kind is wire.PacketKind.DATA:
            self._data(payload)
            return b""
        if kind is wire.PacketKind.PROTOCOL_VERSION:
            return wire.pack(kind, bytes([payload == b"\x00\x02"]))
        if kind is wire.PacketKind.CONTROLLER_VERSION:
            return wire.pack(kind, struct.pack(">4I", *self._c.options.version, BUGFIX_VERSION, BUILD_NUMBER))
        if kind is wire.PacketKind.OUTPUTS:
            return wire.pack(kind, self._set_outputs(payload))
        if kind is wire.PacketKind.INPUTS:
            return wire.pack(kind, self._set_inputs(payload))
        if kind is wire.PacketKind.START:
            self.started = self._recipe is not None
            return wire.pack(kind, bytes([self.started]))
        if kind is wire.PacketKind.PAUSE:
            self.started = False
            return wire.pack(kind, b"\x01")
        self._c.log("client_text", text=payload.decode("latin-1"))
        return b""

    def _set_outputs(self, payload: bytes) -> bytes:
        if len(payload) < 8:
            return b"\x00"
        frequency = struct.unpack_from(">d", payload)[0]
        names = wire.split_names(payload[8:])
        version = self._c.options.version
        types = [wire.VARIABLES[name] if available(name, version) else wire.NOT_FOUND for name in names]
        self.started, self._recipe = False, None
        if names and wire.NOT_FOUND not in types and len(names) <= _MAX_NAMES:
            self._recipe = wire.Recipe(names)
            self._getters = [
                (self._outputs.getter(name), kind.startswith("VECTOR")) for name, kind in zip(names, types, strict=True)
            ]
            steps = self._c.options.steps
            rate = max(frequency, _MIN_FREQUENCY) if frequency > 0.0 else 500.0
            self._every = steps * max(1, round(500.0 / steps / rate))
        return bytes([self._recipe is not None]) + _list(types)

    def _set_inputs(self, payload: bytes) -> bytes:
        names, owners = wire.split_names(payload), self._c.inputs.owners
        types = []
        for name in names:
            if name not in self._c.inputs.values:
                types.append(wire.NOT_FOUND)
            else:
                types.append(wire.VARIABLES[name] if owners.get(name, self) is self else wire.IN_USE)
        full = len(names) > _MAX_NAMES or len(self._inputs) == _MAX_RECIPES
        if not names or full or wire.NOT_FOUND in types or wire.IN_USE in types:
            return b"\x00" + _list(types)
        owners.update(dict.fromkeys(names, self))
        self._inputs.append(wire.Recipe(names, ident=len(self._inputs) + 1))
        return bytes([len(self._inputs)]) + _list(types)

    def _data(self, payload: bytes) -> None:
        number = payload[0] if payload else 0
        if not 1 <= number <= len(self._inputs):
            self._c.log("bad_packet", reason=f"no input recipe {number}")
            return
        recipe = self._inputs[number - 1]
        if len(payload) != recipe.size:
            self._c.log("bad_packet", reason=f"recipe {number} has {recipe.size} bytes, got {len(payload)}")
            if len(payload) < recipe.size:
                return
            payload = payload[: recipe.size]
        self._c.write_inputs(dict(zip(recipe.names, recipe.unpack(payload), strict=True)))


def _list(types: list[str]) -> bytes:
    """Return the types of a reply; of a recipe that is too long those that fit into a packet."""
    return ",".join(types[:_MAX_NAMES]).encode()
