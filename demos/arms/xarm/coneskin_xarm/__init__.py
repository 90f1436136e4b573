"""UFACTORY xArm 6: its table. A scene with ``model = "xArm6"`` finds it by the entry point.

Source: UFACTORY, *xArm Developer Manual*, "Kinematic and dynamic parameters" (standard DH); limits as in the
XARM6_X4 rows of the maker's SDK, highest speed 180 deg/s.
"""

import math

from coneskin.robot.arm.model import ArmModel

_TURN, _ELBOW = math.pi / 2.0, math.atan2(0.2845, 0.0535)  # rad; of the bent upper arm
_UPPER_ARM = math.hypot(0.0535, 0.2845)  # m

XARM6 = ArmModel(
    name="xArm6",
    a=(0.0, _UPPER_ARM, 0.0775, 0.0, 0.076, 0.0),
    d=(0.267, 0.0, 0.0, 0.3425, 0.0, 0.097),
    alpha=(-_TURN, 0.0, -_TURN, _TURN, -_TURN, 0.0),
    joint_lower=(-2.0 * math.pi, -2.059488, -3.92699, -2.0 * math.pi, -1.692969, -2.0 * math.pi),
    joint_upper=(2.0 * math.pi, 2.094395, 0.191986, 2.0 * math.pi, math.pi, 2.0 * math.pi),
    joint_speed=(math.pi,) * 6,
    theta=(0.0, -_ELBOW, _ELBOW, 0.0, 0.0, 0.0),
    driver="coneskin_xarm.driver:DRIVER",
)
