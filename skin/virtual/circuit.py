"""Electronics around the sheets: the converter's inputs in each phase, given the sheets as a four-port.

Two sheets and any contacts between them are one reciprocal linear network with four terminals, I = Y V in the order
A, B, C, D. Where Y comes from (ideal resistors, or the exact field) is the business of a ``ContactModel``; the supply,
the leads, the pull-downs, broken wires and shorts are the same for each and are here, with the quickest model: ladders
of ideal resistors.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, NamedTuple, Protocol

from coneskin.core.errors import SensorError, SkinError
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import DrivenPotentials, Frame

Matrix = tuple[tuple[float, ...], ...]
_A, _B, _C, _D = range(4)
RIGHT_WIRES = "ABCD"  #: electrodes on the terminals A, B, C, D
_RAIL_NAMES = ("ground", "supply", "rail")
_SHORT_CONDUCTANCE = 10.0  # S; a solid metallic short, 0.1 ohm


class LayerContact(NamedTuple):
    """A contact between the two layers."""

    u: float  #: slant distance of the middle from end 1 [m]
    phi: float  #: azimuth of the middle [rad]
    conductance: float  #: between the layers, all of the contact [S]
    radius: float = 0.0  #: of a round contact [m]; 0 for a point
    reach: float = 0.0  #: the radius that it will have at its firmest [m]; 0: this one


def _check_place(sensor: Sensor, contact: LayerContact, refusal: type[SkinError]) -> None:
    """Refuse a contact whose middle is off the sensor, by an error of a type."""
    cone = sensor.frustum
    if not (0.0 <= contact.u <= cone.slant and 0.0 <= contact.phi <= cone.wrap):
        raise refusal(
            f"a contact must lie on {sensor.name}: u in [0, {cone.slant:g}] m and phi in [0, {cone.wrap:g}] rad, "
            f"got {contact.u!r} m and {contact.phi!r} rad"
        )


class ContactModel(Protocol):
    """A model of the sheets and their contacts as seen from the four electrodes."""

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return for each scene of contacts the 4 x 4 matrix Y [S] of the bare sheets, in the order A, B, C, D.

        Each is symmetric, and its rows sum to zero. Scenes of the same contacts, more or less firm, are cheap together.
        """
        ...

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Compute beforehand what would take long when the sensor is touched there."""
        ...


@dataclass(frozen=True, slots=True)
class WiringFaults:
    """Broken wires and shorts between the electronics and the sheets.

    Attributes:
        opened: electrodes whose wire is open.
        shorts: pairs that are joined: two electrodes, or one of them and "ground", "supply" (before the current is
            measured) or "rail" (behind that: a switch that is stuck).

    Raises:
        SensorError: a name is none of these.
    """

    opened: tuple[str, ...] = ()
    shorts: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        for name in self.opened:
            if name not in tuple(RIGHT_WIRES):
                raise SensorError(f"an open wire must be one of A, B, C, D, got {name!r}")
        for pair in self.shorts:
            if not (len(pair) == 2 and pair[0] in tuple(RIGHT_WIRES) and pair[1] in (*RIGHT_WIRES, *_RAIL_NAMES)):
                raise SensorError(
                    "a short must join one of A, B, C, D with another of them, with ground, supply or rail, "
                    f"got {'-'.join(pair)!r}"
                )


class ConverterInputs(NamedTuple):
    """The converter's inputs in one frame, in volts and amperes."""

    touch_c: float
    touch_d: float
    touch_current: float
    radial_c: float
    radial_d: float
    radial_current: float
    angular_a: float
    angular_b: float
    angular_current: float
    touch_supply: float
    radial_supply: float
    angular_supply: float
    touch_a: float  #: from here on: the driven electrodes' own potentials
    touch_b: float
    radial_a: float
    radial_b: float
    angular_c: float
    angular_d: float


_Terminal = Literal["supply", "ground", "pulldown", "input"]


def measure(sensor: Sensor, sheets: Sequence[Matrix], wiring: WiringFaults | None = None) -> ConverterInputs:
    """Compute the converter's inputs in the three phases.

    Args:
        sensor: electronics and polarity.
        sheets: the sheets with their contacts, from a ContactModel, during the touch, radial and angular phase.
        wiring: what is broken; nothing by default.

    Returns:
        potentials [V] and drive currents [A], without noise.
    """
    wiring = wiring or WiringFaults()
    radial: tuple[_Terminal, _Terminal] = ("ground", "supply") if sensor.b_positive else ("supply", "ground")
    angular: tuple[_Terminal, _Terminal] = ("supply", "ground") if sensor.c_positive else ("ground", "supply")
    touch_at, touch_i, touch_own = _phase(sensor, sheets[0], wiring, ("supply", "supply", "pulldown", "pulldown"))
    radial_at, radial_i, radial_own = _phase(sensor, sheets[1], wiring, (*radial, "input", "input"))
    angular_at, angular_i, angular_own = _phase(sensor, sheets[2], wiring, ("input", "input", *angular))
    supply = sensor.electronics.supply_volts
    return ConverterInputs(
        *(touch_at[_C], touch_at[_D], touch_i),
        *(radial_at[_C], radial_at[_D], radial_i),
        *(angular_at[_A], angular_at[_B], angular_i),
        *(supply, supply, supply),
        *(touch_own[_A], touch_own[_B], radial_own[_A], radial_own[_B], angular_own[_C], angular_own[_D]),
    )


def _phase(
    sensor: Sensor,
    admittance: Matrix,
    wiring: WiringFaults,
    terminals: tuple[_Terminal, _Terminal, _Terminal, _Terminal],
) -> tuple[list[float], float, list[float]]:
    """Return the potentials at the inputs [V], the current out of the supply [A], the electrodes' potentials [V]."""
    parts = sensor.electronics
    matrix = [list(row) for row in admittance]
    sources = [0.0] * 4
    loads = {"pulldown": parts.pulldown_ohms, "input": parts.input_ohms, "supply": 0.0, "ground": 0.0}
    feeds = [0.0] * 4
    for k, terminal in enumerate(terminals):
        feeds[k] = 0.0 if RIGHT_WIRES[k] in wiring.opened else 1.0 / (parts.lead_ohms[k] + loads[terminal])
        matrix[k][k] += feeds[k] + 1e-15  # keeps a sheet that has lost all of its wires at ground
        sources[k] += feeds[k] * parts.supply_volts if terminal == "supply" else 0.0
    for first, second in wiring.shorts:
        j = RIGHT_WIRES.index(first)
        if second in RIGHT_WIRES:
            join(matrix, j, RIGHT_WIRES.index(second), _SHORT_CONDUCTANCE)
        else:
            matrix[j][j] += _SHORT_CONDUCTANCE
            sources[j] += 0.0 if second == "ground" else _SHORT_CONDUCTANCE * parts.supply_volts
    at = solve(matrix, sources)
    current = sum(
        (parts.supply_volts - at[k]) * feeds[k] for k, terminal in enumerate(terminals) if terminal == "supply"
    )
    current += sum(
        (parts.supply_volts - at[RIGHT_WIRES.index(first)]) * _SHORT_CONDUCTANCE
        for first, second in wiring.shorts
        if second == "rail"
    )
    seen = [at[k] * feeds[k] * loads[terminal] for k, terminal in enumerate(terminals)]
    return seen, current, at


def join(matrix: list[list[float]], j: int, k: int, siemens: float) -> None:
    """Add a conductance between two nodes to nodal equations [S]."""
    matrix[j][j] += siemens
    matrix[k][k] += siemens
    matrix[j][k] -= siemens
    matrix[k][j] -= siemens


def solve(matrix: list[list[float]], right: Iterable[float]) -> list[float]:
    """Solve a small system of nodal equations (diagonally dominant, so without pivoting); the matrix is overwritten."""
    x = list(right)
    n = len(x)
    for k in range(n):
        row, inverse = matrix[k], 1.0 / matrix[k][k]
        for i in range(k + 1, n):
            factor = matrix[i][k] * inverse
            if factor:
                below = matrix[i]
                for j in range(k + 1, n):
                    below[j] -= factor * row[j]
                x[i] -= factor * x[k]
    for k in range(n - 1, -1, -1):
        row = matrix[k]
        x[k] = (x[k] - sum(row[j] * x[j] for j in range(k + 1, n))) / row[k]
    return x


_DRIVEN_NAMES = DrivenPotentials._fields
_COMMON_NAMES = tuple(name for name in ConverterInputs._fields if name not in _DRIVEN_NAMES)


def frame_of(head: tuple[int, int, int, int, int, int], counts: Mapping[str, int]) -> Frame:
    """Return the frame of these readings.

    Args:
        head: length, device, sensor, status, sequence, clock.
        counts: by the names of ConverterInputs; without the driven potentials where the frame carries none.
    """
    driven = DrivenPotentials._make(counts[name] for name in _DRIVEN_NAMES) if _DRIVEN_NAMES[0] in counts else None
    return Frame._make((*head, *(counts[name] for name in _COMMON_NAMES), driven))


def counts_of(frame: Frame) -> dict[str, int]:
    """Return the readings that a frame carries."""
    counts = {name: getattr(frame, name) for name in _COMMON_NAMES}
    return counts if frame.driven is None else counts | frame.driven._asdict()


_MIN_PART = 1e-6  # part of a sheet between two nodes, so that nodes may coincide


class ResistorLadder:
    """Contact model of ideal series and parallel resistors.

    Each contact divides the upper sheet at its radial fraction and the lower sheet at its angular fraction into
    resistors in series, and joins the two at these nodes. Current that spreads sideways around a small contact is left
    out; the resistance of that spreading counts as part of the contact's own.
    """

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return the matrix of each scene; see ``admittance``."""
        return [self.admittance(sensor, contacts) for contacts in scenes]

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Do nothing: nothing takes long here."""

    def admittance(self, sensor: Sensor, contacts: Sequence[LayerContact]) -> Matrix:
        """Return the 4 x 4 matrix Y [S] in the order A, B, C, D: symmetric, its rows sum to zero.

        Raises:
            SensorError: a contact lies off the sensor, or its conductance is negative.
        """
        size = 4 + 2 * len(contacts)
        y = [[0.0] * size for _ in range(size)]
        along = [(0.0, _B), (1.0, _A)]
        around = [(0.0, _D), (1.0, _C)]
        for k, contact in enumerate(contacts):
            _check_place(sensor, contact, SensorError)
            if not contact.conductance >= 0.0:
                raise SensorError(f"contact.conductance must not be negative, got {contact.conductance!r} S")
            radial, angular = sensor.fractions(contact.u, contact.phi)
            upper, lower = 4 + 2 * k, 5 + 2 * k
            along.append((1.0 - radial if sensor.b_positive else radial, upper))
            around.append((angular if sensor.c_positive else 1.0 - angular, lower))
            join(y, upper, lower, contact.conductance)
        for ladder, ohms in ((along, sensor.radial_ohms), (around, sensor.angular_ohms)):
            ladder.sort()
            for (start, j), (stop, k) in pairwise(ladder):
                join(y, j, k, 1.0 / (ohms * max(stop - start, _MIN_PART)))
        for node in range(size - 1, 3, -1):  # star-mesh: leave the inner nodes out one by one
            _eliminate(y, node)
        return tuple(tuple(row[:4]) for row in y[:4])


def _eliminate(y: list[list[float]], node: int) -> None:
    row = y[node]
    own = row[node]
    for j in range(node):
        if row[j]:
            factor = row[j] / own
            for k in range(node):
                y[j][k] -= factor * row[k]


def wire_order(wires: str) -> tuple[int, ...]:
    """Return the index of the electrode on each terminal, for wires such as "BACD": terminal A has electrode B.

    Raises:
        SensorError: the letters are not A, B, C and D, each once.
    """
    if sorted(wires) != list(RIGHT_WIRES):
        raise SensorError(f'wires must be the letters A, B, C, D, each once, as in "BACD", got {wires!r}')
    return tuple(RIGHT_WIRES.index(letter) for letter in wires)


def reorder(sheets: Matrix, order: Sequence[int]) -> Matrix:
    """Return what the terminals see of the electrodes: the matrix [S] with its rows and columns exchanged."""
    return tuple(tuple(sheets[i][j] for j in order) for i in order)


class RewiredSheets:
    """Contact model whose electrodes are on other terminals, by wires as in ``wire_order``."""

    def __init__(self, model: ContactModel, wires: str) -> None:
        self._model = model
        self._order = wire_order(wires)

    def admittances(self, sensor: Sensor, scenes: Sequence[Sequence[LayerContact]]) -> list[Matrix]:
        """Return for each scene of contacts the matrix Y [S] as the terminals A, B, C, D see it."""
        return [reorder(sheets, self._order) for sheets in self._model.admittances(sensor, scenes)]

    def prepare(self, sensor: Sensor, contact: LayerContact) -> None:
        """Compute beforehand what would take long when the sensor is touched there."""
        self._model.prepare(sensor, contact)
