"""The scene of the benches that guard an arm is that of the tests: a UR5e whose forearm carries one sensor."""

from __future__ import annotations

import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.robot.guarded import START, forearm_scene

__all__ = ["ESCALATE", "START", "forearm_scene", "start_with"]

ESCALATE = 0.025  # s, the default of the scene's watch.escalate_ms


def start_with(base_deg: float) -> list[float]:
    """START with the base turned to an angle [deg]; joint positions [rad]."""
    return [math.radians(base_deg), *START[1:]]
