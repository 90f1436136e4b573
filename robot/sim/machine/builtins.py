"""URScript functions of the simulated controller: time, kinematics and payload, and those that it inherits.

Every public method of `Builtins`, inherited ones included, is one such function under its URScript name and with its
argument names; one that takes time is a generator. The mass matrix and the Coriolis torques are those of the bare arm;
outer joint torques are NaN. A contact is never found, freedrive holds the arm, and measured forces are 0, or what a
client gives by RTDE instead of a sensor.

Source: Universal Robots, "The URScript Programming Language", modules motion, internals and interfaces.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from inspect import isgeneratorfunction
from typing import Any

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.inertia import arm_inertia, joint_torques, mass_matrix
from coneskin.robot.arm.inverse_kinematics import nearest, solutions
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.models import ZERO_VELOCITY
from coneskin.robot.sim.motion.arm import SimulatedArm
from coneskin.robot.sim.motion.path import Path
from coneskin.robot.sim.urscript.value_functions import MAX_LINE, ValueFunctions, written
from coneskin.robot.sim.urscript.values import Array, PoseValue, ScriptError, number, numbers, pose_of, show, values_of

from .io_functions import IoFunctions, add_host_functions, index_of
from .moves import MoveFunctions, Wait
from .socket_functions import SocketFunctions
from .states import PopupNotice, TextNotice

_NOT_SIMULATED = (math.nan,) * 6  # value of what is not simulated, for six joints


class Builtins(MoveFunctions, IoFunctions, SocketFunctions, ValueFunctions):
    """All URScript functions, bound to one program of one controller."""

    @classmethod
    def functions(cls) -> dict[str, bool]:
        """Return the names of all functions -> whether they take time."""
        names = [name for name in dir(cls) if not name.startswith("_") and name != "functions"]
        return {name: isgeneratorfunction(getattr(cls, name)) for name in names}

    # time and text

    def sync(self) -> Wait:
        """Wait for the next cycle."""
        yield

    def sleep(self, t: float) -> Wait:
        """Wait for a time [s], at least for a cycle."""
        for _ in range(max(1, round(t / self._host.steptime)) if t > 0.0 else 0):
            yield

    def textmsg(self, *words: Any) -> None:
        """Write a line to the log, and tell it to the clients."""
        text = "".join(map(written, words))[:MAX_LINE]
        self._host.log("text", text=text)
        self._host.tell(TextNotice(text))

    def interpreter_mode(self, clearQueueOnEnter: Any = True, clearOnEnd: Any = True) -> Wait:
        """Execute statements that come on the interpreter's port, until one of them or a thread ends that."""
        yield from self._program.interpreter.run(bool(clearQueueOnEnter), bool(clearOnEnd))

    def end_interpreter(self) -> None:
        """End interpreter mode."""
        self._program.interpreter.active = False

    def clear_interpreter(self) -> None:
        """Forget what statements of interpreter mode have defined."""
        self._program.interpreter.clear()

    def popup(
        self, s: Any = "", title: Any = "Popup", warning: Any = False, error: Any = False, *_: Any, **__: Any
    ) -> None:
        """Write a line to the log, and tell it to the clients; nobody is there to close a blocking one."""
        self._host.log("popup", text=show(s), title=show(title))
        self._host.tell(PopupNotice(show(title), show(s), bool(warning), bool(error)))

    def request_boolean_from_primary_client(self, message: Any = "") -> Wait:
        """Wait for an answer from a pendant that is not there."""
        self._tell_not_simulated(f"an answer from the pendant, for which the program waits: {show(message)}")
        while True:
            yield

    request_float_from_primary_client = request_integer_from_primary_client = request_boolean_from_primary_client
    request_string_from_primary_client = request_boolean_from_primary_client

    # kinematics

    def get_target_waypoint(self) -> PoseValue:
        """Return the tool pose at which the present motion ends; the present pose if nothing moves the arm."""
        motion = self._arm.motion
        if isinstance(motion, Path):
            return values_of(motion.goal)
        return values_of(self._arm.tcp_pose(self._arm.measured.q))

    def get_jacobian(self, q: Any = None, tcp: Any = None) -> Array:
        """Return the Jacobian of the tool at joint positions, 6 x 6; by default at the present ones with its tool."""
        return Array(Array(row) for row in self._posed(q, tcp).jacobian())

    def get_jacobian_time_derivative(self, q: Any = None, qd: Any = None, tcp: Any = None) -> Array:
        """Return the time derivative of the Jacobian: a central difference along joint speeds (the present ones)."""
        step = 1e-6
        here, speeds = self._posed(q, tcp), self._arm.qd if qd is None else numbers(qd, 6, "qd")
        ahead, behind = (
            self._posed([q + shift * qd for q, qd in zip(here.q, speeds, strict=True)], tcp) for shift in (step, -step)
        )
        pairs = zip(ahead.jacobian(), behind.jacobian(), strict=True)
        return Array(Array((a - b) / (2 * step) for a, b in zip(new, old, strict=True)) for new, old in pairs)

    def _posed(self, q: Any, tcp: Any) -> SimulatedArm:
        """Return an arm like this one at joint positions, with a tool."""
        arm = SimulatedArm(self._arm.model, self._arm.q if q is None else numbers(q, 6, "q"))
        arm.tcp = self._arm.tcp if tcp is None else pose_of(tcp)
        return arm

    def get_mass_matrix(self, q: Any = None, include_rotors_inertia: bool = False) -> Array:
        """Return the mass matrix of the bare arm at joint positions, 6 x 6 [kg m^2]; by default at the present ones."""
        inertia = arm_inertia(self._arm.model)
        rotor = inertia.rotor if include_rotors_inertia else ZERO_VELOCITY
        rows = mass_matrix(self._arm.model, replace(inertia, rotor=rotor), self._posed(q, None).q)
        return Array(Array(row) for row in rows)

    def get_coriolis_and_centrifugal_torques(self, q: Any = None, qd: Any = None) -> Array:
        """Return what joint speeds alone take of torque, of the bare arm [N m]; by default the present ones."""
        model, inertia, here = self._arm.model, arm_inertia(self._arm.model), self._posed(q, None).q
        speeds = self._arm.qd if qd is None else numbers(qd, 6, "qd")
        moving = joint_torques(model, inertia, here, speeds, ZERO_VELOCITY)
        standing = joint_torques(model, inertia, here, ZERO_VELOCITY, ZERO_VELOCITY)
        return Array(a - b for a, b in zip(moving, standing, strict=True))

    def is_within_safety_limits(self, where: Any) -> bool:
        """Return whether joint positions are within their limits, or such positions reach a tool pose."""
        model = self._arm.model
        if isinstance(where, PoseValue):
            try:
                nearest(model, pose_of(where) @ self._arm.tcp.inverse(), self._arm.q)
            except KinematicsError:
                return False
            return True
        return all(low <= q <= high for low, q, high in zip(model.joint_lower, where, model.joint_upper, strict=True))

    def set_tcp(self, pose: Any, *_: Any) -> None:
        """Set the tool centre point in the flange frame."""
        self._arm.tcp = pose_of(numbers(pose, 6, "a tool centre point"))

    # forces, in a world where nothing touches the arm: what would move it even so is told, and it holds

    def tool_contact(self, direction: Any = None) -> int:
        """Return 0: no contact."""
        if direction is not None:
            numbers(direction, 6, "a direction")
        return 0

    def enable_external_ft_sensor(self, enable: Any, *_: Any, **__: Any) -> None:
        """Take forces and torques from RTDE's external_force_torque."""
        self._host.inputs.external_forces = bool(enable)

    ft_rtde_input_enable = enable_external_ft_sensor

    def force_mode(self, task_frame: Any, selection_vector: Any, wrench: Any, type: Any, limits: Any) -> None:
        """Follow forces along the selected axes: nothing touches the arm, and it holds."""
        numbers(task_frame, 6, "a task frame")
        numbers(limits, 6, "limits")
        if int(type) not in (1, 2, 3):
            raise ScriptError(f"the type of a force mode is 1, 2 or 3, got {show(type)}")
        selected = numbers(selection_vector, 6, "a selection vector")
        if any(on and wanted for on, wanted in zip(selected, numbers(wrench, 6, "a wrench"), strict=True)):
            self._tell_not_simulated("the motion of force_mode with a wanted force; the arm holds")

    def force_mode_set_damping(self, damping: float) -> None:
        """Set the damping of force mode, 0..1: no effect."""
        self._program.damping = min(1.0, max(0.0, number(damping, "a damping")))

    def force_mode_get_damping(self) -> float:
        """Return the damping of force mode."""
        return self._program.damping

    def force_mode_set_gain_scaling(self, scaling: float) -> None:
        """Set the gain of force mode, 0..2: no effect."""
        self._program.gain_scaling = min(2.0, max(0.0, number(scaling, "a scaling")))

    def force_mode_get_gain_scaling(self) -> float:
        """Return the gain of force mode."""
        return self._program.gain_scaling

    def direct_torque(
        self, torque: Any, friction_comp: Any = 0, viscous_scale: Any = 0, coulomb_scale: Any = 0
    ) -> Wait:
        """Let torques act on the joints for a cycle, beside gravity [N m]: the arm holds."""
        del friction_comp, viscous_scale, coulomb_scale
        wanted = numbers(torque, 6, "joint torques")
        self._program.drive()
        if any(wanted):
            self._tell_not_simulated("the motion by direct_torque; the arm holds")
        yield

    def set_gravity(self, d: Any) -> None:
        """Set the direction of gravity [m/s^2]: no effect on an arm that follows its path exactly."""
        self._host.gravity = tuple(numbers(d, 3, "gravity"))

    # safety and payload

    def protective_stop(self) -> Wait:
        """Stop the arm as if it had hit something; the program goes on only once a person has unlocked it."""
        self._host.protective_stop(f"protective_stop() in {self._program.name}")
        yield

    def set_payload(self, m: float, cog: Any = None, inertia: Any = None) -> None:
        """Set the payload [kg], its centre of gravity [m] and inertia [kg m^2].

        What is not given: the centre of gravity stays as it is, the inertia becomes zero.
        """
        self._host.payload = number(m, "a payload")
        if cog is not None:
            self._host.payload_cog = tuple(numbers(cog, 3, "a centre of gravity"))
        self._arm.carry(self._host.payload, self._host.payload_cog)
        self._host.payload_inertia = (0.0,) * 6 if inertia is None else tuple(numbers(inertia, 6, "an inertia"))

    def set_target_payload(self, m: float, cog: Any, inertia: Any = None, transition_time: float = 0.0) -> None:
        """Set the payload at once."""
        number(transition_time, "a transition time")
        self.set_payload(m, cog, inertia)

    set_payload_mass = set_payload

    def set_payload_cog(self, CoG: Any) -> None:
        """Set the centre of gravity of the payload [m]."""
        self.set_payload(self._host.payload, CoG)


#: name -> what the function returns: positions and speeds of joints [rad], [rad/s], of the tool [m], [m/s], and so on
_READINGS: dict[str, Callable[..., Any]] = {
    "get_steptime": lambda host: host.steptime,
    # measured by the arm
    "get_actual_joint_positions": lambda host: Array(host.arm.measured.q),
    "get_joint_positions": lambda host: Array(host.arm.measured.q),
    "get_actual_joint_speeds": lambda host: Array(host.arm.measured.qd),
    "get_actual_tcp_pose": lambda host: values_of(host.arm.tcp_pose(host.arm.measured.q)),
    "get_actual_tool_flange_pose": lambda host: values_of(forward(host.arm.model, host.arm.measured.q)),
    "get_actual_tcp_speed": lambda host: Array(host.arm.measured_twist()),
    "is_steady": lambda host: not host.arm.turning,
    "get_actual_joint_positions_history": lambda host, steps=0: Array(
        host.history[max(0, len(host.history) - 1 - int(steps))]
    ),
    "get_forward_kin": lambda host, q=None, tcp=None: values_of(
        forward(host.arm.model, host.arm.q if q is None else q) @ (host.arm.tcp if tcp is None else pose_of(tcp))
    ),
    "get_inverse_kin_has_solution": lambda host, x, *_: bool(
        solutions(host.arm.model, pose_of(x) @ host.arm.tcp.inverse())
    ),
    # commanded; no path has an offset
    "get_target_joint_positions": lambda host: Array(host.arm.q),
    "get_target_joint_speeds": lambda host: Array(host.arm.qd),
    **dict.fromkeys(
        ("get_target_joint_accelerations", "get_actual_joint_accelerations"), lambda host: Array(host.arm.qdd)
    ),
    **dict.fromkeys(
        ("get_target_tcp_pose", "get_target_tcp_pose_along_path"), lambda host: values_of(host.arm.tcp_pose())
    ),
    **dict.fromkeys(("get_target_tcp_speed", "get_target_tcp_speed_along_path"), lambda host: Array(host.arm.twist())),
    "get_tcp_offset": lambda host: values_of(host.arm.tcp),
    # set by programs and clients
    "get_target_payload": lambda host: host.payload,
    "get_target_payload_cog": lambda host: Array(host.payload_cog),
    "get_target_payload_inertia": lambda host: Array(host.payload_inertia),
    "get_gravity": lambda host: Array(host.gravity),
    "get_tcp_force": lambda host: Array(host.inputs.wrench()),
    "force": lambda host: math.hypot(*host.inputs.wrench()[:3]),
    # constants of sensors that are not simulated
    **dict.fromkeys(("get_controller_temp", "get_tool_temp"), lambda _: 30.0),
    "get_joint_temp": lambda _, j: ((30.0,) * 6)[index_of(j, 6)],
    "get_tool_current": lambda _: 0.0,
    "get_tool_accelerometer_reading": lambda _: Array((0.0, 0.0, -9.81)),
    "get_joint_torques": lambda _: Array(_NOT_SIMULATED),
    "get_freedrive_status": lambda _: 0,  # it is not restricted by a position close to a limit
}
_READINGS["tool_pose"] = _READINGS["get_actual_tcp_pose"]  # its name on CB3
add_host_functions(_READINGS)
