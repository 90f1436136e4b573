"""Seven-joint arm in MuJoCo. Here is its table; a scene with ``model = "Seven"`` finds it by the entry point."""

import math

from coneskin.robot.arm.model import ArmModel

_TURN = math.pi / 2.0  # rad

#: lengths of a KUKA LBR iiwa 7 R800; ``seven.xml`` has them too
SEVEN = ArmModel(
    name="Seven",
    a=(0.0,) * 7,
    d=(0.34, 0.0, 0.4, 0.0, 0.4, 0.0, 0.126),
    alpha=(-_TURN, _TURN, _TURN, -_TURN, -_TURN, _TURN, 0.0),
    joint_lower=tuple(-math.radians(limit) for limit in (170, 120, 170, 120, 170, 120, 175)),
    joint_upper=tuple(math.radians(limit) for limit in (170, 120, 170, 120, 170, 120, 175)),
    joint_speed=tuple(math.radians(speed) for speed in (98, 98, 100, 130, 140, 180, 180)),
    driver="coneskin_seven.driver:DRIVER",
)
