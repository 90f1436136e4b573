"""A plant that is lost, and measurements that are not the targets: what the controller makes of them."""

from __future__ import annotations

import io
import json
import struct

import pytest

from coneskin.core.channel import Channel, pair
from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.machine.states import START_Q, Options
from coneskin.robot.sim.motion.arm import CYCLE
from coneskin.robot.sim.motion.motion import SpeedJoints
from coneskin.robot.sim.motion.plant import (
    _MAX_LAG,
    PlantLost,
    PlantState,
    RemotePlant,
    decode_targets,
    encode_state,
)
from coneskin.robot.sim.ports.client_interface import _encode_realtime
from coneskin.robot.sim.ports.rtde import RtdeOutputs
from coneskin.robot.ur.rtde_codec import RobotMode, SafetyMode

ELSEWHERE = PlantState(
    (0.1, -1.0, 1.0, -1.0, -1.0, 0.2), (0.3, 0.0, 0.0, 0.0, 0.0, 0.0), (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
)
QD = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]
MODEL = arm_model("UR3e")  # whose wrists are faster than its base
FARTHEST = [10.0 * CYCLE * speed for speed in MODEL.joint_speed]  # that a joint can go in a cycle [rad]


class OddPlant:
    """Plant that measures the same whatever is commanded, until it is lost."""

    def __init__(self) -> None:
        self.lost = False
        self.closed = 0

    def update(self, q, qd):  # type: ignore[no-untyped-def]
        if self.lost:
            raise PlantLost("it fell off")
        return ELSEWHERE

    def close(self) -> None:
        self.closed += 1


@pytest.fixture
def moving() -> tuple[Controller, OddPlant, io.StringIO]:
    plant, log = OddPlant(), io.StringIO()
    controller = Controller(Options("UR5e"), log, plant)
    controller.arm.motion = SpeedJoints(QD, 10.0)
    for _ in range(20):
        controller.update()
        controller.arm.motion = SpeedJoints(QD, 10.0)
    return controller, plant, log


def test_what_is_measured_is_the_plant_and_what_is_the_target_is_not(moving) -> None:  # type: ignore[no-untyped-def]
    controller, _, _ = moving
    outputs = RtdeOutputs(controller)
    assert outputs.getter("actual_q")() == ELSEWHERE.q
    assert outputs.getter("actual_qd")() == ELSEWHERE.qd
    assert outputs.getter("target_q")() == controller.arm.q
    assert controller.arm.q[0] != ELSEWHERE.q[0]
    controller.resistance[0] = 0.5
    assert list(outputs.getter("actual_current")()) == [1.5, 2.0, 3.0, 0.0, 0.0, 0.0]
    assert outputs.getter("actual_TCP_pose")() != outputs.getter("target_TCP_pose")()
    assert outputs.getter("actual_TCP_speed")() != outputs.getter("target_TCP_speed")()
    packet = struct.unpack_from(">6d", _encode_realtime(controller), 4 + 8 * 31)  # q actual: the 32nd double
    assert packet == ELSEWHERE.q
    assert controller.describe()["q"] == list(ELSEWHERE.q)
    assert controller.describe()["turning"]


def test_without_its_plant_the_arm_has_no_power_and_nothing_says_that_it_stands(moving) -> None:  # type: ignore[no-untyped-def]
    controller, plant, log = moving
    plant.lost = True
    for _ in range(200):
        controller.update()
    assert controller.safety is SafetyMode.FAULT
    assert controller.robot_mode is RobotMode.POWER_OFF
    assert controller.program is None
    assert plant.closed == 1  # it is not asked again
    assert controller.describe()["plant_lost"] == "it fell off"
    assert controller.describe()["qd"] == list(ELSEWHERE.qd)  # the last that was measured: no standstill is made up
    assert controller.describe()["turning"]
    events = [json.loads(line)["event"] for line in log.getvalue().splitlines()]
    assert "plant_lost" in events
    assert "standstill" not in events
    assert not controller.unlock() or controller.safety is SafetyMode.FAULT


@pytest.fixture
def remote():  # type: ignore[no-untyped-def]
    ours, theirs = pair()
    other = Channel(theirs)
    plant = RemotePlant(Channel(ours), ELSEWHERE.q, MODEL)
    yield plant, other
    plant.close()
    other.close()


def test_targets_arrive_and_the_answer_is_measured_in_the_next_cycle(remote) -> None:  # type: ignore[no-untyped-def]
    plant, other = remote
    assert plant.update(START_Q, QD).q == ELSEWHERE.q  # its start
    (message,) = other.receive()
    assert decode_targets(message) == (START_Q, tuple(QD))
    other.send(encode_state(ELSEWHERE))
    assert plant.update(START_Q, QD) == ELSEWHERE


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (b"too short", "9 bytes"),
        (encode_state(ELSEWHERE._replace(qd=(float("nan"),) * 6)), "not a number"),
        (
            encode_state(ELSEWHERE._replace(q=(0.0, 1e30, *ELSEWHERE.q[2:]))),
            "position of joint 2 of 1e[+]30 rad; at most",
        ),
        (
            encode_state(ELSEWHERE._replace(qd=(*ELSEWHERE.qd[:5], -63.0))),
            "speed of joint 6 of -63 rad/s; at most 62.8 is possible",
        ),
        (encode_state(ELSEWHERE._replace(current=(1e5,) * 6)), "current of joint 1 of 1e[+]05 A"),
        (None, "has ended"),
    ],
    ids=["nonsense", "not a number", "far away", "too fast", "too strong", "gone"],
)
def test_a_plant_that_is_gone_or_says_nonsense_is_lost(remote, answer, said) -> None:  # type: ignore[no-untyped-def]
    plant, other = remote
    if answer is None:
        other.close()
    else:
        other.send(answer)
    with pytest.raises(PlantLost, match=said):
        plant.update(START_Q, QD)


def moved(joint: int, way: float) -> PlantState:
    return ELSEWHERE._replace(q=tuple(q + (way if n == joint else 0.0) for n, q in enumerate(ELSEWHERE.q)))


@pytest.mark.parametrize("joint", range(6))
def test_a_joint_that_jumps_is_no_arm(remote, joint: int) -> None:  # type: ignore[no-untyped-def]
    """As far as a blow could fling it within one cycle is believed, and no farther, in each cycle."""
    plant, other = remote
    for share in (0.99, 0.0, -0.99, -1.98):  # each 0.99 or less from the one before
        other.send(encode_state(moved(joint, share * FARTHEST[joint])))
        assert plant.update(START_Q, QD) == moved(joint, share * FARTHEST[joint])
    other.send(encode_state(moved(joint, -0.97 * FARTHEST[joint])))
    with pytest.raises(PlantLost, match=f"a way in 2 ms of joint {joint + 1} of"):
        plant.update(START_Q, QD)


def test_a_joint_that_jumps_by_four_turns_is_said_with_how_far_it_could_go(remote) -> None:  # type: ignore[no-untyped-def]
    plant, other = remote
    other.send(encode_state(moved(1, 25.0)))
    with pytest.raises(PlantLost, match=r"a way in 2 ms of joint 2 of 25 rad; at most 0\.0628 is possible"):
        plant.update(START_Q, QD)


def test_a_plant_that_stands_elsewhere_at_the_start_is_lost(remote) -> None:  # type: ignore[no-untyped-def]
    """Physics and controller must begin at one place: the arm is not carried from one to the other."""
    plant, other = remote
    other.send(encode_state(ELSEWHERE._replace(q=START_Q)))
    with pytest.raises(PlantLost, match="a way in 2 ms of joint"):
        plant.update(START_Q, QD)


def test_a_plant_that_answers_what_it_was_not_asked_is_lost(remote) -> None:  # type: ignore[no-untyped-def]
    """Answers ahead of their targets would hide as many that do not come."""
    plant, other = remote
    other.send(encode_state(ELSEWHERE))
    assert plant.update(START_Q, QD) == ELSEWHERE
    other.send(encode_state(ELSEWHERE))
    other.send(encode_state(ELSEWHERE))
    with pytest.raises(PlantLost, match="was not sent"):
        plant.update(START_Q, QD)


def test_a_plant_that_falls_behind_is_lost_and_one_that_catches_up_is_not(remote) -> None:  # type: ignore[no-untyped-def]
    plant, other = remote
    most = round(_MAX_LAG / CYCLE)
    for _ in range(most):
        plant.update(START_Q, QD)
    for _ in range(most):
        other.send(encode_state(ELSEWHERE))
    for _ in range(most):
        assert plant.update(START_Q, QD) == ELSEWHERE
    with pytest.raises(PlantLost, match="250 ms behind real time: end what else"):
        plant.update(START_Q, QD)


def test_targets_of_another_length_are_refused() -> None:
    with pytest.raises(ValueError, match="must be 96 bytes, got 3"):
        decode_targets(b"abc")
