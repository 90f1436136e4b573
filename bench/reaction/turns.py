"""Turns of bench `reaction`: some collisions under guard, or some bare stops, each with its times."""

from __future__ import annotations

import json
import math
import random
import select
import sys
import tempfile
import threading
import time
from bisect import bisect_left
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from bench.faults.setup import give_precedence
from coneskin.core.errors import ConeSkinError
from coneskin.robot.driver.values import ControllerState, StopPath
from coneskin.robot.guard.signals.journal import BlockKind, decode_event
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.stop_monitor import StopMonitor
from coneskin.robot.ur.rtde_codec import decode_state
from coneskin.robot.ur.rtde_connection import StateReader
from coneskin.runs.replay.run import read_run
from coneskin.scene.reader import parse_scene
from coneskin.session.session import Session, guard
from tests.support.scenes import START, forearm_scene

from .moves import CLOCK, EXTERNAL_MODES, Child, ExternalArm, GuardedArm

MOVES_MODULE = "bench.reaction.moves"
TIME_LIMITS = "skin_silence_ms = 250\narm_silence_ms = 250\nsettle_ms = 10"


def chosen(simulated: SimulatedController, mode: str, rng: random.Random) -> tuple[int, float, list[float]]:
    """Return the side with more room, how long to move before the stop [s], and where the arm is."""
    q = simulated.wait_for_standstill()["q"]
    side = -1 if q[0] > START[0] else 1
    speeding_up = 0.15 if mode == "servoJ" else 0.10  # the arm lags behind its targets
    return side, speeding_up + 0.08 * rng.random(), q


def guarded_turn(mode: str, count: int, rng: random.Random) -> list[dict[str, Any]]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        host, log = free_host(), folder / "log.jsonl"
        simulated = stack.enter_context(SimulatedController("UR5e", host, START, log=log))
        give_precedence(simulated.pid)
        control = "external" if mode in EXTERNAL_MODES else "internal"
        text = forearm_scene(host, control, limits=TIME_LIMITS)
        if mode == "urcl":  # the library takes the slider, as the ROS driver does
            text = text.replace("[arm]\n", "[arm]\nslider_stop = false\n")
        scene = parse_scene(text)
        session = stack.enter_context(guard(scene, recording=folder / "run.rec"))
        external = mode in EXTERNAL_MODES
        arm = ExternalArm(mode, host, stack) if external else GuardedArm(session, mode, simulated.state()["tcp"])
        touched, before = [], 0
        for _ in range(count):
            side, wait, q = chosen(simulated, mode, rng)
            arm.start(side, q)
            time.sleep(wait)
            touched.append(session.touch(0.02 + 0.22 * rng.random(), 6.2 * rng.random(), force=20.0, duration=0.04))
            for name in ("latched", "touch_ended"):
                if session.wait_for((name,), 10.0, after=before) is None:
                    raise RuntimeError(f"no {name} within 10 s: {[e.name for e in session.events[before:]]}")
            arm.over()
            before = len(session.events)
            reset(session)
        session.close()
        return read_turn(mode, folder / "run.rec", touched, came(mode, simulated))


def reset(session: Session) -> None:
    """Reset as soon as it is allowed: the skin must be quiet for some frames."""
    end = CLOCK() + 10.0
    while True:
        try:
            session.reset()
            return
        except ConeSkinError:
            if CLOCK() > end:
                raise
            time.sleep(0.005)


def came(mode: str, simulated: SimulatedController) -> list[float]:
    """Return when the stops came to the controller, in order [s]."""
    if mode in EXTERNAL_MODES:
        return [e["monotonic"] for e in simulated.events("script") if "stop" in e["first_line"]]
    return [e["monotonic"] for e in simulated.events("received") if e["command"] == STOP_COMMANDS[mode]]


#: numbers of ur_rtde 1.6.5's own protocol: stopJ, speedStop, servoStop
STOP_COMMANDS = {"moveJ": 34, "moveL": 34, "speedJ": 15, "servoJ": 16}


def read_turn(mode: str, path: Path, touched: list[float], arrivals: list[float]) -> list[dict[str, Any]]:
    """Return the times of each collision, from the recording."""
    run = read_run(path)
    states = [decode_state(b.time, b.payload) for b in run.blocks if b.kind == BlockKind.ARM]
    samples = on_host_clock(states)
    commands = [
        b.time for b in run.blocks if b.kind == BlockKind.COMMAND and b.payload.startswith((b"driver\nS", b"program\n"))
    ]
    events = [decode_event(b) for b in run.blocks if b.kind == BlockKind.EVENT]
    rows = []
    for number, begin in enumerate(touched):
        end = touched[number + 1] if number + 1 < len(touched) else math.inf
        mine = [event for event in events if begin <= event.time < end]
        stop = next((event for event in mine if event.name == "stopping"), None)
        if stop is None:
            rows.append({"mode": mode, "by": "guard", "missed": True, "events": [event.name for event in mine]})
            continue
        frame = stop.time  # when the bytes were read that made it stop
        command = commands[bisect_left(commands, frame)]
        row = follow(mode, "guard", command, samples, arrivals, since=frame)
        row |= {"touch_frame": frame - begin, "frame_command": command - frame}
        row["frame_slower"] = row["command_slower"] + command - frame
        row["called"] = stop.details["why"]
        row["escalated"] = sum(event.name == "escalated" for event in mine)
        rows.append(row)
    return rows


def baseline_turn(mode: str, count: int, rng: random.Random) -> list[dict[str, Any]]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        host, log = free_host(), folder / "log.jsonl"
        simulated = stack.enter_context(SimulatedController("UR5e", host, START, log=log))
        give_precedence(simulated.pid)
        reader = stack.enter_context(StateReader(host))
        child = stack.enter_context(
            Child(sys.executable, "-m", MOVES_MODULE, "baseline", host, mode, json.dumps(simulated.state()["tcp"]))
        )
        states: list[ControllerState] = []
        over = threading.Event()
        thread = threading.Thread(target=read_states, args=(reader, states, over))
        thread.start()
        stack.callback(thread.join)
        stack.callback(over.set)
        called = []
        for _ in range(count):
            side, wait, q = chosen(simulated, mode, rng)
            called += child.ask(json.dumps([side, wait, *q]))
            simulated.wait_for_standstill()
            time.sleep(0.05)
        arrivals, samples = came(mode, simulated), on_host_clock(states)
        return [follow(mode, "baseline", call, samples, arrivals, since=call) for call in called]


def read_states(reader: StateReader, states: list[ControllerState], over: threading.Event) -> None:
    while not over.is_set():
        select.select([reader], [], [], 0.1)
        states += [decode_state(CLOCK(), payload) for payload in reader.read()]


def on_host_clock(states: list[ControllerState]) -> list[tuple[float, float]]:
    """Return time [s] and speed of each state, by the controller's clock put to the host's.

    A guard looks at states when its skin wakes it, another program at each: when one was read says nothing of the arm.
    """
    ahead = min(state.time - state.controller_time for state in states)
    return [(state.controller_time + ahead, state.speed) for state in states]


def follow(
    mode: str, by: str, command: float, samples: list[tuple[float, float]], arrivals: list[float], since: float
) -> dict[str, Any]:
    """Return the times of a stop after it was sent [s], by the guard's own rule for slower and standing.

    The first arrival from ``since`` on counts: a stop may be there before its send has returned.
    """
    at = bisect_left(samples, (command, 0.0))
    speed = samples[at - 1][1]
    monitor = StopMonitor(command, speed, (StopPath.DRIVER,), MonitoringLimits(escalate=9.0), 9.0)
    for time_, value in samples[at:]:
        monitor.sample(time_, value)
        if monitor.course.standing_at is not None:
            break
    if monitor.course.slowed_at is None or monitor.course.standing_at is None:
        raise RuntimeError(f"{mode}: the arm did not stand after a stop by the {by}")
    arrival = bisect_left(arrivals, since)
    return {
        "mode": mode,
        "by": by,
        "speed": speed,
        "command_came": arrivals[arrival] - command if arrival < len(arrivals) else math.nan,
        "command_slower": monitor.course.slowed_at - command,
        "command_standing": monitor.course.standing_at - command,
    }
