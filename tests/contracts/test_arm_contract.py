"""The driver of UR arms keeps the contract of every driver, against the simulated controller."""

import contextlib

import pytest

from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.protocol import load_driver
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.testing.arm_contract import ARM_CHECKS, ArmOnTest

MODEL = arm_model("UR5e")


@contextlib.contextmanager
def open_arm():
    with SimulatedController("UR5e", free_host()) as controller:

        def move():
            with load_driver(MODEL.driver).stop_connections(controller.host, 20.0) as connections:
                connections.run("def turning():\n  speedj([0.4, 0, 0, 0, 0, 0], 4.0, 20)\nend\n")
                arm.wait(stack.enter_context(load_driver(MODEL.driver).state_reader(controller.host)), standing=False)

        with contextlib.ExitStack() as stack:
            arm = ArmOnTest(load_driver(MODEL.driver), MODEL, controller.host, move, controller.close)
            yield arm


@pytest.mark.parametrize("check", ARM_CHECKS, ids=lambda check: check.__name__)
@pytest.mark.long
def test_the_driver_of_ur_arms_keeps_the_contract(check):
    check(open_arm)
