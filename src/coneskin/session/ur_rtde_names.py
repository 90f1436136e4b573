"""Methods of ur_rtde on the arm of a guarded program, by their names and arguments there, or why one is refused.

A program that was written for RTDEControlInterface, RTDEReceiveInterface and RTDEIOInterface uses the arm in their
place. What moves raises ``Collision`` after a touch, where the wheel's method returned False or nothing.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import timedelta
from functools import partial, wraps
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from coneskin.core.errors import RobotRefused
from coneskin.robot.driver.values import Waypoint
from coneskin.robot.ur.ur_rtde import QUESTION_WORDS

from .arm_client import ArmClient

if TYPE_CHECKING:  # a file of stubs alone, which scripts/reference.py makes from the wheel and the tables below
    from .ur_rtde_methods import UrRtdeMethods
else:
    UrRtdeMethods = object

#: s for which a speed holds at least; a program of ur_rtde may rely on its lasting until speedStop
_SPEED_HOLD_TIME = 0.5
_SERVO_HOLD_TIME = 0.1  # s for which a position holds at least
_STEADY_SPEED = 1e-3  # rad/s
_CYCLE_TIME = 0.002  # s, of the controller
_PROTECTIVE_BIT, _EMERGENCY_BIT = 1 << 2, 1 << 7  # bits of safety_status_bits


class UrRtdeArm(ArmClient, UrRtdeMethods):
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


class _Method(NamedTuple):
    """One method of ur_rtde on the arm."""

    call: Callable[..., Any]  #: takes the arm and then the method's own arguments
    own: str  #: what coneskin calls it, for programs that are written anew
    note: str = ""  #: how it differs; empty where it does not


def _true(call: Callable[..., object]) -> Callable[..., bool]:
    """Return a call that returns True, as most methods of ur_rtde do where nothing stands against them."""

    @wraps(call)
    def answer(*values: Any, **named: Any) -> bool:
        call(*values, **named)
        return True

    return answer


# ---- moves


def _move_j(
    arm: ArmClient, q: Sequence[Any], speed: float = 1.05, acceleration: float = 1.4, asynchronous: bool = False
) -> None:
    """Move in joint space to positions [rad], in rad/s and rad/s2, or along a path of them."""
    if _is_path(q):
        arm.move_path([Waypoint.move_j(p[:6], *p[6:]) for p in q], wait=not (asynchronous or speed is True))
    else:
        arm.move_j(q, speed, acceleration, wait=not asynchronous)


def _move_l(
    arm: ArmClient, pose: Sequence[Any], speed: float = 0.25, acceleration: float = 1.2, asynchronous: bool = False
) -> None:
    """Move the tool straight to a pose [m, rad], in m/s and m/s2, or along a path of them."""
    if _is_path(pose):
        arm.move_path([Waypoint.move_l(p[:6], *p[6:]) for p in pose], wait=not (asynchronous or speed is True))
    else:
        arm.move_l(pose, speed, acceleration, wait=not asynchronous)


def _move_j_ik(
    arm: ArmClient, pose: Sequence[float], speed: float = 1.05, acceleration: float = 1.4, asynchronous: bool = False
) -> None:
    arm.move_j_ik(pose, speed, acceleration, wait=not asynchronous)


def _move_l_fk(
    arm: ArmClient, q: Sequence[float], speed: float = 0.25, acceleration: float = 1.2, asynchronous: bool = False
) -> None:
    arm.move_l_fk(q, speed, acceleration, wait=not asynchronous)


def _is_path(values: Sequence[Any]) -> bool:
    return len(values) > 0 and isinstance(values[0], Sequence)


def _speed_j(arm: ArmClient, qd: Sequence[float], acceleration: float = 0.5, time: float = 0.0) -> None:
    """Move the joints at these speeds [rad/s] for the time [s], or for ``_SPEED_HOLD_TIME`` if that is longer."""
    arm.speed_j(qd, acceleration, max(time, _SPEED_HOLD_TIME))


def _speed_l(arm: ArmClient, xd: Sequence[float], acceleration: float = 0.25, time: float = 0.0) -> None:
    """Move the tool at this velocity [m/s, rad/s] for the time [s], or for ``_SPEED_HOLD_TIME`` if that is longer."""
    arm.speed_l(xd, acceleration, max(time, _SPEED_HOLD_TIME))


def _servo_j(
    arm: ArmClient, q: Sequence[float], _speed: float, _acceleration: float, time: float, lookahead: float, gain: float
) -> None:
    """Follow joint positions [rad] for the time [s], or for ``_SERVO_HOLD_TIME`` if that is longer."""
    arm.servo_j(q, max(time, _SERVO_HOLD_TIME), lookahead, gain)


def _servo_l(
    arm: ArmClient,
    pose: Sequence[float],
    _speed: float,
    _acceleration: float,
    time: float,
    lookahead: float,
    gain: float,
) -> None:
    """Follow poses of the tool [m, rad] for the time [s], or for ``_SERVO_HOLD_TIME`` if that is longer."""
    arm.servo_l(pose, max(time, _SERVO_HOLD_TIME), lookahead, gain)


def _stop(arm: ArmClient, a: float = 10.0, asynchronous: bool = False) -> None:  # noqa: ARG001
    arm.stop(a)


def _stop_j(arm: ArmClient, a: float = 2.0, asynchronous: bool = False) -> None:  # noqa: ARG001
    """Stop the arm with a deceleration [rad/s2]; this method of ur_rtde returns nothing."""
    arm.stop(a)


class _AsyncOperationStatus(NamedTuple):
    """Answer of getAsyncOperationProgressEx: the way point to which a move goes; None where no move runs."""

    waypoint: int | None

    def isAsyncOperationRunning(self) -> bool:
        """Tell whether a move runs."""
        return self.waypoint is not None

    def progress(self) -> int:
        """Return the number of the way point, from 0."""
        return self.waypoint or 0


# ---- set, ask, read


def _set_payload(arm: ArmClient, mass: float, cog: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
    arm.set_payload(mass, cog)


def _ask(name: str) -> _Method:
    return _Method(lambda arm, *values: arm.ask(name, *values), f'ask("{name}", ...)', "while the arm stands")


def _read(variable: str) -> _Method:

    def read(arm: ArmClient) -> Any:
        value = arm.states.value(variable)
        return list(value) if isinstance(value, tuple) else value

    return _Method(read, f'states.value("{variable}")')


def _bit(variable: str) -> Callable[[ArmClient, int], bool]:
    return lambda arm, n: bool(arm.states.value(variable) >> n & 1)


def _read_register(name: str) -> _Method:
    return _Method(lambda arm, n: arm.states.value(f"{name}_{n}"), f'states.value("{name}_...")')


def _is_stopped(bit: int) -> _Method:
    return _Method(lambda arm: bool(arm.states.value("safety_status_bits") & bit), "states.reading().safety_mode")


def _set_digital(group: str) -> _Method:
    switch = _true(lambda arm, number, on: arm.outputs.set_digital(number, on, group))
    return _Method(switch, f'outputs.set_digital(..., "{group}")')


def _set_analog(kind: str) -> _Method:
    """Return the method that sets analog outputs of a kind, as ratios from 0 to 1."""
    set_ratio = _true(lambda arm, number, ratio: arm.outputs.set_analog(number, ratio, kind))
    return _Method(set_ratio, f'outputs.set_analog(..., "{kind}")')


def _set_register(number_type: type) -> _Method:
    write = _true(lambda arm, number, value: arm.outputs.set_register(number, number_type(value)))
    return _Method(write, "outputs.set_register")


def _wait_period(_: ArmClient, t_cycle_start: timedelta) -> None:
    """Wait until a control cycle of 2 ms is over since its beginning."""
    time.sleep(max(0.0, t_cycle_start.total_seconds() + _CYCLE_TIME - time.monotonic()))


# ---- by name

_READ_VARIABLES = """
    timestamp actual_execution_time actual_q actual_qd actual_current target_q target_qd target_qdd
    target_current target_moment actual_TCP_pose actual_TCP_speed target_TCP_pose target_TCP_speed
    actual_TCP_force ft_raw_wrench actual_tool_accelerometer actual_momentum joint_control_output joint_mode
    joint_temperatures actual_joint_voltage actual_main_voltage actual_robot_voltage actual_robot_current
    robot_mode runtime_state safety_mode safety_status_bits speed_scaling target_speed_fraction
    actual_digital_input_bits actual_digital_output_bits standard_analog_input0 standard_analog_input1
    standard_analog_output0 standard_analog_output1 payload payload_cog payload_inertia
"""
#: name of a getter -> the variable that it reads: getActualQ reads actual_q
_GETTER_VARIABLES = {
    "get" + "".join(word[0].upper() + word[1:] for word in variable.split("_")): variable
    for variable in _READ_VARIABLES.split()
} | {"getRobotStatus": "robot_status_bits"}
_SPEED_NOTE = (
    f"the arm is stopped where the next call does not come within {_SPEED_HOLD_TIME:g} s, or `time` if that is longer"
)
_SERVO_NOTE = f"the arm is stopped where the next call does not come within {_SERVO_HOLD_TIME:g} s, or `time`"
_STOP_NOTE = "each kind of motion has its own stop, whichever is called"

#: name in ur_rtde -> what answers it
NAMES: Mapping[str, _Method] = MappingProxyType(
    {
        "moveJ": _Method(_true(_move_j), "move_j, move_path"),
        "moveJ_IK": _Method(_true(_move_j_ik), "move_j_ik"),
        "moveL": _Method(_true(_move_l), "move_l, move_path"),
        "moveL_FK": _Method(_true(_move_l_fk), "move_l_fk"),
        "speedJ": _Method(_true(_speed_j), "speed_j", _SPEED_NOTE),
        "speedL": _Method(_true(_speed_l), "speed_l", _SPEED_NOTE),
        "servoJ": _Method(_true(_servo_j), "servo_j", _SERVO_NOTE),
        "servoL": _Method(_true(_servo_l), "servo_l", _SERVO_NOTE),
        "speedStop": _Method(_true(_stop), "stop", _STOP_NOTE),
        "servoStop": _Method(_true(_stop), "stop", _STOP_NOTE),
        "stopJ": _Method(_stop_j, "stop", f"never asynchronous; {_STOP_NOTE}"),
        "stopL": _Method(_true(_stop), "stop", f"never asynchronous; {_STOP_NOTE}"),
        "stopScript": _Method(_true(_stop), "stop", "stops the arm; the session ends the program on the controller"),
        "getAsyncOperationProgress": _Method(lambda arm: -1 if (at := arm.progress()) is None else at, "progress"),
        "getAsyncOperationProgressEx": _Method(
            lambda arm: _AsyncOperationStatus(arm.progress()), "progress", "isAsyncOperationRunning and progress alone"
        ),
        "setTcp": _Method(_true(ArmClient.set_tcp), "set_tcp", "while the arm stands"),
        "setPayload": _Method(_true(_set_payload), "set_payload", "while the arm stands"),
        **{name: _ask(name) for name in QUESTION_WORDS},
        "isSteady": _Method(
            lambda arm: arm.states.reading().speed < _STEADY_SPEED,
            *("states.reading().speed", f"no joint faster than {_STEADY_SPEED:g} rad/s"),
        ),
        "isProgramRunning": _Method(
            lambda arm: arm.states.reading().program_running, "states.reading().program_running"
        ),
        "isProtectiveStopped": _is_stopped(_PROTECTIVE_BIT),
        "isEmergencyStopped": _is_stopped(_EMERGENCY_BIT),
        **{name: _read(variable) for name, variable in _GETTER_VARIABLES.items()},
        "getSpeedScalingCombined": _Method(
            lambda arm: math.prod(map(arm.states.value, ("speed_scaling", "target_speed_fraction"))),
            'states.value("speed_scaling")',
        ),
        "getDigitalInState": _Method(_bit("actual_digital_input_bits"), "states.reading().digital_input"),
        "getDigitalOutState": _Method(_bit("actual_digital_output_bits"), "states.reading().digital_output"),
        "getOutputIntRegister": _read_register("output_int_register"),
        "getOutputDoubleRegister": _read_register("output_double_register"),
        "setStandardDigitalOut": _set_digital("standard"),
        "setConfigurableDigitalOut": _set_digital("configurable"),
        "setToolDigitalOut": _set_digital("tool"),
        "setAnalogOutputVoltage": _set_analog("voltage"),
        "setAnalogOutputCurrent": _set_analog("current"),
        "setInputIntRegister": _set_register(int),
        "setInputDoubleRegister": _set_register(float),
        "initPeriod": _Method(lambda _: timedelta(seconds=time.monotonic()), "time.monotonic"),
        "waitPeriod": _Method(_wait_period, "time.sleep", "periods of 2 ms"),
        "isConnected": _Method(lambda arm: arm.connected, "connected"),
        "disconnect": _Method(lambda arm: arm.close(), "close", "the arm stays guarded until the session ends"),
    }
)

# ---- refused

_BY_HAND = "use it in a program without the guard, or guard a program on the controller with control = external"
_FORCE_REASON = (
    "in it the arm moves with what pushes it, so that a stop of the guard cannot be told from it by measured speed; "
    + _BY_HAND
)
_PROGRAM_REASON = (
    "a program on the controller would replace the one that the guard stops; run it with control = external, where the "
    "guard stops whatever runs"
)
#: why methods are refused that need more words or are several, and what to do -> their names in ur_rtde
_SHARED_REASONS = {
    _FORCE_REASON: "forceMode freedriveMode teachMode",
    "there is no force mode to set up: leave the call out": "forceModeSetDamping forceModeSetGainScaling",
    "a touch that the controller notices by its motors' currents comes long after the skin's; leave the call out": (
        "startContactDetection stopContactDetection readContactDetection toolContact"
    ),
    f"it changes what the controller's own safety system may rely on; {_BY_HAND}": (
        "zeroFtSensor enableExternalFtSensor ftRtdeInputEnable setExternalForceTorque"
    ),
    "the driver process keeps the controller's watchdog (arm.watchdog_hz); leave the call out": (
        "setWatchdog kickWatchdog"
    ),
    _PROGRAM_REASON: "sendCustomScript sendCustomScriptFile sendCustomScriptFunction setCustomScriptFile",
    "a connection that is gone has stopped the arm, and a person has to look: end the session and start a new one": (
        "reconnect"
    ),
    "the session records all that it hears; for more, use an RTDEReceiveInterface beside the guard: it only reads": (
        "startFileRecording stopFileRecording"
    ),
}

#: name in ur_rtde -> why it is refused, and what to do
REFUSALS: Mapping[str, str] = MappingProxyType(
    {
        "movePath": "its Path is an object of the wheel that cannot be read: call move_path with a list of cs.Waypoint",
        "servoC": "the wheel's own program loses what follows it, a stop included: use servoL, or moveL with blends",
        "moveUntilContact": "it moves until something is hit: call speedL in a loop, and read getActualTCPForce",
        "jogStart": "it moves on without an end if the program hangs: call speedL in a loop",
        "jogStop": "there is no jogging to stop: call stop",
        "directTorque": f"it moves the arm by torques alone; {_FORCE_REASON}",
        "forceModeStop": "there is no force mode to stop: leave the call out",
        "endFreedriveMode": "there is no freedrive to end: leave the call out",
        "getFreedriveStatus": "there is no freedrive: leave the call out",
        "endTeachMode": "there is no teach mode to end: leave the call out",
        "setGravity": "it follows from how the arm is mounted: set it in the controller's installation",
        "setTargetPayload": "it changes the payload while the arm moves: call setPayload while it stands",
        "setSpeedSlider": "the slider is a stop path of the guard: scale the speeds of the program",
        "triggerProtectiveStop": "only a person can unlock one: call stop, or end the session",
        "reuploadScript": f"after a stop session.reset() starts it, because a person has looked; {_PROGRAM_REASON}",
        **{name: why for why, names in _SHARED_REASONS.items() for name in names.split()},
        "unlockProtectiveStop": "no protective stop is ever unlocked by a program: a person does it on the pendant",
    }
)
