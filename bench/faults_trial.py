"""One trial of the fault campaign: a guarded arm moves, something goes wrong, and what the arm then does is judged.

Arm, skin and the guarded program are processes of their own, so that each can be frozen and killed. What decides is not
the guard's word but the log of the simulated controller, and its state.
"""

from __future__ import annotations

import json
import os
import random
import select
import signal
import socket
import tempfile
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from faults_child import Child
from scenes import ESCALATE, START, forearm_scene, start_with

from coneskin.errors import ConeSkinError, RobotConnectionError
from coneskin.robot.sim_process import SimulatedController, free_host

HERE = Path(__file__).parent
GOAL = start_with(140.0)
SPEED, ACCELERATION, DECELERATION = 1.0, 2.0, 10.0
SKIN_SILENCE = ARM_SILENCE = 0.25  # s; a pseudo-terminal on a busy machine can stall for 0.1 s
STUCK = 200  # frames
RETREAT = 'kind = "retreat"\ndistance_mm = 60'
SLOW = 'kind = "slow"\nslow_to = 0.5\ntime_budget_s = 30'
WATCH = "skin_silence_ms = 250\nskin_late_ms = 250\narm_silence_ms = 250\nstuck_frames = 200"
#: v / a, and four times the patience: what docs/safety.md promises once the fault is known
STOP = SPEED / DECELERATION + 4.0 * ESCALATE
CLOCK = time.monotonic


@dataclass
class Outcome:
    """What a trial showed.

    Attributes:
        seconds: from the fault to the measured standstill; None where there was none to measure.
        failures: what must not be, one line each.
        why: what the guard said.
        skin_late: how late the machine had made the frames of the virtual skin before the fault [s].
        repeated: trials that were thrown away for that.
        held_up: the longest time that the guard's loop was held up, as it says itself [s].
    """

    seconds: float | None = None
    held_up: float = 0.0
    skin_late: float = 0.0
    repeated: int = 0
    failures: list[str] = field(default_factory=list)
    why: str = ""


class Trial:
    """The things that can go wrong, for the kinds of fault to reach; used in a ``with``.

    Attributes:
        control: "owner" or "foreign".
        simulated: the controller.
        skin: the skin's process.
        program: the guarded program's process.
        pids: of the guard and of its helpers.
        rng: of this trial.
        happened: when the fault happened, where time does not run from then on.
    """

    _starting = threading.Lock()  # two trials must not choose the same address
    _hosts: ClassVar[set[str]] = set()  # a killed controller's address must stay dead while its trial lasts

    def __init__(self, control: str, seed: str, reaction: str = RETREAT) -> None:
        self.control = control
        self._reaction = reaction
        self.rng = random.Random(seed)
        self.pids: dict[str, int] = {}
        self.happened: float | None = None
        self._stack = ExitStack()
        self._frozen: list[int] = []

    def __enter__(self) -> Trial:
        try:
            stack = self._stack
            self.folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            with self._starting:
                self.host = free_host(self._hosts)
                self._hosts.add(self.host)
                controller = SimulatedController("UR5e", self.host, START, log=self.folder / "log.jsonl")
                self.simulated = stack.enter_context(controller)
            port = self.folder / "port"
            self.skin = Child(str(HERE / "faults_skin.py"), str(port), str(self.rng.randrange(1 << 30)))
            stack.callback(self.skin.close)
            if not self.skin.hear(10.0):
                raise RuntimeError(f"the skin did not start: {self.skin.errors}")
            (self.folder / "scene.toml").write_text(
                forearm_scene(self.host, self.control, port, self._reaction, WATCH), encoding="utf-8"
            )
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        for pid in self._frozen:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        self._stack.close()

    # ---- what the kinds of fault use; each returns when it happened

    def breaks(self, **faults: Any) -> float:
        """Faults of the skin from the next frame on."""
        return float(self.skin.ask(faults=faults)["at"])

    def touch(self) -> float:
        """Touch the skin."""
        return self.skins(touch={"u": 0.13, "phi": 1.55, "duration": 0.2})

    def move_away(self) -> float:
        """Touch the skin, and let the arm stand and then retreat for a random time."""
        touched = self.touch()
        end = CLOCK() + 5.0
        while self.stood_at(touched) is None or not self.moves():  # it stands for 10 ms, which a look may miss
            if CLOCK() > end:
                raise RuntimeError("the arm does not move away")
            time.sleep(0.002)
        time.sleep(0.1 * self.rng.random())
        self.happened = touched
        return CLOCK()

    def go_slow(self) -> float:
        """Touch the skin for long, and let the arm go on slowly for a random time."""
        self.happened = self.skins(touch={"u": 0.13, "phi": 1.55, "duration": 20.0})
        end = CLOCK() + 5.0
        while not 0.0 < self.simulated.state()["qd"][0] < 0.7 * SPEED:
            if CLOCK() > end:
                raise RuntimeError("the arm does not go slower")
            time.sleep(0.005)
        time.sleep(0.3 + 0.2 * self.rng.random())
        return CLOCK()

    def latch(self) -> float:
        """Touch the skin, and let the arm stand, retreat and latch."""
        self.move_away()
        if self.await_standing(5.0) is None:
            raise RuntimeError("the arm does not latch")
        time.sleep(0.5 + 0.2 * self.rng.random())
        return CLOCK()

    def skins(self, **request: Any) -> float:
        """Anything that bench/faults_skin.py can do."""
        return float(self.skin.ask(**request)["at"])

    def controller(self, line: str) -> float:
        """A fault of the simulated controller."""
        at = CLOCK()
        self.simulated.call(line)
        return at

    def signal(self, who: str, number: signal.Signals) -> float:
        """Send a signal to "guard", "owner", "keeper", "program" or "skin"."""
        pid = {"program": self.program.pid, "skin": self.skin.pid, **self.pids}[who]
        at = CLOCK()
        os.kill(pid, number)
        if number == signal.SIGSTOP:
            self._frozen.append(pid)
        return at

    def send_script(self, text: str) -> float:
        """Send a program to the controller, as any other client may."""
        at = CLOCK()
        with socket.create_connection((self.host, 30003), 5.0) as raw:
            raw.sendall(text.encode())
            end = CLOCK() + 0.1
            while (left := end - CLOCK()) > 0.0 and select.select([raw], [], [], left)[0]:
                raw.recv(1 << 16)
        return at

    # ---- the course of a trial

    def start_program(self, timeout: float) -> dict[str, Any]:
        """Start the guarded program; what it says once the guard has armed, or has refused to."""
        arguments = [str(HERE / "faults_program.py"), str(self.folder / "scene.toml"), str(self.recording)]
        self.program = Child(*arguments, repr(timeout), json.dumps(GOAL))
        self._stack.callback(self.program.close)
        answer = self.program.hear(timeout + 15.0)
        self.pids = answer.get("pids", {})
        return answer

    @property
    def recording(self) -> Path:
        return self.folder / "run.rec"

    def run_up(self) -> None:
        """Let the arm move, and a random time pass."""
        if self.control == "owner":
            self.program.say(go=True)
        else:
            self.send_script(f"def bench_move():\n  movej({GOAL}, a={ACCELERATION}, v={SPEED})\nend\n")
        end = CLOCK() + 10.0
        while abs(self.simulated.state()["qd"][0]) < 0.95 * SPEED:
            if CLOCK() > end:
                raise RuntimeError(f"the arm does not move: {self.program.hear(0.0)}")
            time.sleep(0.005)
        time.sleep(0.8 * self.rng.random())

    def moves(self) -> bool:
        """Whether the arm moves now."""
        return any(self.simulated.state()["qd"])

    def await_standing(self, seconds: float) -> list[float] | None:
        """Joint positions once the arm stands; None if it does not in time."""
        with suppress(ConeSkinError):
            found: list[float] = self.simulated.wait_standing(seconds)["q"]
            return found
        return None

    def stood_at(self, since: float) -> float | None:
        """When the arm came to its first standstill after a time, by the controller's own log."""
        return next((e["monotonic"] for e in self.simulated.events("standstill") if e["monotonic"] >= since), None)

    def thaw_all(self) -> None:
        """Whoever was stopped goes on."""
        for pid in self._frozen:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        self._frozen.clear()
        with suppress(RobotConnectionError, ProcessLookupError):
            self.simulated.thaw()
