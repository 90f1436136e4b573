"""Table [motion] of a scene: the way points between which its arm moves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from coneskin.scene.values.scene import MotionScene

from .schema import Key, check

__all__ = ["MOTION_KEYS", "read_motion"]

MOTION_KEYS = (
    Key("waypoints_deg", dict, ...),
    Key("speed_deg_s", float, low=0.1, high=360.0),
    Key("acceleration_deg_s2", float, low=1.0, high=2000.0),
    Key("rounds", int, 0, low=0),
)
_WAYPOINT = (Key("q_deg", list, low=-363.0, high=363.0, length=6),)


def read_motion(tables: Mapping[str, Any], problems: list[str]) -> MotionScene | None:
    """Return the motion; None without one, or with a mistake, which is added to the problems."""
    if "motion" not in tables:
        return None
    rows = tables["motion"].get("waypoints_deg")
    points = []
    if isinstance(rows, list):
        for number, row in enumerate(rows, 1):
            where = f"motion.waypoints_deg[{number}]"
            lines: list[str] = []
            points.append(check({"q_deg": row}, _WAYPOINT, where, lines).get("q", ()))
            problems += [line.replace(f"{where}.q_deg", where) for line in lines]
        if len(rows) < 2:
            problems.append(f"motion.waypoints_deg needs at least 2 waypoints, got {len(rows)}")
    table = {key: value for key, value in tables["motion"].items() if key != "waypoints_deg"}
    values = check(table, MOTION_KEYS[1:], "motion", problems)
    if not isinstance(rows, list):
        problems.append("motion.waypoints_deg must be a list of lists of 6 joint positions [deg]")
    return MotionScene(tuple(points), **values) if len(values) == len(MOTION_KEYS) - 1 else None
