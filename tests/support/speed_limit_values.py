"""Permissible speeds that were invented: what the tests of the file, and of a guard that keeps it, share."""

from __future__ import annotations

from coneskin.scene.tables.speed_limit_tables import limit_digest, limit_fingerprint
from coneskin.scene.values.scene import Scene


def limit_values(scene: Scene, **values: object) -> dict[str, object]:
    """Return the values of a table for a scene, with its digest; ``values`` are added, or taken in place of these."""
    table: dict[str, object] = {
        "fingerprint": limit_fingerprint(scene),
        "date": "2026-11-23T06:00:00Z",
        "coneskin": "0.1.0",
        "edition": "invented",
        "transcribed_by": "one",
        "verified_by": "other",
        "measured_by": "a test",
        "reaction_ms": 10.0,
        "levers_mm": [100.0, 200.0, 400.0],
    } | values
    return {"digest": limit_digest(table)} | table
