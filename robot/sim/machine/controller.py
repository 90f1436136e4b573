"""Simulated controller: registers, programs, safety system, and the control cycle that joins them. No sockets.

Order of a cycle: the registers hold what clients have written since the last one; a program that is due starts; the
watchdog is checked; every thread of the program takes its turn; the targets of the arm move for 2 ms, and the plant
follows them; clients are sent the new state.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import IO, Any

from coneskin.robot.sim.motion.arm import CYCLE, SUDDEN_CHANGE, TRIGGERED, StopCause
from coneskin.robot.sim.motion.plant import KinematicPlant, Plant, PlantLost
from coneskin.robot.sim.urscript.translator import Translation
from coneskin.robot.sim.urscript.values import ScriptError, values_of
from coneskin.robot.ur.rtde_codec import RobotMode, SafetyMode, Value

from .inputs_outputs import InputWatchdog, digital_outputs
from .program import Program
from .script_host import ScriptHost
from .states import FAULT_REPORT, MOVING, ErrorNotice, Options, ProgramFailed, ProgramNotice, Runtime, SafetyNotice

#: commands that change the power of the arm
POWER_COMMANDS = ("power on", "power off", "brake release", "restart safety")


_PLANT_LOST = 50  # number in the log; that of a real controller which loses its arm depends on the joint
_MAX_SECONDARY = 20  # sec programs that run at once
_AT_STANDSTILL = {Runtime.STOPPING: Runtime.STOPPED, Runtime.PAUSING: Runtime.PAUSED}


class Controller(ScriptHost):
    """Controller of one arm; arguments as of `ScriptHost`.

    Attributes:
        remote_control: False in local control, in which no program and no command is taken.
        program: main program; None while none is loaded.
        secondary: ``sec`` programs that run beside it.
        plant_lost: why the plant does not count any more; empty while it does.
    """

    def __init__(self, options: Options, log: IO[str] | None = None, plant: Plant | None = None) -> None:
        super().__init__(options, log)
        self.plant: Plant = KinematicPlant() if plant is None else plant
        self.arm.kinematic = plant is None
        self.plant_lost = ""
        self.resistance = [0.0] * 6  # current that each motor takes beyond the model of the arm [A]
        self.program: Program | None = None
        self.secondary: list[Program] = []
        self.runtime = Runtime.STOPPED
        self.robot_mode = RobotMode.RUNNING
        self.remote_control = options.remote_control
        self._reduced = False
        self._stopped_at = 0.0  # controller time of the last protective stop [s]
        self._arrived = 0  # cycle in which the last program came in
        self._due: tuple[int, Translation] | None = None

    # control cycle

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
            self.log("plant_lost", reason=self.plant_lost)
            self._enter(SafetyMode.FAULT)
            self.tell(ErrorNotice(_PLANT_LOST, 0, self.plant_lost, FAULT_REPORT))
            self.robot_mode = RobotMode.POWER_OFF
            self.stop_program("the plant is lost")

    def _turn_programs(self) -> None:
        if self.cycle % self.options.steps:
            return
        for secondary in list(self.secondary):
            self._turn(secondary)
            if not secondary.running:
                self.secondary.remove(secondary)
                secondary.close()
                self.tell(ProgramNotice(secondary.name, "STOPPED"))
        program = self.program
        if program is None or self.runtime is not Runtime.PLAYING:
            return
        self._turn(program)
        if not program.running:
            self.stop_program("end of the program")
        elif program.driven != self.cycle and self.runtime is Runtime.PLAYING and not self.arm.blends:
            self.arm.motion = None  # no thread commands a motion in this cycle: the arm brakes

    def _turn(self, program: Program) -> None:
        try:
            program.turn()
        except ScriptError as exc:
            self.fail(program.name, exc)

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
        silence = (self.cycle - watchdog.fed) * CYCLE
        if self.runtime is not Runtime.PLAYING or silence <= watchdog.period:
            return
        self.log("watchdog", variable=watchdog.variable, action=watchdog.action, silence=round(silence, 3))
        if watchdog.action == "stop":
            self.stop_program(f"watchdog of {watchdog.variable}")
        elif watchdog.action == "pause":
            self.pause_program()
        self.inputs.watchdogs.pop(watchdog.variable, None)

    # safety system

    def protective_stop(self, reason: str, cause: StopCause = TRIGGERED) -> None:
        """Stop the arm and hold the program, until a person unlocks it."""
        if self.safety not in MOVING:
            return
        self._enter(SafetyMode.PROTECTIVE_STOP)
        self._stopped_at = self.timestamp
        self.log("protective_stop", reason=reason, cause=str(cause))
        self.tell(ErrorNotice(cause.code, cause.argument, reason))
        if self.options.after_protective_stop == "stop":
            self.stop_program("protective stop")
        else:
            self.pause_program()

    def unlock(self, early: bool = False) -> bool:
        """End a protective stop; return False where it is too early, and that is not allowed."""
        if self.safety is SafetyMode.PROTECTIVE_STOP:
            if not early and self.timestamp - self._stopped_at < self.options.unlock_after:
                return False
            self.log("unlocked")
            self._release()
        return True

    def safeguard(self, open: bool) -> str:
        """Open or close the safeguard: the arm brakes, the program is held, and a person has to start it again."""
        if open and self.safety in MOVING:
            self._enter(SafetyMode.SAFEGUARD_STOP)
            self.log("safeguard_stop")
            self.pause_program()
        elif not open and self.safety is SafetyMode.SAFEGUARD_STOP:
            self._release()
        return self.safety.name

    def reduce(self, on: bool) -> str:
        """Begin or end reduced mode, now or once the arm may move: paths and speeds are then half of the commanded."""
        self._reduced = on
        if self.safety in MOVING:
            self._release()
        return self.safety.name

    def _release(self) -> None:
        self._enter(SafetyMode.REDUCED if self._reduced else SafetyMode.NORMAL)

    def _enter(self, mode: SafetyMode) -> None:
        self.safety = mode
        self.tell(SafetyNotice(mode))

    def switch_control(self, remote: bool) -> bool:
        """Switch to remote or to local control, as a person does on the pendant; a running program goes on."""
        self.remote_control = remote
        self.log("control", remote=remote)
        return remote

    def emergency_stop(self) -> None:
        """Act on the emergency stop button: the arm brakes and loses power, the program ends."""
        self.log("emergency_stop")
        self._enter(SafetyMode.ROBOT_EMERGENCY_STOP)
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

    # clients

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
            if self.safety not in (*MOVING, SafetyMode.PROTECTIVE_STOP, SafetyMode.FAULT):
                self.safety, self.robot_mode = SafetyMode.NORMAL, RobotMode.POWER_OFF
            return "Restarting safety"
        if self.safety in MOVING:
            if command == "brake release":
                self.robot_mode = RobotMode.RUNNING
            elif self.robot_mode is RobotMode.POWER_OFF:
                self.robot_mode = RobotMode.IDLE
        return "Brake releasing" if command == "brake release" else "Powering on"
