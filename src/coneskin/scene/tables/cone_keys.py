"""Keys for the dimensions of a cone: the only table of their names, units, ranges and meanings.

Scene files and sensor files read it, ``coneskin design`` writes sensor files by it, and the command line derives its
options from it. The plain names of the keys are the attributes of ``Frustum``.
"""

from __future__ import annotations

import math
from dataclasses import replace

from .schema import Key

__all__ = ["CONE_KEYS", "DOUBLE_CONE_KEYS", "LINK_CONE_KEYS"]

_RADIUS1 = Key("radius1_mm", low=1.0, high=5000.0, meaning="radius at end 1")
_RADIUS2 = Key("radius2_mm", low=1.0, high=5000.0, meaning="radius at end 2")
_HEIGHT = Key(  # 0 is a flat ring
    "height_mm", low=1.0, high=10_000.0, or_zero=True, meaning="distance between the ends along the axis"
)
_WRAP = Key("wrap_deg", default=2.0 * math.pi, low=0.0, high=360.0, above=True, meaning="angle covered about the axis")

#: the active cone of a sensor, in a scene and in a sensor file; a sensor cannot reach an apex
CONE_KEYS = (_RADIUS1, _RADIUS2, _HEIGHT, _WRAP)
#: the side of a link, on the command line; a radius of 0 is an apex
LINK_CONE_KEYS = (replace(_RADIUS1, or_zero=True), replace(_RADIUS2, or_zero=True), _HEIGHT, _WRAP)
#: the same, with a second cone on end 2 of the first
DOUBLE_CONE_KEYS = (
    *LINK_CONE_KEYS[:3],
    replace(_RADIUS2, name="radius3_mm", or_zero=True, meaning="far radius of a second cone on end 2"),
    replace(_HEIGHT, name="height2_mm", meaning="height of the second cone"),
    _WRAP,
)
