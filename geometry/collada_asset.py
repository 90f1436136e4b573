"""What a COLLADA file says of itself: its unit and its up axis."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

from coneskin.core.errors import MeshError

__all__ = ["TO_Z_UP", "ColladaAsset", "read_collada_asset"]

#: rotations that bring the named up axis to z, as COLLADA 1.4.1 describes the three frames
TO_Z_UP = {
    "X_UP": ((0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)),
    "Y_UP": ((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)),
    "Z_UP": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
}

_DEEPEST = 3  # elements within each other down to the unit: COLLADA, asset, unit


@dataclass(frozen=True, slots=True)
class ColladaAsset:
    """The asset element of a COLLADA document.

    Attributes:
        unit: name of the unit.
        metres: length of the unit [m].
        up_axis: a key of ``TO_Z_UP``.
    """

    unit: str = "m"  # COLLADA's own defaults for missing elements
    metres: float = 1.0
    up_axis: str = "Y_UP"


def read_collada_asset(path: Path, data: bytes) -> ColladaAsset:
    """Read unit and up axis of a COLLADA file, whose entities are known to be harmless.

    Args:
        path: its name, for messages.
        data: its bytes.

    Raises:
        MeshError: malformed XML, a unit that is no length, an unknown axis.
    """
    asset = ColladaAsset()
    within: list[str] = []
    try:
        for event, element in ElementTree.iterparse(io.BytesIO(data), ("start", "end")):
            if event == "start":
                within.append(element.tag.rpartition("}")[2])
                continue
            # a tool's own unit may stand in an extra inside, and parts of the document have assets of their own
            inside = (
                within[1:] if len(within) <= _DEEPEST else []
            )  # a deep document would be copied at each of its ends
            within.pop()
            if inside == ["asset", "unit"]:
                asset = replace(asset, unit=element.get("name", "unit"), metres=float(element.get("meter", "1")))
            elif inside == ["asset", "up_axis"]:
                asset = replace(asset, up_axis=(element.text or asset.up_axis).strip())
            elif inside == ["asset"]:
                break
    except ElementTree.ParseError as error:
        raise MeshError(f"{path}: malformed XML: {error}") from error
    except ValueError as error:
        raise MeshError(f"{path}: the unit tag must hold a number of metres: {error}") from error
    if not (math.isfinite(asset.metres) and asset.metres > 0.0):
        raise MeshError(f"{path}: the unit tag must hold metres above 0, got {asset.metres}")
    if asset.up_axis not in TO_Z_UP:
        raise MeshError(f"{path}: up_axis must be X_UP, Y_UP or Z_UP, got {asset.up_axis!r}")
    return asset
