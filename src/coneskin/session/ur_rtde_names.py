"""Methods of ur_rtde on the arm of a guarded program, by their names and arguments there, or why one is refused.

A program that was written for RTDEControlInterface, RTDEReceiveInterface and RTDEIOInterface uses the arm in their
place.
What moves raises ``Collision`` after a touch, where the wheel's method returned False or nothing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import timedelta
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from coneskin.errors import RobotRefused
from coneskin.robot.driver.waypoint import Waypoint

from .arm_client import ArmClient
from .ur_rtde_refusals import REFUSALS

__all__ = ["NAMES", "UrRtdeArm", "UrRtdeMethod"]

_HOLD = 0.5  # s for which a speed holds at least; a program of ur_rtde may rely on its lasting until speedStop
_SERVO_HOLD = 0.1  # s for which a position holds at least
_PERIOD = 0.002  # s, of the controller
_STEADY = 1e-3  # rad/s
_PROTECTIVE, _EMERGENCY = 1 << 2, 1 << 7  # bits of safety_status_bits


class UrRtdeMethod(NamedTuple):
    """One method of ur_rtde on the arm.

    Attributes:
        call: takes the arm and then the method's own arguments.
        own: what coneskin calls it, for programs that are written anew.
        note: how it differs; empty where it does not.
    """

    call: Callable[..., Any]
    own: str
    note: str = ""


class UrRtdeArm(ArmClient):
    """Arm of a guarded program that answers to the methods of ur_rtde as well."""

    if not TYPE_CHECKING:  # a type checker shall find a name that is misspelt

        def __getattr__(self, name: str) -> Callable[..., Any]:
            """Return a method of ur_rtde by its name there; of one that is refused, a function that says why.

            Raises:
                AttributeError: ur_rtde has no such method either.
            """
            if name in NAMES:
                return partial(NAMES[name].call, self)
            if name not in REFUSALS:
                raise AttributeError(f"the arm has no {name!r}, nor has ur_rtde")

            def refuse(*_: object, **__: object) -> None:
                raise RobotRefused(f"{name} is refused: {REFUSALS[name]}")

            return refuse


# ---- moves


def _move_j(
    arm: ArmClient, q: Sequence[Any], speed: float = 1.05, acceleration: float = 1.4, asynchronous: bool = False
) -> bool:
    if _is_path(q):
        return _path(arm, [Waypoint.move_j(p[:6], *p[6:]) for p in q], asynchronous or speed is True)
    arm.move_j(q, speed, acceleration, wait=not asynchronous)
    return True


def _move_l(
    arm: ArmClient, pose: Sequence[Any], speed: float = 0.25, acceleration: float = 1.2, asynchronous: bool = False
) -> bool:
    if _is_path(pose):
        return _path(arm, [Waypoint.move_l(p[:6], *p[6:]) for p in pose], asynchronous or speed is True)
    arm.move_l(pose, speed, acceleration, wait=not asynchronous)
    return True


def _move_j_ik(
    arm: ArmClient, pose: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, asynchronous: bool = False
) -> bool:
    arm.move_j_ik(pose, speed, acceleration, wait=not asynchronous)
    return True


def _move_l_fk(
    arm: ArmClient, q: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, asynchronous: bool = False
) -> bool:
    arm.move_l_fk(q, speed, acceleration, wait=not asynchronous)
    return True


def _is_path(values: Sequence[Any]) -> bool:
    return len(values) > 0 and isinstance(values[0], Sequence)


def _path(arm: ArmClient, waypoints: Sequence[Waypoint], asynchronous: bool = False) -> bool:
    arm.move_path(waypoints, wait=not asynchronous)
    return True


def _speed_j(arm: ArmClient, qd: Sequence[float], acceleration: float = 0.5, time: float = 0.0) -> bool:
    arm.speed_j(qd, acceleration, max(time, _HOLD))
    return True


def _speed_l(arm: ArmClient, xd: Sequence[float], acceleration: float = 0.25, time: float = 0.0) -> bool:
    arm.speed_l(xd, acceleration, max(time, _HOLD))
    return True


def _servo_j(
    arm: ArmClient, q: Sequence[float], _speed: float, _acceleration: float, time: float, lookahead: float, gain: float
) -> bool:
    arm.servo_j(q, max(time, _SERVO_HOLD), lookahead, gain)
    return True


def _servo_l(
    arm: ArmClient,
    pose: Sequence[float],
    _speed: float,
    _acceleration: float,
    time: float,
    lookahead: float,
    gain: float,
) -> bool:
    arm.servo_l(pose, max(time, _SERVO_HOLD), lookahead, gain)
    return True


def _stop(arm: ArmClient, a: float = 10.0, asynchronous: bool = False) -> bool:  # noqa: ARG001
    arm.stop(a)
    return True


def _stop_j(arm: ArmClient, a: float = 2.0, asynchronous: bool = False) -> None:  # noqa: ARG001
    arm.stop(a)


def _progress(arm: ArmClient) -> int:
    waypoint = arm.progress()
    return -1 if waypoint is None else waypoint


class _AsyncOperationStatus(NamedTuple):
    waypoint: int | None

    def isAsyncOperationRunning(self) -> bool:
        return self.waypoint is not None

    def progress(self) -> int:
        return self.waypoint or 0


# ---- set, ask, read


def _set_tcp(arm: ArmClient, pose: Sequence[float]) -> bool:
    arm.set_tcp(pose)
    return True


def _set_payload(arm: ArmClient, mass: float, cog: Sequence[float] = (0.0, 0.0, 0.0)) -> bool:
    arm.set_payload(mass, cog)
    return True


def _ask(name: str) -> UrRtdeMethod:
    return UrRtdeMethod(lambda arm, *values: arm.ask(name, *values), f'ask("{name}", ...)', "while the arm stands")


def _read(variable: str) -> UrRtdeMethod:
    def read(arm: ArmClient) -> Any:
        value = arm.states.value(variable)
        return list(value) if isinstance(value, tuple) else value

    return UrRtdeMethod(read, f'states.value("{variable}")')


def _is_steady(arm: ArmClient) -> bool:
    return arm.states.reading().speed < _STEADY


def _bit(variable: str) -> Callable[[ArmClient, int], bool]:
    return lambda arm, n: bool(arm.states.value(variable) >> n & 1)


def _set_digital(group: str) -> UrRtdeMethod:
    def switch(arm: ArmClient, number: int, on: bool) -> bool:
        arm.outputs.set_digital(number, on, group)
        return True

    return UrRtdeMethod(switch, f'outputs.set_digital(..., "{group}")')


def _set_analog(kind: str) -> UrRtdeMethod:
    def set_ratio(arm: ArmClient, number: int, ratio: float) -> bool:
        arm.outputs.set_analog(number, ratio, kind)
        return True

    return UrRtdeMethod(set_ratio, f'outputs.set_analog(..., "{kind}")')


def _set_register(arm: ArmClient, number: int, value: int) -> bool:
    arm.outputs.set_register(number, int(value))
    return True


def _set_double(arm: ArmClient, number: int, value: float) -> bool:
    arm.outputs.set_register(number, float(value))
    return True


def _init_period(_: ArmClient) -> timedelta:
    return timedelta(seconds=time.monotonic())


def _wait_period(_: ArmClient, t_cycle_start: timedelta) -> None:
    time.sleep(max(0.0, t_cycle_start.total_seconds() + _PERIOD - time.monotonic()))


_GETTERS = {
    **{"getTimestamp": "timestamp", "getActualExecutionTime": "actual_execution_time"},
    **{"getActualQ": "actual_q", "getActualQd": "actual_qd", "getActualCurrent": "actual_current"},
    **{"getTargetQ": "target_q", "getTargetQd": "target_qd", "getTargetQdd": "target_qdd"},
    **{"getTargetCurrent": "target_current", "getTargetMoment": "target_moment"},
    **{"getActualTCPPose": "actual_TCP_pose", "getActualTCPSpeed": "actual_TCP_speed"},
    **{"getTargetTCPPose": "target_TCP_pose", "getTargetTCPSpeed": "target_TCP_speed"},
    **{"getActualTCPForce": "actual_TCP_force", "getFtRawWrench": "ft_raw_wrench"},
    **{"getActualToolAccelerometer": "actual_tool_accelerometer", "getActualMomentum": "actual_momentum"},
    **{"getJointControlOutput": "joint_control_output", "getJointMode": "joint_mode"},
    **{"getJointTemperatures": "joint_temperatures", "getActualJointVoltage": "actual_joint_voltage"},
    **{"getActualMainVoltage": "actual_main_voltage", "getActualRobotVoltage": "actual_robot_voltage"},
    **{"getActualRobotCurrent": "actual_robot_current"},
    **{"getRobotMode": "robot_mode", "getRobotStatus": "robot_status_bits", "getRuntimeState": "runtime_state"},
    **{"getSafetyMode": "safety_mode", "getSafetyStatusBits": "safety_status_bits"},
    **{"getSpeedScaling": "speed_scaling", "getTargetSpeedFraction": "target_speed_fraction"},
    **{"getActualDigitalInputBits": "actual_digital_input_bits"},
    **{"getActualDigitalOutputBits": "actual_digital_output_bits"},
    **{"getStandardAnalogInput0": "standard_analog_input0", "getStandardAnalogInput1": "standard_analog_input1"},
    **{"getStandardAnalogOutput0": "standard_analog_output0", "getStandardAnalogOutput1": "standard_analog_output1"},
    **{"getPayload": "payload", "getPayloadCog": "payload_cog", "getPayloadInertia": "payload_inertia"},
}
_QUESTIONS = (  # of robot/ur/ur_rtde.py; a test compares
    *("getForwardKinematics", "getInverseKinematics", "getInverseKinematicsHasSolution", "poseTrans"),
    *("isPoseWithinSafetyLimits", "isJointsWithinSafetyLimits", "getTCPOffset", "getStepTime", "getJointTorques"),
    *("getTargetWaypoint", "getActualJointPositionsHistory", "getActualToolFlangePose", "getTargetJointAccelerations"),
    *("getJacobian", "getJacobianTimeDerivative", "getMassMatrix", "getCoriolisAndCentrifugalTorques"),
)
_SILENT = f"the arm is stopped where the next call does not come within {_HOLD:g} s, or `time` if that is longer"
_SILENT_SERVO = f"the arm is stopped where the next call does not come within {_SERVO_HOLD:g} s, or `time`"
_BOTH_STOPS = "each kind of motion has its own stop, whichever is called"

#: name in ur_rtde -> what answers it
NAMES: Mapping[str, UrRtdeMethod] = MappingProxyType(
    {
        "moveJ": UrRtdeMethod(_move_j, "move_j, move_path"),
        "moveJ_IK": UrRtdeMethod(_move_j_ik, "move_j_ik"),
        "moveL": UrRtdeMethod(_move_l, "move_l, move_path"),
        "moveL_FK": UrRtdeMethod(_move_l_fk, "move_l_fk"),
        "speedJ": UrRtdeMethod(_speed_j, "speed_j", _SILENT),
        "speedL": UrRtdeMethod(_speed_l, "speed_l", _SILENT),
        "servoJ": UrRtdeMethod(_servo_j, "servo_j", _SILENT_SERVO),
        "servoL": UrRtdeMethod(_servo_l, "servo_l", _SILENT_SERVO),
        "speedStop": UrRtdeMethod(_stop, "stop", _BOTH_STOPS),
        "servoStop": UrRtdeMethod(_stop, "stop", _BOTH_STOPS),
        "stopJ": UrRtdeMethod(_stop_j, "stop", f"never asynchronous; {_BOTH_STOPS}"),
        "stopL": UrRtdeMethod(_stop, "stop", f"never asynchronous; {_BOTH_STOPS}"),
        "stopScript": UrRtdeMethod(_stop, "stop", "stops the arm; the session ends the program on the controller"),
        "getAsyncOperationProgress": UrRtdeMethod(_progress, "progress"),
        "getAsyncOperationProgressEx": UrRtdeMethod(
            lambda arm: _AsyncOperationStatus(arm.progress()), "progress", "isAsyncOperationRunning and progress alone"
        ),
        "setTcp": UrRtdeMethod(_set_tcp, "set_tcp", "while the arm stands"),
        "setPayload": UrRtdeMethod(_set_payload, "set_payload", "while the arm stands"),
        **{name: _ask(name) for name in _QUESTIONS},
        "isSteady": UrRtdeMethod(_is_steady, "states.reading().speed", f"no joint faster than {_STEADY:g} rad/s"),
        "isProgramRunning": UrRtdeMethod(
            lambda arm: arm.states.reading().program_running, "states.reading().program_running"
        ),
        "isProtectiveStopped": UrRtdeMethod(
            lambda arm: bool(arm.states.value("safety_status_bits") & _PROTECTIVE), "states.reading().safety_mode"
        ),
        "isEmergencyStopped": UrRtdeMethod(
            lambda arm: bool(arm.states.value("safety_status_bits") & _EMERGENCY), "states.reading().safety_mode"
        ),
        **{name: _read(variable) for name, variable in _GETTERS.items()},
        "getSpeedScalingCombined": UrRtdeMethod(
            lambda arm: math.prod(map(arm.states.value, ("speed_scaling", "target_speed_fraction"))),
            'states.value("speed_scaling")',
        ),
        "getDigitalInState": UrRtdeMethod(_bit("actual_digital_input_bits"), "states.reading().digital_input"),
        "getDigitalOutState": UrRtdeMethod(_bit("actual_digital_output_bits"), "states.reading().digital_output"),
        "getOutputIntRegister": UrRtdeMethod(
            lambda arm, n: arm.states.value(f"output_int_register_{n}"), 'states.value("output_int_register_...")'
        ),
        "getOutputDoubleRegister": UrRtdeMethod(
            lambda arm, n: arm.states.value(f"output_double_register_{n}"), 'states.value("output_double_register_...")'
        ),
        "setStandardDigitalOut": _set_digital("standard"),
        "setConfigurableDigitalOut": _set_digital("configurable"),
        "setToolDigitalOut": _set_digital("tool"),
        "setAnalogOutputVoltage": _set_analog("voltage"),
        "setAnalogOutputCurrent": _set_analog("current"),
        "setInputIntRegister": UrRtdeMethod(_set_register, "outputs.set_register"),
        "setInputDoubleRegister": UrRtdeMethod(_set_double, "outputs.set_register"),
        "initPeriod": UrRtdeMethod(_init_period, "time.monotonic"),
        "waitPeriod": UrRtdeMethod(_wait_period, "time.sleep", "periods of 2 ms"),
        "isConnected": UrRtdeMethod(lambda arm: arm.connected, "connected"),
        "disconnect": UrRtdeMethod(lambda arm: arm.close(), "close", "the arm stays guarded until the session ends"),
    }
)
