"""Touching: a person is asked for one touch after the other, holds each until it is read, and lets go. Pure.

One machine serves acceptance, calibration, known forces and the examination of wires. It knows the order of events. A
judge of each knows what to ask for, when a touch is steady, and what comes of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from coneskin.skin.sensor import Sensor

from .misreadings import Place

Reading = TypeVar("Reading")
REQUESTS = ("mark", "again", "press")  #: kinds of notice on which the person touches the skin


class Notice(NamedTuple):
    """What the person is told.

    Attributes:
        kind: "mark" (touch this), "again" (the same once more), "press" (this, with a force), "read", "passed",
            "failed", "remark", "sensor" (a sensor is done).
        text: for people.
        details: for programs.
    """

    kind: str
    text: str
    details: Mapping[str, Any] = MappingProxyType({})


class Doubt(NamedTuple):
    """Reason why a touch cannot be read yet."""

    text: str  #: for people
    patience: float  #: duration of a touch after which the person is told, once [s]


@dataclass(frozen=True, slots=True)
class Mark:
    """Place on a sensor, and words by which a person finds it."""

    u: float  #: slant distance from end 1 [m]
    phi: float  #: azimuth [rad]
    where: str  #: the words

    @property
    def place(self) -> Place:
        """Place alone."""
        return Place(self.u, self.phi)

    def request(self, sensor: Sensor, number: int, total: int, again: bool) -> Notice:
        """Return what asks a person to touch it, as number of a total."""
        details = {"number": number, "of": total, "sensor": sensor.name, "where": self.where}
        details |= {"u_mm": round(1e3 * self.u, 1), "phi_deg": round(math.degrees(self.phi), 1)}
        text = f"{number} of {total}: touch {sensor.name} {self.where}"
        return Notice("again", f"once more, {text}", details) if again else Notice("mark", text, details)


class _Samples:
    """Newest samples of a touch, which are kept for a time [s]."""

    def __init__(self, longest: float) -> None:
        self._longest = longest
        self._rows: list[tuple[float, ...]] = []

    def __len__(self) -> int:
        """Return their number."""
        return len(self._rows)

    @property
    def duration(self) -> float:
        """Time from the oldest to the newest [s]; 0 without any."""
        return self._rows[-1][0] - self._rows[0][0] if self._rows else 0.0

    def feed(self, time: float, *values: float) -> None:
        """Add a sample, unless it is the newest one again."""
        if not self._rows or time > self._rows[-1][0]:
            self._rows.append((time, *values))
        oldest = self._rows[-1][0] - self._longest
        self._rows = [row for row in self._rows if row[0] >= oldest]

    def clear(self) -> None:
        """Drop all samples."""
        self._rows = []

    def values(self, number: int) -> list[float]:
        """Return one value of each sample, the oldest first; the first value has number 0."""
        return [row[number + 1] for row in self._rows]


class Held(NamedTuple, Generic[Reading]):
    """A touch that goes on."""

    now: float  #: [s], monotonic
    duration: float  #: of the touch so far [s]
    told: bool  #: the person was told of a doubt during this touch
    readings: Mapping[str, Reading | None]  #: sensor's name -> its reading; None where it is not touched


class _Sensed(Protocol):
    @property
    def sensor(self) -> Sensor: ...


class TouchJudge(Generic[Reading]):
    """Judge of touches: what to ask for, when a touch is steady, and what comes of it.

    Args:
        longest: time for which samples of a touch are kept [s].

    Attributes:
        mark: the mark that is asked for; None between two touches.
        over: there is nothing more to touch.
        incomplete: why it cannot be carried out; empty where it can.
        clear_time: without a touch before the next request [s].
        force: with which a virtual skin is touched [N].
        samples: of the touch that goes on; dropped when it ends.
        too_short: remark on a touch that ended before it was read; a {} stands for its duration [s]. None where empty.
    """

    clear_time = 0.1
    force = 5.0
    too_short = ""

    def __init__(self, longest: float = 0.0) -> None:
        self.mark: Mark | None = None
        self.over = False
        self.incomplete = ""
        self.samples = _Samples(longest)

    @property
    def current(self) -> _Sensed:
        """What is touched now, with its sensor."""
        raise NotImplementedError

    def ask(self) -> Notice:
        """Set ``mark`` to the next one, and return what asks for it."""
        raise NotImplementedError

    def hold(self, touch: Held[Reading]) -> list[Notice] | Doubt:
        """Judge a touch.

        Returns:
            what comes of it, which ends it; nothing while it goes on; or why it cannot be read yet.
        """
        raise NotImplementedError

    def refuse(self) -> list[Notice]:
        """Leave out the mark that is asked for: the person cannot reach it."""
        raise NotImplementedError


class Touching(Generic[Reading]):
    """Touching of one mark after the other, as a judge asks for them."""

    def __init__(self, judge: TouchJudge[Reading]) -> None:
        self.judge = judge
        self._waits_clear = True
        self._clear_since: float | None = None
        self._touched_since: float | None = None
        self._told = False

    @property
    def over(self) -> bool:
        """True once there is nothing more to touch, or it cannot be carried out."""
        return self.judge.over or bool(self.judge.incomplete)

    def update(self, now: float, readings: Mapping[str, Reading | None]) -> list[Notice]:
        """Continue with what the sensors read now.

        Args:
            now: [s], monotonic.
            readings: sensor's name -> its reading; None where it is not touched.

        Returns:
            what the person is told.
        """
        if self.over:
            return []
        touched = any(reading is not None for reading in readings.values())
        if self._waits_clear:
            return self._await_clear(now, touched)
        if not touched:
            return self._let_go(now)
        if self._touched_since is None:
            self._touched_since = now
        held = now - self._touched_since
        outcome = self.judge.hold(Held(now, held, self._told, readings))
        if isinstance(outcome, Doubt):
            if self._told or held < outcome.patience:
                return []
            self._told = True
            return [Notice("remark", outcome.text)]
        self._waits_clear = bool(outcome)
        return outcome

    def refuse(self) -> list[Notice]:
        """Take the mark that is asked for as one that the person cannot reach."""
        if self.judge.mark is None or self.over:
            return []
        notices = self.judge.refuse()
        return notices if self.over or self._waits_clear else [*notices, self._ask()]

    def _await_clear(self, now: float, touched: bool) -> list[Notice]:
        if touched:
            self._clear_since = None
            return []
        if self._clear_since is None:
            self._clear_since = now
        return [self._ask()] if now - self._clear_since >= self.judge.clear_time else []

    def _ask(self) -> Notice:
        self._waits_clear, self._clear_since = False, None
        self._forget()
        return self.judge.ask()

    def _let_go(self, now: float) -> list[Notice]:
        since, remark = self._touched_since, self.judge.too_short
        self._forget()
        return [Notice("remark", remark.format(f"{now - since:.1f}"))] if remark and since is not None else []

    def _forget(self) -> None:
        self._touched_since, self._told = None, False
        self.judge.samples.clear()
