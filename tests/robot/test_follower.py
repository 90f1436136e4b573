"""The program that follows speeds in registers, in the simulated controller; and who may write to them."""

import math
import time

import pytest

from coneskin.errors import RobotRefused
from coneskin.robot.commands import STILL
from coneskin.robot.follower import REGISTERS, FollowerProgram, Steer
from coneskin.robot.foreign import ForeignStops
from coneskin.robot.rtde_connection import RtdeConnection
from coneskin.robot.sim_process import SimulatedController, free_host
from coneskin.robot.state_reader import StateReader
from coneskin.robot.steering import Steering

from .test_sim_controller import Bench

QD = (0.3, -0.2, 0.1, 0.0, 0.4, -0.5)
CYCLE = 0.002


@pytest.fixture
def bench():
    made = Bench()
    made.write = lambda steer: made.controller.received(dict(zip(REGISTERS, steer.values, strict=True)))
    return made


def run(bench, seconds, steer=None):
    for number in range(round(seconds / CYCLE)):
        if steer is not None and number % 2 == 0:
            bench.write(steer)
        bench.step(1)


def speeds(bench):
    return tuple(bench.controller.arm.qd)


def test_the_arm_takes_the_speeds_at_the_acceleration_that_is_written_with_them(bench):
    bench.write(Steer(3, QD, 2.0))
    bench.send(FollowerProgram(3, 10.0, 4.0).text)
    run(bench, 0.01, Steer(3, QD, 2.0))  # until it starts
    run(bench, 0.1, Steer(3, QD, 2.0))
    assert speeds(bench)[5] == pytest.approx(-0.2, abs=0.01)  # the leading joint, 0.1 s at 2 rad/s2
    assert speeds(bench)[0] == pytest.approx(-0.6 * speeds(bench)[5])  # the others in proportion
    run(bench, 0.4, Steer(3, QD, 2.0))
    assert speeds(bench) == pytest.approx(QD)
    run(bench, 0.5, Steer(3, STILL, 2.0))
    assert speeds(bench) == pytest.approx(STILL)
    assert bench.controller.runtime.name == "PLAYING"  # it waits for the next push


@pytest.mark.parametrize("left", [0, 2, 4])
def test_speeds_of_another_movement_move_nothing(bench, left):
    bench.write(Steer(left, QD, 2.0))
    q = tuple(bench.controller.arm.q)
    bench.send(FollowerProgram(3, 10.0, 4.0).text)
    run(bench, 0.5)
    assert tuple(bench.controller.arm.q) == q
    assert bench.controller.runtime.name == "STOPPED"


def test_silence_ends_it_by_the_watchdog(bench):
    bench.write(Steer(3, QD, 2.0))
    bench.send(FollowerProgram(3, 10.0, 4.0).text)
    run(bench, 0.5, Steer(3, QD, 2.0))
    assert speeds(bench) == pytest.approx(QD)
    run(bench, 0.24)
    assert bench.controller.runtime.name == "PLAYING"
    run(bench, 0.02)
    assert bench.controller.runtime.name == "STOPPED"
    assert bench.events("stopped")[-1]["reason"] == f"watchdog of {REGISTERS[0]}"
    run(bench, 0.5)
    assert speeds(bench) == pytest.approx(STILL)


def test_a_stop_replaces_it(bench):
    bench.write(Steer(3, QD, 2.0))
    bench.send(FollowerProgram(3, 10.0, 4.0).text)
    run(bench, 0.5, Steer(3, QD, 2.0))
    bench.send("def coneskin_stop():\n  stopj(10)\nend\n")
    run(bench, 0.3, Steer(3, QD, 2.0))  # even if the guard still steers
    assert speeds(bench) == pytest.approx(STILL)
    assert bench.controller.runtime.name == "STOPPED"


# ---- the connection


@pytest.fixture
def simulated(tmp_path):
    start = [math.radians(q) for q in (0, -90, 90, -90, -90, 0)]
    with SimulatedController("UR5e", free_host(), start, log=tmp_path / "log.jsonl") as controller:
        yield controller


def test_speeds_that_the_last_guard_has_left_move_nothing(simulated):
    with Steering(simulated.host) as steering:
        assert steering.wait(2.0).running
        assert steering.steer(Steer(7, QD, 1.0))
    with Steering(simulated.host) as steering, ForeignStops(simulated.host) as stops:
        assert stops.run(FollowerProgram(7, 10.0, 4.0).text)
        end = time.monotonic() + 10.0
        while not simulated.events("stopped"):
            assert time.monotonic() < end
            assert steering.wait(2.0).speed == 0.0
        assert "watchdog" not in simulated.events("stopped")[-1]["reason"]


def test_a_register_that_another_client_has_taken_is_named(simulated):
    with RtdeConnection(simulated.host) as other:
        other.ask_inputs(("input_double_register_41",))
        with pytest.raises(RobotRefused, match=r"needs registers of .*input_double_register_41.*only stop"):
            Steering(simulated.host).__enter__()
        with StateReader(simulated.host) as reader:  # a scene that only stops needs none
            assert reader.wait(2.0).running
