"""Contract of every driver of an arm: what a guard relies on, as checks for whoever writes one.

    @pytest.mark.parametrize("check", ARM_CHECKS, ids=lambda check: check.__name__)
    def test_my_arm(check):
        check(open_arm)

``open_arm`` returns a context manager of an `ArmOnTest`: the driver, an arm or its twin, and a hand on both. Each check
raises AssertionError where the driver breaks the contract. The checks need the first tier only.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

from coneskin.core.channel import wait_readable
from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.driver.protocol import ArmDriver, PayloadReader
from coneskin.robot.driver.values import ControllerState, StopPath

from . import expect_error

_CHECK_TIMEOUT = 20.0  # s; far beyond what a controller needs, so reached only where the contract is broken
_MOTION_SPEED = 0.1  # rad/s of the leading joint, from which on the arm moves
_STANDSTILL_SPEED = 0.02  # rad/s
_STANDING_STATES = 25  # in a row
_MAX_STEP = 0.05  # s from state to state
_STOP_DECELERATION = 4.0  # rad/s2


@dataclass(frozen=True, slots=True)
class ArmOnTest:
    """An arm, or its twin, whose controller a driver talks to.

    Attributes:
        move: lets a joint move faster than 0.1 rad/s for seconds, as a program beside the guard does.
        pull: takes the controller off the network, as a power cut does.
    """

    driver: ArmDriver
    model: ArmModel
    host: str
    move: Callable[[], None]
    pull: Callable[[], None]

    def states(self, reader: PayloadReader) -> list[ControllerState]:
        """Return the next states, at least one."""
        end = time.monotonic() + _CHECK_TIMEOUT
        while time.monotonic() < end:
            wait_readable([reader], 0.1)
            if payloads := reader.read():
                return [self.driver.decode_state(time.monotonic(), payload) for payload in payloads]
        raise AssertionError(f"the reader brings no state within {_CHECK_TIMEOUT:g} s")

    def wait(self, reader: PayloadReader, standing: bool) -> list[ControllerState]:
        """Return the states until the arm moves, or until it stands."""
        seen: list[ControllerState] = []
        in_row, end = 0, time.monotonic() + _CHECK_TIMEOUT
        while time.monotonic() < end:
            for state in self.states(reader):
                seen.append(state)
                met = state.speed < _STANDSTILL_SPEED if standing else state.speed > _MOTION_SPEED
                in_row = in_row + 1 if met else 0
                if in_row >= _STANDING_STATES:
                    return seen
        raise AssertionError(f"the arm {'still moves' if standing else 'does not move'} after {_CHECK_TIMEOUT:g} s")


OpenArm = Callable[[], AbstractContextManager[ArmOnTest]]


def _paths(driver: ArmDriver) -> frozenset[StopPath]:
    return frozenset[StopPath]().union(*driver.lost_with.values())


def _check_states_carry_time_and_joint_speeds(open_arm: OpenArm) -> None:
    """Check that the controller's clock goes on, and that the speeds are those at which the positions change."""
    with open_arm() as arm, arm.driver.state_reader(arm.host, _CHECK_TIMEOUT) as reader:
        arm.move()
        states = arm.wait(reader, standing=False)[-_STANDING_STATES:]
    times = [state.controller_time for state in states]
    assert all(a < b for a, b in pairwise(times)), f"controller_time must rise in each: {times}"
    for state in states:
        sizes = {len(state.q), len(state.qd)}
        assert sizes == {arm.model.joints}, f"q and qd must be {arm.model.joints} numbers, got {sizes}"
        assert math.isfinite(sum((*state.q, *state.qd))), f"a position or speed is not finite: {state}"
        assert state.powered, "powered must be true of an arm that moves"
    # a computer that is held up makes a gap, in which nobody knows the speeds
    steps = [(a, b) for a, b in pairwise(states) if b.controller_time - a.controller_time < _MAX_STEP]
    assert steps, f"states must come less than {_MAX_STEP} s apart: {times}"
    for joint in range(arm.model.joints):
        moved = sum(b.q[joint] - a.q[joint] for a, b in steps)
        meant = sum(0.5 * (a.qd[joint] + b.qd[joint]) * (b.controller_time - a.controller_time) for a, b in steps)
        assert abs(moved - meant) <= 0.1 * abs(meant) + 2e-3, (
            f"joint {joint + 1}: moved {moved} rad, speeds say {meant}"
        )


def _check_each_stop_path_stops_the_arm(open_arm: OpenArm) -> None:
    """Check that every path of ``lost_with`` brings the moving arm to a measured standstill, and stays there."""
    with open_arm() as arm:
        paths = _paths(arm.driver)
    assert paths, "lost_with must name a stop path"
    for path in sorted(paths, key=lambda path: path.value):
        with (
            open_arm() as arm,
            arm.driver.state_reader(arm.host, _CHECK_TIMEOUT) as reader,
            arm.driver.stop_connections(arm.host, _CHECK_TIMEOUT) as stops,
        ):
            assert set(stops.sockets()) <= set(arm.driver.lost_with), "each socket needs a row in lost_with"
            arm.move()
            arm.wait(reader, standing=False)
            assert stops.use(path, _STOP_DECELERATION), f"{path} was not taken"
            arm.wait(reader, standing=True)


def _check_a_path_that_there_is_not_is_refused(open_arm: OpenArm) -> None:
    """Check that ``use`` tells of a path that the driver does not have."""
    with open_arm() as arm, arm.driver.stop_connections(arm.host, _CHECK_TIMEOUT) as stops:
        for path in frozenset(StopPath) - _paths(arm.driver) - {StopPath.DRIVER, StopPath.WATCHDOG}:
            assert not stops.use(path, _STOP_DECELERATION), f"{path} is in no row of lost_with, and use took it"


def _check_nonsense_is_an_error(open_arm: OpenArm) -> None:
    with open_arm() as arm, arm.driver.state_reader(arm.host, _CHECK_TIMEOUT) as reader:
        payloads: list[bytes] = []
        while not payloads:
            wait_readable([reader], _CHECK_TIMEOUT)
            payloads = reader.read()
    for payload in (b"", payloads[0][:-1], payloads[0] + b"\0", b"\xff" * len(payloads[0])):
        takes = f"decode_state takes {payload[:40]!r} for a state"
        expect_error(RobotConnectionError, partial(arm.driver.decode_state, 0.0, payload), takes)


def _check_the_arm_of_another_table_is_refused(open_arm: OpenArm) -> None:
    """Check that ``check_model`` takes the arm, and refuses one whose first joint is 0.3 m higher."""
    with open_arm() as arm:
        arm.driver.check_model(arm.model, arm.host)
        higher = replace(arm.model, d=(arm.model.d[0] + 0.3, *arm.model.d[1:]))
        takes = "check_model takes another arm for the scene's"
        expect_error(RobotRefused, partial(arm.driver.check_model, higher, arm.host), takes)


def _check_a_lost_controller_is_an_error_and_stays_one(open_arm: OpenArm) -> None:
    """Check that a controller that is gone is told of by the reader and by the stops: it must not look like silence."""
    with open_arm() as arm, arm.driver.state_reader(arm.host, _CHECK_TIMEOUT) as reader:
        with arm.driver.stop_connections(arm.host, _CHECK_TIMEOUT) as stops:
            names = set(stops.sockets())
            arm.pull()
            with suppress(RobotConnectionError):
                while True:  # what had arrived before
                    arm.states(reader)
            _expect_connection_error("read", reader.read)
            lost: set[str] = set()
            end = time.monotonic() + _CHECK_TIMEOUT
            while lost != names and time.monotonic() < end:
                wait_readable(list(stops.sockets().values()), 0.1)
                for name, sock, why in stops.drain():
                    assert why, "drain must say why"
                    sock.close()
                    lost.add(name)
            assert lost == names, f"drain did not tell of {names - lost}"
            assert not stops.reopen(), "reopen must tell that nothing was opened"
            assert not any(stops.use(path, _STOP_DECELERATION) for path in _paths(arm.driver)), "a stop went nowhere"
        _expect_connection_error("state_reader", lambda: arm.driver.state_reader(arm.host, 0.5).__enter__())
        _expect_connection_error("stop_connections", lambda: arm.driver.stop_connections(arm.host, 0.5).__enter__())


def _check_closing_twice_is_fine_and_reading_then_is_not(open_arm: OpenArm) -> None:
    with (
        open_arm() as arm,
        arm.driver.state_reader(arm.host, _CHECK_TIMEOUT) as reader,
        arm.driver.stop_connections(arm.host, _CHECK_TIMEOUT) as stops,
    ):
        for _ in range(2):
            reader.close()
            stops.close()
        assert not stops.sockets()
        assert reader.fileno() == -1
        _expect_connection_error("read", reader.read)


def _expect_connection_error(name: str, call: Callable[[], object]) -> None:
    otherwise = f"{name} must raise RobotConnectionError where the controller is gone"
    expect_error(RobotConnectionError, call, otherwise)


#: Every check, in the order in which a driver is written.
ARM_CHECKS: tuple[Callable[[OpenArm], None], ...] = (
    _check_states_carry_time_and_joint_speeds,
    _check_nonsense_is_an_error,
    _check_each_stop_path_stops_the_arm,
    _check_a_path_that_there_is_not_is_refused,
    _check_the_arm_of_another_table_is_refused,
    _check_a_lost_controller_is_an_error_and_stays_one,
    _check_closing_twice_is_fine_and_reading_then_is_not,
)
