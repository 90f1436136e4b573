"""Materials of a skin: conductive sheets that can be bought, and the padding below the cover.

A long narrow sensor has a large resistance along and a small one around, a ring the other way round. One material for
both layers then makes one drive current small beside the other; two materials bring them together again.

The force of the padding is that of springs in straight pieces, stiff from its end on, times a factor that grows with
the speed of the indentation (Hunt and Crossley), so that it begins and ends at 0 and never pulls:

    f = e(s) (1 + loss ds/dt),  e(s) = as its table says, or stiffness s, and hard_stiffness more per meter beyond

Source: Hunt and Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J. Appl. Mech. 42 (1975).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

from coneskin.core.errors import SensorError


class SheetMaterial(NamedTuple):
    """A conductive sheet."""

    name: str  #: what to ask a supplier for
    ohms: float  #: nominal resistance per square [ohm]; it varies by 10 to 30 % from lot to lot

    @property
    def label(self) -> str:
        """Short name for a part that is cut from it."""
        return f"conductive sheet {self.ohms:g} ohm/sq"


#: in ascending order of resistance; nominal values by which such sheets are sold: measure what you buy
SHEET_MATERIALS = (
    SheetMaterial("carbon-filled polyimide film, 50 um, 100 ohm per square", 100.0),
    SheetMaterial("PEDOT:PSS on polyester film, 350 ohm per square", 350.0),
    SheetMaterial("resistive carbon ink printed on polyester film, 1 kohm per square", 1000.0),
    SheetMaterial("PEDOT:PSS on polyester film, 1.5 kohm per square", 1500.0),
    SheetMaterial("resistive carbon ink printed on polyester film, 10 kohm per square", 10e3),
    SheetMaterial("carbon-filled polyethylene film, 0.1 mm, 31 kohm per square", 31e3),
)
_LIKED_OHMS = 1000.0  # ohm; geometric mean of both resistances: 2.5 mA, beside which leads and pull-downs are small
_MAX_RATIO = 15.0  # of the two resistances, up to which 12 bits give the smaller drive current 100 counts and more
_SECOND_MATERIAL = 0.7  # cost of a second material, in nepers of the mean resistance


def match_sheet_materials(
    squares: float, upper_ohms: float | None = None, lower_ohms: float | None = None
) -> tuple[SheetMaterial, SheetMaterial]:
    """Choose the upper and the lower sheet; one material where the shape allows it.

    Args:
        squares: length over breadth of the active area.
        upper_ohms: resistance per square of the upper sheet where it is given [ohm].
        lower_ohms: the same of the lower sheet.

    Returns:
        upper and lower sheet; what is given is called "given".
    """
    upper = SHEET_MATERIALS if upper_ohms is None else (SheetMaterial("given", upper_ohms),)
    lower = SHEET_MATERIALS if lower_ohms is None else (SheetMaterial("given", lower_ohms),)

    def cost(pair: tuple[SheetMaterial, SheetMaterial]) -> float:
        along, around = pair[0].ohms * squares, pair[1].ohms / squares
        beyond = max(0.0, abs(math.log(along / around)) - math.log(_MAX_RATIO))
        off = abs(math.log(math.sqrt(along * around) / _LIKED_OHMS))
        return 10.0 * beyond + off + (_SECOND_MATERIAL if pair[0].ohms != pair[1].ohms else 0.0)

    return min(((one, two) for one in upper for two in lower), key=cost)


_MAX_GROWTH = 2.0  # of the force between two depths: the straight line is then at most 6 % above a curve that stiffens


@dataclass(frozen=True, slots=True)
class Padding:
    """Padding of a skin as one thing that presses on it feels it. The defaults are assumed, not measured.

    Attributes:
        thickness: indentation at which it bottoms out [m].
        stiffness: until there [N/m].
        hard_stiffness: beyond, of what is below [N/m].
        loss: damping [s/m]; the force of an indentation at 1 m/s is 1 + loss times that at rest.
        table: indentations [m] and forces [N] as measured, in place of thickness and stiffness; it ends with the last.
        spread: share by which the force of any indentation may be off, below 1.
        pieces: indentation, force and slope [N/m] from where each straight piece begins; follows from the others.

    Raises:
        SensorError: a value is not finite, or out of its range.
    """

    thickness: float = 6e-3
    stiffness: float = 10e3
    hard_stiffness: float = 1e6
    loss: float = 0.3
    table: tuple[tuple[float, float], ...] = ()
    spread: float = 0.15
    pieces: tuple[tuple[float, float, float], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name, unit in (("thickness", "m"), ("stiffness", "N/m"), ("hard_stiffness", "N/m")):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SensorError(f"padding.{name} must be finite and above 0 {unit}, got {value!r} {unit}")
        if not (math.isfinite(self.loss) and self.loss >= 0.0):
            raise SensorError(f"padding.loss must be finite and not negative [s/m], got {self.loss!r}")
        if not 0.0 <= self.spread < 1.0:
            raise SensorError(f"padding.spread must be at least 0 and below 1, got {self.spread!r}")
        knots = ((0.0, 0.0), *(self.table or ((self.thickness, self.stiffness * self.thickness),)))
        for (s, f), (deeper, harder) in pairwise(knots):
            if not (s < deeper < math.inf and f < harder < math.inf):
                was = f"{harder:g} N at {1e3 * deeper:g} mm after {f:g} N at {1e3 * s:g} mm"
                raise SensorError(f"the depths and the forces of a padding must rise, got {was}")
            if f and harder > _MAX_GROWTH * f:
                was = f"{harder:g} N at {1e3 * deeper:g} mm after {f:g} N at {1e3 * s:g} mm"
                raise SensorError(
                    f"the force of a padding must at most double to the next depth, got {was}: measure between"
                )
        slopes = [(harder - f) / (deeper - s) for (s, f), (deeper, harder) in pairwise(knots)]
        slopes = slopes if self.table else [self.stiffness]
        pieces = tuple((*knot, slope) for knot, slope in zip(knots, (*slopes, self.hard_stiffness), strict=True))
        object.__setattr__(self, "pieces", pieces)

    def scaled(self, factor: float) -> Padding:
        """Return the padding with all its forces multiplied."""
        stiffness, hard, table = factor * self.stiffness, factor * self.hard_stiffness, self.table
        return replace(self, stiffness=stiffness, hard_stiffness=hard, table=tuple((s, factor * f) for s, f in table))

    def elastic(self, depth: float) -> float:
        """Return the force of an indentation at rest [N]; 0 without one."""
        start, force, slope = next((piece for piece in reversed(self.pieces) if depth > piece[0]), (depth, 0.0, 0.0))
        return force + slope * (depth - start)

    def force(self, depth: float, rate: float) -> float:
        """Return the force of an indentation [m] that grows at a rate [m/s], in N; never below 0."""
        return max(0.0, self.elastic(depth) * (1.0 + self.loss * rate))
