"""Trial of the fault campaign: a guarded arm moves, something goes wrong, and what the arm then does is judged.

Arm, skin and the guarded program are processes of their own, so that each can be frozen and killed. What decides is
not a report of the guard but the log of the simulated controller, and its state.
"""

from __future__ import annotations

import json
import os
import queue
import random
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, ClassVar

from coneskin.core.errors import ConeSkinError, RobotConnectionError
from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.scene.reader import load_scene
from tests.support.scenes import START, forearm_scene, write_passed_record

from .motion import BEHIND, ArmMotion, Touch
from .setup import ACCELERATION, CLOCK, GOAL, MONITORING_TABLE, SECOND_SKIN, SPEED, USUAL_SETUP, Setup, give_precedence


class Child:
    """Process that takes and sends lines of JSON."""

    def __init__(self, *arguments: str, folder: Path | None = None) -> None:
        self._process = subprocess.Popen(
            [sys.executable, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            start_new_session=True,  # Linux divides its time among sessions; one for all would hold them all up
        )
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._threads = [threading.Thread(target=self._read), threading.Thread(target=self._read_errors)]
        self.errors = ""
        for thread in self._threads:
            thread.start()

    @property
    def pid(self) -> int:
        return self._process.pid

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith("{"):  # the wheel prints lines of its own
                self._lines.put(line)

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        self.errors = self._process.stderr.read()

    def say(self, **request: Any) -> None:
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()

    def hear(self, timeout: float) -> dict[str, Any]:
        """Return the next answer; empty if there is none in time."""
        with suppress(queue.Empty):
            answer: dict[str, Any] = json.loads(self._lines.get(timeout=timeout))
            return answer
        return {}

    def ask(self, **request: Any) -> dict[str, Any]:
        self.say(**request)
        return self.hear(5.0)

    def close(self, patience: float = 0.0) -> bool:
        """End the process; return whether it ended by itself within the patience [s]."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(patience)
            ended = True
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            ended = False
        for thread in self._threads:
            thread.join()
        for pipe in (self._process.stdout, self._process.stderr):
            if pipe is not None:
                pipe.close()
        return ended


#: mover -> its lines of URScript, after those of `coneskin heartbeat`; each turns the base, for 2 s or more
MOTIONS = {
    "heartbeat": f"movej({GOAL}, a={ACCELERATION}, v={SPEED})",
    "in speedj": f"speedj([{SPEED}, 0, 0, 0, 0, 0], {ACCELERATION}, 3)",
    "in movel": "movel(pose_add(get_target_tcp_pose(), p[0, -0.75, 0, 0, 0, 0]), a=2, v=0.35)",
    "in speedl": "speedl([0, -0.35, 0, 0, 0, 0], 2, 2.2)",
    "in servoj": f"""q = get_target_joint_positions()
  v = 0.0
  while True:
    if v < {SPEED}:
      v = v + {ACCELERATION} * get_steptime()
    end
    q[0] = q[0] + v * get_steptime()
    servoj(q, 0, 0, get_steptime(), 0.05, 500)
  end""",
}
EXTERNAL_CONTROL = "CONESKIN_EXTERNAL_CONTROL"  # environment variable: path of external_control.urscript


class Trial:
    """Processes of a trial, and the faults that can be injected into them; used in a ``with``.

    Attributes:
        control: "internal" or "external".
        simulated: the controller.
        skin: the skin's process.
        program: the guarded program's process.
        pids: of the guard and of its helpers.
        rng: of this trial.
        happened: when the fault happened, where time does not run from then on.
        motion: of the arm, as the controller has reported it, since it runs.
        touches: that were made.
        mover: program that starts again after each stop, where there is one.
    """

    _starting = threading.Lock()  # two trials must not choose the same address
    _hosts: ClassVar[set[str]] = set()  # a killed controller's address must stay dead while its trial lasts

    def __init__(self, control: str, seed: str, setup: Setup = USUAL_SETUP) -> None:
        self.control = control
        self.setup = setup
        self.motion: ArmMotion | None = None
        self.touches: list[Touch] = []
        self.mover: Child | None = None
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
                give_precedence(self.simulated.pid)
            port = self.folder / "port"
            seed = str(self.rng.randrange(1 << 30))
            self.skin = Child(
                "-m", "bench.faults.virtual_skin", str(port), seed, self.setup.sheets, str(self.setup.skins)
            )
            stack.callback(self.skin.close)
            if not self.skin.hear(30.0):
                raise RuntimeError(f"the skin did not start: {self.skin.errors}")
            scene = forearm_scene(self.host, self.control, str(port), self.setup.reaction, MONITORING_TABLE)
            if self.setup.arm:
                scene = scene.replace("[[link]]", f"{self.setup.arm}\n[[link]]", 1)
            (self.folder / "scene.toml").write_text(scene + SECOND_SKIN * (self.setup.skins - 1), encoding="utf-8")
            for name, text in self.setup.files:
                (self.folder / name).write_text(text, encoding="utf-8")
            write_passed_record(load_scene(self.folder / "scene.toml"))
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

    def press(self, *touches: Touch) -> float:
        """Touch the skin in some places, each so long after now as it says."""
        asked = [asdict(touch) for touch in touches]
        at = float(self.skin.ask(touches=asked)["at"])
        self.touches += [replace(touch, after=at + touch.after) for touch in touches]
        return at

    def breaks(self, **faults: Any) -> float:
        """Inject faults of the skin from the next frame on."""
        return float(self.skin.ask(faults=faults)["at"])

    def touch(self) -> float:
        """Touch the skin where it runs ahead, ever more lightly, as a touch does from which the arm moves away."""
        return self.press(Touch(duration=0.5, grown_force=0.3, growth_time=0.3))

    def start_again(self) -> float:
        """Let a raw program be sent again and again from now on: no arm gains speed if it is from the beginning."""
        assert self.mover is not None
        self.mover.say(go=True)
        return CLOCK()

    def move_away(self) -> float:
        """Touch the skin, and let the arm stand and then retreat for a random time."""
        touched = self.touch()
        end = CLOCK() + 5.0
        while self.stood_at(touched) is None or not self.moves():  # it stands for 10 ms, which a look may miss
            if CLOCK() > end:
                raise RuntimeError(f"the arm does not move away: {self.program.hear(0.0)}")
            time.sleep(0.002)
        time.sleep(0.1 * self.rng.random())
        self.happened = touched
        return CLOCK()

    def go_slow(self) -> float:
        """Touch the skin for long from behind, and let the arm go on slowly, away from the touch, for a random time."""
        self.happened = self.press(Touch(phi=BEHIND, duration=20.0))
        end = CLOCK() + 5.0
        while not 0.0 < self.simulated.state()["qd"][0] < 0.7 * SPEED:
            if CLOCK() > end:
                raise RuntimeError(f"the arm does not go slower: {self.program.hear(0.0)}")
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
        """Send a request to bench/faults/virtual_skin.py."""
        return float(self.skin.ask(**request)["at"])

    def controller(self, line: str) -> float:
        """Inject a fault of the simulated controller."""
        at = CLOCK()
        self.simulated.call(line)
        return at

    def signal(self, process: str, number: signal.Signals) -> float:
        """Send a signal to "guard", "driver", "watchdog", "program", "skin" or "mover"."""
        pid = {"program": self.program.pid, "skin": self.skin.pid, **self.pids}.get(process)
        if pid is None:
            assert self.mover is not None
            pid = self.mover.pid
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
        """Start the guarded program; return its report once the guard is active, or has refused to become so."""
        arguments = ["-m", "bench.faults.program", str(self.folder / "scene.toml"), str(self.recording)]
        manners = ",".join(self.setup.manners)
        self.program = Child(*arguments, repr(timeout), json.dumps(GOAL), manners, folder=self.folder)
        self._stack.callback(self.program.close)
        answer = self.program.hear(timeout + 15.0)
        self.pids = answer.get("pids", {})
        return answer

    def _heartbeat(self) -> str:
        """Return the lines with which a program on the controller ends where the guard is gone."""
        command = [sys.executable, "-m", "coneskin", "heartbeat", str(self.folder / "scene.toml")]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout

    @property
    def recording(self) -> Path:
        return self.folder / "run.rec"

    def run_up(self) -> None:
        """Let the arm move, and a random time pass."""
        self.motion = self._stack.enter_context(ArmMotion(self.host))
        if self.control == "internal":
            self.program.say(go=True)
        elif self.setup.mover in MOTIONS:
            self.send_script(f"def bench_move():\n{self._heartbeat()}\n  {MOTIONS[self.setup.mover]}\nend\n")
        elif self.setup.mover.startswith("driver"):
            how = self.setup.mover.split()[1]
            script, start = os.environ[EXTERNAL_CONTROL], json.dumps(START)
            self.mover = Child(
                "-m", "bench.faults.external_control_peer", self.host, script, start, json.dumps(GOAL), how
            )
            self._stack.callback(self.mover.close)
            if not self.mover.hear(20.0):
                raise RuntimeError(f"external control does not begin: {self.mover.errors}")
        elif self.setup.mover:
            words = self.setup.mover.split()
            self.mover = Child("-m", "bench.faults.restarter", self.host, json.dumps(GOAL), *words)
            self._stack.callback(self.mover.close)
        if self.control == "external" and not self.setup.mover.startswith((*MOTIONS, "loop", "driver")):
            self.send_script(f"def bench_move():\n  movej({GOAL}, a={ACCELERATION}, v={SPEED})\nend\n")
        end = CLOCK() + 10.0
        while (
            abs(self.simulated.state()["qd"][0])
            < (0.5 if self.setup.mover in ("in movel", "in speedl") else 0.95) * SPEED
        ):
            if CLOCK() > end:
                raise RuntimeError(f"the arm does not move: {self.program.hear(0.0)}")
            time.sleep(0.005)
        time.sleep(0.8 * self.rng.random())

    def moves(self) -> bool:
        """Tell whether the arm moves now."""
        return any(self.simulated.state()["qd"])

    def await_standing(self, seconds: float) -> list[float] | None:
        """Return the joint positions once the arm stands; None if it does not in time."""
        with suppress(ConeSkinError):
            found: list[float] = self.simulated.wait_for_standstill(seconds)["q"]
            return found
        return None

    def stood_at(self, since: float) -> float | None:
        """Return when the arm came to its first standstill after a time, by the controller's own log."""
        return next((e["monotonic"] for e in self.simulated.events("standstill") if e["monotonic"] >= since), None)

    def thaw_all(self) -> None:
        """Let every frozen process go on."""
        for pid in self._frozen:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
        self._frozen.clear()
        with suppress(RobotConnectionError, ProcessLookupError):
            self.simulated.thaw()
