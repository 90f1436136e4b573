"""Coupling of the sheets by the contacts, and the four-port of the electrodes: what is applied and read in each phase.

Each electrode has a lead, behind it a terminal: a source with its resistance, an ADC's input, a pull-down, or
nothing. The unknowns are the four electrode potentials and the voltage across the contact, so a weak contact is
never added to a strong sheet and open guides carry exactly no net current.

The electrodes impose a difference of the sheets h0 + hx x/L + hy y/T with h0 = V_B - V_D, hx = V_A - V_B,
hy = -(V_C - V_D). The current through the contacts answers with its total and its two first moments, and by reciprocity
through one symmetric 3 x 3 matrix W = G v v^T + P, v = (1, X, Y). Hence the sensor is a reciprocal 4-port whose
rows sum to zero, with exactly these six numbers beside the two known sheets.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from coneskin.core.arrays import Floats
from coneskin.core.errors import FieldError

if TYPE_CHECKING:
    Numbers = float | Floats

# h = (h0, hx, hy) of the potentials of A (end 2) and B (end 1) of the upper sheet, C (phi=wrap) and D (phi=0) below:
# the order of every axis over electrodes; its transpose gives the currents into the sensor
_DIFFERENCE_MATRIX = np.array([[0.0, 1.0, 0.0, -1.0], [1.0, -1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Coupling:
    """The effect of the contacts between the sheets, one entry for each scene.

    Attributes:
        conductance: G, total conductance between the sheets, spreading in both included [S], shape (n,).
        x: X, electrical centre along the slant as a fraction of L (of the potential in the upper sheet), shape (n,).
        y: Y, electrical centre around as a fraction of T, shape (n,).
        xx: what the contacts add along the slant by letting current change sheets [S], shape (n,).
        xy: the same, across: what moves the guide pair apart [S], shape (n,).
        yy: the same, around [S], shape (n,).
        error: estimate of the error: of X, Y and the guides' potentials relative to the supply, of the rest relative to
            the conductances beside it; NaN where the method has no estimate, shape (n,).
    """

    conductance: Floats
    x: Floats
    y: Floats
    xx: Floats
    xy: Floats
    yy: Floats
    error: Floats

    def __len__(self) -> int:
        return int(self.conductance.shape[0])

    @classmethod
    def of_matrix(cls, w: Floats, fallback: Floats, error: Floats | None = None) -> Coupling:
        """Make it from W, shape (n, 3, 3); fallback: (X, Y) where nothing touches, shape (n, 2)."""
        g = w[:, 0, 0]
        divisor = np.where(g > 0.0, g, 1.0)
        centre = np.where(g[:, None] > 0.0, w[:, 0, 1:] / divisor[:, None], fallback)
        x, y = centre[:, 0], centre[:, 1]
        error = np.full(g.shape, np.nan) if error is None else error
        return cls(g, x, y, w[:, 1, 1] - g * x * x, w[:, 1, 2] - g * x * y, w[:, 2, 2] - g * y * y, error)

    def numbers(self) -> tuple[Numbers, Numbers, Numbers, Numbers, Numbers, Numbers]:
        """Return the six numbers, of a single scene as plain ones: arithmetic of these takes a tenth of the time."""
        g, x, y, xx, xy, yy = self.conductance, self.x, self.y, self.xx, self.xy, self.yy
        if g.size == 1:
            return g.item(), x.item(), y.item(), xx.item(), xy.item(), yy.item()
        return g, x, y, xx, xy, yy

    def matrix(self) -> Floats:
        """Return W [S], shape (n, 3, 3), symmetric."""
        g, x, y = self.conductance, self.x, self.y
        w = np.empty((len(self), 3, 3))
        w[:, 0, 0] = g
        w[:, 0, 1] = w[:, 1, 0] = g * x
        w[:, 0, 2] = w[:, 2, 0] = g * y
        w[:, 1, 1] = g * x * x + self.xx
        w[:, 1, 2] = w[:, 2, 1] = g * x * y + self.xy
        w[:, 2, 2] = g * y * y + self.yy
        return w


def admittance(coupling: Coupling, upper: float, lower: float) -> Floats:
    """Compute Y of the 4-port, I = Y V, currents into the sensor at (A, B, C, D) [S], shape (n, 4, 4).

    Symmetric exactly; rows sum to zero to rounding of their entries. Where contacts are so weak that they vanish
    beside the sheets, `fourport.solve_phase` is more accurate than this matrix, because it never adds the two.
    """
    y = _DIFFERENCE_MATRIX.T @ coupling.matrix() @ _DIFFERENCE_MATRIX
    y = 0.5 * (y + y.transpose(0, 2, 1))
    y[:, :2, :2] += upper * np.array([[1.0, -1.0], [-1.0, 1.0]])
    y[:, 2:, 2:] += lower * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return np.asarray(y, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class Terminal:
    """A Thevenin source behind a lead; the ADC reads between the two."""

    emf: float = 0.0  #: open-circuit potential [V]
    resistance: float = math.inf  #: of the source, or of an input to `emf` [ohm]; 0 drives ideally, inf is open
    lead: float = 0.0  #: resistance between the terminal and the electrode [ohm]

    def __post_init__(self) -> None:
        if not math.isfinite(self.emf):
            raise FieldError(f"emf of a terminal must be finite [V], got {self.emf!r}")
        if not self.resistance >= 0.0:
            raise FieldError(f"resistance of a terminal must be 0 or more [ohm], got {self.resistance!r}")
        if not (self.lead >= 0.0 and math.isfinite(self.lead)):
            raise FieldError(f"lead of a terminal must be 0 or more and finite [ohm], got {self.lead!r}")


@dataclass(frozen=True, slots=True)
class DrivePhase:
    """One state of the electronics: a terminal at each electrode."""

    name: str  #: radial, angular, touch or the user's own
    a: Terminal  #: terminal of electrode A, on the arc of end 2 of the upper sheet
    b: Terminal  #: terminal of electrode B, on the arc of end 1 of the upper sheet
    c: Terminal  #: terminal of electrode C, on the edge phi=wrap of the lower sheet
    d: Terminal  #: terminal of electrode D, on the edge phi=0 of the lower sheet

    @property
    def terminals(self) -> tuple[Terminal, Terminal, Terminal, Terminal]:
        """The four terminals in the order A, B, C, D."""
        return self.a, self.b, self.c, self.d


def radial_phase(supply: float = 1.0, adc: float = math.inf, lead: float = 0.0, source: float = 0.0) -> DrivePhase:
    """Make the radial phase: B at the supply, A at 0 V, guides C and D read.

    Args:
        supply: U0 [V].
        adc: input resistance of the ADC at C and D [ohm].
        lead: resistance of each lead [ohm].
        source: internal resistance of each drive [ohm].
    """
    guide = Terminal(0.0, adc, lead)
    return DrivePhase("radial", Terminal(0.0, source, lead), Terminal(supply, source, lead), guide, guide)


def angular_phase(supply: float = 1.0, adc: float = math.inf, lead: float = 0.0, source: float = 0.0) -> DrivePhase:
    """Make the angular phase: C at the supply, D at 0 V, guides A and B read; arguments as for `radial_phase`."""
    guide = Terminal(0.0, adc, lead)
    return DrivePhase("angular", guide, guide, Terminal(supply, source, lead), Terminal(0.0, source, lead))


@dataclass(frozen=True, slots=True, eq=False)
class Readings:
    """The answer of one phase; axes over electrodes run A, B, C, D."""

    phase: DrivePhase
    electrodes: Floats  #: potentials of the electrodes [V], shape (n, 4)
    terminals: Floats  #: potentials of the terminals, behind the leads, where an ADC reads [V], shape (n, 4)
    currents: Floats  #: from the terminals into the sensor [A], shape (n, 4)
    contact: Floats  #: current from the upper to the lower sheet [A], shape (n,)

    def __len__(self) -> int:
        return int(self.contact.shape[0])


def solve_phase(coupling: Coupling, upper: float, lower: float, phase: DrivePhase) -> Readings:
    """Compute the potentials and currents of one phase.

    Args:
        upper: conductance of the upper sheet without contacts, between its electrodes [S].
        lower: of the lower one [S].

    Raises:
        FieldError: a sheet is connected to nothing: no contact and both its electrodes open.
    """
    numbers = coupling.numbers()
    g, x, y, xx, xy, yy = numbers
    a, b, c, d = terminals = phase.terminals
    opens = [a.resistance == math.inf, b.resistance == math.inf, c.resistance == math.inf, d.resistance == math.inf]
    if (opens[0] and opens[1]) and (opens[2] and opens[3]):
        raise FieldError(f"phase {phase.name}: all four electrodes are open; drive at least one sheet")
    pair = "A and B" if opens[0] and opens[1] else "C and D" if opens[2] and opens[3] else ""
    if pair and not (g > 0.0 if isinstance(g, float) else (g > 0.0).all()):
        raise FieldError(
            f"phase {phase.name}: without contact nothing fixes the potential of {pair}, which are open;"
            " give their terminals a resistance, as every ADC has"
        )
    volts: tuple[Numbers, ...]
    contact = None
    if pair == "C and D" and a.resistance == a.lead == b.resistance == b.lead == 0.0:
        volts = a.emf, b.emf, *_guides(x, y, xy / (lower + yy), b.emf, a.emf)
    elif pair == "A and B" and c.resistance == c.lead == d.resistance == d.lead == 0.0:
        volts = *_guides(y, x, xy / (upper + xx), d.emf, c.emf), c.emf, d.emf
    else:
        solved, contact = _general(coupling, upper, lower, phase)
        volts = tuple(solved.T)
    n = len(coupling)
    if contact is None:
        columns = volts, _currents(numbers, upper, lower, volts, 0.0, opens)
        electrodes, currents = (np.array([c]) if n == 1 else _columns(n, c) for c in columns)
        return Readings(phase, electrodes, electrodes, currents, np.zeros(n))
    electrodes = _columns(n, volts)
    currents = _columns(n, _currents(numbers, upper, lower, volts, contact, opens))
    resistance = np.array([t.resistance if not o else 0.0 for t, o in zip(terminals, opens, strict=True)])
    lead = np.array([t.lead for t in terminals])
    emf = np.array([t.emf for t in terminals])
    # Behind a small source resistance the emf is the better reference, before a large input the electrode.
    from_source = (resistance < lead + 1.0 / min(upper, lower)) & ~np.array(opens)
    read = np.where(from_source, emf - resistance * currents, electrodes + lead * currents)
    return Readings(phase, electrodes, read, currents, contact)


def _columns(n: int, columns: Sequence[Numbers]) -> Floats:
    out = np.empty((n, 4))
    for place, column in enumerate(columns):
        out[:, place] = column
    return out


def _guides(along: Numbers, across: Numbers, moved: Numbers, start: float, end: float) -> tuple[Numbers, Numbers]:
    """Return the potentials (far, near) of one sheet's open guides, the other sheet driven from `start` to `end`.

    No net current passes, so the sheets meet at the electrical centre: start + h along = near + (far - near) across.
    The guides are apart by the current moved across over their sheet's conductance, for each volt of h.
    """
    h = end - start
    apart = h * moved
    near = start + h * along - apart * across
    return near + apart, near


def _currents(
    numbers: Sequence[Numbers],
    upper: float,
    lower: float,
    volts: Sequence[Numbers],
    contact: Numbers,
    opens: list[bool],
) -> list[Numbers]:
    """Return the current into the sensor at each electrode; they sum to zero by construction."""
    _, x, y, xx, xy, yy = numbers
    hx, hy = volts[0] - volts[1], volts[3] - volts[2]
    a = upper * hx + xx * hx + xy * hy + x * contact
    c = -lower * hy - xy * hx - yy * hy - y * contact
    return [0.0 if o else current for current, o in zip((a, contact - a, c, -contact - c), opens, strict=True)]


def _general(coupling: Coupling, upper: float, lower: float, phase: DrivePhase) -> tuple[Floats, Floats]:
    """Solve any four terminals: unknowns V_A - V_B, V_B, V_D - V_C, V_C and the voltage e across the contact.

    An electrode's row is V + R I = E for a small R, V/R + I = E/R for a large one. Where both of a sheet's are large,
    the second row is the sheet's net current instead, in a scale of its own: inputs of 1e18 ohm keep their digits.
    """
    n = len(coupling)
    g = coupling.conductance
    into_a, into_d, contact = np.zeros((n, 5)), np.zeros((n, 5)), np.zeros((n, 5))
    contact[:, 4] = g
    into_a[:, 0], into_a[:, 2], into_a[:, 4] = upper + coupling.xx, coupling.xy, coupling.x * g
    into_d[:, 0], into_d[:, 2], into_d[:, 4] = coupling.xy, lower + coupling.yy, (coupling.y - 1.0) * g
    a, b, c, d = phase.terminals
    level = 1.0 / min(upper, lower)
    matrix, right = np.zeros((n, 5, 5)), np.zeros((n, 5, 1))
    for at, first, second, current, net in ((0, a, b, into_a, contact), (2, d, c, into_d, -contact)):
        volts = np.zeros((2, 5))
        volts[0, at] = volts[:, at + 1] = 1.0
        for row, terminal, into in ((0, first, current), (1, second, net - current)):
            resistance = terminal.resistance + terminal.lead
            weight_v, weight_i = (1.0, resistance) if resistance <= level else (level / resistance, level)
            matrix[:, at + row] = weight_i * into + weight_v * volts[row]
            right[:, at + row, 0] = weight_v * terminal.emf
        ends = (first, second)
        least = min(t.resistance + t.lead for t in ends)
        if least > level:
            # Shares of the net current for each volt; with both open, all of it is the contact's, and is zero.
            shares = [0.0 if math.isinf(least) else least / (t.resistance + t.lead) for t in ends]
            size = np.maximum(1.0, least * g) if math.isfinite(least) else g
            matrix[:, at + 1] = np.array(shares) @ volts
            matrix[:, at + 1, 4] += np.sign(net[:, 4]) * (least * g if math.isfinite(least) else g)
            matrix[:, at + 1] /= size[:, None]
            right[:, at + 1, 0] = sum(s * t.emf for s, t in zip(shares, ends, strict=True)) / size
    # V_B - V_D + (V_A - V_B) X - (V_C - V_D) Y = e
    matrix[:, 4, 0], matrix[:, 4, 1] = coupling.x, 1.0
    matrix[:, 4, 2], matrix[:, 4, 3], matrix[:, 4, 4] = coupling.y - 1.0, -1.0, -1.0
    solved = np.asarray(np.linalg.solve(matrix, right)[:, :, 0], dtype=np.float64)
    h_upper, v_b, h_lower, v_c, e = solved.T
    return np.stack([v_b + h_upper, v_b, v_c, v_c + h_lower], axis=1), np.asarray(g * e)
