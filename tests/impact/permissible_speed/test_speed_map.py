from __future__ import annotations

import math
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from coneskin.core.errors import SceneError
from coneskin.impact.permissible_speed import speed_map
from coneskin.impact.permissible_speed.arm_patches import (
    braking_held,
    inertias_of,
    motion_positions,
    patches_of,
    weigh,
)
from coneskin.impact.permissible_speed.extra_way import ExtraWay, extra_ways
from coneskin.impact.permissible_speed.limits_file import ForceLimits, _parse_limits
from coneskin.impact.permissible_speed.speed_map import LEVERS, _keeps, contact_at, map_speeds, write_map
from coneskin.impact.permissible_speed.two_mass_contact import TwoMassContact
from coneskin.robot.arm.inertia import arm_inertia, joint_torques
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.tables.speed_limit_tables import limit_fingerprint
from coneskin.skin.materials import Padding
from tests.support.effective_mass import effective_mass
from tests.support.scenes import forearm_scene

from .test_limits_file import TEXT

MOTION = """
[motion]
waypoints_deg = [[-10, -90, 90, -90, -90, 0], [60, -90, 90, -90, -90, 0]]
speed_deg_s = 60
acceleration_deg_s2 = 400
"""
SCENE = forearm_scene() + "[padding]\nthickness_mm = 6\nstiffness_n_per_mm = 10\n" + MOTION
#: a free body: its contacts are over soon, and so is the test
FREE = TEXT.replace("support_n_per_mm = 20\n", "")


def test_the_masses_are_those_of_the_mass_matrix() -> None:
    scene = parse_scene(SCENE)
    patches = patches_of(scene)
    assert len(patches) == 48
    cone = scene.sensors[0].sensor.frustum
    assert (min(patch.u for patch in patches), max(patch.u for patch in patches)) == (0.0, cone.slant)
    model, q = arm_model("UR5e"), scene.motion.waypoints[0] if scene.motion else ()
    found = weigh(arm_model("UR5e"), patches, [q])[0]
    for patch, mass in list(zip(patches, found, strict=True))[::7]:
        normal = link_pose(model, q, patch.link).rotate(patch.normal)
        exact = effective_mass(model, arm_inertia(model), q, patch.link, patch.point, normal)
        assert mass == pytest.approx(exact, rel=1e-9)


def test_the_positions_are_those_of_the_motion() -> None:
    positions = np.array(motion_positions(parse_scene(SCENE)))
    assert positions[:, 0].min() == pytest.approx(math.radians(-10.0))
    assert positions[:, 0].max() == pytest.approx(math.radians(60.0))
    assert np.ptp(positions[:, 1:], axis=0) == pytest.approx(0.0)


@pytest.mark.long
def test_a_map_keeps_the_limits_it_was_made_for_and_a_scene_takes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(speed_map, "_CURVE_MASSES", (1.0, 8.0, math.inf))  # each of the others costs a search
    scene, limits = parse_scene(SCENE), _parse_limits(FREE)
    found = map_speeds(scene, limits)
    (hand,) = limits.regions
    for curve in found.curves:
        assert curve.region == "hand"
        assert all(a <= b for a, b in zip(curve.speeds, curve.speeds[1:], strict=False))
        for lever, speed in zip(LEVERS[::3], curve.speeds[::3], strict=True):
            contact = contact_at(speed, lever, curve.mass, hand, limits.measured, scene.padding, curve.extra)  # type: ignore[arg-type]
            assert _keeps(contact, hand.limits)
    ways = extra_ways(arm_model("UR5e"), found.patches, motion_positions(scene))
    for row, mass, way in zip(found.table.patches, found.masses, ways, strict=True):
        assert found.curves[row.curve].mass >= mass
        assert found.curves[row.curve].extra.up_to(way) == way
        assert all(own >= anywhere for own, anywhere in zip(*_speeds(found, row), strict=True))
    write_map(found, tmp_path / "impact.toml")
    text = SCENE.replace('model = "UR5e"', 'model = "UR5e"\nspeed_limit_from = "impact.toml"')
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    taken = load_scene(tmp_path / "scene.toml").speed_limit
    assert taken is not None
    assert len(taken.patches) == len(found.patches)
    for curve, read in zip(found.curves, taken.curves, strict=True):
        assert read == pytest.approx(curve.speeds, abs=1.1e-5)
        assert all(a <= b for a, b in zip(read, curve.speeds, strict=True))  # rounded down
    assert taken.lowest == pytest.approx(found.table.lowest)
    assert taken.verified_by == "other"


def _speeds(found: object, row: object) -> tuple[tuple[float, ...], tuple[float, ...]]:
    curves = found.curves  # type: ignore[attr-defined]
    return curves[row.curve].speeds, curves[row.any_curve].speeds  # type: ignore[attr-defined]


HEAVY = SCENE.replace('model = "UR5e"', 'model = "UR5e"\npayload_kg = {}\npayload_xyz_mm = [0, 0, 50]')


def test_a_payload_makes_masses_heavier_and_the_braking_weaker() -> None:
    """Of one joint at a time, by the torque that it takes: the worst is no better than any."""
    scene = parse_scene(HEAVY.format(5.0))
    assert scene.arm is not None
    model, q = arm_model("UR5e"), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # stretched out, level
    bare, laden = inertias_of(scene.arm)
    assert laden.links[-1].mass == pytest.approx(bare.links[-1].mass + 5.0)
    both = weigh(model, patches_of(scene), [q], (bare, laden))
    assert both.shape == (2, 48)
    assert np.all(both[1] >= both[0] * (1.0 - 1e-9))
    held = braking_held(model, [q], (bare, laden))
    assert 0.0 < held < 0.5 * braking_held(model, [q], (bare,))
    worst = math.inf
    for signs in product((-1.0, 1.0), repeat=6):
        torques = joint_torques(model, laden, q, (0.0,) * 6, tuple(held * sign for sign in signs))
        worst = min(worst, *(most - abs(torque) for most, torque in zip(laden.torque, torques, strict=True)))
    assert worst == pytest.approx(0.0, abs=1e-6)
    assert limit_fingerprint(scene) != limit_fingerprint(parse_scene(SCENE))


@pytest.mark.parametrize(
    ("scene", "limits", "message"),
    [
        (forearm_scene(), TEXT, "need the \\[padding\\]"),
        (SCENE.replace('kind = "stop"', 'kind = "slow"'), TEXT, "a reaction is slow"),
        (SCENE, TEXT.replace("deceleration_rad_s2 = 9", "deceleration_rad_s2 = 11"), "must not be above"),
        (SCENE, TEXT.replace('links = ["forearm"]', 'links = ["wrist_1"]'), "no .* may be struck by the forearm"),
        (HEAVY.format(60.0), TEXT, "60 kg at payload_xyz_mm are too much for the motors"),
        (SCENE[SCENE.index("[padding]") : SCENE.index("[motion]")], TEXT, "need an \\[arm\\]"),
    ],
)
@pytest.mark.long
def test_a_scene_without_what_is_needed_is_refused(scene: str, limits: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        map_speeds(parse_scene(scene), _parse_limits(limits))


def test_two_regions_of_one_name_keep_their_own_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second was searched with the limits of the first."""
    limits = _parse_limits(FREE)
    (hand,) = limits.regions
    softer = replace(hand, limits=ForceLimits(0.5 * hand.limits.transient, 0.5 * hand.limits.lasting))
    monkeypatch.setattr(speed_map, "_CURVE_MASSES", (8.0,))
    monkeypatch.setattr(speed_map, "LEVERS", LEVERS[-1:])
    speeds = []
    for regions in ((softer,), (hand, softer)):
        maker = speed_map._CurveMaker(replace(limits, regions=regions), Padding(), lambda _: None)
        number = maker.number(3, 8.0, 8.0, ExtraWay(), 9.0)
        speeds.append(maker.curves[number].speeds)
    assert speeds[0] == speeds[1]


def test_a_speed_keeps_the_limits_also_without_the_extra_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """A body that swings may meet the arm harder where that goes less far; here, because it is made so."""
    limits = _parse_limits(FREE)

    def gentler(speed: float, lever: float, *rest: Any) -> TwoMassContact:
        *others, extra = rest
        return contact_at(0.5 * speed if extra.lag else speed, lever, *others)

    monkeypatch.setattr(speed_map, "contact_at", gentler)
    monkeypatch.setattr(speed_map, "_CURVE_MASSES", (8.0,))
    monkeypatch.setattr(speed_map, "LEVERS", LEVERS[-1:])
    maker = speed_map._CurveMaker(limits, Padding(), lambda _: None)
    without, with_it = (maker.curves[maker.number(3, 8.0, 8.0, ExtraWay(lag), 9.0)].speeds for lag in (0.0, 0.8))
    assert with_it == pytest.approx(without, rel=1e-3)


def test_a_speed_keeps_the_limits_also_on_the_stiffest_foam(monkeypatch: pytest.MonkeyPatch) -> None:
    """A body that swings may press it longer; here, because it is met twice as fast."""
    limits = _parse_limits(FREE)
    (hand,) = limits.regions

    def harder(speed: float, lever: float, mass: float, region: Any, measured: Any, foam: Padding, extra: Any) -> Any:
        return contact_at(speed * (2.0 if foam.stiffness > 11e3 else 1.0), lever, mass, region, measured, foam, extra)

    monkeypatch.setattr(speed_map, "contact_at", harder)
    monkeypatch.setattr(speed_map, "_CURVE_MASSES", (8.0,))
    monkeypatch.setattr(speed_map, "LEVERS", LEVERS[-1:])
    maker = speed_map._CurveMaker(limits, Padding(), lambda _: None)
    (speed,) = maker.curves[maker.number(3, 8.0, 8.0, ExtraWay(), 9.0)].speeds
    stiffest = Padding().scaled(1.15)
    assert speed > 0.0
    assert _keeps(harder(speed, LEVERS[-1], 8.0, hand, limits.measured, stiffest, ExtraWay()), hand.limits)
    assert not _keeps(harder(1.05 * speed, LEVERS[-1], 8.0, hand, limits.measured, stiffest, ExtraWay()), hand.limits)
