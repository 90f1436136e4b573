"""Materials of the conductive sheets that can be bought, and the choice that suits the shape of a sensor.

A long narrow sensor has a large resistance along and a small one around, a ring the other way round. One material for
both layers then makes one drive current small beside the other; two materials bring them together again.
"""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["SHEET_MATERIALS", "SheetMaterial", "match_sheet_materials"]


class SheetMaterial(NamedTuple):
    """A conductive sheet.

    Attributes:
        name: what to ask a supplier for.
        ohms: nominal resistance per square [ohm]; it varies by 10 to 30 % from lot to lot.
    """

    name: str
    ohms: float

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
