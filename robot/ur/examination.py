"""Examination of a UR controller: ports, model, state, registers, slider, latency, stops.

It moves nothing; a test program of one line writes an output register.

Registers are only asked for and given back: RTDE gives each to one client, and what another one holds is named here
rather than at the start of the guard. An EtherNet/IP or PROFINET adapter that is enabled on the controller holds the
lower half of the registers, which is the half of ur_rtde.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Any

from coneskin.core.channel import wait_readable
from coneskin.core.errors import ConeSkinError, RobotRefused
from coneskin.core.finding import Finding, Verdict
from coneskin.robot.arm.inertia import arm_inertia, highest_acceleration, loaded
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.protocol import ExaminationScope

from .input_writers import HEARTBEAT_INPUTS, SETPOINT_INPUTS, SLIDER_INPUTS
from .model_check import check_model, read_pose
from .rtde_codec import decode_state
from .rtde_connection import RtdeConnection, StateReader
from .stop_sockets import StopSockets

_REPLY_TIMEOUT = 1.5  # s for connecting, and for each reply
_LISTEN_TIME = 1.0  # s of states
_MAX_LATENESS, _MAX_GAP = 1.25, 0.025  # times the control cycle, of the median between two states; s, of the longest
_STRETCHED = (0.0,) * 6  # rad; where a joint carries most
_CB3_MAJOR = 3  # major version of its software, which has a cycle of 8 ms and no local control
_CONTROL_INPUTS = ("input_int_register_0", *(f"input_double_register_{number}" for number in range(6)))  # of ur_rtde
_FREE_REMEDY = (
    "end the other program; or disable EtherNet/IP, PROFINET and MODBUS in the controller's Installation, Fieldbus"
)


def examine(arm: ArmModel, host: str, scope: ExaminationScope) -> list[Finding]:
    """Look at a controller; what cannot be tried says why.

    Args:
        arm: that the scene names.
        scope: what the scene needs of it.
    """
    try:
        with RtdeConnection(host, _REPLY_TIMEOUT) as connection:
            major, minor = connection.ask_version()
    except ConeSkinError as exc:
        rest = ("model", "state", "registers", "latency", "stops")
        wanted, remedy = f"{host}:{RtdeConnection.port} answers", "for a simulated one: coneskin sim-ur"
        return [
            Finding("arm, RTDE", "bad", str(exc), wanted, remedy),
            *(Finding(f"arm, {item}", "not tried", "no controller answers") for item in rest),
        ]
    found = [Finding("arm, RTDE", "ok", f"{host}:{RtdeConnection.port} answers, software {major}.{minor}")]
    found += _tried("arm, model", lambda: _model(arm, host))
    found += _tried("arm, state", lambda: list(_state(host, 0.008 if major == _CB3_MAJOR else 0.002)))
    found += _tried("arm, braking", lambda: _braking(arm, host, scope.deceleration))
    found += _tried("arm, stops", lambda: _stops(host))
    found += list(_registers(host, scope))
    return found


def _tried(item: str, look: Callable[[], list[Finding]]) -> list[Finding]:
    try:
        return look()
    except ConeSkinError as exc:
        return [Finding(item, "bad", str(exc))]


def _model(arm: ArmModel, host: str) -> list[Finding]:
    pose = read_pose(host, _REPLY_TIMEOUT)
    if pose is None:
        return [Finding("arm, model", "not tried", "an old controller, which does not report its TCP's offset")]
    try:
        check_model(arm, pose, host)
    except RobotRefused as exc:
        return [Finding("arm, model", "bad", str(exc), "the scene's model has the flange where the controller has it")]
    return [Finding("arm, model", "ok", f"the flange is where a {arm.name} has it")]


def _braking(arm: ArmModel, host: str, wanted: float) -> list[Finding]:
    """Compare a stop's deceleration [rad/s2] with the arm's motors, stretched out with the payload that it is told."""
    payload: Any = 0.0
    with RtdeConnection(host, _REPLY_TIMEOUT) as connection, suppress(RobotRefused):  # an old one does not tell it
        recipe = connection.ask_outputs(("payload",))
        connection.start()
        (payload,) = recipe.unpack(connection.wait_data(_REPLY_TIMEOUT))
    inertia, still, joints = loaded(arm_inertia(arm), payload, (0.0, 0.0, 0.0)), (0.0,) * arm.joints, range(arm.joints)
    directions = [[sign * float(i == joint) for i in joints] for joint in joints for sign in (1.0, -1.0)]
    held = min(highest_acceleration(arm, inertia, _STRETCHED, still, direction) for direction in directions)
    value = f"stretched out with {payload:g} kg, its motors brake with {held:.1f} rad/s2"
    remedy = (
        f"deceleration_rad_s2 = {max(0.5, held):.1f} in [reaction]; else such a stop takes longer than the guard allows"
    )
    fits = held >= wanted
    return [Finding("arm, braking", "ok" if fits else "warning", value, f"{wanted:g} rad/s2", "" if fits else remedy)]


def _stops(host: str) -> list[Finding]:
    """Prove the stop paths as a guard does at its start."""
    start = time.monotonic()
    with StopSockets(host, _REPLY_TIMEOUT):
        value = f"secondary programs and commands are taken, in {1e3 * (time.monotonic() - start):.0f} ms"
        return [Finding("arm, stops", "ok", value)]


def _state(host: str, cycle: float) -> Iterator[Finding]:
    """Look at the newest state, and at the times at which states come, each control cycle [s]."""
    times: list[float] = []
    with StateReader(host, _REPLY_TIMEOUT) as reader:
        state = reader.wait(_REPLY_TIMEOUT)
        end = time.monotonic() + _LISTEN_TIME
        while (now := time.monotonic()) < end:
            wait_readable([reader], end - now)
            for payload in reader.read():
                state = decode_state(time.monotonic(), payload)
                times.append(state.time)
    power = "on, its brakes released" if state.powered else "not running"
    remedy = "" if state.powered else "power it on and release its brakes on the pendant"
    yield Finding("arm, power", "ok" if state.powered else "bad", power, "running", remedy)
    stopped = state.stopped_by_safety
    remedy = "clear it on the pendant; coneskin unlocks nothing" if stopped else ""
    value = "a protective, safeguard or emergency stop is in force" if stopped else "no stop is in force"
    yield Finding("arm, safety", "bad" if stopped else "ok", value, "", remedy)
    steps = [b - a for a, b in pairwise(times)]
    if len(steps) < 20:
        value = f"{len(times)} states in {_LISTEN_TIME:g} s"
        yield Finding("arm, latency", "bad", value, f"{1.0 / cycle:g} a second", "a wired network")
        return
    middle, longest = statistics.median(steps), max(steps)
    verdict: Verdict = "ok" if middle <= _MAX_LATENESS * cycle and longest <= _MAX_GAP else "warning"
    remedy = "" if verdict == "ok" else "a cable of its own, no wireless network, a quieter computer"
    value = f"a state each {1e3 * middle:.2f} ms (median), the longest gap {1e3 * longest:.1f} ms"
    yield Finding("arm, latency", verdict, value, f"{1e3 * _MAX_LATENESS * cycle:g} ms, {1e3 * _MAX_GAP:g} ms", remedy)


def _registers(host: str, scope: ExaminationScope) -> Iterator[Finding]:
    """Ask for the inputs that the scene needs, and give them back."""
    wanted: list[tuple[str, bool, Sequence[str]]] = [
        ("ur_rtde's registers", scope.control, _CONTROL_INPUTS),
        ("the speed slider", scope.slider, SLIDER_INPUTS),
        ("the setpoints' registers", scope.setpoints, SETPOINT_INPUTS),
        ("the heartbeat's register", scope.heartbeat, HEARTBEAT_INPUTS),
    ]
    for what, needed, names in wanted:
        item = f"arm, {what}"
        if not needed:
            yield Finding(item, "not tried", "not needed by this scene")
            continue
        try:
            with RtdeConnection(host, _REPLY_TIMEOUT) as connection:
                connection.ask_inputs(names)
        except ConeSkinError as exc:
            yield Finding(item, "bad", str(exc), "no other client has them", _FREE_REMEDY)
        else:
            yield Finding(item, "ok", "free")
