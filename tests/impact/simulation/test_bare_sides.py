"""A body that no skin sees, behind an arm that gives way: MuJoCo's force judges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.robot.arm.vectors import added, scaled
from coneskin.robot.guard.signals.journal import EventName
from coneskin.scene.build import place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import BodyScene
from coneskin.skin.materials import Padding
from tests.support.bare_parts import bare_parts_of
from tests.support.scenes import commissioned, forearm_scene
from tests.support.stored_energy import stored_energy

pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")

from coneskin.impact.simulation.collision_run import CollisionRun
from coneskin.impact.simulation.mujoco_plant import MujocoPlant
from coneskin.impact.simulation.scene_description import SheetOnLink

Q = tuple(math.radians(angle) for angle in (-2.0, -90.0, 90.0, -90.0, -90.0, 0.0))
PUSH = 5.0  # N
U, PHI = 0.13, math.radians(150.0)
PAD = Padding()


def pushed(reaction: str, gap: float = 0.01) -> tuple[CollisionRun, float]:
    """Push on a standing arm whose bare strip has a fixed body of 25 N/mm behind it; the force there at most."""
    text = forearm_scene(reaction=reaction).replace("height_mm", "wrap_deg = 300\nheight_mm")
    scene = commissioned(parse_scene(text))
    (skin,) = place_on_arm(scene)
    pose = link_pose(arm_model("UR5e"), Q, skin.link)

    def beside(phi: float, away: float) -> Vector:
        return added(pose.apply(skin.frustum.point(U, phi)), scaled(pose.rotate(skin.frustum.normal(phi)), away))

    person = BodyScene("person", beside(PHI, 0.0398), mass=0.6, stiffness=25e3, force=PUSH, delay=0.02)
    fixed = BodyScene("hand", beside(PHI + math.pi, 0.03 + gap), radius=0.03, mass=1.2, stiffness=25e3)
    run, most = CollisionRun(scene, [person, fixed], Q, bare=bare_parts_of(scene), period=5), [0.0]

    def look() -> bool:
        most[0] = max([most[0], *(contact.force for contact in run.plant.contacts if contact.part == 1)])
        return False

    run.run(lambda _: None, longest=3.0, after=3.0, look=look)
    return run, most[0]


@pytest.mark.promise("P38")
@pytest.mark.long
def test_an_arm_that_gives_way_presses_a_body_behind_a_bare_strip_no_harder_than_it_is_pushed() -> None:
    """625 N for a push of 5 N before, with a stiff pad; see ``bench bare-sides`` for many such cases."""
    run, force = pushed('kind = "comply"\nbare_side = "fast"\ntime_budget_s = 10', gap=0.002)
    over = run.event(EventName.RETREATED)
    assert over is None or over.details["progress"] > 0.001
    assert 0.5 * PUSH < force < 1.5 * PUSH


@pytest.mark.long
@pytest.mark.promise("P33")
@pytest.mark.parametrize(("kind", "bare_side"), [("retreat", "stop"), ("comply", "stop"), ("comply", "allowed")])
def test_where_a_bare_side_would_lead_the_arm_only_stops_unless_the_scene_allows_it(kind: str, bare_side: str) -> None:
    run, force = pushed(f'kind = "{kind}"\nbare_side = "{bare_side}"')
    latched = run.event(EventName.LATCHED)
    assert latched is not None
    assert "no skin covers the" in latched.details["why"]
    assert run.event(EventName.RETREATING) is None
    assert force == 0.0


def test_no_way_from_the_skin_onto_the_strip_and_off_it_gives_energy() -> None:
    """Pressed into the pad, a ball slid onto the lacquer, whose force at that depth is twenty times the pad's."""
    model, depth, radius = arm_model("UR5e"), 1e-3, 0.03
    text = forearm_scene().replace("height_mm", "wrap_deg = 300\nheight_mm")
    (skin,) = place_on_arm(parse_scene(text))
    pose, wrap = link_pose(model, Q, skin.link), skin.frustum.frustum.wrap

    def middle(phi: float, away: float) -> Vector:
        side = scaled(pose.rotate(skin.frustum.normal(phi)), radius + away)
        return added(pose.apply(skin.frustum.point(U, phi)), side)

    off, on = math.radians(-25.0), math.radians(15.0)
    way = [(off, 1e-5 * (50 - k)) for k in range(151)]  # in, along, and out
    way += [(off + (on - off) * k / 800.0, -depth) for k in range(801)]
    way += [(on, 1e-5 * (k - 100)) for k in range(151)]
    places = [middle(wrap + phi, away) for phi, away in way]
    plant = MujocoPlant(
        model, [SheetOnLink("it", skin.link, skin.frustum)], [BodyScene("mass", places[0], radius=radius)], PAD, Q
    )
    forces = []
    for place in places:
        plant._d.qpos[6:9] = [a - b for a, b in zip(place, places[0], strict=True)]
        plant._mj.mj_fwdPosition(plant._m, plant._d)
        forces.append(sum((contact.force * contact.normal for contact in plant._find()), np.zeros(3)))
    steps = np.diff(np.array(places), axis=0)
    work = float(np.sum(0.5 * (np.array(forces[1:]) + np.array(forces[:-1])) * steps))
    assert -1.5 < work / stored_energy(PAD, depth) < 0.1  # what was in the pad is lost
