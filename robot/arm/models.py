"""Arms by name: those of Universal Robots, and those that installed packages bring.

A package of another maker's arm has an entry point in the group ``coneskin.arms``. Its name is the arm's, its object an
``ArmModel``. Only the one that is asked for is imported.

Sources:
    Lengths: Universal Robots support article "DH Parameters for calculations of kinematics and dynamics" and
    ``default_kinematics.yaml`` of Universal_Robots_ROS2_Description, which agree digit for digit. The UR7e is a UR5e of
    higher payload, the UR12e a UR10e: the same geometry and masses. Lengths of UR8 Long, UR15 and UR18, and their
    limits: ``default_kinematics.yaml`` and ``joint_limits.yaml`` of ros-industrial/universal_robot (commits 31e2294,
    499e728, 34b1371). The printed CB3 service manual has other numbers for old series (UR5 series 1 and 2, and UR10
    rounded): for those, and for any work below a few millimetres, use ``ArmModel.calibrated``.
    Limits and speeds: user manuals as collected in ``joint_limits.yaml`` there. The elbow's 180 deg is from that file
    too: the controller accepts 360 deg, but the forearm meets the upper arm before. Wrist 3 of UR3 and UR3e turns
    without end. Universal Robots publishes no joint accelerations.
"""

from __future__ import annotations

import functools
import math
import re

from coneskin.core.errors import KinematicsError

from .model import ArmModel, JointCurrents, Joints

_QUARTER_TURN = math.pi / 2.0  # rad
JOINT_COUNT = 6  #: joints of each of them
#: joint speeds of an arm at rest [rad/s]
ZERO_VELOCITY: Joints = (0.0,) * JOINT_COUNT
#: the driver of these arms
UR_DRIVER = "coneskin.robot.ur.driver:UR_DRIVER"
#: of the motors; assumed, not measured on an arm
UR_CURRENTS = JointCurrents((*(12.0,) * 3, *(9.0,) * 3), (*(3.0,) * 3, *(1.5,) * 3), (*(24.0,) * 3, *(9.0,) * 3))


def is_ur(model: ArmModel) -> bool:
    """Tell whether an arm is one of these, calibrated or not."""
    return model.driver == UR_DRIVER


def _deg(*degrees: float) -> Joints:
    return tuple(math.radians(value) for value in degrees)


def _arm(name: str, lengths: tuple[float, ...], speeds: Joints, wrist_3_limit: float = math.radians(360.0)) -> ArmModel:
    """Return an arm from d1, a2, a3, d4, d5, d6 [m]; the other lengths of a UR arm are zero."""
    d1, a2, a3, d4, d5, d6 = lengths
    upper = (*_deg(360, 360, 180, 360, 360, 0)[:5], wrist_3_limit)
    return ArmModel(
        name=name,
        a=(0.0, a2, a3, 0.0, 0.0, 0.0),
        d=(d1, 0.0, 0.0, d4, d5, d6),
        alpha=(_QUARTER_TURN, 0.0, 0.0, _QUARTER_TURN, -_QUARTER_TURN, 0.0),
        joint_lower=tuple(-limit for limit in upper),
        joint_upper=upper,
        joint_speed=speeds,
        theta=ZERO_VELOCITY,
        driver=UR_DRIVER,
        currents=UR_CURRENTS,
    )


#: highest joint speeds of each size of arm [rad/s]
_SMALL_SPEEDS = _deg(180, 180, 180, 360, 360, 360)
_MEDIUM_SPEEDS = _deg(180, 180, 180, 180, 180, 180)
_LARGE_SPEEDS = _deg(120, 120, 180, 180, 180, 180)
_FAST_SPEEDS = _deg(180, 180, 240, 300, 300, 300)
_HEAVY_SPEEDS = _deg(120, 120, 150, 210, 210, 210)

#: all arms of the maker
UR_MODELS = (  # d1, a2, a3, d4, d5, d6 [m]
    _arm("UR3", (0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819), _SMALL_SPEEDS, math.inf),
    _arm("UR5", (0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823), _MEDIUM_SPEEDS),
    _arm("UR10", (0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922), _LARGE_SPEEDS),
    _arm("UR3e", (0.15185, -0.24355, -0.2132, 0.13105, 0.08535, 0.0921), _SMALL_SPEEDS, math.inf),
    _arm("UR5e", (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996), _MEDIUM_SPEEDS),
    _arm("UR7e", (0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996), _MEDIUM_SPEEDS),
    _arm("UR8 Long", (0.2186, -0.8989, -0.7149, 0.1824, 0.1361, 0.1434), _FAST_SPEEDS),
    _arm("UR10e", (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655), _LARGE_SPEEDS),
    _arm("UR12e", (0.1807, -0.6127, -0.57155, 0.17415, 0.11985, 0.11655), _LARGE_SPEEDS),
    _arm("UR15", (0.2186, -0.6475, -0.5164, 0.1824, 0.1361, 0.1434), _FAST_SPEEDS),
    _arm("UR16e", (0.1807, -0.4784, -0.36, 0.17415, 0.11985, 0.11655), _LARGE_SPEEDS),
    _arm("UR18", (0.2186, -0.475, -0.3389, 0.1824, 0.1361, 0.1434), _FAST_SPEEDS),
    _arm("UR20", (0.2363, -0.8620, -0.7287, 0.2010, 0.1593, 0.1543), _HEAVY_SPEEDS),
    _arm("UR30", (0.2363, -0.6370, -0.5037, 0.2010, 0.1593, 0.1543), _HEAVY_SPEEDS),
)

ENTRY_POINTS = "coneskin.arms"  #: group of the packages
_MODEL_TABLE = {arm.name.lower().replace(" ", ""): arm for arm in UR_MODELS}
#: arms that come with coneskin
MODEL_NAMES = tuple(arm.name for arm in UR_MODELS)


def arm_model(name: str) -> ArmModel:
    """Return the nominal arm of that name; case, spaces, hyphens and underscores do not matter ("ur-10e", "UR10 e").

    Raises:
        KinematicsError: there is no such arm, and the message lists all; or its package is broken.
    """
    plain = _plain(name)
    return _MODEL_TABLE.get(plain) or _installed(plain, name)


@functools.lru_cache(maxsize=32)
def _installed(plain: str, name: str) -> ArmModel:
    from importlib.metadata import entry_points

    installed = entry_points(group=ENTRY_POINTS)
    found = [point for point in installed if _plain(point.name) == plain]
    if not found:
        names = ", ".join((*MODEL_NAMES, *sorted({point.name for point in installed})))
        raise KinematicsError(
            f"arm must be one of {names}, got {name!r}; the arm of another maker is a package to install"
        )
    where = " and ".join(f"{point.dist.name if point.dist else '?'}, {point.value}" for point in found)
    if len(found) > 1:
        raise KinematicsError(f"the arm {name!r} comes from more than one package: {where}; uninstall one")
    try:
        model = found[0].load()
    except Exception as exc:  # whatever somebody else's package raises
        why = f"{type(exc).__name__}: {exc}"
        raise KinematicsError(f"the package of the arm {name!r} ({where}) cannot be imported: {why}") from exc
    if not isinstance(model, ArmModel) or _plain(model.name) != plain:
        raise KinematicsError(f"the package of the arm {name!r} ({where}) must give the ArmModel of that name")
    return model


def _plain(name: str) -> str:
    return re.sub(r"[\s_-]", "", name).lower()
