"""Diagnosis of a fault that lasts: which broken wire or part explains the readings, whatever touches the sensor.

The first frame that contradicts itself stops the arm, under the first name that fits. Then each thing that may be
broken (`wiring_hypothesis`) is fitted to one frame at rest, with the contact free, a step or two in a frame, so that no
frame waits for it. The fault gets another name only where one hypothesis explains the frame far better than those of
all other names do. One name stands for all that the readings cannot tell apart.
"""

from __future__ import annotations

import math

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .frame.contact_matrix import FrameInversion
from .frame.faults import Fault
from .frame.untouched import UntouchedCurrents
from .wiring_hypothesis import Observation, PointContact, WiringHypothesis, list_hypotheses, observe

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
_NO_CONTACT = PointContact(0.0, 0.5, 0.5)
_START_CONTACTS = tuple(
    PointContact(3e-3, x, y) for x, y in ((0.5, 0.5), (0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9))
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
        sensor: the sensor.
        currents: of the untouched sensor.

    Attributes:
        active: a fault that may have a cause in the wiring lasts.
        words: what is broken, for people, where that is known, else empty.
    """

    def __init__(self, sensor: Sensor, currents: UntouchedCurrents) -> None:
        self._sensor, self._currents = sensor, currents
        self._hypotheses: list[WiringHypothesis] = []
        self.end()

    def end(self) -> None:
        """Forget the fault: untouched frames are valid again."""
        self.active = False
        self.words = ""
        self._name = Fault.GUIDES_DISAGREE
        self._last: Frame | None = None
        self._frame: Frame | None = None
        self._fit: _Fit | None = None
        self._number, self._given = 0, self._name
        self._found: list[tuple[float, WiringHypothesis]] = []

    def rename(self, fault: Fault) -> Fault:
        """Return the name of a fault that a frame shows: its own where it is the first, later what was found."""
        if not self.active:
            self.active, self._name = True, fault
        return self._name

    def feed(self, frame: Frame, fault: Fault | None) -> Fault | None:
        """Take a frame while the fault lasts.

        Args:
            frame: whose supply is right.
            fault: what the frame alone says. None where it shows nothing.

        Returns:
            the name, in the frame in which it is found.
        """
        last, self._last = self._last, frame
        if self._frame is None or self._fit is None:
            if last is None or self._differ(last, frame) > _REST_DIFFERENCE:
                return None
            if self._frame is not None and self._differ(self._frame, frame) < _CHANGE_DIFFERENCE:
                return None
            self._frame, self._given, self._number, self._found = frame, fault or self._name, 0, []
            self._fit = self._next()
            return None
        for _ in range(_STEPS_PER_FRAME):
            if self._fit.improve():
                self._found.append((self._fit.sum, self._fit.hypothesis))
                self._number += 1
                if self._number == len(self._hypotheses):
                    self._fit = None
                    return self._decide()
                self._fit = self._next()
                break
        return None

    def _differ(self, one: Frame, other: Frame) -> float:
        """Return by how much the readings of two frames differ at most, in parts of full scale."""
        most = max(abs(a - b) for a, b in zip(one[6:15], other[6:15], strict=True))
        return most / self._sensor.electronics.full_count

    def _next(self) -> _Fit:
        if not self._hypotheses:
            self._hypotheses = list_hypotheses(self._sensor)
        frame, currents = self._frame, self._currents
        assert frame is not None
        learned = currents.radial > 0.0
        upper, lower = 1.0 / self._sensor.radial_ohms, 1.0 / self._sensor.angular_ohms
        if learned:
            upper, lower = FrameInversion(self._sensor).untouched(currents.radial, currents.angular)
        observation = observe(self._sensor, frame, 1.5, learned)
        return _Fit(self._hypotheses[self._number], observation, upper, lower)

    def _decide(self) -> Fault:
        """Return the name of the likeliest hypothesis, where those of other names are far from it."""
        total, found = min(self._found, key=lambda each: each[0])
        rest = total + _SUM_RATIO * (total if total < _CONTACT_GAIN else total - _CONTACT_GAIN)
        near = [each for other, each in self._found if other < rest + (_NAME_MARGIN if each.fault else _BROKEN_MARGIN)]
        names, fault = {hypothesis.fault for hypothesis in near}, found.fault
        self.words = ""
        if total > _MAX_SUM or fault is None or self._given in names:
            fault = self._given
        elif names != {fault}:
            both = _PAIR_OF_WIRE.get(fault)
            fault = both if both and names <= {both, *_WIRE_PAIRS[both]} else self._given
        if len(near) == 1 and found.fault is fault:
            self.words = found.words
        self._name = fault
        return fault


class _Fit:
    """The fit of a contact to an observation under a hypothesis (Levenberg and Marquardt)."""

    def __init__(self, hypothesis: WiringHypothesis, observation: Observation, upper: float, lower: float) -> None:
        self.hypothesis = hypothesis
        self._observation, self._sheets = observation, (upper, lower)
        self._contact, self._errors = _NO_CONTACT, [0.0]
        self._round, self._damping = 0, 0.01
        self.sum = self._total = math.inf

    def improve(self) -> bool:
        """Make the next step. Tell whether it was the last."""
        self._round += 1
        if self._round == 1:
            return self._start()
        contact, errors, total = self._contact, self._errors, self._total
        columns = []
        for moved, change in self._moves(contact):
            scale = 1.0 / change
            columns.append([(b - a) * scale for a, b in zip(errors, self._compare(moved), strict=True)])
        p, q, r = columns
        pp, qq, rr = _dot(p, p), _dot(q, q), _dot(r, r)
        pq, pr, qr = _dot(p, q), _dot(p, r), _dot(q, r)
        a, b, c = -_dot(p, errors), -_dot(q, errors), -_dot(r, errors)
        more = 1.0 + self._damping
        pp, qq, rr = pp * more + 1e-9, qq * more + 1e-9, rr * more + 1e-9
        one, two, three = qq * rr - qr * qr, pr * qr - pq * rr, pq * qr - pr * qq
        scale = 1.0 / (pp * one + pq * two + pr * three)
        steps = (
            (one * a + two * b + three * c) * scale,
            (two * a + (pp * rr - pr * pr) * b + (pq * pr - pp * qr) * c) * scale,
            (three * a + (pq * pr - pp * qr) * b + (pp * qq - pq * pq) * c) * scale,
        )
        moved = PointContact(
            min(max(contact.conductance * math.exp(_within(steps[0], 2.0)), _MIN_CONDUCTANCE), _MAX_CONDUCTANCE),
            min(max(contact.x + _within(steps[1], 0.3), _EDGE_DISTANCE), 1.0 - _EDGE_DISTANCE),
            min(max(contact.y + _within(steps[2], 0.3), _EDGE_DISTANCE), 1.0 - _EDGE_DISTANCE),
        )
        after = self._compare(moved)
        better = _dot(after, after)
        settled = False
        if better < total:
            settled = total - better < 1e-3 * total + 1e-3
            self._contact, self._errors, self._total = moved, after, better
            self.sum = min(self.sum, better + _CONTACT_GAIN)
            self._damping *= 0.2
        else:
            self._damping *= 8.0
        hopeless = self._round >= _TRIAL_STEPS and self._total > _HOPELESS_SUM
        return settled or hopeless or self._round >= _MAX_STEPS

    def _start(self) -> bool:
        """Take the best of a few contacts. Tell whether none is needed."""
        errors = self._compare(_NO_CONTACT)
        self.sum = _dot(errors, errors)
        if self.sum < _CONTACT_GAIN:
            return True
        for contact in _START_CONTACTS:
            errors = self._compare(contact)
            total = _dot(errors, errors)
            if total < self._total:
                self._contact, self._errors, self._total = contact, errors, total
        return False

    def _compare(self, contact: PointContact) -> list[float]:
        values, weights, highest = self._observation
        found = self.hypothesis.predict(contact, *self._sheets, highest)
        return [(a - b) * w for a, b, w in zip(found, values, weights, strict=True)]

    @staticmethod
    def _moves(contact: PointContact) -> tuple[tuple[PointContact, float], ...]:
        """Return contacts beside one, and how far. The conductance counts in logarithms."""
        conductance, x, y = contact
        along, around = 1e-3 if x < 0.5 else -1e-3, 1e-3 if y < 0.5 else -1e-3
        return (
            (PointContact(conductance * math.exp(0.02), x, y), 0.02),
            (PointContact(conductance, x + along, y), along),
            (PointContact(conductance, x, y + around), around),
        )


def _dot(one: list[float], other: list[float]) -> float:
    total = 0.0
    for a, b in zip(one, other, strict=True):
        total += a * b
    return total


def _within(value: float, most: float) -> float:
    return most if value > most else -most if value < -most else value
