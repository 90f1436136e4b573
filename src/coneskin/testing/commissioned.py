"""Commissioning for tests and benches: it says that a scene's skin was touched where nobody has touched it."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from coneskin.scene.commissioning_record import CommissioningRecord, MarkResult, fingerprint, write_record
from coneskin.scene.values.scene import Commissioning, Scene

__all__ = ["commissioned", "write_passed_record"]


def commissioned(scene: Scene) -> Scene:
    """Return a scene whose reactions may move the arm away."""
    return replace(scene, commissioning=Commissioning(True, "declared by a test"))


def write_passed_record(scene: Scene) -> Path:
    """Write a record beside a scene's file as if it had been commissioned now, and return its path."""
    marks = tuple(
        MarkResult(item.sensor.name, "nowhere", 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1, True) for item in scene.sensors
    )
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return write_record(scene, CommissioningRecord(now, "", fingerprint(scene), True, "", "a test", marks))
