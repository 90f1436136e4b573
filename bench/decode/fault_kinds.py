"""Kinds of faults for bench `decode-faults`: what is broken, the names that are right for it, what may hide it."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection


@dataclass(frozen=True)
class FaultCase:
    """A fault, and what is right to say of it.

    Attributes:
        name: for the table.
        faults: what is injected.
        right: names.
        touch_stands: a touch that lasts is right as well: the readings are those of a contact.
        harmless: no name is right too, where there is no touch, or no certain place is wrong.
        shows: without a touch.
        swallows: the fault is that no frame comes.
        released: a touch ends, since nothing is told while it lasts.
        noise: standard deviation of a count.
    """

    name: str
    faults: FaultInjection
    right: frozenset[str]
    touch_stands: bool = False
    harmless: bool = False
    shows: bool = True
    swallows: bool = False
    released: bool = False
    noise: float = 0.7

    def judge(self, said: str, began: bool, misplaced: bool, touched: bool) -> str:
        """Return the verdict: right, wrong, or silent."""
        if said in self.right:
            return "right"
        if said:
            return "wrong"
        if began and self.touch_stands:
            return "right"
        if self.harmless and began == touched and not misplaced:
            return "right"
        return "touch seen" if began else "silent"


def draw_kind(rng: random.Random, number: int, sensor: Sensor, begins: int, driven: bool) -> FaultCase:
    """Return the case of a number: the kinds in turn.

    Args:
        rng: draws what a kind leaves open.
        number: of the case.
        sensor: the sensor.
        begins: frame at which the fault begins.
        driven: frames carry the driven electrodes' potentials.
    """
    kinds = (*_wiring(sensor, begins, driven), *_line(rng, begins), *_gains(rng, begins, driven), *_none(rng))
    return kinds[number % len(kinds)]()


_Kinds = list[Callable[[], FaultCase]]


def _wiring(sensor: Sensor, begins: int, driven: bool) -> _Kinds:
    """Return broken wires and shorts, by the electrodes of this polarity: p for the driven one, n for the grounded."""
    radial = ("B", "A") if sensor.b_positive else ("A", "B")
    angular = ("C", "D") if sensor.c_positive else ("D", "C")
    kinds: _Kinds = []

    def add(name: str, wiring: WiringFaults, *right: str, **rest: bool) -> None:
        faults = FaultInjection(wiring_after=begins, wiring=wiring)
        kinds.append(lambda: FaultCase(name, faults, frozenset(right), **rest))

    def short(one: str, other: str) -> WiringFaults:
        return WiringFaults(shorts=((one, other),))

    for names, sheet, (plus, minus) in (("AB", "UPPER", radial), ("CD", "LOWER", angular)):
        for each in names:
            both = () if driven else (f"OPEN_{sheet}",)  # with the driven potentials the wire itself is named
            add(f"wire of {each} open", WiringFaults((each,)), f"OPEN_{each}", *both)
            add(f"{each} to the supply", short(each, "supply"), f"OPEN_{sheet}")
        add(f"{names[0]} and {names[1]} shorted", short(*names), f"SHORT_{sheet}")
        add(f"positive one of {names} to ground", short(plus, "ground"), f"SHORT_{sheet}")
        hidden = names == "CD"  # an untouched guide is at ground anyway
        add(f"grounded one of {names} to ground", short(minus, "ground"), "LEAK", shows=not hidden, harmless=hidden)
        add(f"switch of the positive one of {names} at the rail", short(plus, "rail"), "GUIDE_DRIVEN")
        add(f"switch of the grounded one of {names} at the rail", short(minus, "rail"), f"SHORT_{sheet}")
    for one in "AB":
        for other in "CD":
            add(f"{one} and {other} joined", short(one, other), "LAYERS_CLOSED", touch_stands=True)
    return kinds


def _line(rng: random.Random, n: int) -> _Kinds:
    """Return faults of device and line."""
    every = 5 * rng.randint(5, 20)
    stuck = rng.choice(("radial_current", "angular_current", "supply"))
    guide = rng.choice(("angular_a", "angular_b", "radial_c", "radial_d", "touch_c", "touch_d"))
    cases = (
        FaultCase("nothing more is sent", FaultInjection(stall_after=n), frozenset({"SILENT"}), swallows=True),
        FaultCase(
            "a stall",
            FaultInjection(stall_after=n, stall_frames=rng.randint(5, 20)),
            frozenset({"GAP", "LATE"}),
            swallows=True,
        ),
        FaultCase("frames lost", FaultInjection(drop_every=rng.randint(2, 10)), frozenset({"GAP"}), swallows=True),
        FaultCase("frames twice", FaultInjection(duplicate_every=every), frozenset({"REPLAYED"})),
        FaultCase("out of order", FaultInjection(swap_every=every), frozenset({"REPLAYED", "GAP"}), swallows=True),
        FaultCase("replayed", FaultInjection(replay_after=n), frozenset({"REPLAYED"}), swallows=True),
        FaultCase("a restart", FaultInjection(restart_after=n), frozenset({"RESTARTED"})),
        FaultCase("clock ahead", FaultInjection(clock_jump_after=n), frozenset({"CLOCK_JUMP"})),
        FaultCase("clock behind", FaultInjection(clock_jump_after=n, clock_jump_us=-50_000), frozenset({"REPLAYED"})),
        FaultCase("all channels stuck", FaultInjection(stuck_after=n), frozenset({"STUCK"}), swallows=True),
        FaultCase(f"{stuck} stuck", FaultInjection(stuck_after=n, stuck_channel=stuck), frozenset({"STUCK"})),
        FaultCase(
            "supply at 0",
            FaultInjection(saturate_after=n, stuck_channel="supply", saturate_count=0),
            frozenset({"SUPPLY"}),
        ),
        FaultCase(
            "guide at full scale",
            FaultInjection(saturate_after=n, stuck_channel=guide, saturate_count=0xFFFF),
            frozenset({"SATURATED"}),
        ),
        FaultCase("status", FaultInjection(status_after=n, status=rng.choice((1, 2, 4, 8, 16))), frozenset({"DEVICE"})),
        FaultCase("unplugged", FaultInjection(unplug_after=n), frozenset({"unplugged"}), swallows=True),
    )
    return [lambda case=case: case for case in cases]  # type: ignore[misc]


def _gains(rng: random.Random, begins: int, driven: bool) -> _Kinds:
    """Return gains of 10 to 25 % too much or too little, and dead inputs, from a frame or from the start.

    A supply that is read 4 to 9 % off from the start is told by the driven electrodes' potentials alone: without them
    it looks like other sheets and another place.
    """
    later, begins = begins, rng.choice((0, begins))
    ratio = rng.choice((-1.0, 1.0)) * rng.uniform(0.10, 0.25) + 1.0
    supply = rng.choice((-1.0, 1.0)) * rng.uniform(0.04, 0.09) + 1.0
    above = {"OUT_OF_RANGE", "GUIDE_DRIVEN"} if ratio > 1.0 else set()  # it reads more than the supply gives
    cases = []
    for name, gain, right in (
        *((f"gain of input {each}", ratio, {"GUIDES_DISAGREE", *above}) for each in "AB"),
        *((f"gain of input {each}", ratio, {"GUIDES_DISAGREE", "LEAK", *above}) for each in "CD"),
        ("gain of the drive current", ratio, {"CURRENT_CHANGED", "GUIDES_DISAGREE", "LEAK"}),
        ("gain of the supply", supply, {"CURRENT_CHANGED", "GUIDES_DISAGREE", "SUPPLY", "LEAD"}),
        *((f"input {each} dead", 0.0, {"GUIDES_DISAGREE", "LEAK"}) for each in "ABCD"),
        ("touch phase dead", 0.0, {"GUIDE_DRIVEN"}),
    ):
        of = name.split()[-1] if "phase" not in name else "touch"
        of = name.split()[1] if "dead" in name and of != "touch" else of
        after = later if of == "supply" and not driven else begins
        faults = FaultInjection(gain_after=after, gain_of=of, gain=gain)
        released = of == "supply"
        cases.append(FaultCase(name, faults, frozenset(right), harmless=True, shows=False, released=released))
    return [lambda case=case: case for case in cases]  # type: ignore[misc]


def _none(rng: random.Random) -> _Kinds:
    """Return nothing broken, under noise of 1 to 10 counts."""
    noise = rng.uniform(1.0, 10.0)
    return [
        lambda: FaultCase("nothing, noise of 1 to 10 counts", FaultInjection(), frozenset(), noise=noise, harmless=True)
    ]
