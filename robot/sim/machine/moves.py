"""URScript functions that move the simulated arm, and the inverse kinematics that they share.

Source: Universal Robots, "The URScript Programming Language", module motion.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any

from coneskin.core.errors import KinematicsError
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.inverse_kinematics import nearest
from coneskin.robot.sim.motion.arm import INVALID_SETPOINT, JOINT_ACCELERATION, Motion, MotionFault
from coneskin.robot.sim.motion.motion import ServoJoints, SpeedJoints, SpeedTool, StopJoints, StopTool
from coneskin.robot.sim.motion.path import JointLine, Path, ToolArc, ToolLine
from coneskin.robot.sim.urscript.values import Array, PoseValue, ScriptError, number, numbers, pose_of, show

from .script_host import CallingProgram, ScriptHost
from .states import ErrorNotice

_NOT_SIMULATED = 0  # number of a log entry that only this simulator writes

Wait = Generator[None, None, None]


class MoveFunctions:
    """URScript functions that move the arm, bound to one program of one controller."""

    def __init__(self, host: ScriptHost, program: CallingProgram) -> None:
        self._host = host
        self._arm = host.arm
        self._program = program

    def _tell_not_simulated(self, what: str) -> None:
        """Tell log and clients, once for each program."""
        if what not in self._program.told:
            self._program.told.add(what)
            self._host.log("not_simulated", what=what)
            self._host.tell(ErrorNotice(_NOT_SIMULATED, 0, f"not simulated: {what}"))

    def _move(self, make: Callable[[], Motion], radius: float = 0.0, **what: Any) -> Wait:
        """Let a motion drive the arm until it is done, or as close to its goal as the blend radius [m]."""
        self._program.drive()
        try:
            motion = make()
        except (MotionFault, KinematicsError) as exc:  # a path that no arm can follow: the safety system acts
            cause = exc.cause if isinstance(exc, MotionFault) else INVALID_SETPOINT
            self._host.protective_stop(str(exc), cause)
            yield
            raise ScriptError(str(exc)) from exc
        self._arm.motion = motion
        self._host.log("motion", kind=type(motion).__name__, program=self._program.name, **what)
        while True:
            yield
            if motion.done:
                return
            self._program.drive()  # raises if another thread has claimed the arm
            if self._arm.motion is not motion:
                raise ScriptError("the motion was ended by the safety system")
            if isinstance(motion, Path) and self._program.interpreter.aborts:
                self._program.interpreter.aborts = False
                if not radius:
                    motion.profile.end_early()
                    continue
                motion.blends = True
                return
            if radius and isinstance(motion, Path) and motion.within(self._arm, radius):
                motion.blends = True
                return

    def _joints(self, target: Sequence[float]) -> list[float]:
        return self.get_inverse_kin(target) if isinstance(target, PoseValue) else numbers(target, 6, "joint positions")

    def _pose(self, target: Any) -> Pose:
        """Return a tool pose, given as such or by joint positions."""
        if isinstance(target, PoseValue):
            return pose_of(numbers(target, 6, "a pose"))
        return self._arm.tcp_pose(numbers(target, 6, "joint positions"))

    def movej(self, q: Any, a: float = 1.4, v: float = 1.05, t: float = 0.0, r: float = 0.0) -> Wait:
        """Move in a straight line in joint space."""
        a, v, t, r = _numbers(a, v, t, r)
        goal = self._joints(q)
        yield from self._move(lambda: JointLine(self._arm, goal, a, v, t), r, target=list(q), a=a, v=v)

    def movel(self, pose: Any, a: float = 1.2, v: float = 0.25, t: float = 0.0, r: float = 0.0) -> Wait:
        """Move the tool in a straight line."""
        a, v, t, r = _numbers(a, v, t, r)
        goal = self._pose(pose)
        yield from self._move(lambda: ToolLine(self._arm, goal, a, v, t), r, target=list(pose), a=a, v=v)

    def movep(self, pose: Any, a: float = 1.2, v: float = 0.25, r: float = 0.0) -> Wait:
        """Move the tool in a straight line; simulated as movel."""
        yield from self.movel(pose, a, v, 0.0, r)

    def movec(
        self, pose_via: Any, pose_to: Any, a: float = 1.2, v: float = 0.25, r: float = 0.0, mode: int = 0
    ) -> Wait:
        """Move the tool on an arc of a circle over a position."""
        a, v, r = _numbers(a, v, r)
        if mode not in (0, 1):
            raise ScriptError(f"the mode of movec is 0 or 1, got {show(mode)}")
        via, goal = self._pose(pose_via).translation, self._pose(pose_to)
        yield from self._move(
            lambda: ToolArc(self._arm, via, goal, a, v, mode == 1), r, target=list(pose_to), via=list(via), a=a, v=v
        )

    def optimovej(self, goal: Any, a: float = 0.3, v: float = 0.3, r: float = 0.0) -> Wait:
        """Move in a straight line in joint space, at shares of what the joints are able to do."""
        (a, v), (r,) = _shares(a, v), _numbers(r)
        q, limits = self._joints(goal), [v * limit for limit in self._arm.model.joint_speed]

        def make() -> Motion:  # the line itself heeds what each joint can do
            return JointLine(self._arm, q, a * JOINT_ACCELERATION, max(limits), limits=limits)

        yield from self._move(make, r, target=list(goal), a=a, v=v)

    def optimovel(self, goal: Any, a: float = 0.3, v: float = 0.3, r: float = 0.0) -> Wait:
        """Move the tool in a straight line, at shares of what the joints are able to do."""
        (a, v), (r,) = _shares(a, v), _numbers(r)
        pose = self._pose(goal)

        def make() -> Motion:
            line = ToolLine(self._arm, pose, 1.0, 1.0)
            line.limit(self._arm, a, v)
            return line

        yield from self._move(make, r, target=list(goal), a=a, v=v)

    def _sustain(self, motion: Any, t: float) -> Wait:
        """Let a motion without an end drive the arm until it has reached its speed, or for a time t [s].

        The time is that of the program, which the speed slider stretches: at 25 % one cycle of it lasts four. So a
        program that gives a speed for each cycle goes the whole of its way. What goes beyond t counts for the next.
        """
        self._arm.motion = motion
        cycles = max(1, round(t / self._host.steptime))
        passed = motion.surplus if t > 0.0 else 0.0
        motion.surplus = 0.0
        while True:
            yield
            passed += self._host.speed_scaling if t > 0.0 and motion.scaled else 1.0
            if passed >= cycles - 1e-9 and (t > 0.0 or getattr(motion, "reached", True)):
                motion.surplus = max(0.0, passed - cycles)
                return
            self._program.drive()
            if self._arm.motion is not motion:
                raise ScriptError("the motion was ended by the safety system")

    def speedj(self, qd: Any, a: float = 1.4, t: float = 0.0) -> Wait:
        """Move at joint speeds; return after t, or, without t, when the speed is reached."""
        qd = numbers(qd, 6, "joint speeds")
        a, t = _numbers(a, t)
        yield from self._go_at(SpeedJoints, lambda: SpeedJoints(qd, a), t, qd, a)

    def speedl(self, xd: Any, a: float = 1.2, t: float = 0.0, aRot: float | None = None) -> Wait:
        """Move the tool at a velocity; return after t, or, without t, when the velocity is reached."""
        xd = numbers(xd, 6, "a tool velocity")
        a, t, aRot = _numbers(a, t, a if aRot is None else aRot)
        yield from self._go_at(SpeedTool, lambda: SpeedTool(self._arm, xd, a, aRot), t, xd, a, aRot)

    def _go_at(self, kind: Any, make: Callable[[], Any], t: float, target: list[float], a: float, *more: float) -> Wait:
        """Go on at a speed, or begin to; see `_sustain`."""
        self._program.drive()
        motion: Any = self._arm.motion
        if not isinstance(motion, kind):
            motion = make()
            self._host.log("motion", kind=kind.__name__, program=self._program.name, target=target, a=a)
        elif motion.target != target:
            self._host.log("retarget", kind=kind.__name__, target=target, a=a)
            motion.retarget(target, a, *more)
        yield from self._sustain(motion, t)

    def servoj(
        self,
        q: Any,
        a: float = 0.0,  # noqa: ARG002 (nor does the real controller use it)
        v: float = 0.0,  # noqa: ARG002
        t: float = 0.002,
        lookahead_time: float = 0.1,
        gain: float = 300.0,
    ) -> Wait:
        """Follow a position; return after t."""
        q = numbers(q, 6, "joint positions")
        t, lookahead_time, gain = _numbers(t, lookahead_time, gain)
        self._program.drive()
        motion = self._arm.motion
        if isinstance(motion, ServoJoints):
            motion.retarget(q, lookahead_time, gain)
        else:
            motion = ServoJoints(q, lookahead_time, gain)
            self._host.log("motion", kind="ServoJoints", program=self._program.name, target=list(q))
        yield from self._sustain(motion, max(t, self._host.steptime))

    def servoc(self, pose: Any, a: float = 1.2, v: float = 0.25, r: float = 0.0) -> Wait:  # noqa: ARG002
        """Follow a pose; simulated as servoj to its joint positions with default smoothing."""
        yield from self.servoj(self._joints(pose))

    def stopj(self, a: float = 2.0) -> Wait:
        """Slow down all joints in proportion; return at standstill, at once if the arm stands."""
        (a,) = _numbers(a)
        yield from self._stop(StopJoints(a), a)

    def stopl(self, a: float = 20.0, aRot: float | None = None) -> Wait:
        """Slow down the tool; return at standstill, at once if the arm stands."""
        a, aRot = _numbers(a, a if aRot is None else aRot)
        yield from self._stop(StopTool(self._arm, a, aRot), a)

    def _stop(self, stop: Motion, a: float) -> Wait:
        self._program.drive()
        if self._arm.moving:
            yield from self._move(lambda: stop, a=a)
        else:
            self._arm.motion = None
            self._host.log("motion", kind=type(stop).__name__, program=self._program.name, a=a, moving=False)

    def set_pos(self, q: Any) -> None:
        """Put a simulated arm that stands at joint positions, without a motion."""
        q = numbers(q, 6, "joint positions")
        self._program.drive()
        model = self._arm.model
        if self._arm.moving:
            raise ScriptError("set_pos puts an arm that stands, and this one moves")
        if not all(
            low <= angle <= high for low, angle, high in zip(model.joint_lower, q, model.joint_upper, strict=True)
        ):
            raise ScriptError(f"set_pos: {show(Array(q))} is beyond the joints' limits [rad]")
        if not self._arm.kinematic:
            raise ScriptError("set_pos puts an arm without dynamics, and the plant of this one has some")
        self._arm.motion = None
        self._arm.put(q)
        self._host.log("put", program=self._program.name, q=q)

    def get_inverse_kin(self, x: Any, qnear: Any = None, *_: Any) -> Array:
        """Return joint positions of a tool pose, nearest to qnear or to the present ones."""
        try:
            return Array(nearest(self._arm.model, pose_of(x) @ self._arm.tcp.inverse(), qnear or self._arm.q))
        except KinematicsError as exc:
            raise ScriptError(str(exc)) from exc


def _shares(*values: Any) -> list[float]:
    """Return shares of what the joints are able to do.

    Raises:
        ScriptError: one is not above 0, or is above 1.
    """
    if not all(isinstance(value, int | float) and 0.0 < value <= 1.0 for value in values):
        raise ScriptError(f"a and v are shares from above 0 to 1, got {', '.join(map(show, values))}")
    return [float(value) for value in values]


def _numbers(*values: Any) -> list[float]:
    """Return speeds, accelerations and times of a program; none (None) counts as 0.

    Raises:
        ScriptError: one is no number, or not finite.
    """
    return [0.0 if value is None else number(value, "a speed, an acceleration or a time") for value in values]
