"""Force limit of a controller, imitated: it estimates the force on the arm from its joints' torques, and stops it.

The limit is that of Universal Robots' safety system ("Tool force", "Elbow force": 150 N is a common setting, 100 to
250 N can be set). How it estimates is not published. Assumed: it knows the torques from outside without error, as a low
pass of 10 ms shows them, and takes them for a force at the tool, or at the elbow, by least squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from coneskin.robot.arm.kinematics import JOINTS, point_jacobian
from coneskin.robot.arm.model import ArmModel

__all__ = ["ForceLimit"]

_FILTER_TIME = 0.01  # s
_ELBOW = 2  # index of the link at whose far end it is
_LEAST_LEVER = 0.1  # of the longest; shorter ones say nothing of a force


class ForceLimit:
    """Force limit of one arm.

    Args:
        model: the arm.
        limit: force at which it stops the arm [N].
    """

    def __init__(self, model: ArmModel, limit: float = 150.0) -> None:
        self._model, self._limit = model, limit
        self._torque: NDArray[np.float64] = np.zeros(JOINTS)

    def exceeded(self, q: Sequence[float], torque: Sequence[float], step: float) -> bool:
        """Take the torques from outside [N m] that have acted for a time [s]; tell whether the arm must stop."""
        share = math.exp(-step / _FILTER_TIME)
        self._torque = share * self._torque + (1.0 - share) * np.asarray(torque, float)
        if not self._torque.any():
            return False
        return max(self._force(q, JOINTS), self._force(q, _ELBOW)) > self._limit

    def _force(self, q: Sequence[float], link: int) -> float:
        """Return the force at the end of a link that explains the torques best [N]."""
        levers = np.array(point_jacobian(self._model, q, link)).T
        force, *_ = np.linalg.lstsq(levers, self._torque, rcond=_LEAST_LEVER)
        return float(np.linalg.norm(force))
