"""The functions that the simulated controller offers to URScript programs.

Every public method of `Builtins` is one, under its URScript name and with its argument names. A generator takes time.
There are no forces in this simulation: force mode, freedrive and contact detection do nothing and find nothing, and
what only a dynamic model could tell (mass matrix, Coriolis torques, joint torques) is NaN.

Source: Universal Robots, "The URScript Programming Language", modules motion, internals, urmath and interfaces.
"""

from __future__ import annotations

import math
from inspect import isgeneratorfunction
from typing import Any

from coneskin.errors import KinematicsError
from coneskin.geometry.pose import Pose

from .inverse import nearest, solutions
from .kinematics import forward
from .sim_arm import CYCLE, Arm
from .sim_motion import Line, ToolLine
from .sim_moves import MoveFunctions, Wait
from .sim_values import Array, PoseValue, ScriptError, numbers, pose_of, rotation_of, rotvec_of, values_of

__all__ = ["Builtins"]

NAN6 = (math.nan,) * 6


class Builtins(MoveFunctions):
    """URScript functions, bound to one program of one controller."""

    @classmethod
    def names(cls) -> frozenset[str]:
        """All functions there are."""
        return frozenset(name for name in dir(cls) if not name.startswith("_") and name not in ("names", "blocking"))

    @classmethod
    def blocking(cls) -> frozenset[str]:
        """Those that take time."""
        return frozenset(name for name in cls.names() if isgeneratorfunction(getattr(cls, name)))

    # time and text

    def sync(self) -> Wait:
        """Wait for the next cycle."""
        yield

    def sleep(self, t: float) -> Wait:
        """Wait for a time [s]."""
        for _ in range(round(t / CYCLE)):
            yield

    def textmsg(self, *words: Any) -> None:
        """A line for the log."""
        self._c.log("text", text="".join(str(word) for word in words))

    def popup(self, text: Any = "", title: Any = "", **_: Any) -> None:
        """A line for the log."""
        self._c.log("popup", text=str(text), title=str(title))

    def get_steptime(self) -> float:
        """The control cycle [s]."""
        return CYCLE

    # kinematics

    def get_inverse_kin_has_solution(self, x: Any, *_: Any) -> bool:
        """A tool pose can be reached."""
        return bool(solutions(self._arm.model, pose_of(x) @ self._arm.tcp.inverse()))

    def get_forward_kin(self, q: Any = None, tcp: Any = None) -> PoseValue:
        """Tool pose of joint positions, by default of the present ones with the present tool."""
        tool = self._arm.tcp if tcp is None else pose_of(tcp)
        return values_of(forward(self._arm.model, self._arm.q if q is None else q) @ tool)

    def get_actual_tcp_pose(self) -> PoseValue:
        """Where the tool is."""
        return values_of(self._arm.tcp_pose())

    get_target_tcp_pose = get_actual_tcp_pose

    def get_actual_tool_flange_pose(self) -> PoseValue:
        """Where the flange is."""
        return values_of(forward(self._arm.model, self._arm.q))

    def get_actual_tcp_speed(self) -> Array:
        """How fast the tool is."""
        return Array(self._arm.twist())

    get_target_tcp_speed = get_actual_tcp_speed

    def get_actual_joint_positions(self) -> Array:
        """Where the joints are."""
        return Array(self._arm.q)

    get_target_joint_positions = get_actual_joint_positions

    def get_actual_joint_speeds(self) -> Array:
        """How fast the joints are."""
        return Array(self._arm.qd)

    get_target_joint_speeds = get_actual_joint_speeds

    def get_target_joint_accelerations(self) -> Array:
        """Accelerations of the joints."""
        return Array(self._arm.qdd)

    def get_actual_joint_positions_history(self, steps: int = 0) -> Array:
        """Where the joints were some cycles ago."""
        history = self._c.history
        return Array(history[max(0, len(history) - 1 - int(steps))] if history else self._arm.q)

    def get_target_waypoint(self) -> PoseValue:
        """Where the present motion ends; the present pose if nothing moves the arm."""
        motion = self._arm.motion
        if isinstance(motion, Line):
            length = motion.profile.length
            return values_of(
                self._arm.tcp_pose([a + b * length for a, b in zip(motion.start, motion.unit, strict=True)])
            )
        if isinstance(motion, ToolLine):
            return values_of(motion.goal)
        return self.get_actual_tcp_pose()

    def get_jacobian(self, *_: Any) -> Array:
        """Jacobian of the tool at the present position, 6 x 6."""
        return Array(Array(row) for row in self._arm.jacobian())

    def get_jacobian_time_derivative(self, *_: Any) -> Array:
        """Its derivative by time: a central difference along the present joint speeds."""
        step = 1e-6
        ahead, behind = (
            Arm(self._arm.model, [q + sign * step * qd for q, qd in zip(self._arm.q, self._arm.qd, strict=True)])
            for sign in (1.0, -1.0)
        )
        ahead.tcp = behind.tcp = self._arm.tcp
        pairs = zip(ahead.jacobian(), behind.jacobian(), strict=True)
        return Array(Array((a - b) / (2 * step) for a, b in zip(new, old, strict=True)) for new, old in pairs)

    def get_mass_matrix(self, *_: Any) -> Array:
        """Not simulated."""
        return Array(Array(NAN6) for _ in range(6))

    def get_coriolis_and_centrifugal_torques(self, *_: Any) -> Array:
        """Not simulated."""
        return Array(NAN6)

    get_joint_torques = get_coriolis_and_centrifugal_torques

    def is_steady(self) -> bool:
        """The arm stands."""
        return not self._arm.moving

    def is_within_safety_limits(self, where: Any) -> bool:
        """Joint positions within their limits, or a tool pose that some such positions reach."""
        model = self._arm.model
        if isinstance(where, PoseValue):
            try:
                nearest(model, pose_of(where) @ self._arm.tcp.inverse(), self._arm.q)
            except KinematicsError:
                return False
            return True
        return all(low <= q <= high for low, q, high in zip(model.joint_lower, where, model.joint_upper, strict=True))

    def set_tcp(self, pose: Any, *_: Any) -> None:
        """The tool centre point in the flange frame."""
        self._arm.tcp = pose_of(pose)

    def get_tcp_offset(self) -> PoseValue:
        """The tool centre point in the flange frame."""
        return values_of(self._arm.tcp)

    # poses

    def pose_trans(self, first: Any, second: Any) -> PoseValue:
        """One pose after another."""
        return values_of(pose_of(first) @ pose_of(second))

    def pose_inv(self, pose: Any) -> PoseValue:
        """The way back."""
        return values_of(pose_of(pose).inverse())

    def pose_add(self, first: Any, second: Any) -> PoseValue:
        """Positions added, turns one after the other, both in the base frame."""
        turn = Pose(rotation_of(first[3:])) @ Pose(rotation_of(second[3:]))
        return PoseValue((*(a + b for a, b in zip(first[:3], second[:3], strict=True)), *rotvec_of(turn.rotation)))

    def pose_sub(self, first: Any, second: Any) -> PoseValue:
        """Positions subtracted, and the turn from the second to the first, in the base frame."""
        turn = Pose(rotation_of(first[3:])) @ Pose(rotation_of(second[3:])).inverse()
        return PoseValue((*(a - b for a, b in zip(first[:3], second[:3], strict=True)), *rotvec_of(turn.rotation)))

    # registers, inputs and outputs

    def read_input_integer_register(self, address: int) -> int:
        """An integer that a client wrote."""
        return self._c.read_command(int(address))

    def read_input_float_register(self, address: int) -> float:
        """A number that a client wrote."""
        return float(self._c.inputs[f"input_double_register_{int(address)}"])  # type: ignore[arg-type]

    def write_output_integer_register(self, address: int, value: Any) -> None:
        """An integer for clients."""
        if not -(2**31) <= int(value) < 2**31:
            raise ScriptError(f"an integer register holds 32 bits, got {value}")
        self._c.output_ints[int(address)] = int(value)

    def write_output_float_register(self, address: int, value: Any) -> None:
        """A number for clients."""
        self._c.output_doubles[int(address)] = float(value)

    def rtde_set_watchdog(self, variable: str, min_frequency: float, action: str = "pause") -> None:
        """What to do when a client writes a variable too rarely."""
        self._c.watch(str(variable), float(min_frequency), str(action))

    def set_standard_digital_out(self, number: int, on: Any) -> None:
        """Switch an output."""
        self._c.set_digital(1 << int(number), bool(on))

    set_digital_out = set_standard_digital_out

    def set_configurable_digital_out(self, number: int, on: Any) -> None:
        """Switch an output."""
        self._c.set_digital(1 << (int(number) + 8), bool(on))

    def set_tool_digital_out(self, number: int, on: Any) -> None:
        """Switch an output."""
        self._c.set_digital(1 << (int(number) + 16), bool(on))

    def get_standard_digital_out(self, number: int) -> bool:
        """An output."""
        return bool(self._c.digital_outputs >> int(number) & 1)

    # safety and payload

    def protective_stop(self) -> Wait:
        """Stop the arm as if it had hit something; the program goes on after it only when a person lets it."""
        self._c.protective_stop(f"protective_stop() in {self._program.name}")
        yield

    def set_payload(self, m: float, cog: Any = None, inertia: Any = None) -> None:
        """What the arm carries; kept for the clients, without an effect."""
        self._c.payload = float(m)
        if cog is not None:
            self._c.payload_cog = tuple(numbers(cog, 3, "a centre of gravity"))
        if inertia is not None:
            self._c.payload_inertia = tuple(numbers(inertia, 6, "an inertia"))

    set_target_payload = set_payload

    def get_target_payload(self) -> float:
        """What the arm carries [kg]."""
        return self._c.payload

    def get_target_payload_cog(self) -> Array:
        """Its centre of gravity [m]."""
        return Array(self._c.payload_cog)

    def get_target_payload_inertia(self) -> Array:
        """Its inertia [kg m2]."""
        return Array(self._c.payload_inertia)

    # forces: nothing touches this arm

    def tool_contact(self, direction: Any = None) -> int:  # noqa: ARG002
        """No contact: 0."""
        return 0

    def get_freedrive_status(self) -> int:
        """Not in freedrive: 0."""
        return 0

    def _nothing(self, *_: Any, **__: Any) -> None:
        """Accepted, without an effect."""

    force_mode = end_force_mode = force_mode_set_damping = force_mode_set_gain_scaling = _nothing
    freedrive_mode = end_freedrive_mode = teach_mode = end_teach_mode = _nothing
    zero_ftsensor = enable_external_ft_sensor = ft_rtde_input_enable = set_gravity = direct_torque = _nothing

    # mathematics

    def norm(self, values: Any) -> float:
        """Euclidean length."""
        return math.hypot(*values) if isinstance(values, list) else abs(values)

    def length(self, values: Any) -> int:
        """How many."""
        return len(values)

    def d2r(self, degrees: float) -> float:
        """Degrees to radians."""
        return math.radians(degrees)

    def r2d(self, radians: float) -> float:
        """Radians to degrees."""
        return math.degrees(radians)


for _name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "floor", "ceil", "pow"):
    setattr(Builtins, _name, staticmethod(getattr(math, _name)))
