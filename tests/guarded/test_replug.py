"""A skin whose plug is pulled and put back: the arm stands, and moves again only with the same device and a reset."""

import contextlib
import sys
from dataclasses import replace

import pytest

from coneskin.core.errors import RobotRefused
from coneskin.runs.replay.run import read_run, replay
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
from coneskin.skin.virtual.pseudo_terminal import PseudoTerminal
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.testing.scenes import START, commissioned, forearm_scene

from .guarded_session import assert_stopped_on_the_way, run_until_moving

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(sys.platform == "win32", reason="a port that goes and comes back is a pseudo-terminal"),
]
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

_LIMITS = "skin_silence_ms = 1000\nskin_late_ms = 1000\narm_silence_ms = 300\nprogram_silence_ms = 500"


@contextlib.contextmanager
def plugged(port, sensor):
    """A device on a port whose name stays, as those in /dev/serial/by-id do; at the end its plug is pulled."""
    with PseudoTerminal(VirtualSkin(sensor, model="ladder", rate_hz=300.0)) as terminal:
        port.symlink_to(terminal.path)
        yield
        port.unlink()


def open_again(session, after):
    """Wait until the port is open again; the position after that event."""
    while True:
        event = session.wait_for(("message",), 10.0, after)
        assert event is not None, "the port was not opened again"
        after = session.events.index(event) + 1
        if "open again" in event.details["what"]:
            return after


def test_the_arm_stops_and_goes_on_only_with_the_same_device_and_a_reset(tmp_path):
    port = tmp_path / "skin"
    with contextlib.ExitStack() as stack, SimulatedController("UR5e", free_host(), START) as controller:
        scene = commissioned(parse_scene(forearm_scene(controller.host, port=str(port), limits=_LIMITS)))
        sensor = scene.sensors[0].sensor
        first = stack.enter_context(contextlib.ExitStack())
        first.enter_context(plugged(port, sensor))
        with guard(scene, recording=tmp_path / "run.rec") as session:
            thread, raised = run_until_moving(controller, session)
            first.close()
            fault = session.wait_for(("fault",), 5.0)
            assert "is gone" in fault.details["what"]
            assert_stopped_on_the_way(controller)
            thread.join(20)
            assert isinstance(raised[0], RobotRefused)
            with pytest.raises(RobotRefused, match="is gone"):
                session.reset()
            with plugged(port, replace(sensor, device_id=5)):
                seen = open_again(session, 0)
                session.wait_for(("never",), 0.5)
                with pytest.raises(
                    RobotRefused, match="another device is on the skin's port: it sends as device/sensor 5/0"
                ):
                    session.reset()
            assert session.wait_for(("fault",), 5.0, seen) is not None
            with plugged(port, sensor):
                open_again(session, seen)
                session.wait_for(("never",), 1.0)  # until it is ready again
                stop = controller.state()["q"]
                session.reset()
                session.arm.move_j([stop[0] - 0.1, *stop[1:]], speed=0.5, acceleration=2.0)
                assert controller.state()["q"][0] == pytest.approx(stop[0] - 0.1, abs=1e-3)
    assert replay(read_run(tmp_path / "run.rec")).same
