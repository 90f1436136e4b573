"""A controller in local control refuses every stop by program or command: refused at the start, told while active."""

import sys

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.robot.guard.signals.journal import SLIDER_HOLDS
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import DEADLINE, fast, scene_for, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402
from coneskin.robot.ur.input_writers import heartbeat_lines  # noqa: E402

from .test_cut_network import MOVES  # noqa: E402
from .test_external_control import send  # noqa: E402


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
        assert session.events[-1].details["why"].endswith(SLIDER_HOLDS)  # who raises it now moves the arm
        controller.wait_for_standstill()
        assert "local control" in next(event for event in session.events if event.name == "stopping").details["why"]
        controller.call("remote control")  # what was connected in local control stays read-only (C210): start again
        with pytest.raises(RobotRefused, match=r"is in local control: .* Choose Remote Control .* then start again"):
            session.reset()


SERVO = """  q = get_actual_joint_positions()
  base = q[0]
  t = 0.0
  while True:
    q[0] = base + 0.3 * (1.0 - cos(2.0 * t))
    servoj(q, 0, 0, 0.002, 0.1, 300)
    t = t + 0.002
  end
end
"""


@pytest.mark.long
@pytest.mark.parametrize(("control", "program"), [("internal", ""), ("internal", MOVES), ("external", SERVO)])
def test_a_guard_does_not_start_on_a_controller_in_local_control(control, program):
    """Whatever moves the arm, and a servoj without the heartbeat's lines, which nothing would stop there."""
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as controller:
        if program:
            send(controller.host, 30002, f"def users():\n  {program}")
            until(lambda: any(controller.state()["qd"]))
        controller.call("local control")
        with (
            pytest.raises(RobotRefused, match=r"local control: it refuses every stop .* Choose Remote Control"),
            guard(scene_for(controller, control=control)),
        ):
            pass


@pytest.mark.promise("P24")
@pytest.mark.long
def test_a_servoj_that_no_slider_stops_is_ended_by_the_controllers_watchdog():
    """In local control nothing else is left: the guard lets its heartbeat end."""
    with (
        SimulatedController(model="UR5e", host=free_host(), start_q=START) as controller,
        guard(scene_for(controller, control="external")) as session,
    ):
        lines = "".join(f"  {line}\n" for line in heartbeat_lines(1.0).splitlines())
        send(controller.host, 30002, f"def users():\n{lines}{SERVO}")
        until(lambda: max(map(abs, controller.state()["qd"])) > 0.3)
        controller.call("local control")
        assert session.wait_for(("latched",), DEADLINE) is not None
        assert not controller.wait_for_standstill()["turning"]
