"""World of one guard: its core, an arm that obeys or not, the processes beside it, a person, and what may go wrong.

The environment may do anything at any time, as long as at most so many things are wrong at once. What is fed is what a
guard is fed: bytes of frames, payloads of states, reports. So the way to a broken invariant is a recording.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

from coneskin.core.recording.block import Block
from coneskin.core.recording.recorder import Recorder
from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import UR_CURRENTS
from coneskin.robot.driver.messages import EndReaction, Release, SetJointVelocity, StatusReport, StopProgram
from coneskin.robot.driver.values import (
    JointVelocitySetpoint,
    SetpointProgram,
    SetSpeedSlider,
    StopPath,
    UseStopPath,
)
from coneskin.robot.guard.core import GuardCore
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.joint_current import _push_torque
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent, encode_loss
from coneskin.robot.reaction.types import ContactOnLink
from coneskin.robot.sim.mock_arm import SLIDER, CompanionProcesses, MockArm
from coneskin.scene.build import build_core, place_on_arm
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import Commissioning
from coneskin.skin.virtual.imperfections import Foam, Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, encode

from .snapshot import Snapshot, restore, save

REACTIONS = {
    "stop": 'kind = "stop"',
    "slow": 'kind = "slow"\ntime_budget_s = 1\npress_mm = 50',
    "comply": 'kind = "comply"\ndistance_mm = 20\nbare_side = "fast"',
    "retreat": 'kind = "retreat"\ndistance_mm = 20\nbare_side = "allowed"',
}
CONTROLS = ("internal", "external")
_SENSOR_TEXT = """\
[[link.sensor]]
id = {number}
name = "{name}"
radius1_mm = 37.6
radius2_mm = 37.2
height_mm = 100
xyz_mm = [0, 0, {at}]
"""
_SCENE_TEXT = """\
[arm]
model = "UR5e"
host = "127.0.0.1"
control = "{control}"
[[link]]
name = "forearm"
{sensors}[source]
kind = "virtual"
[monitoring]
stuck_frames = 0
settle_ms = 40
[reaction]
{reaction}
"""
_START_Q = [math.radians(q) for q in (-20.0, -90.0, 90.0, -90.0, -90.0, 0.0)]
_PLACE = 0.05, 1.57  # m, rad; of a touch on either sensor
_START = 1e5  # s; of the host's clock, and twice that of the controller's: no other number is as large
_CYCLE = 0.01  # s between two states, and between two frames of a sensor
_SHORT = 2  # cycles of an action: 20 ms
_AT_ONCE = {"clock steps back", "clock steps ahead", "a state is nonsense", "suspended", "the process reports an error"}
_WHILE = 32  # cycles after what happens at once and leaves nothing behind that an abstract state would show: 0.32 s
_LASTS = (1, 1, 2, 3, 5, 8, 13, 21, 34, 55)  # cycles of an action by chance
_BRIEF = 16  # cycles at least of a wait for a change: 0.16 s
_CLOCK_CYCLES = 1200  # in which a reset is over, and states that were late since their clock stood still are in time
_LONG, _VERY_LONG = 80, 250  # cycles in which something has to change by itself: 0.8 s, and 2.5 s while it decides
_SPEED = 0.3  # rad/s; of the arm's program
_PUSH = 200.0  # N; of a touch that a complying arm follows
_LIMITS = {"skin": 0.05, "controller": 0.05, "program": 0.15, "process": 0.2}
_MARGIN = 0.045  # s; a frame or two, and the period of what is heard
_STAND_TIME = 1.5  # s in which an arm that stands is latched: a place may take 0.3 s, a watch 0.7 s
_STOP_TIME = 0.5  # s in which every path is used on an arm that does not stand
_ANSWER_TIME = 6.0  # s in which a reset is accepted or refused
_MOST_EVENTS = 40  # of one action
_MOST_STOPS = 4  # of one action: it has one cause, and each may come again when the arm has moved
_AWAY_TOLERANCE = 1e-3  # m/s; by which a touched point may move outward in a motion away

PROGRESS = "back to active"
#: name -> what has to hold, in a sentence
INVARIANTS = {
    "touched": "A touch of a sensor under an active guard is answered in its own frame: a stop, or the slider.",
    "first": "The answer to a touch comes before any event.",
    "still": "No motion is commanded but in a motion away: not while latched, not while stopping, not while active.",
    "safety": "No motion is commanded while the newest state shows a safety stop or no power.",
    "contact": "No setpoint moves a touched point outward, into what touches it.",
    "latches": "An arm that stands after a stop is latched within 1.5 s.",
    "reset": "A latched arm becomes active only after a reset that names its newest stop.",
    "release": "A release goes out only at the start or after an accepted reset.",
    "acknowledged": "The guard becomes active only by the acknowledgement of its newest release.",
    "bounded": "One action makes at most 4 stops and 40 events.",
    "counted": "Each stop has the next number, and what latches is the newest.",
    "fault": "Under each fault an active guard stops within its limit, and becomes active under none.",
    "escalates": "Where the arm does not stand, every stop path that is left is used within 0.5 s.",
    "answered": "Each reset is accepted or refused at once, and an accepted one is over within 6 s.",
    "slider": "A slider that a stop has put to 0 is raised only after an accepted reset of the newest stop.",
    "raises": "Nothing that is fed raises.",
    PROGRESS: "From every state a person who mends what is wrong, and resets, gets back to active.",
}


@dataclass(frozen=True)
class Settings:
    """What is explored.

    Attributes:
        reaction: of the scene, one of ``REACTIONS``.
        control: "internal" or "external".
        sensors: how many.
        most_wrong: things that may be wrong at once.
    """

    reaction: str = "stop"
    control: str = "internal"
    sensors: int = 1
    most_wrong: int = 1

    def scene_text(self) -> str:
        """Return the text of the scene."""
        sensors = "".join(
            _SENSOR_TEXT.format(number=number, name=("one", "two")[number], at=60 + 120 * number)
            for number in range(self.sensors)
        )
        return _SCENE_TEXT.format(control=self.control, sensors=sensors, reaction=REACTIONS[self.reaction])


_COMMISSIONING = Commissioning(True, "declared by a test")


@cache
def _parts(settings: Settings):
    scene = parse_scene(settings.scene_text(), "explored", Path(), recorded=True, commissioning=_COMMISSIONING)
    return scene, tuple(place_on_arm(scene))


@cache
def _frames(settings: Settings) -> dict[tuple[str, str], Frame]:
    """One frame of each sensor for each thing that it may show."""
    scene, _ = _parts(settings)
    quiet = Imperfections(foam=Foam(delayed=0.0))
    u, phi = _PLACE
    found = {}
    for item in scene.sensors:
        shows = {
            "free": [],
            "touch": [ScriptedTouch(0.0, 9.0, u, phi, rise=1e-4)],
            "doubt": [ScriptedTouch(0.0, 9.0, u, at, rise=1e-4) for at in (phi, phi + 2.0)],
        }
        for word, touches in shows.items():
            skin = VirtualSkin(item.sensor, touches, imperfections=quiet, model="ladder")
            frames = skin.frames()
            for _ in range(8):
                _, frame = next(frames)
            found[item.sensor.name, word] = frame
    return found


_RESTING = (Phase.STARTING, Phase.ACTIVE, Phase.LATCHED)  # in which nothing of a stop or a motion matters
#: classes of what never changes, although it could
_SHARED = frozenset({"Workspace", "FrameInversion", "WiringHypothesis", "ArmModel", "_UrDriver", "Sensor"})


@dataclass
class _Wrong:
    """What is wrong now, and since when [s]."""

    skin: str = "free"  # what sensor one shows: free, touch, doubt
    other: str = "free"
    line: str = ""  # of the skin: mute, mess, lost
    states: str = ""  # of the controller: mute, frozen, lost
    safety: bool = False
    unpowered: bool = False
    program: bool = False  # silent
    process: bool = False
    second: bool = False  # guard watchdog, silent
    disobeys: str = ""  # "first" path, or "all"
    lost: tuple[str, ...] = ()  # connections and processes, for good
    ended: bool = False

    def key(self) -> Hashable:
        """Return all of it as one value."""
        return tuple(vars(self).values())

    def count(self) -> int:
        """Return how many things are wrong."""
        touches = (self.skin != "free") + (self.other != "free")
        silent = self.program + self.process + self.second
        broken = bool(self.line) + bool(self.states) + self.safety + self.unpowered + silent
        return touches + broken + bool(self.disobeys) + len(self.lost) + self.ended


@dataclass
class _Judge:
    """What the invariants have to remember."""

    stop: int = 0  # number of the newest
    latched_stop: int = 0
    forgiven: int = 0  # by an accepted reset
    waiting: float = math.inf  # since when a reset waits for its answer
    standing: float = math.inf  # since when the arm stands after a stop
    moving: float = math.inf  # since when it moves although it is stopped
    released: int = 0
    acknowledged: int = 0
    touched: dict[str, bool] = field(default_factory=dict)
    fault_since: float = math.inf
    fault: str = ""
    events: int = 0
    stops: int = 0
    slider_at_0: bool = False
    used: set[str] = field(default_factory=set)
    heard: dict[str, float] = field(default_factory=dict)


class GuardWorld:
    """The world.

    Args:
        settings: what is explored.
        recorded: True to keep every block.
        only: actions that may happen. Empty for all.
        draw: of how long each action lasts. None where the same one always lasts as long.

    Attributes:
        core: of the guard.
        draw: as above.
        blocks: that were fed, and the events that came of them, where they are kept.
    """

    def __init__(
        self,
        settings: Settings,
        recorded: bool = False,
        only: frozenset[str] = frozenset(),
        draw: random.Random | None = None,
    ) -> None:
        self.settings = settings
        self._only = only
        self.draw = draw
        self.blocks: list[Block] | None = [] if recorded else None
        self.now = _START
        self.core = self._new_core()
        self.arm = MockArm(list(_START_Q), [0.0] * 6, clock=2 * _START)
        self.companions = CompanionProcesses()
        self.wrong = _Wrong()
        self._judge = _Judge()
        self._sequence = self._cycles = 0
        self._broken: list[str] = []
        self._step = 0.0  # s; that the controller's clock is off for one state

    def _new_core(self) -> GuardCore:
        scene, placed = _parts(self.settings)
        return build_core(scene, placed)

    # ---- what an explorer needs

    def save(self) -> Snapshot:
        return save(self, _SHARED)

    def restore(self, saved: Snapshot) -> None:
        restore(saved)
        self.draw = None  # from here on the same action lasts as long again

    def key(self) -> Hashable:
        core, judge = self.core, self._judge
        arm, activation, moves = core._arm, core._activation, self.settings.reaction not in ("stop", "slow")
        assert arm is not None
        stopping = core.phase.stopping  # then what only stands against a reset decides nothing yet
        facts: list[object] = [core.phase, self.arm.speed > 0.01, self.arm.safety_bits, self.wrong.key()]
        facts += [
            bool(core._faults) and not (stopping or core.phase is Phase.LATCHED),  # a reset forgives them
            activation.resetting,
            activation._way.released_at is None,
            judge.waiting < math.inf,
        ]
        facts += [(detector.ready and not stopping, detector.touched) for detector in core._stream.detectors]
        trouble = bool(arm.state_age.trouble(self.now)) and not stopping
        facts += [tuple(core._companions._silent), trouble, arm.backup_ready]
        stop, slow = arm._stop, arm.speed_reduction
        facts += [slow.now is None, slow._halted_from is None, slow.halted and self.arm.runtime_state == 2]
        if core.phase not in _RESTING:
            facts += [stop.watch.insists, len(arm._touches.contacts), arm._reaction.kind]
            if moves:
                now = arm.supervision
                facts += [now.may_move, bool(now.barred)]
            if (monitor := stop._monitor) is not None and monitor.course.standing_at is None:
                facts += [monitor.used[-1:] == monitor.used, StopPath.PROTECTIVE in monitor.used]
        return tuple(facts)

    @property
    def wanted(self) -> bool:
        return self.core.phase is Phase.ACTIVE and not self.wrong.count()

    def helps(self, action: str) -> bool:
        return action.startswith("mend") or action in (
            "wait",
            "wait for a change",
            "unlock",
            "reset",
            "restart",
            "the program ends",
        )

    def actions(self) -> Sequence[str]:
        only = self._only
        return [action for action in self._possible() if action in only] if only else self._possible()

    def _possible(self) -> list[str]:
        wrong, phase = self.wrong, self.core.phase
        found = ["wait", "wait for a change"]
        if wrong.ended:
            return [*found, "restart"]
        more = wrong.count() < self.settings.most_wrong
        if phase is Phase.ACTIVE or self.settings.control == "external":
            found.append("a program moves")
        arm = self.core._arm
        halted = arm is not None and arm.speed_reduction.halted  # then a person ends the driver's own program, too
        if (self.settings.control == "external" or halted) and self.arm.runtime_state == 2:
            found.append("the program ends")
        if phase is not Phase.STARTING:
            found += ["reset", "reset another stop"]
        for sensor, name in zip(("skin", "other"), ("one", "two")[: self.settings.sensors], strict=False):
            if getattr(wrong, sensor) != "free":
                found.append(f"mend {name}")
            elif more:
                found += [f"touch {name}", f"doubt {name}"]
        if wrong.line:
            found.append("mend the skin")
        elif more:
            found += ["skin mute", "skin mess", "skin lost"]
        if wrong.states in ("mute", "frozen"):
            found.append("mend the states")
        elif more and not wrong.states:
            found += ["states mute", "states frozen", "states lost"]
        if not wrong.states:
            found += ["clock steps back", "clock steps ahead", "a state is nonsense"]
        external = self.settings.control == "external"
        for name in ("safety", "unpowered", "program", "process", *(("second",) if external else ())):
            if getattr(wrong, name):
                found.append(f"mend {name}")
            elif more:
                found.append(f"{name} wrong")
        if self.arm.safety_bits != 1 and not wrong.safety:
            found.append("unlock")
        if wrong.disobeys:
            found.append("mend the arm")
        elif more:
            found += ["first path fails", "all paths fail"]
        if more:
            processes = ("watchdog", "second") if external else ("driver",)
            found += [f"lose {what}" for what in ("program", "command", "slider", *processes)]
            found += ["the session ends"]
        if "driver" not in wrong.lost and "watchdog" not in wrong.lost:
            found.append("the process reports an error")
        found += ["suspended"]
        if wrong.lost or wrong.states == "lost" or phase is Phase.STARTING:
            found.append("restart")
        return found

    def act(self, action: str) -> list[str]:
        self._broken = []
        judge = self._judge
        judge.events = judge.stops = 0
        cycles, before = _WHILE if action in _AT_ONCE else _SHORT, None
        if self.draw is not None:
            cycles = self.draw.choice(_LASTS)
        try:
            if action == "wait for a change":
                cycles, before = self._patience(), self.key()
            self._change(action)
            for number in range(cycles):
                self._cycle()
                if self._broken or (before is not None and number > _BRIEF and self.key() != before):
                    break
        except Exception as exc:
            self._break("raises", f"{type(exc).__name__}: {exc}")
        if judge.events > _MOST_EVENTS or judge.stops > _MOST_STOPS:
            self._break("bounded", f"{judge.stops} stops and {judge.events} events in {cycles * _CYCLE:g} s")
        self.arm.commands.clear()
        return self._broken

    def _patience(self) -> int:
        """Return the cycles in which something has to change by itself."""
        arm, resting = self.core._arm, self.core.phase in _RESTING
        assert arm is not None
        late = resting and arm.state_age.trouble(self.now) and not self.wrong.states
        if self._judge.waiting < math.inf or late:
            return _CLOCK_CYCLES
        return _LONG if resting else _VERY_LONG

    def _break(self, name: str, what: str) -> None:
        assert name in INVARIANTS, name
        self._broken.append(f"{name}: {what} ({self.core.phase.value}, at {self.now - _START:.3f} s)")

    # ---- what happens

    def _change(self, action: str) -> None:
        wrong, arm = self.wrong, self.arm
        match action.split():
            case ["a", "program", "moves"]:
                arm.runtime_state = 2
                arm.go([math.copysign(_SPEED, _START_Q[0] - arm.q[0]), 0, 0, 0, 0, 0], 20.0)
            case ["the", "program", "ends"]:
                arm.runtime_state = 1
                arm.go([0.0] * 6, 20.0)
            case ["reset"]:
                self._reset(self._judge.latched_stop)
            case ["reset", *_]:
                self._reset(self._judge.latched_stop + 1)
            case ["touch" | "doubt" as how, name]:
                setattr(wrong, "skin" if name == "one" else "other", how)
            case ["mend", "one" | "two" as name]:
                setattr(wrong, "skin" if name == "one" else "other", "free")
            case ["skin", "lost"]:
                wrong.line = "lost"
                self._feed(BlockKind.LOST, encode_loss("skin", "the port is gone"))
            case ["skin", how]:
                wrong.line = how
            case ["mend", "the", "skin"]:
                was, wrong.line = wrong.line, ""
                if was == "lost" and self.core.phase is Phase.LATCHED:
                    self._feed(BlockKind.REOPENED, b"skin")
                elif was == "lost":
                    wrong.line = "lost"
            case ["states", "lost"]:
                wrong.states = "lost"
                self._feed(BlockKind.LOST, encode_loss("controller", "the controller has closed the connection"))
            case ["states", how]:
                wrong.states = how
            case ["mend", "the", "states"]:
                wrong.states = ""
            case ["clock", "steps", "back"]:
                arm.clock -= 10.0
            case ["clock", "steps", "ahead"]:
                self._step = 3600.0
            case ["a", "state", "is", "nonsense"]:
                self._feed(BlockKind.ARM, arm.packet([math.nan] * 6, arm.qd, arm.current))
            case [name, "wrong"]:
                setattr(wrong, name, True)
            case ["mend", "the", "arm"]:
                wrong.disobeys = ""
            case ["mend", name]:
                setattr(wrong, name, False)
            case ["first", *_]:
                wrong.disobeys = "first"
            case ["all", *_]:
                wrong.disobeys = "all"
            case ["lose", what]:
                wrong.lost = (*wrong.lost, what)
                self._feed(BlockKind.LOST, encode_loss(what, f"{what} has ended"))
            case ["the", "session", "ends"]:
                wrong.ended = True
                self._feed(BlockKind.LOST, encode_loss("session", "the guard was told to end"))
            case ["the", "process", *_]:
                self._feed(BlockKind.DRIVER, StatusReport("error", "the wheel has raised").encode())
            case ["suspended"]:
                self._feed(BlockKind.SUSPENDED, b"2.000")
            case ["restart"]:
                fresh = GuardWorld(self.settings, only=self._only, draw=self.draw)
                self.__dict__.update(fresh.__dict__)
        first = StopPath.DRIVER if self.settings.control == "internal" else StopPath.PROGRAM
        all_paths = frozenset(StopPath)
        arm.obeys = {"": all_paths, "first": all_paths - {first}, "all": frozenset[StopPath]()}[wrong.disobeys]
        if wrong.safety:
            arm.safety_bits = 0b10000000100
            arm.go([0.0] * 6, 20.0)
        elif action in ("mend safety", "unlock"):
            arm.safety_bits = 1
        arm.robot_mode = 5 if wrong.unpowered else 7
        if wrong.unpowered:
            arm.go([0.0] * 6, 20.0)

    def _reset(self, stop: int) -> None:
        judge = self._judge
        number = self._cycles + 1
        before = judge.waiting
        out = self._feed(BlockKind.RESET, b"%d %d" % (stop, number))
        answers = [o.name for o in out if isinstance(o, GuardEvent) and o.details.get("request") == number]
        if not answers or answers[0] not in (EventName.RESET, EventName.REFUSED):
            self._break("answered", f"a reset of stop {stop} is not answered: {answers}")
        elif answers[0] is EventName.RESET and stop != judge.stop:
            self._break("reset", f"a reset of stop {stop} is accepted, the newest is {judge.stop}")
        elif answers[0] is EventName.RESET:
            judge.forgiven, judge.waiting = stop, min(before, self.now)

    def _cycle(self) -> None:
        wrong, arm = self.wrong, self.arm
        self.now += _CYCLE
        self._cycles += 1
        self.companions.program_is_mute = wrong.program or wrong.ended
        self.companions.process_is_mute = wrong.process or bool({"driver", "watchdog"} & set(wrong.lost))
        self.companions.second_is_mute = wrong.second or "second" in wrong.lost
        for block in list(self.companions.blocks(self.now)):
            if block.kind == BlockKind.DRIVER and block.payload.startswith(b"released"):
                self._judge.acknowledged = int(block.payload.split(b"\n")[1])
            self._take(block)
        if wrong.line != "lost":
            self._feed_skin()
        if self.settings.reaction == "comply":
            arm.current = self._held()
        clock = arm.clock
        for _ in range(5):
            arm.update()
        if self._cycles % 2 == 0 and self.core.needs.slider and "slider" not in wrong.lost:
            self._feed(BlockKind.SLIDER, SLIDER.pack((arm.slider,)))
        if wrong.states == "frozen":
            arm.clock = clock
        if wrong.states not in ("mute", "lost"):
            was, arm.clock, self._step = arm.clock, arm.clock + self._step, 0.0
            payload = arm.packet(arm.q, arm.qd, arm.current)
            arm.clock = was
            self._feed(BlockKind.ARM, payload)
        else:
            self._feed(BlockKind.TICK, b"")
        self._look()

    def _held(self) -> list[float]:
        """Return the currents that hold the arm against what pushes it [A]: a complying arm follows only these."""
        q, torque = tuple(self.arm.q), [0.0] * 6
        for shows, at in zip((self.wrong.skin, self.wrong.other), _parts(self.settings)[1], strict=False):
            if shows != "free":
                assert at.model is not None
                pushed = _push_torque(at.model, q, ContactOnLink(at.link, *at.place(*_PLACE)))  # type: ignore[arg-type]
                torque = [a + _PUSH * b for a, b in zip(torque, pushed, strict=True)]
        return [-a / b for a, b in zip(torque, UR_CURRENTS.torque_per_ampere, strict=True)]

    def _feed_skin(self) -> None:
        wrong = self.wrong
        self._sequence = (self._sequence + 1) & 0xFFFF
        for number, item in enumerate(_parts(self.settings)[0].sensors):
            if wrong.line == "mute":
                continue
            shows = (wrong.skin, wrong.other)[number]
            frame = _frames(self.settings)[item.sensor.name, shows]
            clock = round((self.now - _START) * 1e6) & 0xFFFFFFFF
            data = encode(frame._replace(sequence=self._sequence, clock_us=clock, status=0))
            if wrong.line == "mess":
                data = bytes(255 - byte for byte in data)
            before, was = self.core.phase, self._judge.touched.get(item.sensor.name, False)
            out = self._feed(BlockKind.SKIN, data)
            touched = shows != "free" and wrong.line == ""
            if touched and not was and before is Phase.ACTIVE:
                self._judge_touch(out)
            if wrong.line == "":
                self._judge.touched[item.sensor.name] = touched

    def _feed(self, kind: BlockKind, payload: bytes) -> list[object]:
        return self._take(Block(kind, self.now, payload))

    def _take(self, block: Block) -> list[object]:
        out: list[object] = []
        before = self.core.phase
        self.core.feed(block, out)  # type: ignore[arg-type]
        if self.blocks is not None:
            self.blocks.append(block)
            self.blocks += [output.block() for output in out if isinstance(output, GuardEvent)]
        stopped = False  # by an output of this input
        for output in out:
            stopped = stopped or isinstance(output, StopProgram | EndReaction | UseStopPath)
            self._judge_output(output, before, stopped)
            self.companions.feed(output)
            if isinstance(output, Release):
                self._judge.released = output.number
                if self.settings.control == "internal":
                    self.arm.runtime_state = 2  # the driver process starts its program again where it has ended
            elif not isinstance(output, GuardEvent):
                self.arm.feed(output)
        return out

    # ---- what must hold

    def _judge_touch(self, out: list[object]) -> None:
        answers = (StopProgram, UseStopPath)
        commands = [output for output in out if not isinstance(output, GuardEvent)]
        stops = [output for output in commands if isinstance(output, answers)]
        slow = [output for output in commands if isinstance(output, SetSpeedSlider)]
        paths_left = self.settings.control == "internal" or set(self.wrong.lost) != {"program", "command", "slider"}
        if not stops and not (slow and self.settings.reaction == "slow") and paths_left:
            self._break("touched", f"a touch is answered by {out}")
        elif stops and self.settings.reaction != "slow" and not isinstance(out[0], answers):
            self._break("first", f"the first output is {out[0]}")

    def _judge_output(self, output: object, before: Phase, stopped: bool) -> None:
        judge, phase, wrong = self._judge, self.core.phase, self.wrong
        moves = isinstance(output, SetJointVelocity | SetpointProgram) or (
            isinstance(output, JointVelocitySetpoint) and output.token != 0
        )
        if moves:
            if stopped or Phase.RETREATING not in (before, phase):
                self._break("still", f"{output}")
            if wrong.safety or wrong.unpowered or self.arm.safety_bits != 1:
                self._break("safety", f"{output}")
            if not isinstance(output, SetpointProgram):
                self._judge_contact(output)  # type: ignore[arg-type]
        elif isinstance(output, Release):
            if before is not Phase.STARTING and judge.forgiven != judge.stop:
                self._break("release", f"{output}")
        elif isinstance(output, UseStopPath):
            judge.used.add(output.path.value)
            judge.slider_at_0 = judge.slider_at_0 or output.path is StopPath.SLIDER
        elif isinstance(output, StopProgram):
            judge.used.add(StopPath.DRIVER.value)
        elif isinstance(output, SetSpeedSlider):
            if judge.slider_at_0 and output.fraction > 0.0 and judge.forgiven != judge.stop:
                self._break("slider", f"{output}")
            judge.slider_at_0 = judge.slider_at_0 and output.fraction <= 0.0
        elif isinstance(output, GuardEvent):
            judge.events += 1
            self._judge_event(output)

    def _judge_event(self, event: GuardEvent) -> None:
        judge = self._judge
        if event.name is EventName.STOPPING:
            judge.stops += 1
            number = event.details["stop"]
            if number not in (judge.stop, judge.stop + 1) or number == 0:
                self._break("counted", f"stop {number} after stop {judge.stop}")
            judge.stop = number
        elif event.name is EventName.LATCHED:
            judge.latched_stop = event.details["stop"]
            if judge.latched_stop != judge.stop:
                self._break("counted", f"stop {judge.latched_stop} latches, the newest is {judge.stop}")
        elif event.name is EventName.ACTIVATED:
            if judge.stop and judge.forgiven != judge.stop:
                self._break("reset", f"active after stop {judge.stop}, forgiven was {judge.forgiven}")
            if judge.acknowledged != judge.released or not judge.released:
                self._break("acknowledged", f"release {judge.released}, acknowledged {judge.acknowledged}")
            if self._fault() and self.now - judge.fault_since > 0.3:
                self._break("fault", f"active although {self._fault()}")
            judge.waiting = math.inf
            judge.used.clear()
            judge.slider_at_0 = False
        elif event.name is EventName.REFUSED:
            judge.waiting = math.inf

    def _judge_contact(self, output: SetJointVelocity | JointVelocitySetpoint) -> None:
        """Move the touched points a little as commanded, and see on which side of the skin they come out."""
        _, placed = _parts(self.settings)
        step = 1e-4
        for shows, at in zip((self.wrong.skin, self.wrong.other), placed, strict=False):
            if shows != "touch":
                continue
            point, normal = at.place(*_PLACE)
            model = at.model
            assert model is not None
            q = [a + step * v for a, v in zip(self.arm.q, output.qd, strict=True)]
            here, there = link_pose(model, self.arm.q, at.link), link_pose(model, q, at.link)
            outward = here.rotate(normal)
            moved = [(b - a) / step for a, b in zip(here.apply(point), there.apply(point), strict=True)]
            speed = sum(a * b for a, b in zip(outward, moved, strict=True))
            if speed > _AWAY_TOLERANCE:
                self._break("contact", f"{1e3 * speed:.1f} mm/s into a touch: {output}")

    def _fault(self) -> str:
        """Return what is wrong that an active guard has to stop for. Empty where nothing is."""
        wrong = self.wrong
        if wrong.line:
            return f"the skin is {wrong.line}"
        if wrong.states:
            return f"the states are {wrong.states}"
        if wrong.safety or wrong.unpowered:
            return "the controller has stopped the arm"
        if wrong.program or wrong.process or wrong.second or wrong.lost:
            return "a process or a connection is gone"
        return ""

    def _look(self) -> None:
        """Judge what holds at the end of every cycle."""
        judge, phase, now = self._judge, self.core.phase, self.now
        fault = self._fault()
        if fault != judge.fault:
            judge.fault, judge.fault_since = fault, now if fault else math.inf
        limit = (
            _LIMITS["process"]
            if self.wrong.process or self.wrong.second
            else _LIMITS["program"]
            if self.wrong.program
            else 0.05
        )
        if (
            fault
            and phase in (Phase.ACTIVE, Phase.SLOWED, Phase.RETREATING)
            and now - judge.fault_since > limit + _MARGIN
        ):
            self._break("fault", f"{fault} for {now - judge.fault_since:.3f} s")
        stopped = phase.stopping
        stands = self.arm.speed < 1e-3 and not self.wrong.states
        judge.standing = min(judge.standing, now) if stopped and stands else math.inf
        if now - judge.standing > _STAND_TIME:
            self._break("latches", f"it stands for {now - judge.standing:.2f} s")
        stopping = phase.stopping and self.arm.speed > 0.1 and self.wrong.disobeys == "all"
        if not stopping:
            judge.moving = math.inf
        elif judge.moving == math.inf:
            judge.moving = now
            judge.used = set()
        if now - judge.moving > _STOP_TIME and (missing := self._paths() - judge.used):
            self._break("escalates", f"not used within {_STOP_TIME} s: {sorted(missing)}")
        if now - judge.waiting > _ANSWER_TIME:
            self._break("answered", f"a reset waits for {now - judge.waiting:.1f} s")

    def _paths(self) -> set[str]:
        paths = {"program", "command", "slider", "protective"}
        paths |= {"watchdog"} if self.settings.control == "external" else set()
        gone = set(self.wrong.lost) | ({"protective"} if "program" in self.wrong.lost else set())
        return paths - gone

    # ---- what is kept

    def write(self, path: Path) -> None:
        """Write what was fed, and what came of it, as a recording that replays."""
        assert self.blocks is not None
        header = {
            "scene": self.settings.scene_text(),
            "name": "explored",
            "folder": "",
            "commissioning": {"valid": True, "note": _COMMISSIONING.note},
            "clocks": {"monotonic": _START, "unix": 0.0},
        }
        path.unlink(missing_ok=True)
        with Recorder(path) as recorder:
            recorder.write(Block(BlockKind.HEADER, _START, json.dumps(header).encode()), *self.blocks)
