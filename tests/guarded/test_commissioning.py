"""A guard with real processes and a scene that retreats: without a commissioning record the arm only stops."""

import pytest

from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import parse_scene
from coneskin.session.session import guard
from tests.support.scenes import START, commissioned

from .guarded_session import DEADLINE, run_until_moving, scene_text, until_undisturbed


@pytest.mark.promise("P12")
@pytest.mark.long
@pytest.mark.parametrize("known", [False, True], ids=["without a record", "commissioned"])
def test_only_a_commissioned_arm_may_move_away(known, tmp_path):
    def attempt():
        with SimulatedController(model="UR5e", host=free_host(), start_q=START) as controller:
            scene = parse_scene(scene_text(controller.host), "scene.toml", tmp_path)
            with guard(commissioned(scene) if known else scene) as session:
                thread, raised = run_until_moving(controller, session)
                session.touch(0.13, 1.57, duration=0.4)  # it lasts until the arm stands, on a busy computer too
                thread.join(DEADLINE)
                assert session.wait_for(("latched",), DEADLINE) is not None, [event.name for event in session.events]
            assert raised[0] is not None
            return session.events

    events = until_undisturbed(attempt)
    names = [event.name for event in events]
    assert ("not_commissioned" in names) is not known
    assert ("retreating" in names) is known, [event.details for event in events if event.name == "latched"]
