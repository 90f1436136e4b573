"""A skin whose plug is pulled and put back: the arm stands, and moves again only with the same device and a reset."""

import contextlib
import sys
from dataclasses import replace

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.runs.replay.run import read_run
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
from coneskin.skin.virtual.pseudo_terminal import PseudoTerminal
from coneskin.skin.virtual.skin import VirtualSkin
from tests.support.scenes import START, commissioned, forearm_scene

from .guarded_session import (
    DEADLINE,
    PATIENT,
    assert_stopped_on_the_way,
    await_message,
    is_reset,
    run_until_moving,
    until,
)

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform == "win32", reason="a port that goes and comes back is a pseudo-terminal"),
]
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402


@contextlib.contextmanager
def plugged(port, sensor):
    """A device on a port whose name stays, as those in /dev/serial/by-id do; at the end its plug is pulled."""
    with PseudoTerminal(VirtualSkin(sensor, model="ladder", rate_hz=300.0)) as terminal:
        port.symlink_to(terminal.path)
        yield
        port.unlink()


def another_device(session):
    """Try to reset; whether it is refused because of the other device, once that has sent something."""
    with pytest.raises(RobotRefused) as refused:
        session.reset()
    return "another device is on the skin's port: it sends as device/sensor 5/0" in str(refused.value)


def test_the_arm_stops_and_goes_on_only_with_the_same_device_and_a_reset(tmp_path):
    port = tmp_path / "skin"
    with contextlib.ExitStack() as stack, SimulatedController("UR5e", free_host(), START) as controller:
        scene = commissioned(parse_scene(forearm_scene(controller.host, port=str(port), limits=PATIENT)))
        sensor = scene.sensors[0].sensor
        first = stack.enter_context(contextlib.ExitStack())
        first.enter_context(plugged(port, sensor))
        with guard(scene, recording=tmp_path / "run.rec") as session:
            thread, raised = run_until_moving(controller, session)
            first.close()
            fault = session.wait_for(("fault",), DEADLINE)
            assert "is gone" in fault.details["what"]
            assert_stopped_on_the_way(controller)
            thread.join(DEADLINE)
            assert isinstance(raised[0], RobotRefused)
            with pytest.raises(RobotRefused, match="is gone"):
                session.reset()
            with plugged(port, replace(sensor, device_id=5)):
                seen = await_message(session, "open again")
                until(lambda: another_device(session))
            assert session.wait_for(("fault",), DEADLINE, seen) is not None
            with plugged(port, sensor):
                await_message(session, "open again", seen)
                stop = controller.state()["q"]
                until(lambda: is_reset(session))
                session.arm.move_j([stop[0] - 0.1, *stop[1:]], speed=0.5, acceleration=2.0)
                assert controller.state()["q"][0] == pytest.approx(stop[0] - 0.1, abs=1e-3)
    assert read_run(tmp_path / "run.rec").replay().same
