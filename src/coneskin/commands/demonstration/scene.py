"""Scene of the demo: the arm with a skin on its forearm, and the soft body that it runs into where physics is there."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coneskin.scene.values.scene import Scene

__all__ = ["FROM_DEG", "TOUCHED_U", "TO_DEG", "leading_side", "make_scene"]

#: the scene of the demo: the tube of the UR5e's forearm as ``coneskin design`` finds it. The limits of
#: silence are long because a pseudo-terminal on a busy machine can stall for that long
_SCENE = """\
[arm]
model = "UR5e"
host = "{host}"

[[link]]
name = "forearm"

[[link.sensor]]
id = 1
name = "forearm skin"
radius1_mm = 37.62
radius2_mm = 37.30
height_mm = 240
xyz_mm = [0, -0.4, 100]

[source]
kind = "virtual"
rate_hz = 500

[reaction]
kind = "{reaction}"
deceleration_rad_s2 = 40      # this arm's motors can, folded as it is here: docs/safety.md
distance_mm = 20              # and back what it moved while it stopped: the whole arm may go 100 mm

[monitoring]                  # defaults: 50 ms each; a pseudo-terminal on a busy machine can stall for longer
skin_silence_ms = 250
skin_late_ms = 250
arm_silence_ms = 250
{more}"""
#: with physics: servos follow 10 ms late, and what they do comes from one more process
_PATIENCE = "escalate_ms = 100"
#: what it runs into, half way; as heavy as a hand (ISO/TS 15066, table A.3), and much softer
_BODY = """
[[body]]
kind = "hand"
xyz_mm = [{x:.1f}, {y:.1f}, {z:.1f}]
radius_mm = {radius_mm:g}
mass_kg = 0.6
stiffness_n_per_mm = 2
"""
_RADIUS = 0.03  # m of that
TOUCHED_U = 0.13  #: m; slant distance of the touch from end 1
FROM_DEG = (-40.0, -90.0, 90.0, -90.0, -90.0, 0.0)  #: joint positions at the start
TO_DEG = (60.0, -80.0, 80.0, -90.0, -90.0, 0.0)  #: joint positions at the end


def make_scene(host: str, reaction: str, soft: bool, folder: Path) -> Scene:
    """Return the scene of the demo.

    Args:
        host: address of its controller.
        reaction: kind of its reaction.
        soft: True where it runs into something soft; else a script touches it.
        folder: that its files belong to.
    """
    from coneskin.scene.reader import parse_scene

    text = _SCENE.format(host=host, reaction=reaction, more=_PATIENCE if soft else "")
    scene = parse_scene(text, "scene.toml", folder)
    return parse_scene(text + _body_in_the_way(scene), "scene.toml", folder) if soft else scene


def _body_in_the_way(scene: Scene) -> str:
    """Return the table of a body that the sensor's leading side meets half way."""
    from coneskin.robot.arm.kinematics import link_pose
    from coneskin.robot.arm.ur_models import arm_model
    from coneskin.scene.build import place_on_arm

    (placed,) = place_on_arm(scene)
    assert scene.arm is not None
    middle = [math.radians(0.5 * (a + b)) for a, b in zip(FROM_DEG, TO_DEG, strict=True)]
    point, normal = placed.place(TOUCHED_U, leading_side(scene))
    pose = link_pose(arm_model(scene.arm.model), middle, placed.link)
    out = pose.rotate(normal)
    x, y, z = (1e3 * (p + _RADIUS * n) for p, n in zip(pose.apply(point), out, strict=True))
    return _BODY.format(x=x, y=y, z=z, radius_mm=1e3 * _RADIUS)


def leading_side(scene: Scene) -> float:
    """Return the azimuth of the sensor's leading side [rad]: there an obstacle would hit the arm."""
    from coneskin.robot.arm.kinematics import link_pose, point_jacobian
    from coneskin.robot.arm.ur_models import arm_model
    from coneskin.scene.build import place_on_arm

    (placed,) = place_on_arm(scene)
    assert scene.arm is not None
    arm = arm_model(scene.arm.model)
    middle = [math.radians(0.5 * (a + b)) for a, b in zip(FROM_DEG, TO_DEG, strict=True)]
    qd = [math.radians(b - a) for a, b in zip(FROM_DEG, TO_DEG, strict=True)]

    def towards(phi: float) -> float:
        point, normal = placed.place(TOUCHED_U, phi)
        rows = point_jacobian(arm, middle, placed.link, point)
        n = link_pose(arm, middle, placed.link).rotate(normal)
        return sum(n[k] * sum(j * v for j, v in zip(rows[k], qd, strict=True)) for k in range(3))

    return max((math.radians(degree) for degree in range(360)), key=towards)
