"""A controller in local control refuses every stop by program or command: refused at the start, told while active."""

import sys

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.session.session import guard
from coneskin.testing.scenes import START

from .guarded_session import DEADLINE, fast, scene_for, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

from .test_cut_network import MOVES  # noqa: E402
from .test_external_control import send  # noqa: E402


@pytest.mark.long
@pytest.mark.parametrize("control", ["internal", "external"])
def test_a_guard_does_not_start_on_a_controller_in_local_control(control):
    with (
        SimulatedController(model="UR5e", host=free_host(), start_q=START, remote_control=False) as controller,
        pytest.raises(RobotRefused, match=r"local control: it refuses every stop .* Choose Remote Control"),
        guard(scene_for(controller, control=control)),
    ):
        pass


@pytest.mark.promise("P24")
@pytest.mark.long
def test_a_switch_to_local_control_stops_the_arm_and_says_why():
    with (
        SimulatedController(model="UR5e", host=free_host(), start_q=START) as controller,
        guard(scene_for(controller, control="external")) as session,
    ):
        send(controller.host, 30002, f"def users():\n  {MOVES}")
        until(lambda: fast(controller))
        controller.call("local control")
        assert session.wait_for(("latched",), DEADLINE) is not None
        controller.wait_for_standstill()
        assert "local control" in next(event for event in session.events if event.name == "stopping").details["why"]
