"""Setpoint program in the simulated controller, and which client may write to its registers."""

import time

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.robot.arm.models import ZERO_VELOCITY
from coneskin.robot.driver.values import JointVelocitySetpoint, SetpointProgram
from coneskin.robot.ur.input_writers import (
    SETPOINT_INPUTS,
    SLIDER_INPUTS,
    RegisterWriter,
    RtdeSpeedSlider,
    _register_values,
    decode_fraction,
    program_text,
    set_slider,
)
from coneskin.robot.ur.rtde_connection import RtdeConnection, StateReader
from coneskin.robot.ur.stop_sockets import StopSockets
from tests.robot.sim.machine.test_controller import Bench
from tests.support.served_controller import served

QD = (0.3, -0.2, 0.1, 0.0, 0.4, -0.5)
CYCLE = 0.002
PATIENCE = 60.0  # s; a slow machine is no failure


@pytest.fixture
def bench():
    made = Bench()

    def write(setpoint):
        made.controller.write_inputs(dict(zip(SETPOINT_INPUTS, _register_values(setpoint), strict=True)))

    made.write = write
    return made


def run(bench, seconds, setpoint=None):
    for number in range(round(seconds / CYCLE)):
        if setpoint is not None and number % 2 == 0:
            bench.write(setpoint)
        bench.step(1)


def speeds(bench):
    return tuple(bench.controller.arm.qd)


def test_the_arm_takes_the_speeds_at_the_acceleration_that_is_written_with_them(bench):
    bench.write(JointVelocitySetpoint(3, QD, 2.0))
    bench.send(program_text(SetpointProgram(3, 10.0, 4.0)))
    run(bench, 0.01, JointVelocitySetpoint(3, QD, 2.0))  # until it starts
    run(bench, 0.1, JointVelocitySetpoint(3, QD, 2.0))
    assert speeds(bench)[5] == pytest.approx(-0.2, abs=0.01)  # the leading joint, 0.1 s at 2 rad/s2
    assert speeds(bench)[0] == pytest.approx(-0.6 * speeds(bench)[5])  # the others in proportion
    run(bench, 0.4, JointVelocitySetpoint(3, QD, 2.0))
    assert speeds(bench) == pytest.approx(QD)
    run(bench, 0.5, JointVelocitySetpoint(3, ZERO_VELOCITY, 2.0))
    assert speeds(bench) == pytest.approx(ZERO_VELOCITY)
    assert bench.controller.runtime.name == "PLAYING"  # it waits for the next push


@pytest.mark.parametrize("left", [0, 2, 4])
def test_speeds_of_another_movement_move_nothing(bench, left):
    bench.write(JointVelocitySetpoint(left, QD, 2.0))
    q = tuple(bench.controller.arm.q)
    bench.send(program_text(SetpointProgram(3, 10.0, 4.0)))
    run(bench, 0.5)
    assert tuple(bench.controller.arm.q) == q
    assert bench.controller.runtime.name == "STOPPED"


@pytest.mark.promise("P43")
def test_silence_ends_it_by_the_watchdog(bench):
    bench.write(JointVelocitySetpoint(3, QD, 2.0))
    bench.send(program_text(SetpointProgram(3, 10.0, 4.0)))
    run(bench, 0.5, JointVelocitySetpoint(3, QD, 2.0))
    assert speeds(bench) == pytest.approx(QD)
    run(bench, 0.24)
    assert bench.controller.runtime.name == "PLAYING"
    run(bench, 0.02)
    assert bench.controller.runtime.name == "STOPPING"  # until the arm stands
    assert bench.events("stopped")[-1]["reason"] == f"watchdog of {SETPOINT_INPUTS[0]}"
    run(bench, 0.5)
    assert bench.controller.runtime.name == "STOPPED"
    assert speeds(bench) == pytest.approx(ZERO_VELOCITY)


def test_a_stop_replaces_it(bench):
    bench.write(JointVelocitySetpoint(3, QD, 2.0))
    bench.send(program_text(SetpointProgram(3, 10.0, 4.0)))
    run(bench, 0.5, JointVelocitySetpoint(3, QD, 2.0))
    bench.send("def coneskin_stop():\n  stopj(10)\nend\n")
    run(bench, 0.3, JointVelocitySetpoint(3, QD, 2.0))  # even if the guard still sends setpoints
    assert speeds(bench) == pytest.approx(ZERO_VELOCITY)
    assert bench.controller.runtime.name == "STOPPED"


# ---- the connection


@pytest.fixture(scope="module")
def simulated():
    with served() as controller:
        yield controller


def test_speeds_that_the_last_guard_has_left_move_nothing(simulated):
    with RegisterWriter(simulated.host, PATIENCE) as writer:
        assert writer.wait(PATIENCE).powered
        assert writer.write(JointVelocitySetpoint(7, QD, 1.0))
    with RegisterWriter(simulated.host, PATIENCE) as writer, StopSockets(simulated.host, PATIENCE) as stops:
        assert stops.run(program_text(SetpointProgram(7, 10.0, 4.0)))
        end = time.monotonic() + PATIENCE
        while not simulated.events("stopped"):
            assert time.monotonic() < end
            assert writer.wait(PATIENCE).speed == 0.0
        assert "watchdog" not in simulated.events("stopped")[-1]["reason"]


def test_the_slider_belongs_to_others_until_a_stop_takes_it(simulated):
    with RtdeSpeedSlider(simulated.host, PATIENCE, claim=False) as slider:
        with RtdeConnection(simulated.host, PATIENCE) as other:
            assert other.send(other.ask_inputs(SLIDER_INPUTS), (1, 0.5))
            while decode_fraction(slider.wait_data(PATIENCE)) != 0.5:
                pass
            with pytest.raises(RobotRefused, match="the speed slider of"):
                RtdeSpeedSlider(simulated.host, PATIENCE, claim=False).__enter__()
        while True:  # the controller notices the end of the other connection in its own time
            assert slider.set(0.0)
            if decode_fraction(slider.wait_data(PATIENCE)) == 0.0:
                break
            slider._claimed = False
        with RtdeConnection(simulated.host, PATIENCE) as other, pytest.raises(RobotRefused, match="in use"):
            other.ask_inputs(SLIDER_INPUTS)
    assert set_slider(simulated.host, 1.0, PATIENCE)


def test_a_register_that_another_client_has_taken_is_named(simulated):
    with RtdeConnection(simulated.host, PATIENCE) as other:
        other.ask_inputs(("input_double_register_41",))
        with pytest.raises(RobotRefused, match=r"needs registers of .*input_double_register_41.*only stop"):
            RegisterWriter(simulated.host, PATIENCE).__enter__()
        with StateReader(simulated.host, PATIENCE) as reader:  # a scene that only stops needs none
            assert reader.wait(PATIENCE).powered
