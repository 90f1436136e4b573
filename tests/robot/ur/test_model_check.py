"""Model check: every model of the family is distinguished from the others, with and without a tool."""

import math
import socket
import threading

import pytest

from coneskin.core.errors import RobotConnectionError, RobotRefused
from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.models import MODEL_NAMES, arm_model
from coneskin.robot.sim.process import free_host
from coneskin.robot.ur.driver import UR_DRIVER
from coneskin.robot.ur.model_check import _ArmPose, _flange_distance, check_model, read_pose
from tests.support.served_controller import served

Q = (0.3, -1.2, 1.1, -1.4, -1.5, 0.4)
NONE = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
SAME = [{"UR5E", "UR7E"}]  # one geometry under two names


def rotation_vector(rotation):
    """Of a rotation below half a turn, written independently of the module."""
    trace = sum(rotation[k][k] for k in range(3))
    angle = math.acos((trace - 1.0) / 2.0)
    scale = angle / (2.0 * math.sin(angle))
    r = rotation
    return (r[2][1] - r[1][2]) * scale, (r[0][2] - r[2][0]) * scale, (r[1][0] - r[0][1]) * scale


def pose_of(name, q=Q, tool=(0.0, 0.0, 0.0)):
    """Return what a controller of this model reports with a tool straight off the flange [m]."""
    flange = forward(arm_model(name), q)
    return _ArmPose(q, (*flange.apply(tool), *rotation_vector(flange.rotation)), (*tool, 0.0, 0.0, 0.0))


@pytest.mark.parametrize("name", MODEL_NAMES)
def test_a_model_is_itself_and_no_other(name):
    pose = pose_of(name, tool=(0.01, -0.02, 0.15))
    assert _flange_distance(arm_model(name), pose) < 1e-12  # a chain of rotations of numbers around 1
    check_model(arm_model(name), pose, "host")
    for other in MODEL_NAMES:
        if other != name and {other.upper(), name.upper()} not in SAME:
            if _flange_distance(arm_model(other), pose) <= 0.01:
                continue  # the two cannot be distinguished at this pose, and then points are as close
            with pytest.raises(RobotRefused, match=rf"is no {arm_model(other).name}: .*correct arm.model"):
                check_model(arm_model(other), pose, "host")


@pytest.mark.parametrize("listens", [False, True])
def test_where_no_controller_answers_the_message_says_what_to_check(listens):
    """No server, or one that is no controller, such as a proxy."""
    host = free_host()
    with socket.socket() as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # an earlier test's connections may linger there
        sock.bind((host, 30004))
        if listens:
            sock.listen()
            threading.Thread(target=lambda: sock.accept()[0].close(), daemon=True).start()
        words = rf"{host}:30004.*check the address \(arm.host\).*is on.*RTDE is enabled.*remote control"
        with pytest.raises(RobotConnectionError, match=words):
            read_pose(host)


def test_an_unknown_arm_fits_no_model():
    with pytest.raises(RobotRefused, match="no model fits"):
        check_model(arm_model("UR5e"), _ArmPose(Q, (3.0, 0.0, 0.0, 0.0, 0.0, 0.0), NONE), "host")


@pytest.mark.long
def test_the_simulated_controller_is_asked():
    with served(model="ur10e", start_q=Q) as simulated:
        pose = read_pose(simulated.host, 30.0)
        check_model(arm_model("UR10e"), pose, simulated.host)
        UR_DRIVER.check_model(arm_model("UR10e"), simulated.host)
        with pytest.raises(RobotRefused, match=r"is no UR5e: its flange is .* mm .* UR10e"):
            UR_DRIVER.check_model(arm_model("UR5e"), simulated.host)
