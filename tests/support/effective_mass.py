"""Effective mass of an arm, by numpy: the reference of what the permissible speeds compute for many positions at once.

Source: Khatib, "Inertial properties in robotic manipulation: an object-level framework", IJRR 14 (1995), eq. 9: the
effective mass along a unit vector n is 1 / (n^T J M^-1 J^T n), for the Jacobian J of a point and the mass matrix M.
"""

import math
from collections.abc import Sequence

import numpy as np

from coneskin.geometry.pose import Vector
from coneskin.robot.arm.inertia import ArmInertia, mass_matrix
from coneskin.robot.arm.kinematics import point_jacobian
from coneskin.robot.arm.model import ArmModel


def effective_mass(
    model: ArmModel, inertia: ArmInertia, q: Sequence[float], link: int, p_link: Vector, direction: Vector
) -> float:
    """Return the mass that a blow at a point of a link feels along a direction [kg]; infinite where it cannot move.

    Args:
        model: the nominal arm.
        inertia: of the arm.
        q: joint positions [rad].
        link: index of the link's DH frame, 0 to 6.
        p_link: the point in that frame [m].
        direction: in the base frame. Its length does not matter.
    """
    along = np.array(direction) / math.hypot(*direction) @ np.array(point_jacobian(model, q, link, p_link))
    mobility = float(along @ np.linalg.solve(mass_matrix(model, inertia, q), along))
    return 1.0 / mobility if mobility > 0.0 else math.inf
