"""What the simulated controller tells its clients: name of an output -> how to get its value.

Outputs that need a dynamic model or sensors that are not simulated (currents, torques, forces, temperatures) hold the
constants below, which is what an arm at rest without load might show; nothing in coneskin relies on them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .rtde_codec import VARIABLES, Value
from .sim_controller import Controller
from .sim_options import Version
from .sim_safety import Runtime, SafetyMode, robot_bits, safety_bits
from .sim_values import values_of

__all__ = ["Outputs", "available"]

_ZEROS = (0.0,) * 6
_CONSTANTS: dict[str, Value] = {
    "joint_temperatures": (30.0,) * 6,
    "joint_mode": (253,) * 6,  # RUNNING
    "actual_main_voltage": 48.0,
    "actual_robot_voltage": 48.0,
    "actual_robot_current": 0.5,
    "actual_joint_voltage": (48.0,) * 6,
    "actual_tool_accelerometer": (0.0, 0.0, -9.81),
    "target_gravity": (0.0, 0.0, -9.81),
    "io_current": 0.1,
    "tool_temperature": 30.0,
}

#: Outputs that older controllers do not have: name -> first minor version of PolyScope 5, and of CB3 (None: never).
_SINCE: dict[str, tuple[int, int | None]] = {
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
    """A controller of that version has this output."""
    if name not in VARIABLES or name.startswith("input_") or name in ("external_force_torque", "speed_slider_mask"):
        return name.startswith("input_") and name in VARIABLES  # input registers can be read back
    since, cb3 = _SINCE.get(name, (0, 0))
    if version[0] == 3:
        return cb3 is not None and version[1] >= cb3
    return version[0] > 5 or version[1] >= since


class Outputs:
    """Values of one controller by the name of the output; those that are dear are computed once a cycle."""

    def __init__(self, controller: Controller) -> None:
        self._c = c = controller
        self._pose_at: tuple[object, object] = (None, None)
        self._pose: Value = _ZEROS
        self._twist_at = -1
        self._twist: Value = _ZEROS
        arm = c.arm
        self._getters: dict[str, Callable[[], Value | Sequence[float]]] = {
            "timestamp": lambda: c.timestamp,
            "control_step": lambda: c.cycle,
            "actual_q": lambda: arm.q,
            "target_q": lambda: arm.q,
            "actual_qd": lambda: arm.qd,
            "target_qd": lambda: arm.qd,
            "target_qdd": lambda: arm.qdd,
            "actual_TCP_pose": self._tcp_pose,
            "target_TCP_pose": self._tcp_pose,
            "actual_TCP_speed": self._tcp_speed,
            "target_TCP_speed": self._tcp_speed,
            "tcp_offset": lambda: tuple(values_of(arm.tcp)),
            "runtime_state": lambda: int(c.runtime),
            "robot_mode": lambda: int(c.robot_mode),
            "safety_mode": lambda: int(c.safety),
            "safety_status": lambda: int(c.safety),
            "robot_status_bits": lambda: robot_bits(c.robot_mode, c.runtime is Runtime.PLAYING),
            "safety_status_bits": lambda: safety_bits(c.safety),
            "speed_scaling": lambda: 0.0 if c.safety is not SafetyMode.NORMAL else c.slider,
            "target_speed_fraction": lambda: c.slider,
            "actual_digital_output_bits": lambda: c.digital_outputs,
            "standard_analog_output0": lambda: c.inputs["standard_analog_output_0"],
            "standard_analog_output1": lambda: c.inputs["standard_analog_output_1"],
            "payload": lambda: c.payload,
            "payload_cog": lambda: c.payload_cog,
            "payload_inertia": lambda: c.payload_inertia,
        }

    def getter(self, name: str) -> Callable[[], Value | Sequence[float]]:
        """How to get the value of an output."""
        c = self._c
        if name in self._getters:
            return self._getters[name]
        if name.startswith("output_int_register_"):
            index = int(name.rsplit("_", 1)[1])
            return lambda: c.output_ints[index]
        if name.startswith("output_double_register_"):
            index = int(name.rsplit("_", 1)[1])
            return lambda: c.output_doubles[index]
        if name in c.inputs and name.startswith("input_"):
            return lambda: c.inputs[name]
        kind = VARIABLES[name]
        zero: Value = (0.0,) * int(kind[6]) if kind.startswith("VECTOR") else 0
        constant = _CONSTANTS.get(name, zero)
        return lambda: constant

    def _tcp_pose(self) -> Value:
        arm = self._c.arm
        if self._pose_at[0] is not arm.q or self._pose_at[1] is not arm.tcp:  # a cycle that moves makes a new list
            self._pose = tuple(values_of(arm.tcp_pose()))
            self._pose_at = (arm.q, arm.tcp)
        return self._pose

    def _tcp_speed(self) -> Value:
        if self._twist_at != self._c.cycle:
            self._twist = tuple(self._c.arm.twist())
            self._twist_at = self._c.cycle
        return self._twist
