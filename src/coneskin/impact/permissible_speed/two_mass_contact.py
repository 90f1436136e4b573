"""Model of one contact along its normal: a driven arm, the padding of its skin, and a body that is struck.

    symbol    meaning
    p(t)      where the controller wants the surface of the arm, from the first contact on [m]
    x1, x2    where surface and body are [m]; 0 at the first contact
    s         compression between them, x1 - x2 [m]
    f         force between them [N]

    m1 x1'' = k1 (p - x1) + c1 (p' - x1') - f,   m2 x2'' = f - k2 x2 - c2 x2',   f = e(s) (1 + loss s')

The compression is that of the padding and of the body's tissue in series. The force closes the layers of the sensor;
a reaction time later p begins to brake. An infinite m1 moves as the controller wants, an infinite m2 does not give way;
without k1 and c1 this is the two-mass model of ISO/TS 15066, annex A: a free mass, a spring, a free mass.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from coneskin.core.errors import SensorError
from coneskin.skin.materials import Padding

#: N; closes the layers of the sensor, "A Flexible Annular Sectorial Sensor ...", section 4.2
_CLOSING_FORCE = 0.5


@dataclass(frozen=True, slots=True)
class DrivenArm:
    """Arm as the contact feels it, along the normal.

    Attributes:
        speed: of the surface towards the body [m/s].
        mass: effective mass [kg]; infinite where the arm moves as it is driven, whatever the force.
        stiffness: of the joints' servos [N/m]; 0 for an arm that moves freely.
        damping: of the servos [N s/m].
        reaction: from the closing of the layers until the arm brakes [s], as measured; infinite where it never does.
        deceleration: of the surface then [m/s^2], as measured.

    Raises:
        SensorError: a value is out of its range.
    """

    speed: float
    mass: float = math.inf
    stiffness: float = 0.0
    damping: float = 0.0
    reaction: float = math.inf
    deceleration: float = 1.0

    def __post_init__(self) -> None:
        _check("arm.speed", self.speed, "m/s", most=100.0)
        _check("arm.mass", self.mass, "kg", above=True, infinite=True)
        _check("arm.stiffness", self.stiffness, "N/m")
        _check("arm.damping", self.damping, "N s/m")
        _check("arm.reaction", self.reaction, "s", infinite=True)
        _check("arm.deceleration", self.deceleration, "m/s^2", above=True)

    @property
    def stopping_way(self) -> float:
        """How far it is driven from the closing of the layers on [m], if no force slows it."""
        return self.speed * self.reaction + self.speed**2 / (2.0 * self.deceleration)


@dataclass(frozen=True, slots=True)
class StruckBody:
    """Body that the arm strikes. Its values are the user's: none is known that holds for every person.

    Raises:
        SensorError: a value is out of its range.
    """

    mass: float  #: effective mass [kg]; infinite for one that cannot give way
    tissue: float = math.inf  #: stiffness of what is between its surface and its mass [N/m]; infinite for none
    support: float = 0.0  #: stiffness of the spring that holds it [N/m]; 0 for a free one
    damping: float = 0.0  #: of that spring [N s/m]

    def __post_init__(self) -> None:
        _check("body.mass", self.mass, "kg", above=True, infinite=True)
        _check("body.tissue", self.tissue, "N/m", above=True, infinite=True)
        _check("body.support", self.support, "N/m")
        _check("body.damping", self.damping, "N s/m")


@dataclass(frozen=True, slots=True)
class _CompressionLaw:
    """Force over the compression of padding and tissue in series: straight pieces, and a factor for the speed.

    Attributes:
        pieces: compression [m], force [N] and slope [N/m] from where each begins.
        loss: damping [s/m], by the share that the whole padding has in the compression.
    """

    pieces: tuple[tuple[float, float, float], ...]
    loss: float

    @classmethod
    def of(cls, padding: Padding, tissue: float = math.inf) -> _CompressionLaw:
        """Return the law of a padding on a tissue [N/m]."""
        pieces = tuple((s + f / tissue, f, 1.0 / (1.0 / slope + 1.0 / tissue)) for s, f, slope in padding.pieces)
        whole, force, _ = padding.pieces[-1]
        return cls(pieces, padding.loss * whole / (whole + force / tissue))

    def piece_at(self, s: float) -> int:
        """Return the number of the piece that a compression is in."""
        return max(0, sum(piece[0] < s for piece in self.pieces) - 1)

    def under(self, force: float) -> float:
        """Return the compression at rest under a force [m]."""
        s, f, slope = next(piece for piece in reversed(self.pieces) if force >= piece[1] or not piece[1])
        return s + max(0.0, force - f) / slope


@dataclass(frozen=True, slots=True)
class TwoMassContact:
    """One contact."""

    arm: DrivenArm  #: that is driven into the body
    body: StruckBody  #: that it strikes
    padding: Padding = field(default_factory=Padding)  #: of the skin between them
    closing_force: float = _CLOSING_FORCE  #: at which the layers of the sensor close [N]
    law: _CompressionLaw = field(init=False)  #: of the compression; follows from padding and body

    def __post_init__(self) -> None:
        _check("closing_force", self.closing_force, "N")
        object.__setattr__(self, "law", _CompressionLaw.of(self.padding, self.body.tissue))

    @property
    def yielding(self) -> float:
        """What arm and body give way at rest [m/N], beside the compression; infinite where one of them is free."""
        arm, body = self.arm, self.body
        found = 0.0 if math.isinf(arm.mass) else 1.0 / arm.stiffness if arm.stiffness > 0.0 else math.inf
        if not math.isinf(body.mass):
            found += 1.0 / body.support if body.support > 0.0 else math.inf
        return found

    @property
    def way_to_close(self) -> float:
        """How far a slow arm goes until its layers close [m]; infinite where they never do."""
        return self.law.under(self.closing_force) + (self.closing_force * self.yielding if self.closing_force else 0.0)

    def static(self, way: float) -> tuple[float, float]:
        """Return force [N] and compression [m] once all is at rest, with the controller's surface at a place [m]."""
        if way <= 0.0:
            return 0.0, min(0.0, way)
        yielding = self.yielding
        if math.isinf(yielding):
            return 0.0, 0.0
        s, f, slope = next(piece for piece in reversed(self.law.pieces) if way >= piece[0] + piece[1] * yielding)
        more = (way - s - f * yielding) / (1.0 / slope + yielding)
        return f + more, s + more / slope


def _check(
    name: str, value: float, unit: str, *, above: bool = False, most: float = math.inf, infinite: bool = False
) -> None:
    """Refuse what is below 0, is 0 where it must be above, or is infinite where it must not be."""
    known = isinstance(value, float | int) and (math.isfinite(value) or infinite)
    if known and 0.0 <= value <= most and not (above and value == 0.0):
        return
    rule = "above 0" if above else "at least 0"
    rule += f" and at most {most:g}" if most < math.inf else "" if infinite else " and finite"
    raise SensorError(f"{name} must be {rule} {unit}, got {value!r} {unit}")
