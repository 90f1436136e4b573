"""Keys of one sensor's table: cone, bends, place, wires, electronics, sheets, thresholds, calibration."""

from __future__ import annotations

from .cone_keys import CONE_KEYS
from .schema import Key

__all__ = ["CALIBRATION_KEYS", "SENSOR_KEYS"]

_PLACE = (
    Key("xyz_mm", list, (0.0, 0.0, 0.0), low=-10_000.0, high=10_000.0, length=3),
    Key("rpy_deg", list, (0.0, 0.0, 0.0), low=-360.0, high=360.0, length=3),
)
_BENDS = (
    Key("bend_wrap_deg", list, (), low=0.0, high=360.0, above=True, meaning="shares of the wrap, evenly bent each"),
    Key("bend_turn_deg", list, (), low=-360.0, high=360.0, meaning="angle by which each of them turns the normal"),
    Key("bend_lift_mm", float, 0.0, low=0.0, high=100.0, meaning="height above a side whose rulings meet in a point"),
)
_WIRE = (
    Key("id", int, 0, low=0, high=255),
    Key("device", int, 0, low=0, high=65535),
    Key("name", str, ""),
)
_POLARITY = (
    Key("radial_positive", str, "B", choices=("A", "B")),
    Key("angular_positive", str, "C", choices=("C", "D")),
)
_ELECTRONICS = (
    Key("supply_v", float, None, low=0.1, high=50.0, meaning="potential of the positive electrode"),
    Key("adc_v", float, 3.3, low=0.1, high=50.0, meaning="potential of the highest count of the A/D converter"),
    Key("adc_bits", int, None, low=8, high=16, meaning="resolution of the A/D converter"),
    Key("pulldown_ohm", float, None, low=1.0, high=1e9, meaning="from C and D to ground in the touch phase"),
    Key("input_ohm", float, 10e6, low=1.0, high=1e12),
    Key("lead_ohm", list, (1.0,) * 4, low=0.0, high=1e6, length=4, above=True, one_for_all=True),
    Key("current_full_scale_ma", float, None, low=1e-3, high=1e4, meaning="drive current of the highest count"),
)
_SHEETS = (
    Key(
        "upper_sheet_ohm",
        float,
        1000.0,
        low=1e-3,
        high=1e9,
        meaning="resistance of the upper conductive layer per square",
    ),
    Key(
        "lower_sheet_ohm",
        float,
        1000.0,
        low=1e-3,
        high=1e9,
        meaning="resistance of the lower conductive layer per square",
    ),
)
_THRESHOLDS = (
    Key("touch_level", float, 0.10, low=0.0, high=1.0, above=True),
    Key("touch_force_n", float, None, low=0.01, high=1000.0, meaning="force of the touch threshold"),
    Key("release_level", float, 0.05, low=0.03, high=1.0, above=True),  # above the drift that the detector compensates
    Key("location_level", float, 0.20, low=0.0, high=1.0, above=True),
)
#: that a calibration stands for
CALIBRATION_KEYS = (
    Key("map_along", list, None, low=-0.1, high=0.1, length=5, meaning="numbers of a calibration"),
    Key("map_around", list, None, low=-0.1, high=0.1, length=5, meaning="numbers of a calibration"),
    Key("map_note", str, ""),
    Key("forces_n", list, None, low=0.0, high=1000.0, meaning="known forces of a calibration"),
    Key("force_levels", list, None, low=0.0, high=1.0, meaning="levels that they gave"),
    Key("force_error", float, 0.0, low=0.0, high=0.99, meaning="standard deviation of a force, of itself"),
)
#: of one sensor
SENSOR_KEYS = (
    *(*CONE_KEYS, *_BENDS, *_PLACE, *_WIRE, *_POLARITY),
    *(*_ELECTRONICS, *_SHEETS, *_THRESHOLDS, *CALIBRATION_KEYS),
)
