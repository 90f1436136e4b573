"""The simulated controller: registers, programs, safety, and the control cycle that joins them. No sockets in here.

Order of a cycle: what clients wrote since the last one is in the registers; a program that is due starts; the watchdog
looks; every thread of the program takes its turn; the arm moves for 2 ms; clients are sent what is then true.
"""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import IO, Any

from coneskin.errors import RobotRefused

from . import ur_models
from .rtde_codec import VARIABLES, Value
from .sim_arm import CYCLE, Arm
from .sim_options import Options
from .sim_program import Program
from .sim_safety import RobotMode, Runtime, SafetyMode
from .sim_urscript import Translation
from .sim_values import ScriptError, values_of

__all__ = ["Controller"]

HISTORY = 500  #: cycles that get_actual_joint_positions_history remembers
_COMMAND_REGISTERS = ("input_int_register_0", "input_int_register_24")
_GET_FORWARD_KINEMATICS = 44


@dataclass(slots=True)
class _Watchdog:
    variable: str
    period: float
    action: str
    fed: int  # cycle of the last packet


class Controller:
    """One arm and its controller.

    Attributes:
        cycle: how many control cycles have passed.
        inputs: name -> value, kept after the client that wrote it has gone.
        owners: name -> the session that may write it.
    """

    def __init__(self, options: Options, log: IO[str] | None = None) -> None:
        self.options = options
        self.arm = Arm(ur_models.model(options.model), options.start_q)
        for i, (low, q, high) in enumerate(
            zip(self.arm.model.joint_lower, self.arm.q, self.arm.model.joint_upper, strict=True), 1
        ):
            if not low <= q <= high:
                raise RobotRefused(f"start position of joint {i} must be in [{low:.3f}, {high:.3f}] rad, got {q:.3f}")
        self.cycle = 0
        self.inputs: dict[str, Value] = {name: 0 for name in VARIABLES if VARIABLES[name] != "VECTOR6D"}
        self.inputs["external_force_torque"] = (0.0,) * 6
        self.owners: dict[str, object] = {}
        self.output_ints = [0] * 48
        self.output_doubles = [0.0] * 48
        self.digital_outputs = 0
        self.slider = 1.0
        self.payload = 0.0
        self.payload_cog: tuple[float, ...] = (0.0, 0.0, 0.0)
        self.payload_inertia: tuple[float, ...] = (0.0,) * 6
        self.program: Program | None = None
        self.secondary: list[Program] = []
        self.runtime = Runtime.STOPPED
        self.robot_mode = RobotMode.RUNNING
        self.safety = SafetyMode.NORMAL
        self.stopped_at = 0  #: cycle of the last protective stop
        self.history: deque[list[float]] = deque([list(self.arm.q)], maxlen=HISTORY)
        self._arrived = 0  # cycle in which the last program came in
        self._due: tuple[int, Translation] | None = None
        self._watchdog: _Watchdog | None = None
        self._fresh = False
        self._log = log

    # the cycle

    @property
    def timestamp(self) -> float:
        """Time since power-on [s]."""
        return self.cycle * CYCLE

    def step(self) -> None:
        """One control cycle."""
        self.cycle += 1
        if self._due is not None and self.cycle >= self._due[0]:
            self._start(self._due[1])
        if self._watchdog is not None:
            self._check_watchdog(self._watchdog)
        self._turn_programs()
        was_moving = self.arm.moving
        fault = self.arm.step(self.slider, hold=self.runtime is Runtime.PAUSED or self.safety is not SafetyMode.NORMAL)
        if was_moving and not self.arm.moving:
            self.log("standstill", q=self.arm.q)
        if fault:
            self.protective_stop(fault)
            self.stop_program("ended by the safety system")
        self.history.append(self.arm.q)

    def _turn_programs(self) -> None:
        for beside in list(self.secondary):
            try:
                beside.turn()
            except ScriptError as exc:
                self.log("abort", program=beside.name, reason=str(exc))
            if not beside.running:
                self.secondary.remove(beside)
        program = self.program
        if program is None or self.runtime is not Runtime.PLAYING:
            return
        try:
            program.turn()
        except ScriptError as exc:
            self.log("abort", program=program.name, reason=str(exc))
        if not program.running:
            self.stop_program("end of the program")
        elif program.driven != self.cycle and self.runtime is Runtime.PLAYING:
            self.arm.motion = None  # nobody asks for motion any more: the arm brakes

    # programs

    def arriving(self) -> None:
        """The last byte of a program has come: the running one ends now, the new one starts after the delay."""
        if self._ready():
            self.stop_program("replaced by another")
        self._arrived = self.cycle

    def load(self, translation: Translation) -> None:
        """The program that has arrived, translated."""
        if translation.secondary:
            self.secondary.append(Program(self, translation))
            return
        delay = max(1, round(self.options.start_delay / CYCLE))
        self._due = (self._arrived + delay, translation)

    def _start(self, translation: Translation) -> None:
        self._due = None
        if not self._ready():
            self.log("refused", program=translation.name, reason=f"{self.robot_mode.name}, {self.safety.name}")
            return
        self.stop_program("replaced by another")
        self.program = Program(self, translation)
        self.runtime = Runtime.PLAYING
        self.log("program", program=translation.name)

    def _ready(self) -> bool:
        """Programs may run."""
        return self.robot_mode is RobotMode.RUNNING and self.safety is SafetyMode.NORMAL

    def stop_program(self, reason: str) -> None:
        """End the program; the arm brakes if it moves. Registers keep what they hold."""
        self._due = None
        self._watchdog = None
        if self.program is not None:
            self.log("stopped", program=self.program.name, reason=reason)
        self.program = None
        self.arm.motion = None
        self.runtime = Runtime.STOPPED

    def pause_program(self) -> bool:
        """Hold the program and the arm."""
        if self.program is None or self.runtime is not Runtime.PLAYING:
            return False
        self.runtime = Runtime.PAUSED
        self.log("paused", program=self.program.name)
        return True

    def resume_program(self) -> bool:
        """Go on after a pause; the motion that was interrupted goes on too."""
        if self.program is None or self.runtime is not Runtime.PAUSED or self.safety is not SafetyMode.NORMAL:
            return False
        self.runtime = Runtime.PLAYING
        if self._watchdog is not None:
            self._watchdog.fed = self.cycle
        self.log("resumed", program=self.program.name)
        return True

    def watch(self, variable: str, frequency: float, action: str) -> None:
        """What the script function rtde_set_watchdog asks for; 0 Hz ends it."""
        self._watchdog = _Watchdog(variable, 1.0 / frequency, action, self.cycle) if frequency > 0.0 else None

    def _check_watchdog(self, watchdog: _Watchdog) -> None:
        if self.runtime is not Runtime.PLAYING or (self.cycle - watchdog.fed) * CYCLE <= watchdog.period:
            return
        self.log("watchdog", variable=watchdog.variable, action=watchdog.action)
        if watchdog.action == "stop":
            self.stop_program(f"watchdog of {watchdog.variable}")
        elif watchdog.action == "pause":
            self.pause_program()
        self._watchdog = None

    # safety

    def protective_stop(self, reason: str) -> None:
        """Stop the arm and hold the program; only a person ends this."""
        if self.safety is not SafetyMode.NORMAL:
            return
        self.safety = SafetyMode.PROTECTIVE_STOP
        self.stopped_at = self.cycle
        self.log("protective_stop", reason=reason)
        if self.options.after_protective_stop == "stop":
            self.stop_program("protective stop")
        else:
            self.pause_program()

    def unlock(self) -> bool:
        """End a protective stop; refused before its time."""
        if self.safety is SafetyMode.PROTECTIVE_STOP:
            if (self.cycle - self.stopped_at) * CYCLE < self.options.unlock_after:
                return False
            self.safety = SafetyMode.NORMAL
            self.log("unlocked")
        return True

    def emergency_stop(self) -> None:
        """The red button: the arm brakes and loses its power, the program ends."""
        self.safety = SafetyMode.ROBOT_EMERGENCY_STOP
        self.robot_mode = RobotMode.POWER_OFF
        self.log("emergency_stop")
        self.stop_program("emergency stop")

    # what clients write

    def received(self, values: Mapping[str, Value]) -> None:
        """A data packet of a client: name -> value, in the order of its recipe."""
        self.inputs.update(values)
        if self._watchdog is not None and self._watchdog.variable in values:
            self._watchdog.fed = self.cycle
        for register in _COMMAND_REGISTERS:
            if register in values:
                command = values[register]
                self._fresh = True
                if command and self._log is not None:
                    self.log("received", command=command, values=list(values.values())[1:])
                if command == _GET_FORWARD_KINEMATICS and self.options.quirks == "fixed":
                    self._mend_forward_kinematics(values)
        if values.get("speed_slider_mask"):
            self.slider = min(1.0, max(0.0, float(values["speed_slider_fraction"])))  # type: ignore[arg-type]
            self.log("slider", fraction=self.slider)
        for name, shift in (("standard", 0), ("configurable", 8), ("tool", 16)):
            mask = values.get(f"{name}_digital_output_mask", 0)
            if mask:
                wanted = int(values[f"{name}_digital_output"])  # type: ignore[arg-type]
                for bit in range(8):
                    if int(mask) >> bit & 1:  # type: ignore[arg-type]
                        self.set_digital(1 << (bit + shift), bool(wanted >> bit & 1))

    def _mend_forward_kinematics(self, names: Mapping[str, Value]) -> None:
        """Without a tool in the packet, use the active one instead of what an earlier command left behind."""
        if "input_double_register_6" not in names:
            for i, value in enumerate(values_of(self.arm.tcp), 6):
                self.inputs[f"input_double_register_{i}"] = value

    def set_digital(self, bit: int, on: bool) -> None:
        """Switch outputs: bits 0-7 standard, 8-15 configurable, 16-17 tool."""
        self.digital_outputs = self.digital_outputs | bit if on else self.digital_outputs & ~bit
        self.log("digital", outputs=self.digital_outputs)

    def read_command(self, address: int) -> int:
        """An integer register, as a program reads it; notes when the program takes a command."""
        value = int(self.inputs[f"input_int_register_{address}"])  # type: ignore[arg-type]
        if self._fresh and address in (0, 24):
            self._fresh = False
            if value and self._log is not None:
                self.log("taken", command=value)
        return value

    # the log

    def log(self, event: str, **facts: Any) -> None:
        """One JSON line: cycle, controller time, this machine's monotonic clock, what happened."""
        if self._log is None:
            return
        line = {"cycle": self.cycle, "time": round(self.timestamp, 3), "monotonic": time.monotonic(), "event": event}
        self._log.write(json.dumps(line | facts, default=_plain) + "\n")

    def describe(self) -> dict[str, Any]:
        """The state, for a person or a test."""
        return {
            "cycle": self.cycle,
            "q": list(self.arm.q),
            "qd": list(self.arm.qd),
            "tcp": list(values_of(self.arm.tcp_pose())),
            "program": self.program.name if self.program is not None else "",
            "runtime": self.runtime.name,
            "robot_mode": self.robot_mode.name,
            "safety": self.safety.name,
            "slider": self.slider,
            "digital_outputs": self.digital_outputs,
        }


def _plain(value: object) -> object:
    return list(value) if isinstance(value, list | tuple) else str(value)
