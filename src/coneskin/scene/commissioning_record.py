"""Commissioning record of a scene: what a person has touched, what the skin read, and whether a retreat is earned.

It lies beside the scene, as ``scene.commissioning.json`` beside ``scene.toml``. It shows that a procedure was carried
out on this skin, on this link; it is no lock, and a record that was edited by hand cannot be recognized.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from coneskin.core.errors import SceneError
from coneskin.core.files import explain_os_error, read_file, write_whole
from coneskin.core.text import read_json

from .values.scene import Commissioning, PlacedSensor, Scene, facts_digest, sensor_facts

MIN_MARKS = 5  #: marks on each sensor
MAX_MISS = (0.020, math.radians(25.0))  #: m along the link, and rad about it, by which a mark may be misread at most
_CHAIN_NUMBER = 1  # to be raised where the way from a frame to a place on the arm changes, so that old records are void
_MAX_BYTES = 1 << 20  # of a record
_DAY_SECONDS = 86400.0  # s; by one, a record may be ahead of this computer's date


@dataclass(frozen=True, slots=True)
class MarkResult:
    """Result of one touched mark."""

    sensor: str  #: its name
    where: str  #: the place in the words that the person was given
    u_mm: float  #: slant distance from end 1 that was expected [mm]
    phi_deg: float  #: azimuth that was expected [deg]
    read_u_mm: float  #: as the skin read it [mm]
    read_phi_deg: float  #: as the skin read it [deg]
    distance_mm: float  #: of the two along the surface [mm]
    level: float  #: of the touch
    attempts: int  #: how often it was touched
    passed: bool  #: it was read where it is, within the tolerance


@dataclass(frozen=True, slots=True)
class CommissioningRecord:
    """Record of one commissioning.

    Attributes:
        date: when it ended, UTC, as ISO 8601 has it.
        coneskin: the version.
        fingerprint: of all that the result depends on; see ``fingerprint``.
        passed: every mark of every sensor was read where it is.
        cause: why it did not pass, for people.
        by: who touched it; empty where nobody said so.
        marks: in the order in which they were touched.
        sheet_ohm: what the untouched sheets of each sensor, by its number, had per square, upper and lower [ohm].
    """

    date: str
    coneskin: str
    fingerprint: str
    passed: bool
    cause: str
    by: str
    marks: tuple[MarkResult, ...]
    sheet_ohm: dict[str, tuple[float, float]] = field(default_factory=dict)


def fingerprint(scene: Scene) -> str:
    """Return a hash of everything that places of touches on the arm depend on.

    It changes with the arm's model, and with link, frame, pose, geometry, polarity, sheets, electronics, calibration
    and numbers of each sensor, and between a virtual skin and a real one. It does not with names, thresholds, reactions
    and ports.
    """
    from coneskin.skin.sources.kinds import is_simulated

    simulated = scene.source is not None and is_simulated(scene.source.kind)
    facts = {
        "chain": _CHAIN_NUMBER,
        "arm": scene.arm.model if scene.arm else None,
        "simulated": simulated,
        "sensors": [[_link_name(link.name), link.frame, _facts(item)] for link in scene.links for item in link.sensors],
    }
    return facts_digest(facts)


def _link_name(name: str) -> str:
    return "".join(ch for ch in name.lower().removesuffix("_link") if ch.isalnum())


def _facts(item: PlacedSensor) -> dict[str, Any]:
    sensor, pose = item.sensor, item.placed.link_frustum
    facts = {**sensor_facts(sensor), "pose": [pose.rotation, pose.translation]}
    if sensor.place_map is not None:
        facts["map"] = [sensor.place_map.along, sensor.place_map.around]
    if bends := item.placed.bends:
        facts["bends"] = [[bend.width, bend.turn] for bend in bends]
        facts["lift"] = item.placed.lift
    return facts


def _record_path(scene: Scene) -> Path:
    """Return the path of a scene's record, which lies beside its file."""
    return scene.folder / f"{Path(scene.name).stem}.commissioning.json"


def write_record(scene: Scene, record: CommissioningRecord) -> Path:
    """Write a scene's record, whole or not at all, in place of an older one; return its path.

    Raises:
        SceneError: it cannot be written.
    """
    path = _record_path(scene)
    with explain_os_error(lambda why: SceneError([why], scene.name), f"the record {path} cannot be written"):
        write_whole(path, json.dumps(asdict(record), indent=2) + "\n")
    return path


def _read_record(path: Path) -> CommissioningRecord:
    """Read a record. Whatever is not one raises an OSError, ValueError, TypeError, AttributeError or KeyError."""
    table = read_json(read_file(path, _MAX_BYTES))
    marks = tuple(MarkResult(**mark) for mark in table.pop("marks"))
    ohms = {str(name): (float(upper), float(lower)) for name, (upper, lower) in table.pop("sheet_ohm", {}).items()}
    record = CommissioningRecord(**table, marks=marks, sheet_ohm=ohms)
    datetime.fromisoformat(record.date)
    return record


def with_commissioning(scene: Scene, now: float) -> Scene:
    """Return a scene with what its record says, where a reaction of it would move the arm away.

    Args:
        scene: what it says of its commissioning already is kept.
        now: computer's date, seconds since 1970.
    """
    if scene.commissioning is not None or not scene.moves_away:
        return scene
    return replace(scene, commissioning=_check(scene, now))


def _check(scene: Scene, now: float) -> Commissioning:
    path = _record_path(scene)
    try:
        record = _read_record(path)
    except FileNotFoundError:
        why = f"there is no commissioning record {path.name}"
    except OSError as exc:
        why = f"the commissioning record {path.name} is of no use, it cannot be read: {exc.strerror or exc}"
    except (ValueError, TypeError, AttributeError, KeyError) as exc:
        why = f"the commissioning record {path.name} is of no use, it is no commissioning record: {exc}"
    else:
        then = datetime.fromisoformat(record.date)
        then = then if then.tzinfo else then.replace(tzinfo=UTC)
        if not (why := _objection(scene, record, f"{then:%Y-%m-%d}", now - then.timestamp())):
            by = f" by {record.by}" if record.by else ""
            note = f"passed on {then:%Y-%m-%d}{by}, {len(record.marks)} marks"
            return Commissioning(True, note, record.sheet_ohm)
    return Commissioning(False, f"{why}: see `coneskin commission`")


def _objection(scene: Scene, record: CommissioningRecord, day: str, age: float) -> str:
    """Return what stands against a record of a day, of this age [s]; empty where it is valid."""
    it, limit = f"the commissioning of {day}", scene.commissioning_max_age
    if record.passed is not True or not record.marks or not all(mark.passed is True for mark in record.marks):
        return f"{it} has failed{f', {record.cause}' if record.cause else ''}"
    if record.fingerprint != fingerprint(scene):
        return (
            f"{it} was of another scene, arm, link, pose, geometry, wiring, electronics or calibration of a sensor, or "
            "the kind of source, is another now"
        )
    if flaw := _flaw(scene, record):
        return f"{it} is not complete, {flaw}"
    if limit is not None and age > limit:
        allowed = f"{limit / _DAY_SECONDS:g} days are allowed (commissioning.max_age_days)"
        return f"{it} is {age / _DAY_SECONDS:.1f} days old, {allowed}"
    if limit is not None and age < -_DAY_SECONDS:
        return f"the commissioning is dated {day}, which is still to come; set the date"
    return ""


def _flaw(scene: Scene, record: CommissioningRecord) -> str:
    """Return what a record lacks that says it has passed; empty where it shows what it has to. Names do not matter."""
    touched = list(dict.fromkeys(mark.sensor for mark in record.marks))
    if len(touched) != len(scene.sensors):
        return f"it has marks on {len(touched)} sensors, and the scene has {len(scene.sensors)}"
    known = [ohms for item in scene.sensors for ohms in record.sheet_ohm.get(item.sensor.number, (0.0, 0.0))]
    if not all(0.0 < ohms < math.inf for ohms in known):
        return "it has no `sheet_ohm` of each sensor, by which a peeled electrode would show"
    for name in touched:
        marks = [mark for mark in record.marks if mark.sensor == name]
        places = {(mark.u_mm, mark.phi_deg) for mark in marks}
        if len(places) < MIN_MARKS:
            return f"{name} has marks at {len(places)} places, and {MIN_MARKS} are needed"
        for mark in marks:
            along = 1e-3 * abs(mark.read_u_mm - mark.u_mm)
            around = abs(math.remainder(math.radians(mark.read_phi_deg - mark.phi_deg), 2.0 * math.pi))
            if not (along <= MAX_MISS[0] and around <= MAX_MISS[1]):
                off = f"{1e3 * along:.0f} mm and {math.degrees(around):.0f} deg"
                return f"a mark on {name} was read {off} off, {1e3 * MAX_MISS[0]:g} mm and 25 deg are allowed"
            if not mark.level > 0.0:
                return f"a mark on {name} has the level {mark.level:g}, at which nothing touches"
    return ""
