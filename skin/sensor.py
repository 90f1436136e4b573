"""Sensor: two conducting sheets on the side of a truncated cone, and the law from potentials to a place.

Symbols (paper, section 2): U0 supply, Ur and Ut the potentials at the contact in the radial and in the angular phase,
r1, r2, theta0 the flat sector (r1 at end 1), r and theta the polar coordinates of the contact on it.
Inside, everything is written in the surface coordinates u (slant distance from end 1) and phi (azimuth), which stay
finite where a cone becomes a cylinder: theta = phi theta0 / wrap, |dr| = |du|.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum

from .electronics import Electronics, Polarity, Thresholds, match_electronics
from .sheet_functions import LogScale
from .tolerance import FILM_SHEETS, SheetTolerance

if TYPE_CHECKING:
    from .calibration import ForceTable, PlaceMap

_MATCHED_ELECTRONICS = Electronics()  # this very object: to be chosen
_MIN_NOMINAL_COUNTS = 16  # counts; half of it, the limit for an open wire, is well above noise


def sheet_resistances(frustum: Frustum, upper_sheet_ohms: float, lower_sheet_ohms: float) -> tuple[float, float]:
    """Return the resistances of the untouched sheets between their electrodes, A to B and C to D [ohm].

    Args:
        upper_sheet_ohms: sheet resistance of the upper layer [ohm per square].
        lower_sheet_ohms: sheet resistance of the lower layer [ohm per square].

    Raises:
        SensorError: an end is an apex, which has no arc for an electrode.
    """
    for end, radius in ((1, frustum.radius1), (2, frustum.radius2)):
        if radius <= 0.0:
            raise SensorError(
                f"frustum.radius{end} must be above 0 m for a sensor: an apex has no arc for an electrode, and "
                f"eq. 20 has no limit there; got {radius!r} m"
            )
    breadth = frustum.wrap * LogScale(frustum.radius1, frustum.radius2, frustum.slant).mean_radius
    return upper_sheet_ohms * frustum.slant / breadth, lower_sheet_ohms * breadth / frustum.slant


class _Bounds(NamedTuple):
    """The limits of a sensor in counts of its converter, computed once for the live path."""

    full: int  #: highest count
    supply_low: int
    supply_high: int
    radial_low: int  #: drive current of the radial phase
    radial_high: int
    angular_low: int  #: drive current of the angular phase
    angular_high: int
    touch_current_per_guide: float  #: counts of drive current for one count on one guide in the touch phase
    touch_current_slack: float  #: allowed difference [counts of drive current]
    weaker_guide: float  #: in a touch, the lower guide is at least this ratio of the higher
    noise: int  #: counts that mean nothing
    radial_drop: float  #: counts of potential lost on both leads together for one count of drive current
    angular_drop: float
    load_ratio: float  #: pull-down over guide input resistance


@dataclass(frozen=True, slots=True)
class Sensor:
    """One annular-sector sensor with its electronics.

    Attributes:
        frustum: the active area: between the inner rims of the arc electrodes, from electrode D (phi = 0) to C.
        sensor_id: number of the sensor on the wire, 0..255.
        electronics: supply, converter, resistors; by default those that match the sheets (``match_electronics``).
        polarity: which electrode of each pair is positive.
        thresholds: from where on a value counts.
        device_id: number of the electronics on the wire, 0..65535.
        upper_sheet_ohms: sheet resistance of the upper layer, electrodes A and B [ohm per square].
        lower_sheet_ohms: sheet resistance of the lower layer, electrodes C and D [ohm per square].
        name: what people call it; by default its numbers.
        place_map: what its calibration takes off the places that it reads; None where it has none.
        force_table: what force its level stands for; None where no calibration has shown it.
        tolerance: what is not ideal about its sheets and not taken off by its calibration.
        known_ohms: what its untouched sheets had per square when touches last showed that its places are right, upper
            and lower [ohm]; empty where nobody knows.
        bounds: its limits in counts, for the live path.
        b_positive: B, not A, is at the supply in the radial phase.
        c_positive: C, not D, is at the supply in the angular phase.

    Raises:
        SensorError: an end of the frustum has no arc for an electrode, a number does not fit the wire, the normal drive
            current does not fit the range in which it is measured, or the place map is that of another frustum.
    """

    frustum: Frustum
    sensor_id: int = 0
    electronics: Electronics = _MATCHED_ELECTRONICS
    polarity: Polarity = field(default_factory=Polarity)
    thresholds: Thresholds = field(default_factory=Thresholds)
    device_id: int = 0
    upper_sheet_ohms: float = 1000.0
    lower_sheet_ohms: float = 1000.0
    name: str = ""
    place_map: PlaceMap | None = None
    force_table: ForceTable | None = None
    tolerance: SheetTolerance = FILM_SHEETS
    known_ohms: tuple[float, ...] = ()
    bounds: _Bounds = field(init=False, repr=False, compare=False)
    _from_end1: LogScale = field(init=False, repr=False, compare=False)
    _from_end2: LogScale = field(init=False, repr=False, compare=False)
    b_positive: bool = field(init=False, repr=False, compare=False)
    c_positive: bool = field(init=False, repr=False, compare=False)
    _wrap: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        cone = self.frustum
        sheet_resistances(cone, 1.0, 1.0)  # refuses an apex
        for name, top in (("sensor_id", 0xFF), ("device_id", 0xFFFF)):
            value = getattr(self, name)
            if not (isinstance(value, int) and 0 <= value <= top):
                raise SensorError(f"{name} must be a whole number from 0 to {top}, got {value!r}")
        for name in ("upper_sheet_ohms", "lower_sheet_ohms"):
            value = getattr(self, name)
            if not 0.0 < value < float("inf"):
                raise SensorError(f"{name} must be finite and above 0 ohm per square, got {value!r}")
        if self.place_map is not None and self.place_map.frustum != cone:
            raise SensorError(f"place_map must be one of {cone}, got one of {self.place_map.frustum}")
        put = object.__setattr__
        put(self, "name", self.name or f"sensor {self.number}")
        put(self, "_from_end1", LogScale(cone.radius1, cone.radius2, cone.slant))
        put(self, "_from_end2", LogScale(cone.radius2, cone.radius1, cone.slant))
        if self.electronics is _MATCHED_ELECTRONICS:
            put(self, "electronics", match_electronics(self.radial_ohms, self.angular_ohms))
        put(self, "b_positive", self.polarity.radial == "B")
        put(self, "c_positive", self.polarity.angular == "C")
        put(self, "_wrap", cone.wrap)
        put(self, "bounds", self._work_out_bounds())

    @property
    def number(self) -> str:
        """Device and sensor number, as 0/1."""
        return f"{self.device_id}/{self.sensor_id}"

    @property
    def radial_ohms(self) -> float:
        """Resistance of the untouched upper sheet from A to B [ohm]."""
        return sheet_resistances(self.frustum, self.upper_sheet_ohms, self.lower_sheet_ohms)[0]

    @property
    def angular_ohms(self) -> float:
        """Resistance of the untouched lower sheet from C to D [ohm]."""
        return sheet_resistances(self.frustum, self.upper_sheet_ohms, self.lower_sheet_ohms)[1]

    def sheet_ohms(self, upper: float, lower: float) -> tuple[float, float]:
        """Return what the upper and the lower sheet have per square [ohm] with such conductances [S]."""
        return self.upper_sheet_ohms / (self.radial_ohms * upper), self.lower_sheet_ohms / (self.angular_ohms * lower)

    @property
    def radial_amperes(self) -> float:
        """Drive current of the untouched sensor in the radial phase [A]."""
        return self.electronics.supply_volts / (
            self.radial_ohms + self.electronics.lead_ohms.a + self.electronics.lead_ohms.b
        )

    @property
    def angular_amperes(self) -> float:
        """Drive current of the untouched sensor in the angular phase [A]."""
        return self.electronics.supply_volts / (
            self.angular_ohms + self.electronics.lead_ohms.c + self.electronics.lead_ohms.d
        )

    def fractions(self, u: float, phi: float) -> tuple[float, float]:
        """Return the potentials at a place as fractions of the supply (eq. 19, 22).

        Args:
            u: slant distance from end 1 [m], in [0, slant].
            phi: azimuth [rad], in [0, wrap].

        Returns:
            the radial and the angular potential over U0, in [0, 1].
        """
        end2 = self._from_end2
        radial = end2.fraction(end2.length - u) if self.b_positive else self._from_end1.fraction(u)
        angular = phi / self._wrap
        return radial, angular if self.c_positive else 1.0 - angular

    def place(self, radial: float, angular: float) -> tuple[float, float]:
        """Return the place where the potentials are these fractions of the supply (eq. 20, 24): inverse of fractions.

        Args:
            radial: potential in the radial phase over U0; values outside [0, 1] give the end of the sensor.
            angular: potential in the angular phase over U0; likewise.

        Returns:
            u [m] and phi [rad].
        """
        along = 1.0 - radial if self.b_positive else radial
        around = angular if self.c_positive else 1.0 - angular
        along = 0.0 if along < 0.0 else 1.0 if along > 1.0 else along
        around = 0.0 if around < 0.0 else 1.0 if around > 1.0 else around
        return self._from_end1.distance(along), self._wrap * around

    def radial_sensitivity(self, u: float) -> float:
        """Return the change of the radial potential along the side at u [m]: dUr/du [V/m], signed.

        Its magnitude is |dUr/dr| of eq. 25, since |dr| = |du|; on a cylinder it is U0/slant.
        """
        slope = self._from_end1.slope(u) * self.electronics.supply_volts
        return -slope if self.b_positive else slope

    def _work_out_bounds(self) -> _Bounds:
        parts, limits = self.electronics, self.thresholds
        full = parts.full_count
        volt, ampere = full / parts.adc_volts, full / parts.current_full_scale
        nominal: dict[str, float] = {}
        for phase, amperes in (("radial", self.radial_amperes), ("angular", self.angular_amperes)):
            nominal[phase] = amperes * ampere
            if not _MIN_NOMINAL_COUNTS <= nominal[phase] <= 0.9 * full:
                raise SensorError(
                    f"{self.name}: electronics.current_full_scale must suit the normal drive current of the {phase} "
                    f"phase, {amperes:.3g} A (sheets: {self.upper_sheet_ohms:g} and {self.lower_sheet_ohms:g} ohm per "
                    f"square); with {parts.current_full_scale:g} A it is {nominal[phase]:.3g} counts of {full}, "
                    f"allowed are {_MIN_NOMINAL_COUNTS} to {0.9 * full:.0f}"
                )
        supply = parts.supply_volts * volt
        leads, ohm = parts.lead_ohms, volt / ampere
        largest_touch = 2.0 * parts.supply_volts / parts.pulldown_ohms * ampere
        return _Bounds(
            full=full,
            supply_low=round(supply * (1.0 - limits.supply_tolerance)),
            supply_high=min(round(supply * (1.0 + limits.supply_tolerance)), full - 1),
            radial_low=round(nominal["radial"] * limits.current_low),
            radial_high=min(round(nominal["radial"] * limits.current_high), full - 1),
            angular_low=round(nominal["angular"] * limits.current_low),
            angular_high=min(round(nominal["angular"] * limits.current_high), full - 1),
            touch_current_per_guide=ampere / volt / parts.pulldown_ohms,
            touch_current_slack=max(limits.balance * largest_touch, 6.0),
            # the worst place is an edge electrode: the other guide is behind the whole sheet
            weaker_guide=0.5 * parts.pulldown_ohms / (parts.pulldown_ohms + self.angular_ohms),
            noise=max(2, full // 100),
            radial_drop=(leads.a + leads.b) * ohm,
            angular_drop=(leads.c + leads.d) * ohm,
            load_ratio=parts.pulldown_ohms / parts.input_ohms,
        )
