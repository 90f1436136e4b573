"""Tool, payload and poses through the guard: the controller takes them, and the arm goes where the tool is to be."""

import math

import pytest

from coneskin.core.errors import KinematicsError
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.robot.ur.model_check import read_pose
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import scene_for

pytestmark = pytest.mark.long
TOOL = [0.0, 0.0, 0.15, 0.0, 0.0, 0.0]


def test_a_tool_is_taken_and_a_pose_is_reached_with_it() -> None:
    with SimulatedController("UR5e", free_host(), START) as simulated, guard(scene_for(simulated)) as session:
        session.arm.set_tcp(TOOL)
        session.arm.set_payload(1.2, (0.0, 0.0, 0.05))
        before = read_pose(simulated.host)
        assert before is not None
        assert before.offset == pytest.approx(TOOL)
        target = [before.tcp[0] + 0.05, *before.tcp[1:]]
        session.arm.move_j_ik(target, speed=1.0, acceleration=2.0)
        after = read_pose(simulated.host)
        assert after is not None
        assert math.dist(after.tcp[:3], target[:3]) < 1e-3
        flange = forward(arm_model("UR5e"), after.q)
        assert math.dist(flange.apply(TOOL[:3]), target[:3]) < 1e-3, "the tool is there, not the flange"
        with pytest.raises(KinematicsError, match="a payload is a mass from 0 kg on"):
            session.arm.set_payload(-1.0)
