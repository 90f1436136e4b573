"""JSON schemas of the messages in an MCAP file: Foxglove knows the two of its own by their names, and plots the rest.

Source: the message schemas of Foxglove, https://docs.foxglove.dev/docs/sdk/schemas (Log, SceneUpdate).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["SCHEMAS"]

_Schema = dict[str, Any]


def _object(title: str = "", **properties: _Schema) -> _Schema:
    named = {"title": title} if title else {}
    return {**named, "type": "object", "properties": properties, "required": list(properties)}


def _list(items: _Schema) -> _Schema:
    return {"type": "array", "items": items}


_TEXT, _NUMBER, _WHOLE, _FLAG = ({"type": name} for name in ("string", "number", "integer", "boolean"))
_UNSIGNED = {"type": "integer", "minimum": 0}
_NANOSECONDS = {"type": "integer", "minimum": 0, "maximum": 999_999_999}
_TIME = _object("time", sec=_UNSIGNED, nsec=_NANOSECONDS)
_DURATION = _object("duration", sec=_WHOLE, nsec=_NANOSECONDS)
_VECTOR = _object("foxglove.Vector3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_POINT = _object("foxglove.Point3", x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object("foxglove.Quaternion", x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object("foxglove.Pose", position=_VECTOR, orientation=_QUATERNION)
_COLOUR = _object("foxglove.Color", r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_LINE = _object(
    "foxglove.LinePrimitive",
    type={"enum": [0, 1, 2]},
    pose=_POSE,
    thickness=_NUMBER,
    scale_invariant=_FLAG,
    points=_list(_POINT),
    color=_COLOUR,
    colors=_list(_COLOUR),
    indices=_list(_UNSIGNED),
)
_SPHERE = _object("foxglove.SpherePrimitive", pose=_POSE, size=_VECTOR, color=_COLOUR)
_UNUSED = _list({"type": "object"})
_ENTITY = _object(
    "foxglove.SceneEntity",
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_DURATION,
    frame_locked=_FLAG,
    metadata=_list(_object("foxglove.KeyValuePair", key=_TEXT, value=_TEXT)),
    arrows=_UNUSED,
    cubes=_UNUSED,
    spheres=_list(_SPHERE),
    cylinders=_UNUSED,
    lines=_list(_LINE),
    triangles=_UNUSED,
    texts=_UNUSED,
    models=_UNUSED,
)
_LOG = _object(
    "foxglove.Log",
    timestamp=_TIME,
    level={"enum": [0, 1, 2, 3, 4, 5]},
    message=_TEXT,
    name=_TEXT,
    file=_TEXT,
    line=_UNSIGNED,
)
_JOINTS = {f"{name}{joint}_{unit}": _NUMBER for name, unit in (("q", "rad"), ("qd", "rad_s")) for joint in range(1, 7)}

#: name -> JSON schema
SCHEMAS: Mapping[str, _Schema] = {
    "foxglove.Log": _LOG,
    "foxglove.SceneUpdate": _object("foxglove.SceneUpdate", deletions=_UNUSED, entities=_list(_ENTITY)),
    "coneskin.ArmState": _object("coneskin.ArmState", **_JOINTS),
    "coneskin.SpeedSlider": _object("coneskin.SpeedSlider", fraction=_NUMBER),
    "coneskin.Command": _object("coneskin.Command", command=_TEXT, numbers=_list(_NUMBER)),
    "coneskin.TouchLevel": _object("coneskin.TouchLevel", sensor=_TEXT, level=_NUMBER, clock_us=_UNSIGNED),
}
