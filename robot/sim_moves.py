"""The URScript functions that move the simulated arm, and the inverse kinematics that they share.

Source: Universal Robots, "The URScript Programming Language", module motion.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import TYPE_CHECKING, Any

from coneskin.errors import KinematicsError

from .inverse import nearest
from .sim_arm import CYCLE, Arm, Motion, MotionFault
from .sim_motion import Line, ServoJoints, SpeedJoints, SpeedTool, StopJoints, StopTool, ToolLine
from .sim_values import Array, PoseValue, ScriptError, numbers, pose_of

if TYPE_CHECKING:
    from .sim_controller import Controller
    from .sim_program import Program

__all__ = ["MoveFunctions", "Wait"]

Wait = Generator[None, None, None]


class MoveFunctions:
    """URScript functions that take the arm, bound to one program of one controller."""

    def __init__(self, controller: Controller, program: Program) -> None:
        self._c = controller
        self._arm: Arm = controller.arm
        self._program = program

    def _move(self, make: Callable[[], Motion], **what: Any) -> Wait:
        self._program.drive()
        try:
            motion = make()
        except (MotionFault, KinematicsError) as exc:
            raise ScriptError(str(exc)) from exc
        self._arm.motion = motion
        self._c.log("motion", kind=type(motion).__name__, program=self._program.name, **what)
        while True:
            yield
            if motion.done:
                return
            self._program.drive()  # refuses if another thread has taken the arm
            if self._arm.motion is not motion:
                raise ScriptError("the motion was ended by the safety system")

    def _joints(self, target: Sequence[float]) -> list[float]:
        return self.get_inverse_kin(target) if isinstance(target, PoseValue) else numbers(target, 6, "joint positions")

    def movej(self, q: Any, a: float = 1.4, v: float = 1.05, t: float = 0.0, r: float = 0.0) -> Wait:  # noqa: ARG002
        """A straight line in joint space. The blend radius r is not simulated: the arm stops at each way point."""
        yield from self._move(lambda: Line(self._arm, self._joints(q), a, v, t), target=list(q), a=a, v=v)

    def movel(self, pose: Any, a: float = 1.2, v: float = 0.25, t: float = 0.0, r: float = 0.0) -> Wait:  # noqa: ARG002
        """A straight line of the tool."""
        goal = pose_of(pose) if isinstance(pose, PoseValue) else self._arm.tcp_pose(self._joints(pose))
        yield from self._move(lambda: ToolLine(self._arm, goal, a, v, t), target=list(pose), a=a, v=v)

    movep = movel

    def _keep(self, motion: Any, t: float) -> Wait:
        """Hand the arm to a motion without an end: until it has its speed, or for a time."""
        self._arm.motion = motion
        cycles = max(1, round(t / CYCLE))
        while True:
            yield
            cycles -= 1
            if cycles <= 0 and (t > 0.0 or getattr(motion, "reached", True)):
                return
            self._program.drive()
            if self._arm.motion is not motion:
                raise ScriptError("the motion was ended by the safety system")

    def speedj(self, qd: Any, a: float = 1.4, t: float = 0.0) -> Wait:
        """Joint speeds; returns after t, or, without t, when the speed is reached."""
        qd = numbers(qd, 6, "joint speeds")
        self._program.drive()
        motion = self._arm.motion
        if not isinstance(motion, SpeedJoints):
            motion = SpeedJoints(qd, a)
            self._c.log("motion", kind="SpeedJoints", program=self._program.name, target=qd, a=a)
        elif motion.target != qd:
            self._c.log("retarget", kind="SpeedJoints", target=qd, a=a)
            motion.retarget(qd, a)
        yield from self._keep(motion, t or 0.0)

    def speedl(self, xd: Any, a: float = 1.2, t: float = 0.0, aRot: float | None = None) -> Wait:
        """Velocity of the tool; returns after t, or, without t, when the velocity is reached."""
        xd = numbers(xd, 6, "a tool velocity")
        self._program.drive()
        motion, angular = self._arm.motion, a if aRot is None else aRot
        if not isinstance(motion, SpeedTool):
            motion = SpeedTool(self._arm, xd, a, angular)
            self._c.log("motion", kind="SpeedTool", program=self._program.name, target=xd, a=a)
        elif motion.target != xd:
            self._c.log("retarget", kind="SpeedTool", target=xd, a=a)
            motion.retarget(xd, a, angular)
        yield from self._keep(motion, t or 0.0)

    def servoj(
        self,
        q: Any,
        a: float = 0.0,  # noqa: ARG002 (the controller does not use it either)
        v: float = 0.0,  # noqa: ARG002
        t: float = 0.002,
        lookahead_time: float = 0.1,
        gain: float = 300.0,
    ) -> Wait:
        """Follow a position; returns after t."""
        q = numbers(q, 6, "joint positions")
        self._program.drive()
        motion = self._arm.motion
        if isinstance(motion, ServoJoints):
            motion.retarget(q, lookahead_time, gain)
        else:
            motion = ServoJoints(q, lookahead_time, gain)
            self._c.log("motion", kind="ServoJoints", program=self._program.name, target=list(q))
        yield from self._keep(motion, max(t, CYCLE))

    def servoc(self, pose: Any, a: float = 1.2, v: float = 0.25, r: float = 0.0) -> Wait:  # noqa: ARG002
        """Follow a pose; simulated as servoj to its joint positions, with that function's default smoothing."""
        yield from self.servoj(self._joints(pose))

    def stopj(self, a: float = 2.0) -> Wait:
        """Slow down all joints in proportion; returns at standstill, at once if the arm stands."""
        self._program.drive()
        if self._arm.moving:
            yield from self._move(lambda: StopJoints(a), a=a)
        else:
            self._arm.motion = None
            self._c.log("motion", kind="StopJoints", program=self._program.name, a=a, moving=False)

    def stopl(self, a: float = 20.0, aRot: float | None = None) -> Wait:
        """Slow down the tool; returns at standstill, at once if the arm stands."""
        self._program.drive()
        if self._arm.moving:
            yield from self._move(lambda: StopTool(self._arm, a, a if aRot is None else aRot), a=a)
        else:
            self._arm.motion = None
            self._c.log("motion", kind="StopTool", program=self._program.name, a=a, moving=False)

    def get_inverse_kin(self, x: Any, qnear: Any = None, *_: Any) -> Array:
        """Joint positions of a tool pose, nearest to qnear or to where the arm is."""
        try:
            return Array(nearest(self._arm.model, pose_of(x) @ self._arm.tcp.inverse(), qnear or self._arm.q))
        except KinematicsError as exc:
            raise ScriptError(str(exc)) from exc
