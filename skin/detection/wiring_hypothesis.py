"""Hypothesis on what is broken between the electronics and the sheets: which readings it predicts at a contact.

Each sheet is a resistor with the contact's tap on it, between its two electrodes. The contact joins the taps. Each
electrode has a feed, by the phase and by what is broken: a conductance to a potential. Leaving the electrodes out one
by one is exact, joined ones included, and leaves two equations, for the two taps.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .frame.faults import Fault

_SHORT_CONDUCTANCE = 10.0  # S; of a short
_OPEN_CONDUCTANCE = 1e-12  # S; brings what has lost all its wires to ground
_WIRE_NAMES = "ABCD"
_EDGE_DISTANCE = 1e-3  # of a side; a tap is no nearer to an electrode


class PointContact(NamedTuple):
    """A point that joins the sheets: each part of 0..1, the conductance in siemens."""

    conductance: float
    x: float  #: along, from end 1
    y: float  #: around, from phi = 0


class Observation(NamedTuple):
    """Readings of a frame over the supply of their phase, with what they may be off, and what they cannot exceed."""

    values: tuple[float, ...]  #: of the nine of the phases; with driven potentials these six as well
    weights: tuple[float, ...]  #: one over the deviations
    highest: tuple[float, ...]


class _Group(NamedTuple):
    """One electrode, or some that are joined, in one phase."""

    feed: float  #: S
    source: float  #: feed times potential [S]
    measured: float  #: S; of the feed, what the drive current is measured in
    upper: tuple[int, ...]
    lower: tuple[int, ...]


class _Phase(NamedTuple):
    groups: tuple[_Group, ...]
    reads: tuple[tuple[int, float], ...]  #: group, and what the electronics see of its potential
    driven: tuple[int, ...]  #: groups


class WiringHypothesis:
    """One thing that is broken, or nothing.

    Args:
        sensor: the sensor.
        words: what is broken, for people.
        fault: its name.
        opened: electrodes whose wire is open.
        joined: two electrodes, or one and "ground", "supply" (before the current is measured) or "rail" (behind that).
        dead: electrodes, or "touch", whose readings are 0.
    """

    def __init__(
        self,
        sensor: Sensor,
        words: str,
        fault: Fault | None,
        opened: str = "",
        joined: tuple[str, str] | None = None,
        dead: str = "",
    ) -> None:
        self.words, self.fault = words, fault
        self._broken = sensor, opened, joined
        self._phases: tuple[_Phase, ...] = ()
        readings = {"C": (0, 3), "D": (1, 4), "A": (6,), "B": (7,), "touch": (0, 1, 2), "": ()}
        self._dead = readings[dead]

    def predict(self, contact: PointContact, upper: float, lower: float, highest: Sequence[float]) -> list[float]:
        """Return the readings over the supply, in the order of an observation.

        Args:
            contact: the contact.
            upper: conductance of the upper sheet [S].
            lower: that of the lower one [S].
            highest: what a reading cannot exceed.
        """
        joint, x, y = contact
        x = _EDGE_DISTANCE if x < _EDGE_DISTANCE else 1.0 - _EDGE_DISTANCE if x > 1.0 - _EDGE_DISTANCE else x
        y = _EDGE_DISTANCE if y < _EDGE_DISTANCE else 1.0 - _EDGE_DISTANCE if y > 1.0 - _EDGE_DISTANCE else y
        sheets = (upper / (1.0 - x), upper / x, lower / (1.0 - y), lower / y)
        if not self._phases:  # in the frame that asks first: those of all hypotheses together are 2.6 ms
            self._phases = _phases(*self._broken)
        found: list[float] = []
        own: list[float] = []
        for groups, reads, driven in self._phases:
            top = bottom = joint + _OPEN_CONDUCTANCE
            cross, from_top, from_bottom = joint, 0.0, 0.0
            kept = []
            for feed, source, measured, uppers, lowers in groups:
                up = low = 0.0
                for k in uppers:
                    up += sheets[k]
                for k in lowers:
                    low += sheets[k]
                share = 1.0 / (feed + up + low)
                top += up - up * up * share
                bottom += low - low * low * share
                cross += up * low * share
                from_top += up * source * share
                from_bottom += low * source * share
                kept.append((source, measured, up, low, share))
            scale = 1.0 / (top * bottom - cross * cross)
            at_top = (bottom * from_top + cross * from_bottom) * scale
            at_bottom = (cross * from_top + top * from_bottom) * scale
            potentials, current = [], 0.0
            for source, measured, up, low, share in kept:
                potential = (source + up * at_top + low * at_bottom) * share
                potentials.append(potential)
                current += measured * (1.0 - potential)
            for group, seen in reads:
                found.append(potentials[group] * seen)
            found.append(current)
            for group in driven:
                own.append(potentials[group])
        for k in self._dead:
            found[k] = 0.0
        if len(highest) > len(found):
            found += own
        return [most if value > most else value for value, most in zip(found, highest, strict=True)]


def _phases(sensor: Sensor, opened: str, joined: tuple[str, str] | None) -> tuple[_Phase, ...]:
    radial = "g+" if sensor.b_positive else "+g"
    angular = "+g" if sensor.c_positive else "g+"
    return tuple(_phase(sensor, roles, opened, joined) for roles in ("++pp", radial + "ii", "ii" + angular))


def _phase(sensor: Sensor, roles: str, opened: str, joined: tuple[str, str] | None) -> _Phase:
    """Return the feeds of a phase. A role is + for the supply, g for ground, p for a pull-down, i for an input."""
    parts = sensor.electronics
    loads = {"+": 0.0, "g": 0.0, "p": parts.pulldown_ohms, "i": parts.input_ohms}
    feeds, sources, measured, seen = [_OPEN_CONDUCTANCE] * 4, [0.0] * 4, [0.0] * 4, [0.0] * 4
    for k, (name, role) in enumerate(zip(_WIRE_NAMES, roles, strict=True)):
        if name not in opened:
            feed = 1.0 / (parts.lead_ohms[k] + loads[role])
            feeds[k] += feed
            seen[k] = feed * loads[role]
            if role == "+":
                sources[k], measured[k] = feed, feed
        if joined is not None and joined[0] == name and joined[1] not in _WIRE_NAMES:
            feeds[k] += _SHORT_CONDUCTANCE
            sources[k] += _SHORT_CONDUCTANCE if joined[1] != "ground" else 0.0
            measured[k] += _SHORT_CONDUCTANCE if joined[1] == "rail" else 0.0
    pair = [] if joined is None or joined[1] not in _WIRE_NAMES else [_WIRE_NAMES.index(name) for name in joined]
    members = [[k] for k in range(4) if k not in pair] + ([pair] if pair else [])
    groups = tuple(
        _Group(
            sum(feeds[k] for k in ks),
            sum(sources[k] for k in ks),
            sum(measured[k] for k in ks),
            tuple(k for k in ks if k < 2),
            tuple(k for k in ks if k > 1),
        )
        for ks in members
    )
    where = {k: number for number, ks in enumerate(members) for k in ks}
    reads = tuple((where[k], seen[k]) for k in range(4) if roles[k] in "pi")
    return _Phase(groups, reads, tuple(where[k] for k in range(4) if roles[k] not in "pi"))


def list_hypotheses(sensor: Sensor) -> list[WiringHypothesis]:
    """Return all that may be broken of a sensor, nothing at first."""
    plus_upper, minus_upper = "BA" if sensor.b_positive else "AB"
    plus_lower, minus_lower = "CD" if sensor.c_positive else "DC"
    upper, lower, leak, driven = Fault.SHORT_UPPER, Fault.SHORT_LOWER, Fault.LEAK, Fault.GUIDE_DRIVEN
    found = [WiringHypothesis(sensor, "nothing", None)]
    for name in _WIRE_NAMES:
        found.append(WiringHypothesis(sensor, f"{name} open", Fault[f"OPEN_{name}"], opened=name))
    joints: list[tuple[str, Fault, tuple[str, str]]] = []
    for name in _WIRE_NAMES:
        fault = Fault.OPEN_UPPER if name in "AB" else Fault.OPEN_LOWER
        joints.append((f"{name} joined to the supply", fault, (name, "supply")))
    joints += [("A joined with B", upper, ("A", "B")), ("C joined with D", lower, ("C", "D"))]
    for name, fault in ((plus_upper, upper), (minus_upper, leak), (plus_lower, lower), (minus_lower, leak)):
        joints.append((f"{name} joined to ground", fault, (name, "ground")))
    for name, fault in ((plus_upper, driven), (minus_upper, upper), (plus_lower, driven), (minus_lower, lower)):
        joints.append((f"switch of {name} stuck at the supply", fault, (name, "rail")))
    for first, second in ("AC", "AD", "BC", "BD"):
        joints.append((f"{first} joined with {second}", Fault.LAYERS_CLOSED, (first, second)))
    found += [WiringHypothesis(sensor, words, fault, joined=joined) for words, fault, joined in joints]
    for name in _WIRE_NAMES:
        fault = Fault.GUIDES_DISAGREE if name in "AB" else leak
        found.append(WiringHypothesis(sensor, f"input of {name} dead", fault, dead=name))
    return [*found, WiringHypothesis(sensor, "touch phase dead", driven, dead="touch")]


_GUIDE_ERROR = 0.01  # part of the supply; what the circuit's model may be off
_CURRENT_ERROR = 0.05  # part of a current, where the sheets are known
_UNLEARNED_CURRENT_ERROR = 0.25  # and where they are not
_FULL_SCALE_ERROR = 0.002  # part of a current's full scale


def observe(sensor: Sensor, frame: Frame, noise: float, learned: bool) -> Observation:
    """Return a frame as an observation.

    Args:
        sensor: the sensor.
        frame: whose supply is right.
        noise: standard deviation of a count.
        learned: the sheets are known from untouched frames.
    """
    parts = sensor.electronics
    unit = parts.current_full_scale / parts.adc_volts
    full, rest = parts.full_count, _FULL_SCALE_ERROR * parts.full_count
    values: list[float] = []
    weights: list[float] = []
    highest: list[float] = []

    def put_potentials(scale: float, *counts: int) -> None:
        for count in counts:
            values.append(count * scale)
            weights.append(1.0 / (noise * scale + _GUIDE_ERROR))
            highest.append(full * scale)

    supplies = frame.touch_supply, frame.radial_supply, frame.angular_supply
    guides = frame.touch_c, frame.touch_d, frame.radial_c, frame.radial_d, frame.angular_a, frame.angular_b
    currents = frame.touch_current, frame.radial_current, frame.angular_current
    for phase in (0, 1, 2):
        put_potentials(1.0 / supplies[phase], *guides[2 * phase : 2 * phase + 2])
        scale, current = unit / supplies[phase], currents[phase]
        values.append(current * scale)
        weights.append(
            1.0 / ((noise + rest + (_CURRENT_ERROR if learned else _UNLEARNED_CURRENT_ERROR) * current) * scale)
        )
        highest.append(full * scale)
    if frame.driven is not None:
        for phase in (0, 1, 2):
            put_potentials(1.0 / supplies[phase], *frame.driven[2 * phase : 2 * phase + 2])
    return Observation(tuple(values), tuple(weights), tuple(highest))
