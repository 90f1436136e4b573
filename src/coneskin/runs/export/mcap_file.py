"""MCAP file of a run, which Foxglove draws: events as a log, joints and touch level as plots, the arm as a 3D scene.

The messages are JSON in the shapes of Foxglove (foxglove.Log, foxglove.SceneUpdate) and four of our own for plots. A
schema is made of a message of its kind.

Source: the message schemas of Foxglove, https://docs.foxglove.dev/docs/sdk/schemas (Log, SceneUpdate).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from heapq import merge
from pathlib import Path
from typing import Any, NamedTuple

from coneskin.core.errors import ConeSkinError, needed_package
from coneskin.core.progress import Progress, silent
from coneskin.core.text import printable
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.workspace import skeleton
from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.signals.journal import CONTACT_EVENTS, EventName, GuardEvent
from coneskin.runs.decisions import recorded_commands
from coneskin.runs.replay.run import Run
from coneskin.scene.build import SensorOnArm
from coneskin.skin.detection.frame.reading import read

_STATE_WINDOW = 1.0  # s between a contact and the state of the arm in which it is drawn
_DRAWN_EVERY = 0.02  # s between two drawings of the arm
_FRAME_ID = "base"
_ERROR_EVENTS = frozenset(
    {EventName.FAULT, EventName.STOP_FAILED, EventName.GUARD_UNRESPONSIVE, EventName.GUARD_EXITED}
)
_WARNING_EVENTS = frozenset({EventName.CONTACT, EventName.STOPPING, EventName.ESCALATED, EventName.NOT_COMMISSIONED})
_INFO, _WARNING, _ERROR = 2, 3, 4  # levels of foxglove.Log


class _Message(NamedTuple):
    """One message: its topic, its schema, host time [s] and value."""

    topic: str
    schema: str
    time: float
    value: dict[str, Any]


def write_mcap(run: Run, path: Path, progress: Progress = silent) -> int:
    """Write a run as an MCAP file and return the number of messages; arguments as of ``export_run``.

    Raises:
        MissingExtra: mcap is not installed.
        SceneError: this version of coneskin cannot read the scene.
    """
    with needed_package("mcap", "an MCAP file", "mcap"):
        from mcap.writer import Writer
    messages = merge(*_streams(run, progress), key=lambda message: message.time)
    number = -1
    unix = run.unix_offset
    with path.open("xb") as file:
        writer = Writer(file)
        writer.start(profile="", library="coneskin")
        channels: dict[str, int] = {}
        schemas: dict[str, int] = {}
        for number, message in enumerate(messages):
            if message.topic not in channels:
                if message.schema not in schemas:
                    schema = {"title": message.schema, **_schema_of(_examples().get(message.schema, message.value))}
                    schemas[message.schema] = writer.register_schema(
                        message.schema, "jsonschema", json.dumps(schema).encode()
                    )
                channels[message.topic] = writer.register_channel(message.topic, "json", schemas[message.schema])
            stamp = round(1e9 * (message.time + unix))
            writer.add_message(channels[message.topic], stamp, json.dumps(message.value).encode(), stamp, number)
        writer.add_metadata("coneskin", {"scene": run.header["scene"], "missing": run.missing})
        writer.finish()
    return number + 1


def _streams(run: Run, progress: Progress) -> list[Iterable[_Message]]:
    """Return the messages of each kind in the order of time, read from the run one after the other."""
    unix, events = run.unix_offset, sorted(run.events, key=lambda event: event.time)
    logs = [_Message("/events", "foxglove.Log", event.time, _log(event, run, unix)) for event in events]
    streams: list[Iterable[_Message]] = [
        logs,
        _levels(run, progress),
        (_Message("/slider", "coneskin.SpeedSlider", time, {"fraction": value}) for time, value in run.slider()),
        _commands(run),
        (_Message("/arm", "coneskin.ArmState", state.time, _joints(state)) for state in run.states()),
    ]
    if (scene := run.scene()).arm is not None:
        arm, placed = scene.arm.arm_model, run.place_sensors()
        streams += [_drawn_arm(run, arm, placed, unix), _drawn_contacts(run, arm, placed, events, unix)]
    return streams


def _levels(run: Run, progress: Progress) -> Iterator[_Message]:
    sensors = {(item.sensor.device_id, item.sensor.sensor_id): item.sensor for item in run.scene().sensors}
    for time, frame in run.frames(progress):
        if (sensor := sensors.get((frame.device, frame.sensor))) is not None:
            value = {"sensor": sensor.name, "level": read(sensor, frame).level, "clock_us": frame.clock_us}
            yield _Message(f"/skin/{frame.device}_{frame.sensor}", "coneskin.TouchLevel", time, value)


def _commands(run: Run) -> Iterator[_Message]:
    for command in recorded_commands(run.blocks):
        value = {"command": command.what, "numbers": [n for n in command.numbers if math.isfinite(n)]}
        if math.isfinite(command.time):
            yield _Message("/commands", "coneskin.Command", command.time, value)


def _joints(state: ControllerState) -> dict[str, float]:
    units = (("q", "rad"), ("qd", "rad_s"))
    return {
        f"{name}{joint}_{unit}": number for name, unit in units for joint, number in enumerate(getattr(state, name), 1)
    }


def _log(event: GuardEvent, run: Run, unix: float) -> dict[str, Any]:
    (line,) = run.timeline([event])
    level = _ERROR if event.name in _ERROR_EVENTS else _WARNING if event.name in _WARNING_EVENTS else _INFO
    text = printable(line.split(" s  ", 1)[-1])
    said = {"level": level, "message": text, "name": event.name.value, "file": "", "line": 0}
    return {"timestamp": _stamp(event.time + unix), **said}


def _drawn_arm(run: Run, arm: ArmModel, placed: Sequence[SensorOnArm], unix: float) -> Iterator[_Message]:
    """Yield the arm with its sensors."""
    due = -math.inf
    for state in run.states():
        if state.time >= due:
            due = state.time + _DRAWN_EVERY
            lines = [_line([*skeleton(arm, state.q)], (0.4, 0.45, 0.5), 0.05)]
            for item in placed:
                lines += _rings(item, arm, state)
            value = _update("arm", state.time + unix, lines)
            yield _Message("/drawing/arm", "foxglove.SceneUpdate", state.time, value)


def _drawn_contacts(
    run: Run, arm: ArmModel, placed: Sequence[SensorOnArm], events: Sequence[GuardEvent], unix: float
) -> Iterator[_Message]:
    """Yield each contact at the moment at which its place was known."""
    by_name = {item.name: item for item in placed}
    for number, event in enumerate(events):
        touched = by_name.get(str(event.details.get("sensor")))
        if event.name not in CONTACT_EVENTS or touched is None:
            continue
        near = run.states(event.time - _STATE_WINDOW, event.time + _STATE_WINDOW)
        state = min(near, key=lambda one: abs(one.time - event.time), default=None)
        if state is None:
            continue
        base_link = link_pose(arm, state.q, touched.link)
        try:
            point, normal = base_link.apply(event.details["point"]), base_link.rotate(event.details["normal"])
        except (ConeSkinError, LookupError, TypeError, ValueError):  # another version's event
            continue
        tip = tuple(p + 0.2 * n for p, n in zip(point, normal, strict=True))
        normal_line = _line([point, tip], (0.9, 0.1, 0.1), 0.008)
        value = _update(f"contact {number}", event.time + unix, [normal_line], [_sphere(point)])
        yield _Message("/drawing/contacts", "foxglove.SceneUpdate", event.time, value)


def _rings(item: SensorOnArm, arm: ArmModel, state: ControllerState) -> list[dict[str, Any]]:
    base_link, frustum = link_pose(arm, state.q, item.link), item.frustum.frustum
    rings = []
    for u in (0.0, 0.5, 1.0):
        points = [base_link.apply(item.frustum.point(u * frustum.slant, frustum.wrap * k / 24)) for k in range(25)]
        rings.append(_line(points, (0.1, 0.6, 0.2), 0.004))
    return rings


_JSON_TYPES = {str: "string", bool: "boolean", int: "integer", float: "number"}


def _examples() -> dict[str, dict[str, Any]]:
    """Return messages whose lists hold something, of the kinds that have lists: schema -> value."""
    point = (0.0, 0.0, 0.0)
    drawn = _update("", 0.0, [_line([point], point, 0.0)], [_sphere(point)])
    return {"foxglove.SceneUpdate": drawn, "coneskin.Command": {"command": "", "numbers": [0.0]}}


def _schema_of(value: Any) -> dict[str, Any]:
    """Return the JSON schema of a message: each of its kind has the same keys. What a list never holds is an object."""
    if isinstance(value, dict):
        return {"type": "object", "properties": {k: _schema_of(v) for k, v in value.items()}, "required": list(value)}
    if isinstance(value, list):
        return {"type": "array", "items": _schema_of(value[0] if value else {})}
    return {"type": _JSON_TYPES[type(value)]}


def _stamp(unix: float) -> dict[str, int]:
    seconds = math.floor(unix)
    return {"sec": seconds, "nsec": min(999_999_999, round(1e9 * (unix - seconds)))}


def _colour(red: float, green: float, blue: float) -> dict[str, float]:
    return {"r": red, "g": green, "b": blue, "a": 1.0}


def _at(point: Any = (0.0, 0.0, 0.0)) -> dict[str, Any]:
    x, y, z = point
    return {"position": {"x": x, "y": y, "z": z}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


def _line(points: list[Any], colour: tuple[float, float, float], thickness: float) -> dict[str, Any]:
    return {
        "type": 0,  # a strip
        "pose": _at(),
        "thickness": thickness,
        "scale_invariant": False,
        "points": [{"x": x, "y": y, "z": z} for x, y, z in points],
        "color": _colour(*colour),
        "colors": [],
        "indices": [],
    }


def _sphere(point: Any) -> dict[str, Any]:
    return {"pose": _at(point), "size": {"x": 0.03, "y": 0.03, "z": 0.03}, "color": _colour(0.9, 0.1, 0.1)}


def _update(
    ident: str, unix: float, lines: list[dict[str, Any]], spheres: Sequence[dict[str, Any]] = ()
) -> dict[str, Any]:
    entity = {
        "timestamp": _stamp(unix),
        "frame_id": _FRAME_ID,
        "id": ident,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        "lines": lines,
        "spheres": list(spheres),
        **{kind: [] for kind in ("arrows", "cubes", "cylinders", "triangles", "texts", "models")},
    }
    return {"deletions": [], "entities": [entity]}
