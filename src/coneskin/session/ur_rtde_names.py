"""Methods of ur_rtde on the arm of a guarded program, by their names and arguments there, or why one is refused.

A program that was written for RTDEControlInterface, RTDEReceiveInterface and RTDEIOInterface uses the arm in their
place.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import RobotRefused

from . import ur_rtde_calls as calls
from .arm_client import ArmClient
from .ur_rtde_calls import UrRtdeMethod
from .ur_rtde_refusals import REFUSALS

__all__ = ["NAMES", "UrRtdeArm"]

_PROTECTIVE, _EMERGENCY = 1 << 2, 1 << 7  # bits of safety_status_bits


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
_SILENT = f"the arm is stopped where the next call does not come within {calls.HOLD:g} s, or `time` if that is longer"
_SILENT_SERVO = f"the arm is stopped where the next call does not come within {calls.SERVO_HOLD:g} s, or `time`"
_BOTH_STOPS = "each kind of motion has its own stop, whichever is called"

#: name in ur_rtde -> what answers it
NAMES: Mapping[str, UrRtdeMethod] = MappingProxyType(
    {
        "moveJ": UrRtdeMethod(calls.move_j, "move_j, move_path"),
        "moveJ_IK": UrRtdeMethod(calls.move_j_ik, "move_j_ik"),
        "moveL": UrRtdeMethod(calls.move_l, "move_l, move_path"),
        "moveL_FK": UrRtdeMethod(calls.move_l_fk, "move_l_fk"),
        "speedJ": UrRtdeMethod(calls.speed_j, "speed_j", _SILENT),
        "speedL": UrRtdeMethod(calls.speed_l, "speed_l", _SILENT),
        "servoJ": UrRtdeMethod(calls.servo_j, "servo_j", _SILENT_SERVO),
        "servoL": UrRtdeMethod(calls.servo_l, "servo_l", _SILENT_SERVO),
        "speedStop": UrRtdeMethod(calls.stop, "stop", _BOTH_STOPS),
        "servoStop": UrRtdeMethod(calls.stop, "stop", _BOTH_STOPS),
        "stopJ": UrRtdeMethod(calls.stop_j, "stop", f"never asynchronous; {_BOTH_STOPS}"),
        "stopL": UrRtdeMethod(calls.stop, "stop", f"never asynchronous; {_BOTH_STOPS}"),
        "stopScript": UrRtdeMethod(calls.stop, "stop", "stops the arm; the session ends the program on the controller"),
        "getAsyncOperationProgress": UrRtdeMethod(calls.progress, "progress"),
        "getAsyncOperationProgressEx": UrRtdeMethod(
            lambda arm: calls.AsyncOperationStatus(arm.progress()),
            "progress",
            "isAsyncOperationRunning and progress alone",
        ),
        "setTcp": UrRtdeMethod(calls.set_tcp, "set_tcp", "while the arm stands"),
        "setPayload": UrRtdeMethod(calls.set_payload, "set_payload", "while the arm stands"),
        **{name: calls.ask(name) for name in _QUESTIONS},
        "isSteady": UrRtdeMethod(
            calls.is_steady, "states.reading().speed", f"no joint faster than {calls.STEADY:g} rad/s"
        ),
        "isProgramRunning": UrRtdeMethod(
            lambda arm: arm.states.reading().program_running, "states.reading().program_running"
        ),
        "isProtectiveStopped": UrRtdeMethod(
            lambda arm: bool(arm.states.value("safety_status_bits") & _PROTECTIVE), "states.reading().safety_mode"
        ),
        "isEmergencyStopped": UrRtdeMethod(
            lambda arm: bool(arm.states.value("safety_status_bits") & _EMERGENCY), "states.reading().safety_mode"
        ),
        **{name: calls.read(variable) for name, variable in _GETTERS.items()},
        "getSpeedScalingCombined": UrRtdeMethod(
            lambda arm: math.prod(map(arm.states.value, ("speed_scaling", "target_speed_fraction"))),
            'states.value("speed_scaling")',
        ),
        "getDigitalInState": UrRtdeMethod(calls.bit("actual_digital_input_bits"), "states.reading().digital_input"),
        "getDigitalOutState": UrRtdeMethod(calls.bit("actual_digital_output_bits"), "states.reading().digital_output"),
        "getOutputIntRegister": UrRtdeMethod(
            lambda arm, n: arm.states.value(f"output_int_register_{n}"), 'states.value("output_int_register_...")'
        ),
        "getOutputDoubleRegister": UrRtdeMethod(
            lambda arm, n: arm.states.value(f"output_double_register_{n}"), 'states.value("output_double_register_...")'
        ),
        "setStandardDigitalOut": calls.set_digital("standard"),
        "setConfigurableDigitalOut": calls.set_digital("configurable"),
        "setToolDigitalOut": calls.set_digital("tool"),
        "setAnalogOutputVoltage": calls.set_analog("voltage"),
        "setAnalogOutputCurrent": calls.set_analog("current"),
        "setInputIntRegister": UrRtdeMethod(calls.set_register, "outputs.set_register"),
        "setInputDoubleRegister": UrRtdeMethod(calls.set_double, "outputs.set_register"),
        "initPeriod": UrRtdeMethod(calls.init_period, "time.monotonic"),
        "waitPeriod": UrRtdeMethod(calls.wait_period, "time.sleep", "periods of 2 ms"),
        "isConnected": UrRtdeMethod(lambda arm: arm.connected, "connected"),
        "disconnect": UrRtdeMethod(lambda arm: arm.close(), "close", "the arm stays guarded until the session ends"),
    }
)
