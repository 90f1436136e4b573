"""File of a map of permissible speeds, as a scene names it: TOML with one table, [speed_limit]."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from coneskin.core.errors import SceneError
from coneskin.scene.tables.speed_limit_check import limit_digest
from coneskin.scene.values.whole_file import write_whole

from .speed_map import SpeedMap

__all__ = ["map_table", "write_map"]

_HEAD = """\
# Permissible speeds of a scene's skins, written by `coneskin permissible`. No safety assessment.
# A scene takes them with speed_limit_from in [arm]. Change the limits, not this file, and write it anew.
"""


def map_table(found: SpeedMap) -> dict[str, Any]:
    """Return the table of a map, in the units of the file."""
    table = found.table
    values: dict[str, Any] = {
        "format": table.format,
        "fingerprint": table.fingerprint,
        "date": table.date,
        "coneskin": table.coneskin,
        "edition": table.edition,
        "transcribed_by": table.transcribed_by,
        "verified_by": table.verified_by,
        "measured_by": table.measured_by,
        "reaction_ms": 1e3 * table.reaction,
        "deceleration_rad_s2": table.deceleration,
    }
    if table.lowest:
        values["lowest_deg"] = [math.degrees(q) for q in table.lowest]
        values["highest_deg"] = [math.degrees(q) for q in table.highest]
    values["levers_mm"] = [1e3 * lever for lever in table.levers]
    values["curve"] = [
        {"region": curve.region}
        | ({} if math.isinf(curve.mass) else {"mass_kg": curve.mass})
        | {"lag_mm": 1e3 * curve.extra.lag, "bend_mm": 1e3 * curve.extra.bend}
        | {"speeds_mm_s": [math.floor(1e5 * speed) / 1e2 for speed in curve.speeds]}
        for curve in found.curves
    ]
    values["patch"] = [
        {
            "sensor": patch.sensor,
            "u_mm": round(1e3 * patch.u, 6),
            "phi_deg": round(math.degrees(patch.phi), 6),
            "curve": patch.curve,
            "any_curve": patch.any_curve,
        }
        for patch in table.patches
    ]
    return {"speed_limit": {"digest": limit_digest(values)} | values}


def write_map(found: SpeedMap, path: Path) -> None:
    """Write the file of a map, whole or not at all.

    Raises:
        SceneError: it cannot be written.
    """
    import tomli_w

    try:
        write_whole(path, _HEAD + tomli_w.dumps(map_table(found)))
    except OSError as exc:
        raise SceneError([f"the speeds {path} cannot be written: {exc.strerror or exc}"], path.name) from exc
