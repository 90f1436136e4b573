"""Wire format of RTDE protocol version 2: variables, packets and recipes. Pure: bytes in, values out.

A packet is ``size:uint16 kind:uint8 payload``, big endian; the size counts its own three header bytes. A data packet's
payload is a recipe id (one byte) followed by the values in the order of the recipe.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide"; widths confirmed against ur_rtde 1.6.5, which decodes
by its own table of names and so only understands the true ones.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Mapping, Sequence
from enum import IntEnum
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.driver.values import ControllerState

#: type on the wire -> (code of the struct module, number of values)
_WIRE_TYPES: Mapping[str, tuple[str, int]] = {
    "DOUBLE": ("d", 1),
    "INT32": ("i", 1),
    "UINT32": ("I", 1),
    "UINT64": ("Q", 1),
    "UINT8": ("B", 1),
    "BOOL": ("?", 1),
    "VECTOR3D": ("d", 3),
    "VECTOR6D": ("d", 6),
    "VECTOR6INT32": ("i", 6),
    "VECTOR6UINT32": ("I", 6),
}


def _table() -> dict[str, str]:
    names = {
        "VECTOR6D": """target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current
            actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed
            actual_TCP_force target_TCP_pose target_TCP_speed actual_TCP_acceleration target_TCP_acceleration
            tcp_offset joint_temperatures actual_joint_voltage ft_raw_wrench wrench_calc_from_currents payload_inertia
            target_base_acceleration target_base_wrench external_force_torque""",
        "VECTOR3D": "actual_tool_accelerometer payload_cog elbow_position elbow_velocity target_gravity",
        "VECTOR6INT32": "joint_mode",
        "UINT64": """actual_digital_input_bits actual_digital_output_bits actual_configurable_digital_input_bits
            actual_configurable_digital_output_bits control_step""",
        "UINT32": """runtime_state robot_status_bits safety_status_bits script_control_line speed_slider_mask
            analog_io_types tool_mode tool_analog_input_types euromap67_input_bits euromap67_output_bits
            output_bit_registers0_to_31 output_bit_registers32_to_63 input_bit_registers0_to_31
            input_bit_registers32_to_63""",
        "INT32": """robot_mode safety_mode safety_status tool_output_voltage time_scale_source encoder0_raw
            encoder1_raw""",
        "UINT8": """standard_digital_output_mask standard_digital_output configurable_digital_output_mask
            configurable_digital_output tool_digital_output_mask tool_digital_output standard_analog_output_mask
            standard_analog_output_type tool_output_mode tool_digital_output0_mode tool_digital_output1_mode""",
        "DOUBLE": """timestamp actual_execution_time target_execution_time speed_scaling target_speed_fraction
            speed_slider_fraction actual_momentum actual_main_voltage actual_robot_voltage actual_robot_current
            actual_robot_energy_consumed actual_robot_braking_energy_dissipated tcp_force_scalar
            standard_analog_input0 standard_analog_input1 standard_analog_output0 standard_analog_output1
            standard_analog_output_0 standard_analog_output_1 tool_analog_input0 tool_analog_input1
            tool_output_current tool_temperature io_current euromap67_24V_voltage euromap67_24V_current payload
            joint_position_deviation_ratio collision_detection_ratio""",
    }
    table = {name: kind for kind, words in names.items() for name in words.split()}
    for direction in ("input", "output"):
        for index in range(48):
            table[f"{direction}_int_register_{index}"] = "INT32"
            table[f"{direction}_double_register_{index}"] = "DOUBLE"
        for index in range(64, 128):  # 0-63 travel as the two words input_bit_registers*
            table[f"{direction}_bit_register_{index}"] = "BOOL"
    return table


#: name of each variable -> its type on the wire
VARIABLES: Mapping[str, str] = MappingProxyType(_table())


#: One value on the wire: a scalar, or the tuple of a vector.
Value = float | int | bool | tuple[float, ...]


class RobotMode(IntEnum):
    """State of the arm: robot_mode."""

    NO_CONTROLLER = -1
    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7
    UPDATING_FIRMWARE = 8


class SafetyMode(IntEnum):
    """State of the safety system: safety_mode."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9
    VALIDATE_JOINT_ID = 10
    UNDEFINED_SAFETY_MODE = 11


PROGRAM_RUNNING: Final = 2  #: value of runtime_state

HEADER = struct.Struct(">HB")
PROTOCOL_VERSION = 2
NOT_FOUND = "NOT_FOUND"  #: the type that a controller answers for a name that it does not know
IN_USE = "IN_USE"  #: the type that it answers for an input that another client owns


class PacketKind(IntEnum):
    """Type byte of a packet."""

    PROTOCOL_VERSION = ord("V")
    CONTROLLER_VERSION = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    OUTPUTS = ord("O")
    INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


class Packet(NamedTuple):
    """Packet without its header."""

    kind: PacketKind
    payload: bytes


def pack(kind: int, payload: bytes = b"") -> bytes:
    """Put the header before a payload.

    Raises:
        ValueError: the packet would be longer than its 16-bit size can say.
    """
    size = HEADER.size + len(payload)
    if size > 0xFFFF:
        raise ValueError(f"an RTDE packet must not be longer than 65535 bytes, got {size}")
    return HEADER.pack(size, kind) + payload


_PACKET_KINDS = {int(kind): kind for kind in PacketKind}
_KIND_BYTE = re.compile(b"[" + bytes(_PACKET_KINDS) + b"]")


def split(buffer: bytes) -> tuple[list[Packet], bytes]:
    """Cut what has arrived into packets; never raises, whatever the bytes are.

    TCP does not lose bytes, so a header that cannot be (size below 3, unknown kind) means that the peer is not speaking
    RTDE; such bytes are skipped up to where a header may be. How the stream was chopped makes no difference to the
    packets.

    Args:
        buffer: the rest of the last call followed by the bytes that came since.

    Returns:
        the packets that are complete, and the bytes that are not yet one.
    """
    packets: list[Packet] = []
    position, end = 0, len(buffer)
    while end - position >= HEADER.size:
        size, code = HEADER.unpack_from(buffer, position)
        kind = _PACKET_KINDS.get(code)
        if size < HEADER.size or kind is None:
            found = _KIND_BYTE.search(buffer, position + HEADER.size)
            position = found.start() - HEADER.size + 1 if found else end - HEADER.size + 1
            continue
        if position + size > end:
            break
        packets.append(Packet(kind, bytes(buffer[position + HEADER.size : position + size])))
        position += size
    return packets, bytes(buffer[position:])


class Recipe:
    """Ordered list of variables, and the layout of its values in a data packet.

    Attributes:
        names: the variables, in order.
        ident: the id that stands in the first byte of each data packet.
        size: the length of a data packet's payload [bytes], the id included.
    """

    __slots__ = ("_scalar", "_spans", "_struct", "ident", "names", "size")

    def __init__(self, names: Sequence[str], ident: int = 1) -> None:
        unknown = [name for name in names if name not in VARIABLES]
        if unknown:
            raise ValueError(f"RTDE has no variable named {', '.join(unknown)}")
        self.names = tuple(names)
        self.ident = ident
        layout, spans, start = ">B", [], 1
        for name in names:
            code, count = _WIRE_TYPES[VARIABLES[name]]
            layout += f"{count}{code}" if count > 1 else code
            spans.append((start, start + count) if count > 1 else (start, 0))
            start += count
        self._struct = struct.Struct(layout)
        self._spans = tuple(spans)
        self._scalar = all(stop == 0 for _, stop in spans)
        self.size = self._struct.size

    def pack(self, values: Sequence[Value]) -> bytes:
        """Lay the values out as the payload of a data packet, the id first.

        Args:
            values: one for each name, in order; a vector is a tuple.

        Raises:
            ValueError: too many or too few values, or one that its type cannot hold.
        """
        flat: list[float | int | bool] = []
        for value in values:
            if isinstance(value, tuple | list):
                flat.extend(value)
            else:
                flat.append(value)
        return self.pack_flat(flat)

    def pack_flat(self, values: Sequence[float | int | bool]) -> bytes:
        """Return the payload of values whose vectors are already flat: quicker than ``pack``, for a 500 Hz loop."""
        try:
            return self._struct.pack(self.ident, *values)
        except struct.error as exc:
            raise ValueError(f"RTDE recipe {self.ident} ({', '.join(self.names)}): {exc}") from exc

    def unpack(self, payload: bytes) -> tuple[Value, ...]:
        """Take the values out of the payload of a data packet.

        Returns:
            one value for each name, in order; a vector is a tuple.

        Raises:
            RobotConnectionError: the payload has another length, so the two sides do not agree on the recipe.
        """
        flat = self.unpack_flat(payload)
        if self._scalar:
            return flat
        return tuple(flat[start - 1 : stop - 1] if stop else flat[start - 1] for start, stop in self._spans)

    def unpack_flat(self, payload: bytes) -> tuple[Any, ...]:
        """Return the values of a data packet whose vectors stay flat: quicker than ``unpack``, for a 500 Hz loop.

        Raises:
            RobotConnectionError: as of ``unpack``.
        """
        if len(payload) != self.size:
            raise RobotConnectionError(
                f"an RTDE data packet of recipe {self.ident} must hold {self.size} bytes, got {len(payload)}: "
                "the controller and the reader disagree about its variables"
            )
        return self._struct.unpack(payload)[1:]


# What a client asks while it sets a connection up.


def pack_outputs_request(names: Sequence[str], frequency_hz: float = 500.0) -> bytes:
    """Return the request for outputs at a frequency [Hz]; the reply goes to `unpack_types`."""
    return pack(PacketKind.OUTPUTS, struct.pack(">d", frequency_hz) + ",".join(names).encode("ascii"))


def pack_inputs_request(names: Sequence[str]) -> bytes:
    """Return the request for sole use of inputs; the reply goes to `unpack_types`."""
    return pack(PacketKind.INPUTS, ",".join(names).encode("ascii"))


def split_names(text: bytes) -> tuple[str, ...]:
    """Return the variable names of a set-up request. ur_rtde ends its list with a comma, other clients do not."""
    return tuple(name for name in text.decode("ascii", "replace").split(",") if name)


def unpack_types(payload: bytes, names: Sequence[str]) -> Recipe:
    """Read the reply to a request for outputs or inputs.

    Args:
        payload: the payload of the reply.
        names: the variables asked for, in order.

    Returns:
        the recipe, under the id that the controller gave it.

    Raises:
        RobotRefused: the controller does not know a variable, or another client owns it, or it has another type here.
    """
    types = split_names(payload[1:])
    if len(types) != len(names):
        raise RobotRefused(f"the controller answered {len(types)} types to {len(names)} RTDE variables")
    wrong = [
        f"{name} is not known to this controller"
        if got == NOT_FOUND
        else f"{name} is in use by another client"
        if got == IN_USE
        else f"{name} should be {VARIABLES.get(name)}, the controller says {got}"
        for name, got in zip(names, types, strict=True)
        if got != VARIABLES.get(name)
    ]
    if wrong:
        raise RobotRefused("the controller refuses RTDE variables: " + "; ".join(wrong))
    return Recipe(names, payload[0])


_STATE_NAMES = ("timestamp", "actual_q", "actual_qd", "robot_mode", "safety_status_bits", "runtime_state")
_CURRENT_NAMES = ("actual_current", "target_current")
#: the variables that the state reader asks for
STATE_RECIPE: Final = Recipe((*_STATE_NAMES, *_CURRENT_NAMES))
_WITHOUT_CURRENTS: Final = Recipe(_STATE_NAMES)  # of recordings made before the reader asked for them
#: bits 2 to 10: protective, recovery, safeguard, emergency, violation, fault, stopped
_SAFETY_STOPS: Final = 0b11111111100
_ARM_RUNNING: Final = 7  # value of robot_mode: powered, brakes released


def decode_state(time: float, payload: bytes) -> ControllerState:
    """Return the state, read at a host time [s], in the payload of a data packet of the state reader's recipe.

    Raises:
        RobotConnectionError: the payload has another length, or its time, a position, a speed or a current is not
            finite.
    """
    recipe = _WITHOUT_CURRENTS if len(payload) == _WITHOUT_CURRENTS.size else STATE_RECIPE
    values = recipe.unpack_flat(payload)
    controller_time, q, qd, currents = values[0], values[1:7], values[7:13], values[16:]
    if not math.isfinite(sum(values)):  # most are, and one sum tells
        if not math.isfinite(controller_time + sum(q) + sum(qd)):
            raise RobotConnectionError(
                f"its time, joint positions or speeds are not finite: {controller_time} s, {q} rad, {qd} rad/s"
            )
        if not math.isfinite(sum(currents)):
            raise RobotConnectionError(f"its motor currents are not finite: {currents} A")
    powered, running = values[13] == _ARM_RUNNING, values[15] == PROGRAM_RUNNING
    stopped = values[14] & _SAFETY_STOPS != 0
    current, target = (currents[:6], currents[6:]) if currents else (None, None)
    fields = time, controller_time, q, qd, powered, stopped, running, current, target
    return tuple.__new__(ControllerState, fields)  # quicker than ControllerState()
