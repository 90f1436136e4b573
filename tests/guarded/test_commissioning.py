"""A guard with real processes and a scene that retreats: without a commissioning record the arm only stops."""

import pytest

from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
from coneskin.testing.scenes import START, commissioned

from .guarded_session import run_until_moving, scene_text


@pytest.fixture
def controller():
    with SimulatedController(model="UR5e", host=free_host(), start_q=START) as simulated:
        yield simulated


@pytest.mark.promise("P12")
@pytest.mark.long
@pytest.mark.parametrize("known", [False, True], ids=["without a record", "commissioned"])
def test_only_a_commissioned_arm_may_move_away(controller, known, tmp_path):
    scene = parse_scene(scene_text(controller.host), "scene.toml", tmp_path)
    with guard(commissioned(scene) if known else scene) as session:
        thread, raised = run_until_moving(controller, session)
        session.touch(0.13, 1.57, duration=0.1)
        thread.join(20)
        assert session.wait_for(("latched",), 10.0) is not None, [event.name for event in session.events]
        names = [event.name for event in session.events]
    assert raised[0] is not None
    assert ("not_commissioned" in names) is not known
    assert ("retreating" in names) is known, [event.details for event in session.events if event.name == "latched"]
