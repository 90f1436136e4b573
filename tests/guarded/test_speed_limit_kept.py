"""The speed slider around a guard that limits it, with real processes: a person's setting outlives the guard."""

import math

import pytest
import tomli_w

from coneskin.scene.reader import load_scene, parse_scene
from coneskin.session.session import guard
from tests.support.scenes import START
from tests.support.speed_limit_values import limit_values

from .guarded_session import DEADLINE, FAR, kill, moving, scene_text, until

pytestmark = pytest.mark.long
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402
from coneskin.robot.ur.input_writers import set_slider  # noqa: E402

PERSONS = 0.8


@pytest.fixture
def controller(tmp_path):
    """A controller whose speed slider a person has put to 80 %."""
    with SimulatedController(model="UR5e", host=free_host(), start_q=START, log=tmp_path / "log.jsonl") as simulated:
        assert set_slider(simulated.host, PERSONS, 5.0)
        until(lambda: simulated.state()["slider"] == PERSONS)
        yield simulated


def limited_scene(simulated, folder):
    """A scene whose forearm may nowhere be faster than 0.2 m/s; the motion of the tests would be at about 0.5."""
    changes = {'kind = "retreat"\ndistance_mm = 30': 'kind = "stop"\ndeceleration_rad_s2 = 8'}
    text = scene_text(simulated.host, changes) + "[padding]\nthickness_mm = 6\nstiffness_n_per_mm = 10\n"
    bare = parse_scene(text)
    (sensor,) = bare.sensors
    patch = {"sensor": sensor.sensor.name, "curve": 0, "any_curve": 0}
    ends = 0.0, 1e3 * sensor.sensor.frustum.slant
    limit = limit_values(
        bare,
        deceleration_rad_s2=8.0,
        curve=[{"region": "hand", "speeds_mm_s": [200.0, 200.0, 200.0]}],
        patch=[{**patch, "u_mm": u, "phi_deg": phi} for u in ends for phi in (0.0, 90.0, 180.0, 270.0)],
    )
    (folder / "impact.toml").write_text(tomli_w.dumps({"speed_limit": limit}), encoding="utf-8")
    named = text.replace('model = "UR5e"', 'model = "UR5e"\nspeed_limit_from = "impact.toml"')
    (folder / "scene.toml").write_text(named, encoding="utf-8")
    return load_scene(folder / "scene.toml")


def under_way(state):
    """Whether the guard has lowered the slider, and the arm moves on under it."""
    return state["slider"] < 0.5 * PERSONS and math.dist(state["q"], START) > 0.1 < max(map(abs, state["qd"]))


def test_a_guard_that_ends_in_the_middle_of_a_motion_leaves_the_slider_as_a_person_had_it(controller, tmp_path):
    with guard(limited_scene(controller, tmp_path)) as session:
        thread, raised = moving(session)
        until(lambda: under_way(controller.state()))
    thread.join(DEADLINE)
    assert isinstance(raised[0], Exception)
    assert controller.wait_for_standstill()["slider"] == PERSONS
    set_before = [event["fraction"] for event in controller.events("slider")]
    assert set_before[0] == set_before[-1] == PERSONS
    assert all(fraction <= PERSONS for fraction in set_before)


def test_a_guard_that_is_killed_under_its_limit_leaves_an_arm_that_stands(controller, tmp_path):
    with guard(limited_scene(controller, tmp_path)) as session:
        thread, raised = moving(session)
        until(lambda: under_way(controller.state()))
        kill(session, "guard")
        stood = controller.wait_for_standstill()
        thread.join(DEADLINE)
        assert isinstance(raised[0], Exception)
        assert stood["slider"] < 0.5 * PERSONS  # nobody raises what it had lowered
    after = controller.state()
    assert max(map(abs, after["qd"])) == 0.0
    assert after["q"] == stood["q"]
    assert math.dist(after["q"], START) < math.dist(FAR, START) - 0.1
    assert after["slider"] < 0.5 * PERSONS
