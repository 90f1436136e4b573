"""Keys of one sensor, in a scene and in a sensor file, and of the cone of a link.

``coneskin design`` writes sensor files by them, and the command line derives its options from them. The plain names of
the keys of a cone are the attributes of ``Frustum``.
"""

from __future__ import annotations

import math
from dataclasses import replace

from coneskin.core.keys import Key, with_meanings

#: the active cone of a sensor, in a scene and in a sensor file; a sensor cannot reach an apex
CONE_KEYS = _RADIUS1_KEY, _RADIUS2_KEY, _HEIGHT_KEY, _WRAP_KEY = with_meanings(
    """
    radius1_mm: radius at end 1, the arc of electrode B
    radius2_mm: radius at end 2, the arc of electrode A
    height_mm: distance between the ends along the axis, 0 for a flat ring
    wrap_deg: angle covered about the axis, from electrode D (phi = 0) to C
    """,
    Key("radius1_mm", low=1.0, high=5000.0),
    Key("radius2_mm", low=1.0, high=5000.0),
    Key("height_mm", low=1.0, high=10_000.0, or_zero=True),
    Key("wrap_deg", default=2.0 * math.pi, low=0.0, high=360.0, above=True),
)
#: the side of a link, on the command line; a radius of 0 is an apex
LINK_CONE_KEYS = (
    replace(_RADIUS1_KEY, or_zero=True, meaning="radius at end 1"),
    replace(_RADIUS2_KEY, or_zero=True, meaning="radius at end 2"),
    _HEIGHT_KEY,
    replace(_WRAP_KEY, meaning="angle covered about the axis"),
)
#: the same, with a second cone on end 2 of the first
DOUBLE_CONE_KEYS = (
    *LINK_CONE_KEYS[:3],
    replace(_RADIUS2_KEY, name="radius3_mm", or_zero=True, meaning="far radius of a second cone on end 2"),
    replace(_HEIGHT_KEY, name="height2_mm", meaning="height of the second cone"),
    LINK_CONE_KEYS[3],
)
_BEND_KEYS = with_meanings(
    """
    bend_wrap_deg: of a link that is not round: shares of the wrap from phi = 0 on, each bent evenly. They add up to
        `wrap_deg`. `coneskin design` writes them
    bend_turn_deg: angle by which the normal turns across each share, 0 for a plane. The cone's u, phi and lengths
        stay. Its ends are then as long as the link is around
    bend_lift_mm: height of the sensor above the side whose rulings meet in one point, or are parallel. The bends
        are those of the link, at their places on the sensor
    """,
    Key("bend_wrap_deg", list, (), low=0.0, high=360.0, above=True),
    Key("bend_turn_deg", list, (), low=-360.0, high=360.0),
    Key("bend_lift_mm", float, 0.0, low=0.0, high=100.0),
)
_PLACE_KEYS = with_meanings(
    """
    xyz_mm: where the middle of end 1 is, in the link's `frame`
    rpy_deg: roll, pitch, yaw about the fixed axes, as in URDF. z runs from end 1 to end 2, x points at phi = 0
    """,
    Key("xyz_mm", list, (0.0, 0.0, 0.0), low=-10_000.0, high=10_000.0, length=3),
    Key("rpy_deg", list, (0.0, 0.0, 0.0), low=-360.0, high=360.0, length=3),
)
_WIRE_KEYS = with_meanings(
    """
    id: number of the sensor on the wire
    device: number of its electronics on the wire
    name: its name in events and messages. Two sensors must not share one
    """,
    Key("id", int, 0, low=0, high=255),
    Key("device", int, 0, low=0, high=65535),
    Key("name", str, "", unset="from its numbers"),
)
_POLARITY_KEYS = with_meanings(
    """
    radial_positive: which arc electrode is at the supply in the radial phase
    angular_positive: which edge electrode is at the supply in the angular phase
    """,
    Key("radial_positive", str, "B", choices=("A", "B")),
    Key("angular_positive", str, "C", choices=("C", "D")),
)
_MATCHED_WORDS = "matches the sheets"
_ELECTRONICS_KEYS = with_meanings(
    """
    supply_v: potential of the positive electrode, U0; at most 95 % of `adc_v`
    adc_v: potential of the highest count of the A/D converter
    adc_bits: resolution of the A/D converter
    pulldown_ohm: from C and D to ground in the touch phase
    input_ohm: from each guide to ground in the other phases; at least 10 times `pulldown_ohm`
    lead_ohm: wire and switch of each electrode: one number for all, or a list for A, B, C, D
    current_full_scale_ma: drive current of the highest count
    current_zero_ma: drive current that the count of no current stands for, as the board's bias makes it
    """,
    Key("supply_v", float, None, low=0.1, high=50.0, unset=_MATCHED_WORDS),
    Key("adc_v", float, 3.3, low=0.1, high=50.0),
    Key("adc_bits", int, None, low=8, high=16, unset=_MATCHED_WORDS),
    Key("pulldown_ohm", float, None, low=1.0, high=1e9, unset=_MATCHED_WORDS),
    Key("input_ohm", float, 10e6, low=1.0, high=1e12),
    Key("lead_ohm", list, (1.0,) * 4, low=0.0, high=1e6, length=4, above=True, one_for_all=True),
    Key("current_full_scale_ma", float, None, low=1e-3, high=1e4, unset=_MATCHED_WORDS),
    Key("current_zero_ma", float, 0.0, low=0.0, high=1e3),
)
_SHEET_KEYS = with_meanings(
    """
    upper_sheet_ohm: resistance of the upper conductive layer per square
    lower_sheet_ohm: resistance of the lower conductive layer per square
    sheet_class: how uniform they are: `film` (sputtered or printed, as of touch panels), `coated` (hand-cut carbon
        film, textile) or `ideal`. Without a calibration, the doubt of each place follows from it; it holds a fifth of
        an electrode that has peeled off, too, which no reading shows
    """,
    Key("upper_sheet_ohm", float, 1000.0, low=1e-3, high=1e9),
    Key("lower_sheet_ohm", float, 1000.0, low=1e-3, high=1e9),
    Key("sheet_class", str, "film", choices=("film", "coated", "ideal")),
)
_THRESHOLD_KEYS = with_meanings(
    """
    touch_level: level from which the sensor is touched
    touch_force_n: the same as a force, in place of `touch_level`. It needs a calibration with known forces, and one
        of those. `location_level` then is no lower
    release_level: level below which a touch has ended; below `touch_level`
    location_level: level from which the place of a touch is valid; not below `touch_level`
    """,
    Key("touch_level", float, 0.10, low=0.0, high=1.0, above=True),
    Key("touch_force_n", float, None, low=0.01, high=1000.0),
    Key("release_level", float, 0.05, low=0.03, high=1.0, above=True),
    Key("location_level", float, 0.20, low=0.0, high=1.0, above=True),
)
#: that a calibration stands for
CALIBRATION_KEYS = with_meanings(
    """
    map_along: what a calibration takes off places along the side; `calibration` gives it
    map_around: what a calibration takes off places about the axis; `calibration` gives it
    map_error_mm: standard deviation of a calibrated place, along and around; `calibration` gives it
    map_note: where `map_along` and `map_around` come from
    map_sheet_ohm: the sheets' ohm per square, as `calibration` gives it
    forces_n: known forces of a calibration, rising; `calibration` gives them
    force_levels: levels that the known forces gave
    force_error: standard deviation of a force that is read, as a share of it
    """,
    Key("map_along", list, None, low=-0.25, high=0.25, length=6),
    Key("map_around", list, None, low=-0.25, high=0.25, length=6),
    Key("map_error_mm", float, None, low=0.0, high=100.0),
    Key("map_note", str, ""),
    Key("map_sheet_ohm", list, None, low=1e-3, high=1e9, length=2),
    Key("forces_n", list, None, low=0.0, high=1000.0),
    Key("force_levels", list, None, low=0.0, high=1.0),
    Key("force_error", float, 0.0, low=0.0, high=0.99),
)
SENSOR_KEYS = (
    *(*CONE_KEYS, *_BEND_KEYS, *_PLACE_KEYS, *_WIRE_KEYS, *_POLARITY_KEYS),
    *(*_ELECTRONICS_KEYS, *_SHEET_KEYS, *_THRESHOLD_KEYS, *CALIBRATION_KEYS),
)
