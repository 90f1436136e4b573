"""Diagnosis of a fault that lasts: which broken wire or part explains the readings, whatever touches the sensor.

The first frame that contradicts itself stops the arm, under the first name that fits. Then each thing that may be
broken is fitted to one frame at rest, with the contact free, a step or two in a frame, so that no frame waits for it.
The fault gets another name only where one hypothesis explains the frame far better than those of all other names do.
One name stands for all that the readings cannot tell apart.

Each sheet is a resistor with the contact's tap on it, between its two electrodes. The contact joins the taps. Each
electrode has a feed, by the phase and by what is broken: a conductance to a potential. Leaving the electrodes out one
by one is exact, joined ones included, and leaves two equations, for the two taps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .frame.faults import Fault
from .frame.reading import judge
from .frame.untouched import UntouchedCurrents, bounded

_SHORT_CONDUCTANCE = 10.0  # S; of a short
_OPEN_CONDUCTANCE = 1e-12  # S; brings what has lost all its wires to ground
_WIRE_NAMES = "ABCD"
_TAP_DISTANCE = 1e-3  # of a side; a tap is no nearer to an electrode


class _PointContact(NamedTuple):
    """A point that joins the sheets: each part of 0..1, the conductance in siemens."""

    conductance: float
    x: float  #: along, from end 1
    y: float  #: around, from phi = 0


class _Observation(NamedTuple):
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


class _WiringHypothesis:
    """One thing that is broken, or nothing.

    Args:
        words: what is broken, for people.
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
        readings = {"C": (0, 3), "D": (1, 4), "A": (6,), "B": (7,), "touch": (0, 1, 2), "": ()}
        self._dead = readings[dead]

    @cached_property  # by the frame that asks first: those of all hypotheses together are 2.6 ms
    def _phases(self) -> tuple[_Phase, ...]:
        return _phases(*self._broken)

    def predict(self, contact: _PointContact, upper: float, lower: float, highest: Sequence[float]) -> list[float]:
        """Return the readings over the supply, in the order of an observation.

        Args:
            upper: conductance of the upper sheet [S].
            lower: that of the lower one [S].
            highest: what a reading cannot exceed.
        """
        joint, x, y = contact
        x = _TAP_DISTANCE if x < _TAP_DISTANCE else 1.0 - _TAP_DISTANCE if x > 1.0 - _TAP_DISTANCE else x
        y = _TAP_DISTANCE if y < _TAP_DISTANCE else 1.0 - _TAP_DISTANCE if y > 1.0 - _TAP_DISTANCE else y
        sheets = (upper / (1.0 - x), upper / x, lower / (1.0 - y), lower / y)
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


def _list_hypotheses(sensor: Sensor) -> list[_WiringHypothesis]:
    """Return all that may be broken of a sensor, nothing at first."""
    plus_upper, minus_upper = "BA" if sensor.b_positive else "AB"
    plus_lower, minus_lower = "CD" if sensor.c_positive else "DC"
    upper, lower, leak, driven = Fault.SHORT_UPPER, Fault.SHORT_LOWER, Fault.LEAK, Fault.GUIDE_DRIVEN
    found = [_WiringHypothesis(sensor, "nothing", None)]
    found += [_WiringHypothesis(sensor, f"{name} open", Fault[f"OPEN_{name}"], opened=name) for name in _WIRE_NAMES]
    pairs = zip("ABCD", (Fault.OPEN_UPPER, Fault.OPEN_UPPER, Fault.OPEN_LOWER, Fault.OPEN_LOWER), strict=True)
    joints = [(f"{name} joined to the supply", fault, (name, "supply")) for name, fault in pairs]
    joints += [("A joined with B", upper, ("A", "B")), ("C joined with D", lower, ("C", "D"))]
    for name, fault in ((plus_upper, upper), (minus_upper, leak), (plus_lower, lower), (minus_lower, leak)):
        joints.append((f"{name} joined to ground", fault, (name, "ground")))
    for name, fault in ((plus_upper, driven), (minus_upper, upper), (plus_lower, driven), (minus_lower, lower)):
        joints.append((f"switch of {name} stuck at the supply", fault, (name, "rail")))
    joints += [(f"{a} joined with {b}", Fault.LAYERS_CLOSED, (a, b)) for a in "AB" for b in "CD"]
    found += [_WiringHypothesis(sensor, words, fault, joined=joined) for words, fault, joined in joints]
    for name, fault in zip(_WIRE_NAMES, (Fault.GUIDES_DISAGREE, Fault.GUIDES_DISAGREE, leak, leak), strict=True):
        found.append(_WiringHypothesis(sensor, f"input of {name} dead", fault, dead=name))
    return [*found, _WiringHypothesis(sensor, "touch phase dead", driven, dead="touch")]


_GUIDE_ERROR = 0.01  # part of the supply; what the circuit's model may be off
_CURRENT_ERROR = 0.05  # part of a current, where the sheets are known
_UNLEARNED_CURRENT_ERROR = 0.25  # and where they are not
_FULL_SCALE_ERROR = 0.002  # part of a current's full scale


def _observe(sensor: Sensor, frame: Frame, noise: float, learned: bool) -> _Observation:
    """Return a frame as an observation.

    Args:
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
        off = rest + (_CURRENT_ERROR if learned else _UNLEARNED_CURRENT_ERROR) * current
        weights.append(1.0 / ((noise + off) * scale))
        highest.append(full * scale)
    if frame.driven is not None:
        for phase in (0, 1, 2):
            put_potentials(1.0 / supplies[phase], *frame.driven[2 * phase : 2 * phase + 2])
    return _Observation(tuple(values), tuple(weights), tuple(highest))


#: Faults that a broken wire or part may be the cause of.
DIAGNOSED_FAULTS = frozenset(
    {
        *(Fault.OPEN_UPPER, Fault.OPEN_A, Fault.OPEN_B, Fault.OPEN_LOWER, Fault.OPEN_C, Fault.OPEN_D),
        *(Fault.SHORT_UPPER, Fault.SHORT_LOWER, Fault.LEAK),
        *(Fault.GUIDES_DISAGREE, Fault.GUIDE_DRIVEN, Fault.OUT_OF_RANGE),
    }
)
_WIRE_PAIRS = {Fault.OPEN_UPPER: (Fault.OPEN_A, Fault.OPEN_B), Fault.OPEN_LOWER: (Fault.OPEN_C, Fault.OPEN_D)}
_PAIR_OF_WIRE = {one: both for both, pair in _WIRE_PAIRS.items() for one in pair}
_REST_DIFFERENCE = 0.01  # part of full scale, by which two frames at rest differ at most
_CHANGE_DIFFERENCE = 0.03  # likewise; what is farther from the frame that was explained needs another explanation
_STEPS_PER_FRAME = 2  # of the fit in one frame
_MAX_STEPS = 12  # steps for one hypothesis
_TRIAL_STEPS, _HOPELESS_SUM = 5, 2000.0  # steps, and the sum of squares beyond which no more are made then
_NO_CONTACT = _PointContact(0.0, 0.5, 0.5)
_START_CONTACTS = tuple(
    _PointContact(3e-3, x, y) for x, y in ((0.5, 0.5), (0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9))
)
_MIN_CONDUCTANCE, _MAX_CONDUCTANCE = 1e-6, 1.0  # S; of a contact
_EDGE_DISTANCE = 2e-3  # of a side; a contact is no nearer to an electrode
_NAME_MARGIN = 8.0  # by which a sum of squares must be less than those of other names,
_BROKEN_MARGIN = 3.0  # and less than nothing broken, which the frame has excluded,
_SUM_RATIO = 3.0  # and by so often what a contact leaves unexplained
_CONTACT_GAIN = 9.0  # by which the sum of squares is better at least where there is a contact
_MAX_SUM = 200.0  # a sum of squares that explains nothing; a firm contact clipped by an edge leaves 140


class FaultDiagnosis:
    """The diagnosis of one sensor.

    Args:
        currents: of the untouched sensor.

    Attributes:
        name: of a fault that may have a cause in the wiring, and lasts. None where none does.
        words: what is broken, for people, where that is known, else empty.
    """

    def __init__(self, sensor: Sensor, currents: UntouchedCurrents) -> None:
        self._sensor, self._currents = sensor, currents
        self.end()

    @cached_property
    def _hypotheses(self) -> list[_WiringHypothesis]:
        return _list_hypotheses(self._sensor)

    def end(self) -> None:
        """Forget the fault: untouched frames are valid again."""
        self.words = ""
        self.name: Fault | None = None
        self._last: Frame | None = None
        self._given: tuple[Frame, Fault] | None = None  # what is explained
        self._fit: _Fit | None = None
        self._found: list[tuple[float, _WiringHypothesis]] = []

    def rename(self, fault: Fault) -> Fault:
        """Return the name of a fault that a frame shows: its own where it is the first, later what was found."""
        self.name = self.name or fault
        return self.name

    def feed(self, frame: Frame, fault: Fault | None) -> Fault | None:
        """Take a frame while the fault lasts.

        Args:
            frame: whose supply is right.
            fault: what the frame alone says. None where it shows nothing.

        Returns:
            the name, in the frame in which it is found.
        """
        last, self._last = self._last, frame
        if self._given is None or self._fit is None:
            if last is None or self._differ(last, frame) > _REST_DIFFERENCE:
                return None
            if self._given is not None and self._differ(self._given[0], frame) < _CHANGE_DIFFERENCE:
                return None
            self._given, self._found = (frame, fault or self.name or Fault.GUIDES_DISAGREE), []
            self._fit = self._next(frame)
            return None
        for _ in range(_STEPS_PER_FRAME):
            if self._fit.improve():
                self._found.append((self._fit.sum, self._fit.hypothesis))
                if len(self._found) == len(self._hypotheses):
                    self._fit = None
                    return self._decide(self._given[1])
                self._fit = self._next(self._given[0])
                break
        return None

    def _differ(self, one: Frame, other: Frame) -> float:
        """Return by how much the readings of two frames differ at most, in parts of full scale."""
        most = max(abs(a - b) for a, b in zip(one[6:15], other[6:15], strict=True))
        return most / self._sensor.electronics.full_count

    def _next(self, frame: Frame) -> _Fit:
        observation = _observe(self._sensor, frame, 1.5, self._currents.means[1] > 0.0)
        return _Fit(self._hypotheses[len(self._found)], observation, *self._currents.sheets())

    def _decide(self, given: Fault) -> Fault:
        """Return the name of the likeliest hypothesis, where those of other names are far from it."""
        total, found = min(self._found, key=lambda each: each[0])
        rest = total + _SUM_RATIO * (total if total < _CONTACT_GAIN else total - _CONTACT_GAIN)
        near = [each for other, each in self._found if other < rest + (_NAME_MARGIN if each.fault else _BROKEN_MARGIN)]
        names, fault = {hypothesis.fault for hypothesis in near}, found.fault
        self.words = ""
        if total > _MAX_SUM or fault is None or given in names:
            fault = given
        elif names != {fault}:
            both = _PAIR_OF_WIRE.get(fault)
            fault = both if both and names <= {both, *_WIRE_PAIRS[both]} else given
        if len(near) == 1 and found.fault is fault:
            self.words = found.words
        self.name = fault
        return fault


def explain_frame(sensor: Sensor, frame: Frame) -> str:
    """Say in words what is broken, by one frame of a sensor at rest; empty where it does not tell, or nothing is."""
    fault = judge(sensor, frame)[1]
    if fault not in DIAGNOSED_FAULTS:
        return ""
    diagnosis = FaultDiagnosis(sensor, UntouchedCurrents(sensor, 0.0))
    while diagnosis.feed(frame, fault) is None:
        pass
    return diagnosis.words


class _Fit:
    """The fit of a contact to an observation under a hypothesis (Levenberg and Marquardt)."""

    def __init__(self, hypothesis: _WiringHypothesis, observation: _Observation, upper: float, lower: float) -> None:
        self.hypothesis = hypothesis
        self._observation, self._sheets = observation, (upper, lower)
        self._best = _NO_CONTACT, [0.0], math.inf  # contact, errors and the sum of their squares
        self._pace = 0, 0.01  # steps, and how much they are damped
        self.sum = math.inf

    def improve(self) -> bool:
        """Make the next step. Tell whether it was the last."""
        number, damping = self._pace[0] + 1, self._pace[1]
        self._pace = number, damping
        if number == 1:
            return self._start()
        contact, errors, total = self._best
        columns = []
        for moved, change in self._moves(contact):
            scale = 1.0 / change
            columns.append([(b - a) * scale for a, b in zip(errors, self._compare(moved), strict=True)])
        p, q, r = columns
        pp, qq, rr = _dot(p, p), _dot(q, q), _dot(r, r)
        pq, pr, qr = _dot(p, q), _dot(p, r), _dot(q, r)
        a, b, c = -_dot(p, errors), -_dot(q, errors), -_dot(r, errors)
        more = 1.0 + damping
        pp, qq, rr = pp * more + 1e-9, qq * more + 1e-9, rr * more + 1e-9
        one, two, three = qq * rr - qr * qr, pr * qr - pq * rr, pq * qr - pr * qq
        scale = 1.0 / (pp * one + pq * two + pr * three)
        steps = (
            (one * a + two * b + three * c) * scale,
            (two * a + (pp * rr - pr * pr) * b + (pq * pr - pp * qr) * c) * scale,
            (three * a + (pq * pr - pp * qr) * b + (pp * qq - pq * pq) * c) * scale,
        )
        moved = _PointContact(
            min(max(contact.conductance * math.exp(bounded(steps[0], 2.0)), _MIN_CONDUCTANCE), _MAX_CONDUCTANCE),
            min(max(contact.x + bounded(steps[1], 0.3), _EDGE_DISTANCE), 1.0 - _EDGE_DISTANCE),
            min(max(contact.y + bounded(steps[2], 0.3), _EDGE_DISTANCE), 1.0 - _EDGE_DISTANCE),
        )
        after = self._compare(moved)
        better = _dot(after, after)
        settled = False
        if better < total:
            settled = total - better < 1e-3 * total + 1e-3
            self._best = moved, after, better
            self.sum = min(self.sum, better + _CONTACT_GAIN)
            self._pace = number, 0.2 * damping
        else:
            self._pace = number, 8.0 * damping
        hopeless = number >= _TRIAL_STEPS and self._best[2] > _HOPELESS_SUM
        return settled or hopeless or number >= _MAX_STEPS

    def _start(self) -> bool:
        """Take the best of a few contacts. Tell whether none is needed."""
        errors = self._compare(_NO_CONTACT)
        self.sum = _dot(errors, errors)
        if self.sum < _CONTACT_GAIN:
            return True
        for contact in _START_CONTACTS:
            errors = self._compare(contact)
            total = _dot(errors, errors)
            if total < self._best[2]:
                self._best = contact, errors, total
        return False

    def _compare(self, contact: _PointContact) -> list[float]:
        values, weights, highest = self._observation
        found = self.hypothesis.predict(contact, *self._sheets, highest)
        return [(a - b) * w for a, b, w in zip(found, values, weights, strict=True)]

    @staticmethod
    def _moves(contact: _PointContact) -> tuple[tuple[_PointContact, float], ...]:
        """Return contacts beside one, and how far. The conductance counts in logarithms."""
        conductance, x, y = contact
        along, around = 1e-3 if x < 0.5 else -1e-3, 1e-3 if y < 0.5 else -1e-3
        return (
            (_PointContact(conductance * math.exp(0.02), x, y), 0.02),
            (_PointContact(conductance, x + along, y), along),
            (_PointContact(conductance, x, y + around), around),
        )


def _dot(one: list[float], other: list[float]) -> float:
    total = 0.0
    for a, b in zip(one, other, strict=True):
        total += a * b
    return total
