"""The rule end to end: speeds of a map, kept by the guard in the physics engine, where the arm meets a hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from coneskin.impact.permissible_speed import speed_map
from coneskin.impact.permissible_speed.limits_file import _parse_limits
from coneskin.impact.permissible_speed.speed_map import map_speeds
from coneskin.robot.guard.signals.journal import EventName
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import BodyScene
from tests.support.scenes import forearm_scene

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

from coneskin.impact.simulation.collision_run import CollisionRun

#: the hand of tests/impact/simulation, behind more room for the slider to act
START = tuple(math.radians(angle) for angle in (-30.0, -90.0, 90.0, -90.0, -90.0, 0.0))
HAND = BodyScene("hand", (-0.192, -0.120, 0.5875), radius=0.04, mass=0.6, stiffness=15e3)
LIMITS = """\
[limits]
edition = "invented"
transcribed_by = "one"
verified_by = "other"
[[limits.region]]
name = "hand"
mass_kg = 0.6
support_n_per_mm = 15
transient_force_n = 60
lasting_force_n = 60
[measured]
reaction_ms = 12
deceleration_rad_s2 = 10
by = "the constants of coneskin.impact.simulation.collision_run"
"""


@pytest.mark.long
def test_an_arm_that_asks_for_too_much_meets_the_hand_with_less_than_the_limit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(speed_map, "_CURVE_MASSES", (math.inf,))  # others change little, and cost a search each
    scene = parse_scene(
        forearm_scene() + "[padding]\nthickness_mm = 6\nstiffness_n_per_mm = 10\n"
        "[motion]\nwaypoints_deg = [[-30, -90, 90, -90, -90, 0], [20, -90, 90, -90, -90, 0]]\n"
        "speed_deg_s = 80\nacceleration_deg_s2 = 400\n"
    )
    found = map_speeds(scene, _parse_limits(LIMITS))
    limited = replace(scene, speed_limit=found.table)
    peaks = {}
    for name, one in (("free", scene), ("limited", limited)):
        run = CollisionRun(one, [HAND], START)
        run.run(lambda _: ((1.4, 0.0, 0.0, 0.0, 0.0, 0.0), 2.0), longest=4.0)
        peaks[name] = run.meter.outcome.peak
        assert run.event(EventName.CONTACT) is not None
        assert (run.event(EventName.SPEED_LIMITED) is not None) is (name == "limited")
    assert peaks["free"] > 100.0
    assert 5.0 < peaks["limited"] < 60.0
