"""Methods of ur_rtde on ``session.arm``, for type checkers. Made by scripts/reference.py."""

from collections.abc import Sequence
from datetime import timedelta
from typing import NoReturn, overload

from typing_extensions import deprecated

class _AsyncOperationStatus:
    def isAsyncOperationRunning(self) -> bool: ...
    def progress(self) -> int: ...

class UrRtdeMethods:
    @deprecated("refused: it moves the arm by torques alone; in it the arm moves with what pushes it, so that a stop of the guard cannot be told from it by measured speed; use it in a program without the guard, or guard a program on the controller with control = external")
    def directTorque(self, *args: object, **kwargs: object) -> NoReturn: ...
    def disconnect(self) -> None:
        """In coneskin: close; the arm stays guarded until the session ends."""
    @deprecated("refused: it changes what the controller's own safety system may rely on; use it in a program without the guard, or guard a program on the controller with control = external")
    def enableExternalFtSensor(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: there is no freedrive to end: leave the call out")
    def endFreedriveMode(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: there is no teach mode to end: leave the call out")
    def endTeachMode(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: in it the arm moves with what pushes it, so that a stop of the guard cannot be told from it by measured speed; use it in a program without the guard, or guard a program on the controller with control = external")
    def forceMode(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: there is no force mode to set up: leave the call out")
    def forceModeSetDamping(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: there is no force mode to set up: leave the call out")
    def forceModeSetGainScaling(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: there is no force mode to stop: leave the call out")
    def forceModeStop(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: in it the arm moves with what pushes it, so that a stop of the guard cannot be told from it by measured speed; use it in a program without the guard, or guard a program on the controller with control = external")
    def freedriveMode(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: it changes what the controller's own safety system may rely on; use it in a program without the guard, or guard a program on the controller with control = external")
    def ftRtdeInputEnable(self, *args: object, **kwargs: object) -> NoReturn: ...
    def getActualCurrent(self) -> list[float]:
        """In coneskin: states.value("actual_current")."""
    def getActualDigitalInputBits(self) -> int:
        """In coneskin: states.value("actual_digital_input_bits")."""
    def getActualDigitalOutputBits(self) -> int:
        """In coneskin: states.value("actual_digital_output_bits")."""
    def getActualExecutionTime(self) -> float:
        """In coneskin: states.value("actual_execution_time")."""
    def getActualJointPositionsHistory(self, arg0: int, /) -> list[float]:
        """In coneskin: ask("getActualJointPositionsHistory", ...); while the arm stands."""
    def getActualJointVoltage(self) -> list[float]:
        """In coneskin: states.value("actual_joint_voltage")."""
    def getActualMainVoltage(self) -> float:
        """In coneskin: states.value("actual_main_voltage")."""
    def getActualMomentum(self) -> float:
        """In coneskin: states.value("actual_momentum")."""
    def getActualQ(self) -> list[float]:
        """In coneskin: states.value("actual_q")."""
    def getActualQd(self) -> list[float]:
        """In coneskin: states.value("actual_qd")."""
    def getActualRobotCurrent(self) -> float:
        """In coneskin: states.value("actual_robot_current")."""
    def getActualRobotVoltage(self) -> float:
        """In coneskin: states.value("actual_robot_voltage")."""
    def getActualTCPForce(self) -> list[float]:
        """In coneskin: states.value("actual_TCP_force")."""
    def getActualTCPPose(self) -> list[float]:
        """In coneskin: states.value("actual_TCP_pose")."""
    def getActualTCPSpeed(self) -> list[float]:
        """In coneskin: states.value("actual_TCP_speed")."""
    def getActualToolAccelerometer(self) -> list[float]:
        """In coneskin: states.value("actual_tool_accelerometer")."""
    def getActualToolFlangePose(self) -> list[float]:
        """In coneskin: ask("getActualToolFlangePose", ...); while the arm stands."""
    def getAsyncOperationProgress(self) -> int:
        """In coneskin: progress."""
    def getAsyncOperationProgressEx(self) -> _AsyncOperationStatus:
        """In coneskin: progress; isAsyncOperationRunning and progress alone."""
    def getCoriolisAndCentrifugalTorques(self, q: Sequence[float] = ..., qd: Sequence[float] = ...) -> list[float]:
        """In coneskin: ask("getCoriolisAndCentrifugalTorques", ...); while the arm stands."""
    def getDigitalInState(self, arg0: int, /) -> bool:
        """In coneskin: states.reading().digital_input."""
    def getDigitalOutState(self, arg0: int, /) -> bool:
        """In coneskin: states.reading().digital_output."""
    def getForwardKinematics(self, q: Sequence[float] = ..., tcp_offset: Sequence[float] = ...) -> list[float]:
        """In coneskin: ask("getForwardKinematics", ...); while the arm stands."""
    @deprecated("refused: there is no freedrive: leave the call out")
    def getFreedriveStatus(self, *args: object, **kwargs: object) -> NoReturn: ...
    def getFtRawWrench(self) -> list[float]:
        """In coneskin: states.value("ft_raw_wrench")."""
    def getInverseKinematics(self, x: Sequence[float], qnear: Sequence[float] = ..., max_position_error: float = ..., max_orientation_error: float = ...) -> list[float]:
        """In coneskin: ask("getInverseKinematics", ...); while the arm stands."""
    def getInverseKinematicsHasSolution(self, x: Sequence[float], qnear: Sequence[float] = ..., max_position_error: float = ..., max_orientation_error: float = ...) -> bool:
        """In coneskin: ask("getInverseKinematicsHasSolution", ...); while the arm stands."""
    def getJacobian(self, pos: Sequence[float] = ..., tcp: Sequence[float] = ...) -> list[float]:
        """In coneskin: ask("getJacobian", ...); while the arm stands."""
    def getJacobianTimeDerivative(self, pos: Sequence[float] = ..., vel: Sequence[float] = ..., tcp: Sequence[float] = ...) -> list[float]:
        """In coneskin: ask("getJacobianTimeDerivative", ...); while the arm stands."""
    def getJointControlOutput(self) -> list[float]:
        """In coneskin: states.value("joint_control_output")."""
    def getJointMode(self) -> list[int]:
        """In coneskin: states.value("joint_mode")."""
    def getJointTemperatures(self) -> list[float]:
        """In coneskin: states.value("joint_temperatures")."""
    def getJointTorques(self) -> list[float]:
        """In coneskin: ask("getJointTorques", ...); while the arm stands."""
    def getMassMatrix(self, q: Sequence[float] = ..., include_rotors_inertia: bool = ...) -> list[float]:
        """In coneskin: ask("getMassMatrix", ...); while the arm stands."""
    def getOutputDoubleRegister(self, arg0: int, /) -> float:
        """In coneskin: states.value("output_double_register_...")."""
    def getOutputIntRegister(self, arg0: int, /) -> int:
        """In coneskin: states.value("output_int_register_...")."""
    def getPayload(self) -> float:
        """In coneskin: states.value("payload")."""
    def getPayloadCog(self) -> list[float]:
        """In coneskin: states.value("payload_cog")."""
    def getPayloadInertia(self) -> list[float]:
        """In coneskin: states.value("payload_inertia")."""
    def getRobotMode(self) -> int:
        """In coneskin: states.value("robot_mode")."""
    def getRobotStatus(self) -> int:
        """In coneskin: states.value("robot_status_bits")."""
    def getRuntimeState(self) -> int:
        """In coneskin: states.value("runtime_state")."""
    def getSafetyMode(self) -> int:
        """In coneskin: states.value("safety_mode")."""
    def getSafetyStatusBits(self) -> int:
        """In coneskin: states.value("safety_status_bits")."""
    def getSpeedScaling(self) -> float:
        """In coneskin: states.value("speed_scaling")."""
    def getSpeedScalingCombined(self) -> float:
        """In coneskin: states.value("speed_scaling")."""
    def getStandardAnalogInput0(self) -> float:
        """In coneskin: states.value("standard_analog_input0")."""
    def getStandardAnalogInput1(self) -> float:
        """In coneskin: states.value("standard_analog_input1")."""
    def getStandardAnalogOutput0(self) -> float:
        """In coneskin: states.value("standard_analog_output0")."""
    def getStandardAnalogOutput1(self) -> float:
        """In coneskin: states.value("standard_analog_output1")."""
    def getStepTime(self) -> float:
        """In coneskin: ask("getStepTime", ...); while the arm stands."""
    def getTCPOffset(self) -> list[float]:
        """In coneskin: ask("getTCPOffset", ...); while the arm stands."""
    def getTargetCurrent(self) -> list[float]:
        """In coneskin: states.value("target_current")."""
    def getTargetJointAccelerations(self) -> list[float]:
        """In coneskin: ask("getTargetJointAccelerations", ...); while the arm stands."""
    def getTargetMoment(self) -> list[float]:
        """In coneskin: states.value("target_moment")."""
    def getTargetQ(self) -> list[float]:
        """In coneskin: states.value("target_q")."""
    def getTargetQd(self) -> list[float]:
        """In coneskin: states.value("target_qd")."""
    def getTargetQdd(self) -> list[float]:
        """In coneskin: states.value("target_qdd")."""
    def getTargetSpeedFraction(self) -> float:
        """In coneskin: states.value("target_speed_fraction")."""
    def getTargetTCPPose(self) -> list[float]:
        """In coneskin: states.value("target_TCP_pose")."""
    def getTargetTCPSpeed(self) -> list[float]:
        """In coneskin: states.value("target_TCP_speed")."""
    def getTargetWaypoint(self) -> list[float]:
        """In coneskin: ask("getTargetWaypoint", ...); while the arm stands."""
    def getTimestamp(self) -> float:
        """In coneskin: states.value("timestamp")."""
    def initPeriod(self) -> timedelta:
        """In coneskin: time.monotonic."""
    def isConnected(self) -> bool:
        """In coneskin: connected."""
    def isEmergencyStopped(self) -> bool:
        """In coneskin: states.reading().safety_mode."""
    def isJointsWithinSafetyLimits(self, arg0: Sequence[float], /) -> bool:
        """In coneskin: ask("isJointsWithinSafetyLimits", ...); while the arm stands."""
    def isPoseWithinSafetyLimits(self, arg0: Sequence[float], /) -> bool:
        """In coneskin: ask("isPoseWithinSafetyLimits", ...); while the arm stands."""
    def isProgramRunning(self) -> bool:
        """In coneskin: states.reading().program_running."""
    def isProtectiveStopped(self) -> bool:
        """In coneskin: states.reading().safety_mode."""
    def isSteady(self) -> bool:
        """In coneskin: states.reading().speed; no joint faster than 0.001 rad/s."""
    @deprecated("refused: it moves on without an end if the program hangs: call speedL in a loop")
    def jogStart(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: there is no jogging to stop: call stop")
    def jogStop(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: the driver process keeps the controller's watchdog (arm.watchdog_hz); leave the call out")
    def kickWatchdog(self, *args: object, **kwargs: object) -> NoReturn: ...
    @overload
    def moveJ(self, path: Sequence[Sequence[float]], asynchronous: bool = ...) -> bool:
        """In coneskin: move_j, move_path."""
    @overload
    def moveJ(self, q: Sequence[float], speed: float = ..., acceleration: float = ..., asynchronous: bool = ...) -> bool:
        """In coneskin: move_j, move_path."""
    def moveJ_IK(self, pose: Sequence[float], speed: float = ..., acceleration: float = ..., asynchronous: bool = ...) -> bool:
        """In coneskin: move_j_ik."""
    @overload
    def moveL(self, path: Sequence[Sequence[float]], asynchronous: bool = ...) -> bool:
        """In coneskin: move_l, move_path."""
    @overload
    def moveL(self, pose: Sequence[float], speed: float = ..., acceleration: float = ..., asynchronous: bool = ...) -> bool:
        """In coneskin: move_l, move_path."""
    def moveL_FK(self, q: Sequence[float], speed: float = ..., acceleration: float = ..., asynchronous: bool = ...) -> bool:
        """In coneskin: move_l_fk."""
    @deprecated("refused: its Path is an object of the wheel that cannot be read: call move_path with a list of cs.Waypoint")
    def movePath(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: it moves until something is hit: call speedL in a loop, and read getActualTCPForce")
    def moveUntilContact(self, *args: object, **kwargs: object) -> NoReturn: ...
    def poseTrans(self, p_from: Sequence[float], p_from_to: Sequence[float]) -> list[float]:
        """In coneskin: ask("poseTrans", ...); while the arm stands."""
    @deprecated("refused: a touch that the controller notices by its motors' currents comes long after the skin's; leave the call out")
    def readContactDetection(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: a connection that is gone has stopped the arm, and a person has to look: end the session and start a new one")
    def reconnect(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: after a stop session.reset() starts it, because a person has looked; a program on the controller would replace the one that the guard stops; run it with control = external, where the guard stops whatever runs")
    def reuploadScript(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: a program on the controller would replace the one that the guard stops; run it with control = external, where the guard stops whatever runs")
    def sendCustomScript(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: a program on the controller would replace the one that the guard stops; run it with control = external, where the guard stops whatever runs")
    def sendCustomScriptFile(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: a program on the controller would replace the one that the guard stops; run it with control = external, where the guard stops whatever runs")
    def sendCustomScriptFunction(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: the wheel's own program loses what follows it, a stop included: use servoL, or moveL with blends")
    def servoC(self, *args: object, **kwargs: object) -> NoReturn: ...
    def servoJ(self, arg0: Sequence[float], arg1: float, arg2: float, arg3: float, arg4: float, arg5: float, /) -> bool:
        """In coneskin: servo_j; the arm is stopped where the next call does not come within 0.1 s, or `time`."""
    def servoL(self, arg0: Sequence[float], arg1: float, arg2: float, arg3: float, arg4: float, arg5: float, /) -> bool:
        """In coneskin: servo_l; the arm is stopped where the next call does not come within 0.1 s, or `time`."""
    def servoStop(self, a: float = ...) -> bool:
        """In coneskin: stop; each kind of motion has its own stop, whichever is called."""
    def setAnalogOutputCurrent(self, arg0: int, arg1: float, /) -> bool:
        """In coneskin: outputs.set_analog(..., "current")."""
    def setAnalogOutputVoltage(self, arg0: int, arg1: float, /) -> bool:
        """In coneskin: outputs.set_analog(..., "voltage")."""
    def setConfigurableDigitalOut(self, arg0: int, arg1: bool, /) -> bool:
        """In coneskin: outputs.set_digital(..., "configurable")."""
    @deprecated("refused: a program on the controller would replace the one that the guard stops; run it with control = external, where the guard stops whatever runs")
    def setCustomScriptFile(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: it changes what the controller's own safety system may rely on; use it in a program without the guard, or guard a program on the controller with control = external")
    def setExternalForceTorque(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: it follows from how the arm is mounted: set it in the controller's installation")
    def setGravity(self, *args: object, **kwargs: object) -> NoReturn: ...
    def setInputDoubleRegister(self, arg0: int, arg1: float, /) -> bool:
        """In coneskin: outputs.set_register."""
    def setInputIntRegister(self, arg0: int, arg1: int, /) -> bool:
        """In coneskin: outputs.set_register."""
    def setPayload(self, arg0: float, arg1: Sequence[float], /) -> bool:
        """In coneskin: set_payload; while the arm stands."""
    @deprecated("refused: the slider is a stop path of the guard: scale the speeds of the program")
    def setSpeedSlider(self, *args: object, **kwargs: object) -> NoReturn: ...
    def setStandardDigitalOut(self, arg0: int, arg1: bool, /) -> bool:
        """In coneskin: outputs.set_digital(..., "standard")."""
    @deprecated("refused: it changes the payload while the arm moves: call setPayload while it stands")
    def setTargetPayload(self, *args: object, **kwargs: object) -> NoReturn: ...
    def setTcp(self, arg0: Sequence[float], /) -> bool:
        """In coneskin: set_tcp; while the arm stands."""
    def setToolDigitalOut(self, arg0: int, arg1: bool, /) -> bool:
        """In coneskin: outputs.set_digital(..., "tool")."""
    @deprecated("refused: the driver process keeps the controller's watchdog (arm.watchdog_hz); leave the call out")
    def setWatchdog(self, *args: object, **kwargs: object) -> NoReturn: ...
    def speedJ(self, qd: Sequence[float], acceleration: float = ..., time: float = ...) -> bool:
        """In coneskin: speed_j; the arm is stopped where the next call does not come within 0.5 s, or `time` if that is longer."""
    def speedL(self, xd: Sequence[float], acceleration: float = ..., time: float = ...) -> bool:
        """In coneskin: speed_l; the arm is stopped where the next call does not come within 0.5 s, or `time` if that is longer."""
    def speedStop(self, a: float = ...) -> bool:
        """In coneskin: stop; each kind of motion has its own stop, whichever is called."""
    @deprecated("refused: a touch that the controller notices by its motors' currents comes long after the skin's; leave the call out")
    def startContactDetection(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: the session records all that it hears; for more, use an RTDEReceiveInterface beside the guard: it only reads")
    def startFileRecording(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: a touch that the controller notices by its motors' currents comes long after the skin's; leave the call out")
    def stopContactDetection(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: the session records all that it hears; for more, use an RTDEReceiveInterface beside the guard: it only reads")
    def stopFileRecording(self, *args: object, **kwargs: object) -> NoReturn: ...
    def stopJ(self, a: float = ..., asynchronous: bool = ...) -> None:
        """In coneskin: stop; never asynchronous; each kind of motion has its own stop, whichever is called."""
    def stopL(self, a: float = ..., asynchronous: bool = ...) -> None:
        """In coneskin: stop; never asynchronous; each kind of motion has its own stop, whichever is called."""
    def stopScript(self) -> None:
        """In coneskin: stop; stops the arm; the session ends the program on the controller."""
    @deprecated("refused: in it the arm moves with what pushes it, so that a stop of the guard cannot be told from it by measured speed; use it in a program without the guard, or guard a program on the controller with control = external")
    def teachMode(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: a touch that the controller notices by its motors' currents comes long after the skin's; leave the call out")
    def toolContact(self, *args: object, **kwargs: object) -> NoReturn: ...
    @deprecated("refused: only a person can unlock one: call stop, or end the session")
    def triggerProtectiveStop(self, *args: object, **kwargs: object) -> NoReturn: ...
    def waitPeriod(self, arg0: timedelta, /) -> None:
        """In coneskin: time.sleep; periods of 2 ms."""
    @deprecated("refused: it changes what the controller's own safety system may rely on; use it in a program without the guard, or guard a program on the controller with control = external")
    def zeroFtSensor(self, *args: object, **kwargs: object) -> NoReturn: ...
