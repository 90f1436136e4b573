"""Arm watch: the measured posture of an arm that nobody may move while its skin is commissioned. It sends nothing."""

from __future__ import annotations

import time
from types import TracebackType
from typing import TYPE_CHECKING

from coneskin.core.channel import wait_readable
from coneskin.core.errors import RobotRefused, RobotTimeout
from coneskin.robot.arm.ur_models import arm_model
from coneskin.robot.driver.registry import load_driver

if TYPE_CHECKING:
    from coneskin.robot.arm.model import Joints
    from coneskin.scene.values.scene import ArmScene

__all__ = ["ArmWatch"]

_FIRST_TIMEOUT = 3.0  # s for the first state
_SILENCE = 1.0  # s without a state
_MOVED = 0.02  # rad; the words for the marks are of one posture


class ArmWatch:
    """States of one arm; opened in a ``with``.

    Args:
        arm: of the scene.

    Attributes:
        q: joint positions at the beginning [rad].
    """

    def __init__(self, arm: ArmScene) -> None:
        model = arm_model(arm.model)
        self._driver = load_driver(model.family)
        self._driver.check_model(model, arm.host)
        self._reader = self._driver.state_reader(arm.host)
        self._heard = 0.0
        self.q: Joints = (0.0,) * 6

    def __enter__(self) -> ArmWatch:
        self._reader.__enter__()
        end = time.monotonic() + _FIRST_TIMEOUT
        while not self._heard:
            if time.monotonic() > end:
                self._reader.close()
                raise RobotTimeout(f"the controller has sent no state within {_FIRST_TIMEOUT:g} s")
            wait_readable([self._reader], 0.05)
            self._read()
        return self

    def __exit__(self, kind: type[BaseException] | None, exc: BaseException | None, tb: TracebackType | None) -> None:
        self._reader.close()

    def check(self) -> None:
        """Raise where the arm has moved, or is not measured any more.

        Raises:
            RobotRefused: it has moved since the beginning.
            RobotTimeout: its controller is silent.
            RobotConnectionError: its controller is gone.
        """
        self._read()
        if time.monotonic() - self._heard > _SILENCE:
            raise RobotTimeout(f"the controller has sent no state for {_SILENCE:g} s")

    def _read(self) -> None:
        for payload in self._reader.read():
            now = time.monotonic()
            state = self._driver.decode_state(now, payload)
            if not self._heard:
                self.q = state.q
            self._heard = now
            off = max(abs(a - b) for a, b in zip(state.q, self.q, strict=True))
            if off > _MOVED:
                raise RobotRefused(
                    f"the arm has moved, a joint by {off:.3f} rad: the marks were described for where it stood; begin "
                    "again and leave it there"
                )
