"""Physics in real time: force -> skin -> bytes -> decode -> stop -> force, with every process its own."""

from __future__ import annotations

import math
import os
import socket
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import pytest

from coneskin.core.channel import Channel, pair, wait_readable
from coneskin.core.errors import Collision, ConeSkinError, MissingExtra, RobotRefused
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent, body_places, contact_force
from coneskin.runs.replay.run import read_run
from coneskin.runs.what_if.what_if import _judge_run
from coneskin.scene.reader import parse_scene
from coneskin.scene.values.scene import Scene
from coneskin.session.session import guard
from tests.guarded.guarded_session import TOO_BUSY, until
from tests.support.scenes import forearm_scene, start_with

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")
pytest.importorskip("mujoco", reason="the physics engine is MuJoCo (PyPI: mujoco)")
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.impact.simulation.live_plant import LivePlant  # noqa: E402
from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

START, GOAL = start_with(-10.0), start_with(60.0)
#: in the way of the forearm's leading side, which meets it at 0.21 m/s after 0.3 s
_HAND = """
[[body]]
kind = "hand"
xyz_mm = [-192, -120, 587.5]
mass_kg = 0.6
stiffness_n_per_mm = 2
"""
_PATIENT = "skin_silence_ms = 1000\narm_silence_ms = 1000\nprogram_silence_ms = 1500\nescalate_ms = 250"


def scene_at(host: str) -> Scene:
    text = forearm_scene(host, limits=_PATIENT).replace("[arm]", "[arm]\nwatchdog_hz = 1")
    return parse_scene(text + _HAND)


Live = tuple[Scene, LivePlant, SimulatedController]


@contextmanager
def opened() -> Iterator[Live]:
    host = free_host()
    scene = scene_at(host)
    with (
        LivePlant(scene, START) as plant,
        SimulatedController("UR5e", host, START, plant=plant.controller) as controller,
    ):
        yield scene, plant, controller


def until_undisturbed(attempt: Callable[[Live], bool], opener: Callable[[], AbstractContextManager[Live]]) -> None:
    """Make attempts, each with a physics of its own, until one is not held up by this computer, and says so.

    Skips the test where none is not, and far more processes want to run than there are cores.
    """
    for _ in range(5):
        with opener() as live:
            try:
                if attempt(live):
                    return
            except ConeSkinError:
                if not held_up(live):
                    raise
    if os.getloadavg()[0] > TOO_BUSY:
        pytest.skip("no verdict: this computer is too busy for any physics in real time")
    pytest.fail("this computer has held the physics up five times of five")


def once_it_moves(controller: SimulatedController, act: Callable[[], object]) -> threading.Thread:
    """Act from a thread once the arm moves, or has lost its physics; the thread."""

    def moves() -> bool:
        state = controller.state()
        return max(map(abs, state["qd"])) > 0.1 or state["plant_lost"] != ""

    def run() -> None:
        until(moves)
        act()

    thread = threading.Thread(target=run)
    thread.start()
    return thread


def held_up(live: Live) -> bool:
    """Tell whether the controller has given the physics up because it did not keep up."""
    return "behind real time" in live[2].state()["plant_lost"]


@pytest.mark.long
def test_a_hand_that_is_met_stops_the_arm_and_the_stop_is_measured(tmp_path: Path) -> None:
    recordings = (tmp_path / f"{number}.rec" for number in count())

    def attempt(live: Live) -> bool:
        scene, plant, controller = live
        recording = next(recordings)
        with guard(scene, recording=recording, pressed_by=plant.skin) as session:
            with pytest.raises(Collision):
                session.arm.move_j(GOAL, speed=1.0, acceleration=8.0)
            rest = controller.wait_for_standstill()
        judge_the_stop(live, recording, session.events, rest)
        return True

    until_undisturbed(attempt, opened)


@pytest.mark.long
def test_what_the_bodies_bore_is_told_after_the_controller_has_ended() -> None:
    """A controller that gives the physics up, because a busy computer held it up, takes no figure along."""
    with opened() as (_, plant, controller):
        controller.__exit__(None, None, None)
        for _ in range(2):
            outcome, began = plant.outcome()
            assert (outcome.peak, math.isnan(began)) == (0.0, True)


def judge_the_stop(live: Live, recording: Path, events: list[GuardEvent], rest: dict[str, Any]) -> None:
    scene, plant, _ = live
    assert rest["plant_lost"] == ""
    outcome, began = plant.outcome()
    contact, stood = (next(e for e in events if e.name == name) for name in (EventName.CONTACT, EventName.STANDSTILL))
    assert began < contact.time < stood.time
    assert 5.0 < outcome.peak < 300.0  # 2 and 10 N/mm in series, 10 to 30 mm on: as far as it comes on a busy computer
    assert outcome.approach == pytest.approx(0.21, abs=0.03)
    assert outcome.impulse > 0.0
    assert START[0] + 0.1 < rest["q"][0] < GOAL[0] - 0.5  # on its way, and far from its goal
    assert rest["q"][0] != rest["tcp"][0]
    located = next(e for e in events if e.name == EventName.CONTACT_LOCATED)
    assert located.details["u"] == pytest.approx(0.13, abs=0.01)
    run = read_run(recording)
    assert run.replay().same
    (row,) = _judge_run(recording)
    assert (row["truth"], row["touches"], row["missed"], row["false_alarms"]) == ("virtual skin", 1, 0, 0)
    truths = list(run.select(kinds=frozenset({BlockKind.TRUTH})))
    felt = [(block.time, force) for block in truths if (force := contact_force(block.payload)) is not None]
    assert felt[0][0] == pytest.approx(began, abs=0.004)
    assert 0.5 * outcome.peak < max(force for _, force in felt) <= outcome.peak  # told every 10 ms, not at its peak
    places = [body_places(block.payload)[0] for block in truths if body_places(block.payload)]
    start = scene.bodies[0].place
    assert math.dist(places[0], start) < 0.002
    assert 0.3 < max(math.dist(place, start) for place in places) * 2e3 / outcome.peak < 2.0  # F = k x, and it swings


@pytest.mark.long
@pytest.mark.parametrize(("harm", "said"), [("kill", "has ended"), ("freeze", "behind real time")])
def test_physics_that_dies_or_falls_behind_is_said_and_stops_everything(harm: str, said: str) -> None:
    def attempt(live: Live) -> bool:
        scene, plant, controller = live
        with guard(scene, pressed_by=plant.skin) as session:
            harming = once_it_moves(controller, getattr(plant, harm))
            with pytest.raises(RobotRefused, match=r"safety system|fault|NOT confirmed"):
                session.arm.move_j(GOAL, speed=0.2, acceleration=1.0)
            harming.join()
            if held_up(live) and harm != "freeze":
                return False
            assert said in controller.state()["plant_lost"]
            assert controller.state()["safety"] == "FAULT"
            assert not any(event.name == EventName.STANDSTILL for event in session.events)  # nobody has measured one
            with pytest.raises(RobotRefused):
                session.reset()
        return True

    until_undisturbed(attempt, opened)


class Relay(threading.Thread):
    """Line between physics and controller that passes on all, until it is told to answer for the physics."""

    def __init__(self, physics: socket.socket) -> None:
        super().__init__()
        self.controller, own = pair()
        self._physics, self._own = Channel(physics), Channel(own)
        self._answer: bytes | None = None

    def answer(self, message: bytes) -> None:
        """Answer once, from now on, what the physics would not."""
        self._answer = message

    def run(self) -> None:
        while not (self._physics.closed or self._own.closed):
            ready = wait_readable([self._physics, self._own], 0.5)
            for one, other in ((self._physics, self._own), (self._own, self._physics)):
                for message in one.receive() if one in ready else ():
                    wrong, self._answer = self._answer, None
                    if wrong is not None and other is self._own:
                        message = wrong
                    elif wrong is not None:
                        self._answer = wrong
                    other.send(message)
        self._physics.close()
        self._own.close()


@pytest.mark.long
def test_a_guarded_arm_whose_physics_talks_nonsense_is_in_a_fault_without_power() -> None:
    """One nonsense of those in tests/robot/sim/test_plant.py."""
    answer = struct.pack("<18d", START[0] + 25.0, *START[1:], *(0.0,) * 12)
    relays: list[Relay] = []

    @contextmanager
    def relayed() -> Iterator[Live]:
        host = free_host()
        scene = scene_at(host)
        with LivePlant(scene, START) as plant:
            relays.append(relay := Relay(plant.controller))
            relay.start()
            with SimulatedController("UR5e", host, START, plant=relay.controller) as controller:
                yield scene, plant, controller
            relay.join(60.0)
            assert not relay.is_alive()

    def attempt(live: Live) -> bool:
        scene, plant, controller = live
        with guard(scene, pressed_by=plant.skin) as session:
            harming = once_it_moves(controller, partial(relays[-1].answer, answer))
            with pytest.raises(RobotRefused, match=r"safety system|fault|NOT confirmed"):
                session.arm.move_j(GOAL, speed=0.2, acceleration=1.0)
            harming.join()
            if held_up(live):
                return False
            rest = controller.state()
            assert "a way in 2 ms of joint 1 of 25 rad" in rest["plant_lost"]
            assert (rest["safety"], rest["robot_mode"], rest["runtime"]) == ("FAULT", "POWER_OFF", "STOPPED")
            assert not any(event.name == EventName.STANDSTILL for event in session.events)  # nobody has measured one
            with pytest.raises(RobotRefused):
                session.reset()
            until(lambda: controller.state()["cycle"] > rest["cycle"])
            later = controller.state()
            assert later["q"] == rest["q"]
            assert math.isclose(later["q"][0], START[0], abs_tol=0.3)  # far from its goal
        return True

    until_undisturbed(attempt, relayed)


def test_a_scene_without_an_arm_has_no_physics() -> None:
    with pytest.raises(RobotRefused, match=r"needs an \[arm\]"), LivePlant(parse_scene(""), START):
        pass


def without_engine(folder: Path) -> dict[str, str]:
    """An environment in which MuJoCo cannot be imported."""
    (folder / "mujoco.py").write_text("raise ImportError('not here')")
    return {**os.environ, "PYTHONPATH": str(folder)}


def test_without_the_engine_the_pip_line_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in without_engine(tmp_path).items():
        monkeypatch.setenv(name, value)
    with (
        pytest.raises(MissingExtra, match=r"pip install 'coneskin\[physics\]'"),
        LivePlant(scene_at("127.0.0.1"), START),
    ):
        pass


@pytest.mark.long
def test_the_command_refuses_bodies_without_the_engine(tmp_path: Path) -> None:
    host = free_host()
    (tmp_path / "scene.toml").write_text(scene_at(host).text)
    words = [sys.executable, "-m", "coneskin", "guard", str(tmp_path / "scene.toml"), "--simulated", "--once"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, env=without_engine(tmp_path))
    assert done.returncode == 1
    assert "pip install 'coneskin[physics]'" in done.stderr
    assert "Traceback" not in done.stderr
