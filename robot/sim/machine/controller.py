"""Simulated controller: registers, programs, safety system, and the control cycle that joins them. No sockets.

Order of a cycle: the registers hold what clients have written since the last one; a program that is due starts; the
watchdog is checked; every thread of the program takes its turn; the targets of the arm move for 2 ms, and the plant
follows them; clients are sent the new state.
"""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import IO, Any

from coneskin.robot.arm.models import arm_model
from coneskin.robot.sim.motion.arm import CYCLE, SUDDEN_CHANGE, TRIGGERED, SimulatedArm, StopCause
from coneskin.robot.sim.motion.plant import KinematicPlant, Plant, PlantLost
from coneskin.robot.sim.urscript.translator import Translation
from coneskin.robot.sim.urscript.values import ScriptError, values_of
from coneskin.robot.ur.rtde_codec import Value

from .inputs_outputs import ClientInputs, InputWatchdog, Terminals, digital_outputs
from .program import Program
from .states import (
    MOVING,
    ErrorNotice,
    Notice,
    Options,
    ProgramFailed,
    ProgramNotice,
    Report,
    RobotMode,
    Runtime,
    SafetyMode,
    SafetyNotice,
)

_PLANT_LOST = 50  # number in the log; that of a real controller which loses its arm depends on the joint


class _SafetySystem:
    """Safety system of one controller: its state, what changes it, and what clients and the log are told.

    It holds neither program nor arm: the controller does, by the state that it finds here.

    Args:
        unlock_after: time that must pass before a protective stop can be unlocked [s].
        log: takes an event and its facts.
        tell: takes what every client of the primary interface is told.

    Attributes:
        mode: its state.
        stopped_at: controller time of the last protective stop [s].
    """

    def __init__(self, unlock_after: float, log: Callable[..., None], tell: Callable[[Notice], None]) -> None:
        self.mode = SafetyMode.NORMAL
        self.stopped_at = 0.0
        self._reduced = False
        self._unlock_after, self._log, self._tell = unlock_after, log, tell

    def protective_stop(self, reason: str, cause: StopCause, now: float) -> bool:
        """Begin a protective stop; return False where the arm may not move anyway."""
        if self.mode not in MOVING:
            return False
        self._enter(SafetyMode.PROTECTIVE_STOP)
        self.stopped_at = now
        self._log("protective_stop", reason=reason, cause=str(cause))
        self._tell(ErrorNotice(cause.code, cause.argument, Report.WARNING, reason))
        return True

    def unlock(self, now: float, early: bool) -> bool:
        """End a protective stop; return False where it is too early, and that is not allowed."""
        if self.mode is SafetyMode.PROTECTIVE_STOP:
            if not early and now - self.stopped_at < self._unlock_after:
                return False
            self._log("unlocked")
            self._release()
        return True

    def open_safeguard(self) -> bool:
        """Begin a safeguard stop; return False where the arm may not move anyway."""
        if self.mode not in MOVING:
            return False
        self._enter(SafetyMode.SAFEGUARD_STOP)
        self._log("safeguard_stop")
        return True

    def close_safeguard(self) -> None:
        """End a safeguard stop."""
        if self.mode is SafetyMode.SAFEGUARD_STOP:
            self._release()

    def reduce(self, on: bool) -> None:
        """Begin or end reduced mode, now or once the arm may move."""
        self._reduced = on
        if self.mode in MOVING:
            self._release()

    def emergency_stop(self) -> None:
        """Act on the emergency stop button."""
        self._log("emergency_stop")
        self._enter(SafetyMode.ROBOT_EMERGENCY_STOP)

    def lose_plant(self, reason: str) -> None:
        """Begin a fault, because the arm is not there any more; nothing ends it."""
        self._log("plant_lost", reason=reason)
        self._enter(SafetyMode.FAULT)
        self._tell(ErrorNotice(_PLANT_LOST, 0, Report.FAULT, reason))

    def restart(self) -> bool:
        """End an emergency stop; return whether there was one."""
        if self.mode in (*MOVING, SafetyMode.PROTECTIVE_STOP, SafetyMode.FAULT):
            return False
        self.mode = SafetyMode.NORMAL
        return True

    def _release(self) -> None:
        self._enter(SafetyMode.REDUCED if self._reduced else SafetyMode.NORMAL)

    def _enter(self, mode: SafetyMode) -> None:
        self.mode = mode
        self._tell(SafetyNotice(mode))


#: commands that change the power of the arm
POWER_COMMANDS = ("power on", "power off", "brake release", "restart safety")


def _no_rtde(name: str) -> Any:
    raise ScriptError(f"{name}: this controller has no RTDE")


def _plain(value: object) -> object:
    return list(value) if isinstance(value, list | tuple) else str(value)


_MAX_SECONDARY = 20  # sec programs that run at once
_MAX_NOTICES = 1000  # that wait to be sent; a program that writes more in a cycle loses the oldest
_HISTORY_LENGTH = 500  # cycles; the range of get_actual_joint_positions_history
_REDUCED_SHARE = 0.5  # of the speed slider, in reduced mode; a real controller has limits of its own instead
_AT_STANDSTILL = {Runtime.STOPPING: Runtime.STOPPED, Runtime.PAUSING: Runtime.PAUSED}


class Controller:
    """Controller of one arm.

    Args:
        options: its kind.
        log: file for a JSON line for each event.
        plant: what its targets move; by default the arm follows them exactly.

    Attributes:
        cycle: number of control cycles since power-on.
        remote_control: False in local control, in which no program and no command is taken.
        outside_time: returns the time of those outside [s]; late cycles are made up for in less of it.
        rtde_value: returns the value of an output of RTDE, which those set who know these.
        inputs: what clients write.
        program: main program; None while none is loaded.
        secondary: ``sec`` programs that run beside it.
        safety_system: what may stop the arm whatever the program does.
        notices: what clients are still to be told.
        history: measured joint positions of the last cycles, oldest first [rad].
        plant_lost: why the plant does not count any more; empty while it does.
    """

    def __init__(self, options: Options, log: IO[str] | None = None, plant: Plant | None = None) -> None:
        self.options = options
        self.arm = SimulatedArm(arm_model(options.model), options.start_q)
        self.plant: Plant = KinematicPlant() if plant is None else plant
        self.arm.kinematic = plant is None
        self.plant_lost = ""
        self.cycle = 0
        self.inputs = ClientInputs(self.log, options.fieldbus)
        self.inputs.watchdog_delay = options.watchdog_delay
        self.arm.deceleration = options.deceleration
        self.output_ints = [0] * 48
        self.output_doubles = [0.0] * 48
        self.digital_outputs = 0
        self.terminals = Terminals()
        self.outside_time: Callable[[], float] = lambda: self.timestamp
        self.rtde_value: Callable[[str], Any] = _no_rtde
        self.frozen = 0.0  # time in which no cycle ran though its clock went on [s]
        self.beyond = False  # programs may connect to other computers
        self.slider = 1.0
        self.resistance = [0.0] * 6  # current that each motor takes beyond the model of the arm [A]
        self.gravity: tuple[float, ...] = (0.0, 0.0, 9.82)
        self.payload = 0.0
        self.payload_cog: tuple[float, ...] = (0.0, 0.0, 0.0)
        self.payload_inertia: tuple[float, ...] = (0.0,) * 6
        self.program: Program | None = None
        self.secondary: list[Program] = []
        self.runtime = Runtime.STOPPED
        self.robot_mode = RobotMode.RUNNING
        self.remote_control = options.remote_control
        self.safety_system = _SafetySystem(options.unlock_after, self.log, self.tell)
        self.history: deque[list[float]] = deque([list(self.arm.q)], maxlen=_HISTORY_LENGTH)
        self.notices: deque[Notice] = deque(maxlen=_MAX_NOTICES)
        self._arrived = 0  # cycle in which the last program came in
        self._due: tuple[int, Translation] | None = None
        self._log = log

    # control cycle

    @property
    def timestamp(self) -> float:
        """Time since power-on [s]."""
        return self.cycle * CYCLE + self.frozen

    @property
    def speed_scaling(self) -> float:
        """Share of the commanded speeds at which paths run; the safety system's own stops are not in it."""
        return self.slider * _REDUCED_SHARE if self.safety is SafetyMode.REDUCED else self.slider

    @property
    def steptime(self) -> float:
        """Control cycle, in which each thread of a program takes one turn [s]."""
        return self.options.steps * CYCLE

    def hold_up(self, seconds: float) -> None:
        """Note that the computer has held this controller up: its clock goes on, its arm has stood still meanwhile."""
        self.frozen += seconds
        self.log("held_up", seconds=round(seconds, 3))

    def update(self) -> None:
        """Run one step of 2 ms: a control cycle, or on CB3 a quarter of one."""
        self.cycle += 1
        if self._due is not None and self.cycle >= self._due[0]:
            self._start(self._due[1])
        for watchdog in list(self.inputs.watchdogs.values()):
            self._check_watchdog(watchdog)
        self._turn_programs()
        was_turning = self.arm.turning
        held = self.runtime.paused or self.safety not in MOVING
        self.arm.category_0 = self.safety not in MOVING and self.safety is not SafetyMode.SAFEGUARD_STOP
        fault = self.arm.update(self.speed_scaling, hold=held)
        self._update_plant()
        if was_turning and not self.arm.turning:
            self.log("standstill", q=self.arm.measured.q)
        if not self.arm.moving:
            self.runtime = _AT_STANDSTILL.get(self.runtime, self.runtime)
        if fault is not None:
            self.protective_stop(str(fault), fault.cause)
            self.stop_program("ended by the safety system")
        self.history.append(list(self.arm.measured.q))

    def _update_plant(self) -> None:
        """Let the plant follow the targets. Without it the arm has no power, and shows what was measured last."""
        if self.plant_lost:
            return
        try:
            self.arm.measured = self.plant.update(self.arm.q, self.arm.qd)
        except PlantLost as exc:
            self.plant_lost = str(exc)
            self.plant.close()
            self.safety_system.lose_plant(self.plant_lost)
            self.robot_mode = RobotMode.POWER_OFF
            self.stop_program("the plant is lost")

    def _turn_programs(self) -> None:
        if self.cycle % self.options.steps:
            return
        for secondary in list(self.secondary):
            try:
                secondary.turn()
            except ScriptError as exc:
                self.fail(secondary.name, exc)
            if not secondary.running:
                self.secondary.remove(secondary)
                secondary.close()
                self.tell(ProgramNotice(secondary.name, "STOPPED"))
        program = self.program
        if program is None or self.runtime is not Runtime.PLAYING:
            return
        try:
            program.turn()
        except ScriptError as exc:
            self.fail(program.name, exc)
        if not program.running:
            self.stop_program("end of the program")
        elif program.driven != self.cycle and self.runtime is Runtime.PLAYING and not self.arm.blends:
            self.arm.motion = None  # no thread commands a motion in this cycle: the arm brakes

    # programs

    def program_arrived(self) -> None:
        """Note that the last byte of a program has come: it starts after the delay, once it is translated."""
        self._arrived = self.cycle

    def load(self, translation: Translation) -> None:
        """Start a translated program: a ``sec`` program now; another ends the running one, and waits for the delay."""
        if translation.secondary:
            if len(self.secondary) >= _MAX_SECONDARY:
                self._refuse(translation.name, f"{_MAX_SECONDARY} sec programs run already")
            else:
                self.secondary.append(Program(self, translation))
                self.tell(ProgramNotice(translation.name, "STARTED"))
            return
        if self.ready:
            self.stop_program("replaced by another")
        delay = max(1, round(self.options.start_delay / CYCLE))
        self._due = (self._arrived + delay, translation)

    def _start(self, translation: Translation) -> None:
        self._due = None
        if not self.ready:
            self._refuse(translation.name, f"{self.robot_mode.name}, {self.safety.name}")
            return
        self.stop_program("replaced by another")
        self.program = Program(self, translation)
        self.runtime = Runtime.PLAYING
        self.log("program", program=translation.name)
        self.tell(ProgramNotice(translation.name, "STARTED"))

    def _refuse(self, name: str, reason: str) -> None:
        self.log("refused", program=name, reason=reason)
        self.tell(ProgramFailed(f"{name} does not start: {reason}"))

    @property
    def ready(self) -> bool:
        """True where a program may start."""
        return self.robot_mode is RobotMode.RUNNING and self.safety in MOVING

    def stop_program(self, reason: str) -> None:
        """End the program; the arm brakes if it moves. Registers keep their values."""
        self._due = None
        self.inputs.watchdogs.clear()
        if self.program is not None:
            self.log("stopped", program=self.program.name, reason=reason)
            self.tell(ProgramNotice(self.program.name, "STOPPED"))
            self.program.close()
        self.program = None
        self.arm.motion = None
        self.runtime = Runtime.STOPPING if self.arm.moving else Runtime.STOPPED

    def pause_program(self) -> bool:
        """Hold the program and the arm; return False where no program plays."""
        if self.program is None or self.runtime is not Runtime.PLAYING:
            return False
        self.runtime = Runtime.PAUSING if self.arm.moving else Runtime.PAUSED
        self.log("paused", program=self.program.name)
        self.tell(ProgramNotice(self.program.name, "PAUSED"))
        return True

    def resume_program(self) -> bool:
        """Go on after a pause, with the motion that was interrupted; return False where that is not possible."""
        if self.program is None or not self.runtime.paused or self.safety not in MOVING:
            return False
        self.runtime = Runtime.PLAYING
        for watchdog in self.inputs.watchdogs.values():
            watchdog.fed = self.cycle
        self.log("resumed", program=self.program.name)
        self.tell(ProgramNotice(self.program.name, "RESUMED"))
        return True

    def _check_watchdog(self, watchdog: InputWatchdog) -> None:
        if self.runtime is not Runtime.PLAYING or not watchdog.expired(self.cycle):
            return
        self.log("watchdog", variable=watchdog.variable, action=watchdog.action)
        if watchdog.action == "stop":
            self.stop_program(f"watchdog of {watchdog.variable}")
        elif watchdog.action == "pause":
            self.pause_program()
        self.inputs.watchdogs.pop(watchdog.variable, None)

    # safety system

    @property
    def safety(self) -> SafetyMode:
        """State of the safety system."""
        return self.safety_system.mode

    def protective_stop(self, reason: str, cause: StopCause = TRIGGERED) -> None:
        """Stop the arm and hold the program, until a person unlocks it."""
        if not self.safety_system.protective_stop(reason, cause, self.timestamp):
            return
        if self.options.after_protective_stop == "stop":
            self.stop_program("protective stop")
        else:
            self.pause_program()

    def unlock(self, early: bool = False) -> bool:
        """End a protective stop; return False where it is too early, and that is not allowed."""
        return self.safety_system.unlock(self.timestamp, early)

    def safeguard(self, open: bool) -> str:
        """Open or close the safeguard: the arm brakes, the program is held, and a person has to start it again."""
        if not open:
            self.safety_system.close_safeguard()
        elif self.safety_system.open_safeguard():
            self.pause_program()
        return self.safety.name

    def reduce(self, on: bool) -> str:
        """Begin or end reduced mode, in which paths and speeds are at most `_REDUCED_SHARE` of what is commanded."""
        self.safety_system.reduce(on)
        return self.safety.name

    def switch_control(self, remote: bool) -> bool:
        """Switch to remote or to local control, as a person does on the pendant; a running program goes on."""
        self.remote_control = remote
        self.log("control", remote=remote)
        return remote

    def emergency_stop(self) -> None:
        """Act on the emergency stop button: the arm brakes and loses power, the program ends."""
        self.safety_system.emergency_stop()
        self.robot_mode = RobotMode.POWER_OFF
        self.stop_program("emergency stop")

    # inputs

    def write_inputs(self, values: Mapping[str, Value]) -> None:
        """Take the values of a client's data packet, name -> value, in the order of its recipe."""
        self.inputs.write(values, self.cycle)
        if values.get("speed_slider_mask"):
            before, self.slider = self.slider, min(1.0, max(0.0, float(values["speed_slider_fraction"])))  # type: ignore[arg-type]
            self.log("slider", fraction=self.slider)
            if before == 0.0 < self.slider and self.runtime is Runtime.PLAYING and self.arm.motion is not None:
                self.protective_stop("the speed slider was raised from 0 while a program moved the arm", SUDDEN_CHANGE)
        for bit, on in digital_outputs(values):
            self.set_digital(1 << bit, on)
        self.terminals.write_analog(values)

    def set_digital(self, bit: int, on: bool) -> None:
        """Switch digital outputs: bits 0-7 standard, 8-15 configurable, 16-17 tool."""
        self.digital_outputs = self.digital_outputs | bit if on else self.digital_outputs & ~bit
        self.log("digital", outputs=self.digital_outputs)

    # clients and log

    def tell(self, notice: Notice) -> None:
        """Keep a notice until the server sends it to every client of the primary interface."""
        self.notices.append(notice)

    def fail(self, program: str, problem: ScriptError) -> None:
        """Report a program that cannot be run, or that has failed."""
        self.log("abort", program=program, reason=str(problem))
        self.tell(ProgramFailed(problem.title, problem.line, problem.column))

    def log(self, event: str, **facts: Any) -> None:
        """Write one JSON line: cycle, controller time, this machine's monotonic clock, event and its facts."""
        if self._log is not None:
            now, here = round(self.timestamp, 3), time.monotonic()
            line = {"cycle": self.cycle, "time": now, "monotonic": here, "event": event}
            self._log.write(json.dumps(line | facts, default=_plain) + "\n")

    @property
    def currents(self) -> list[float]:
        """Current that each motor takes beyond the model of the arm [A]: what the plant measures, and a fault line."""
        return [a + b for a, b in zip(self.resistance, self.arm.measured.current, strict=True)]

    def describe(self) -> dict[str, Any]:
        """Return the state: positions and speeds as they are measured [rad], [rad/s], and the words of its modes."""
        arm = self.arm
        return {
            "cycle": self.cycle,
            "q": list(arm.measured.q),
            "qd": list(arm.measured.qd),
            "turning": arm.turning,
            "plant_lost": self.plant_lost,
            "tcp": list(values_of(arm.tcp_pose(arm.measured.q))),
            "program": self.program.name if self.program is not None else "",
            "runtime": self.runtime.name,
            "robot_mode": self.robot_mode.name,
            "safety": self.safety.name,
            "slider": self.slider,
            "resistance": list(self.resistance),
            "digital_outputs": self.digital_outputs,
        }

    # power

    def switch_power(self, command: str) -> str:
        """Carry out one of `POWER_COMMANDS`; return what the dashboard answers. A real arm takes seconds for it."""
        if command == "power off":
            self.stop_program("power off")
            self.robot_mode = RobotMode.POWER_OFF
            return "Powering off"
        if command == "restart safety":
            if self.safety_system.restart():
                self.robot_mode = RobotMode.POWER_OFF
            return "Restarting safety"
        if self.safety in MOVING:
            if command == "brake release":
                self.robot_mode = RobotMode.RUNNING
            elif self.robot_mode is RobotMode.POWER_OFF:
                self.robot_mode = RobotMode.IDLE
        return "Brake releasing" if command == "brake release" else "Powering on"
