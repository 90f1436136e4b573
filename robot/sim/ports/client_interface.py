"""Client interfaces of the simulated controller (ports 30001 to 30003): states and messages out, programs in.

Numbers are big endian. A packet is its length with these four bytes, its kind, and for a message (kind 20) the
controller's time [us], its source and the kind of message. A state consists of sub-packages: length, kind and fields.
Sub-packages 5 (kinematics) and 6 (configuration) come once, in the first state, as they never change here. A packet of
the realtime interface is its length, then doubles at fixed places; it grew at its end from version to version. What is
not simulated has the value of an arm at rest.

These ports take URScript, and lines which Universal Robots does not document but whose own client library sends. Such a
line acts at once and does not touch a running program otherwise. Ports 30011 to 30013 send the same, and take nothing.

Source: Universal Robots, "Client Interface" (version 5.x, and the sheet of the realtime client); the sizes of states
are those of a recorded packet in the tests of Universal Robots' own client library.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable, Iterable

from coneskin.robot.arm.model import ArmModel
from coneskin.robot.sim.machine import states
from coneskin.robot.sim.machine.controller import Controller
from coneskin.robot.sim.motion.arm import JOINT_ACCELERATION
from coneskin.robot.sim.motion.path import Path
from coneskin.robot.sim.urscript.translator import MAX_LENGTH, complete_programs
from coneskin.robot.sim.urscript.values import ScriptError, values_of
from coneskin.robot.ur.rtde_codec import RobotMode, SafetyMode

MESSAGE = 20  #: kind of a packet that holds one message
_TEXT_MESSAGE, _POPUP_MESSAGE, _VERSION_MESSAGE, _SAFETY_MESSAGE = 0, 2, 3, 5  # kinds of messages
_ERROR_MESSAGE, _KEY_MESSAGE, _FAILED_MESSAGE = 6, 7, 10
_RUNTIME, _INTERFACE = 253, 254  # source of a message: the runtime machine, the interface itself
_NO_DATA = 0  # of a report: it carries no further value
_MAX_TITLE_LENGTH = 255  # bytes: its length is one byte


def _pack(kind: int, body: bytes) -> bytes:
    """Return a packet of the client interface, or a sub-package of a state."""
    return struct.pack(">IB", 5 + len(body), kind) + body


def _message(time: float, source: int, kind: int, body: bytes) -> bytes:
    return _pack(MESSAGE, struct.pack(">QBB", round(time * 1e6), source, kind) + body)


def _bytes(text: str) -> bytes:
    """Return a text; a half of a pair of surrogates, which a file in JSON can hold, becomes a question mark."""
    return text.encode("utf-8", "replace")


def _encode_version(time: float, version: states.Version) -> bytes:
    """Return the message that a client of the primary interface gets first, at a time since power-on [s]."""
    major, minor = version
    name, date = b"URControl", b"01-01-2026, 00:00:00"
    body = struct.pack(">B", len(name)) + name + struct.pack(">BBii", major, minor, 0, 1) + date
    return _message(time, _INTERFACE, _VERSION_MESSAGE, body)


def _encode_notice(time: float, notice: states.Notice) -> bytes:
    """Return a notice as a message, at a time since power-on [s]."""
    match notice:
        case states.TextNotice(text):
            return _message(time, _RUNTIME, _TEXT_MESSAGE, _bytes(text))
        case states.PopupNotice(title, text, warning, error):
            head = _bytes(title)[:_MAX_TITLE_LENGTH]
            flags = struct.pack(">IBBBBB", 0, 0, warning, error, False, len(head))
            return _message(time, _RUNTIME, _POPUP_MESSAGE, flags + head + _bytes(text))
        case states.ProgramNotice(name, event):
            key = f"PROGRAM_XXX_{event}".encode()
            return _message(time, _RUNTIME, _KEY_MESSAGE, struct.pack(">iiB", 0, 0, len(key)) + key + _bytes(name))
        case states.ProgramFailed(text, line, column):
            return _message(time, _RUNTIME, _FAILED_MESSAGE, struct.pack(">ii", line, column) + _bytes(text))
        case states.SafetyNotice(mode):
            return _message(time, _RUNTIME, _SAFETY_MESSAGE, struct.pack(">iiBiI", 0, 0, mode, _NO_DATA, 0))
        case states.ErrorNotice(code, argument, text, report):
            body = struct.pack(">iiiII", code, argument, report, _NO_DATA, 0)
            return _message(time, _RUNTIME, _ERROR_MESSAGE, body + _bytes(text))


_ZEROS3, _ZEROS6 = (0.0,) * 3, (0.0,) * 6
#: first version of PolyScope 5, and of CB3, with packets of so many bytes
_PACKET_SIZES = (((5, 10), (3, 15), 1220), ((5, 9), (3, 14), 1140), ((5, 4), (3, 10), 1116))
_MIN_PACKET_SIZE = 1108  # bytes; of older ones, whose packets end with the speed of the elbow


def _realtime_size(version: states.Version) -> int:
    """Return the length of a packet of that version [bytes]."""
    return next(
        (size for e, cb3, size in _PACKET_SIZES if version >= (cb3 if version[0] == 3 else e)), _MIN_PACKET_SIZE
    )


def _encode_realtime(c: Controller) -> bytes:
    """Return the packet of the present cycle."""
    arm = c.arm
    measured, powered = arm.measured, c.robot_mode is not RobotMode.POWER_OFF
    pose, twist = values_of(arm.tcp_pose(measured.q)), arm.measured_twist()
    target_pose, target_twist = values_of(arm.tcp_pose()), arm.twist()
    modes = (253.0 if c.robot_mode is RobotMode.RUNNING else 255.0,) * 6
    volts = 48.0 * powered
    values = (
        *(c.timestamp, *arm.q, *arm.qd, *arm.qdd, *_ZEROS6, *_ZEROS6),  # targets: q, qd, qdd, current, torque
        *(*measured.q, *measured.qd, *c.currents, *_ZEROS6),  # measured: q, qd, current; control current
        *(*pose, *twist, *_ZEROS6, *target_pose, *target_twist),  # tool: pose, speed and force, then both targets
        *(0.0, *((30.0,) * 6), 0.0, 0.0, float(c.robot_mode), *modes, float(c.safety)),  # inputs, temperatures, states
        *(*_ZEROS6, 0.0, 0.0, -9.81, *_ZEROS6),  # tool accelerometer between what is for internal use
        *(0.0 if c.safety != 1 else c.slider, 0.0, 0.0, 0.0),  # speed scaling, momentum
        *(48.0, volts, 0.5 * powered, *((volts,) * 6), float(c.digital_outputs), float(c.runtime)),
        *(*_ZEROS3, *_ZEROS3, float(c.safety)),  # elbow: position, speed; safety state
        *(0.0, 0.0, 0.0, c.payload, *c.payload_cog, *c.payload_inertia),
    )
    size = _realtime_size(c.options.version)
    return struct.pack(f">i{(size - 4) // 8}d", size, *values[: (size - 4) // 8])


ROBOT_STATE = 16  #: kind of a packet that holds the state
_MODE, _JOINTS, _TOOL, _BOARD, _CARTESIAN, _KINEMATICS, _CONFIGURATION = 0, 1, 2, 3, 4, 5, 6
_FORCES, _ADDITIONAL, _CALIBRATION, _SAFETY, _TOOL_LINE, _TOOL_OUTPUTS = 7, 8, 9, 10, 11, 12
_CONTROL_MODE_POSITION = 0
_TOOL_RUNNING = 253  # mode of the tool
#: size of an arm -> its number as robot type
_ROBOT_TYPES = {"UR5": 1, "UR7": 1, "UR10": 2, "UR12": 2, "UR3": 3, "UR16": 4, "UR18": 5, "UR8 Long": 6}
_ROBOT_TYPES |= {"UR20": 7, "UR30": 8, "UR15": 9}
_ROBOT_SUBTYPES = {3: 0, 5: 3}  # major version of the software -> sub-type, as recorded from 5.24
_BOX, _BOARD_VERSION = 4, 6  # of an e-Series control box, as recorded
_DEFAULT_MOTION = (math.radians(60.0), math.radians(80.0), 0.25, 1.2, 0.25)  # joint and tool v and a, and their radius


def _encode_state(controller: Controller, *, first: bool = False) -> bytes:
    """Return the packet of the present state; a new client first gets it with kinematics and configuration."""
    model, version = controller.arm.model, controller.options.version
    fixed = (_kinematics(model), _configuration(model, version[0])) if first else ()
    return _pack(ROBOT_STATE, b"".join((*_changing(controller), *fixed)))


def _changing(c: Controller) -> Iterable[bytes]:
    arm = c.arm
    running, paused = c.runtime.word != "STOPPED", c.runtime.paused
    powered = c.robot_mode is not RobotMode.POWER_OFF
    stopped = c.safety is SafetyMode.ROBOT_EMERGENCY_STOP
    flags = (True, True, powered, stopped, c.safety is SafetyMode.PROTECTIVE_STOP, running and not paused, paused)
    scaling = c.speed_scaling if c.safety in states.MOVING else 0.0
    time = round(c.timestamp * 1e6)
    mode = struct.pack(">Q7BBBddd", time, *flags, c.robot_mode, _CONTROL_MODE_POSITION, c.slider, scaling, 1.0)
    last = b"" if c.options.version[0] == 3 else bytes(1)  # a byte that CB3 does not have, here and below
    yield _pack(_MODE, mode + last)
    joints = (
        struct.pack(">dddffffB", q, target, qd, current, 48.0 * powered, 30.0, 0.0, states.joint_mode(c.robot_mode))
        for q, target, qd, current in zip(arm.measured.q, arm.q, arm.measured.qd, c.currents, strict=True)
    )
    yield _pack(_JOINTS, b"".join(joints))
    yield _pack(_TOOL, struct.pack(">BBddfBffB", 1, 1, 0.0, 0.0, 0.0, 0, 0.0, 30.0, _TOOL_RUNNING))
    t = c.terminals
    inputs = struct.pack(">IIBBdd", t.digital_inputs, c.digital_outputs, *t.input_domains[:2], *t.analog_inputs[:2])
    outputs = struct.pack(">BBdd", *t.output_domains, *map(t.analog_output, (0, 1)))
    rest = struct.pack(">ffffBBBIBB", 30.0, 48.0, 0.5, 0.1, c.safety, 0, 0, 0, 1, 1) + bytes(1)
    yield _pack(_BOARD, inputs + outputs + rest)
    yield _pack(_CARTESIAN, struct.pack(">12d", *values_of(arm.tcp_pose(arm.measured.q)), *values_of(arm.tcp)))
    yield _pack(_FORCES, bytes(56))
    yield _pack(_ADDITIONAL, struct.pack(">BBB", 0, 1, 0) + last)
    yield _pack(_CALIBRATION, bytes(48))
    yield _pack(_SAFETY, bytes(38))  # "used by Universal Robots software only"
    if not last:
        return  # a tool without an interface
    yield _pack(_TOOL_LINE, struct.pack(">?iiiff", False, 115200, 0, 1, 1.5, 3.5))
    yield _pack(_TOOL_OUTPUTS, struct.pack(">BBB", 0, 1, 1))


def _kinematics(model: ArmModel) -> bytes:
    table = struct.pack(">24d", *model.theta, *model.a, *model.d, *model.alpha)
    checksum = (zlib.crc32(table[8 * i :: 48]) for i in range(6))  # one for each joint
    return _pack(_KINEMATICS, struct.pack(">6I", *checksum) + table + struct.pack(">I", 0))


def _configuration(model: ArmModel, major: int) -> bytes:
    turn = 2.0 * math.pi  # a joint without end is reported with the range of the others
    limits = [max(-turn, min(turn, q)) for pair in zip(model.joint_lower, model.joint_upper, strict=True) for q in pair]
    motion = [value for speed in model.joint_speed for value in (speed, JOINT_ACCELERATION)]
    table = (*model.a, *model.d, *model.alpha, *model.theta)
    numbers = struct.pack(">53d", *limits, *motion, *_DEFAULT_MOTION, *table)
    size = _ROBOT_TYPES.get(model.name.removesuffix("e"), 0)
    box = struct.pack(">iiii", _BOARD_VERSION, _BOX, size, _ROBOT_SUBTYPES.get(major, 3))
    return _pack(_CONFIGURATION, numbers + box)


_STATE_CYCLES = 50  # between two states of primary and secondary interface: 10 Hz
_READ_ONLY = 210  # number of the error of a connection that takes no program


def greeting(controller: Controller, name: str) -> bytes:
    """Return what a new client of a port gets first."""
    if name == "realtime":
        return b""
    return _encode_version(controller.timestamp, controller.options.version) + _encode_state(controller, first=True)


def due_packets(controller: Controller, listening: frozenset[str]) -> dict[str, tuple[bytes, bytes]]:
    """Return what is due in this cycle: port -> state and messages for each of its clients.

    A state is worth nothing once there is a newer one; a message is sent once.

    Args:
        controller: whose notices are taken.
        listening: ports that have clients; for the others nothing is made.
    """
    c = controller
    packets: dict[str, bytes] = {}
    notices = [c.notices.popleft() for _ in range(len(c.notices))]
    changed = any(isinstance(notice, states.SafetyNotice) for notice in notices)  # whose state comes no later
    if (changed or c.cycle % _STATE_CYCLES == 0) and (ports := listening & {"primary", "secondary"}):
        packets = dict.fromkeys(ports, _encode_state(c))
    if "realtime" in listening and c.cycle % c.options.steps == 0:
        packets["realtime"] = _encode_realtime(c)
    due = {name: (state, b"") for name, state in packets.items()}
    if "primary" in listening and notices:
        messages = b"".join([_encode_notice(c.timestamp, notice) for notice in notices])
        due["primary"] = (packets.get("primary", b""), messages)
    return due


#: line of a client -> what the controller does
_COMMAND_LINES: dict[str, Callable[[Controller], object]] = {
    "power on": lambda c: c.switch_power("power on"),
    "power off": lambda c: c.switch_power("power off"),
    "set robotmode run": lambda c: c.switch_power("brake release"),
    "set unlock protective stop": lambda c: c.unlock(early=True),  # only the dashboard makes one wait
    "stop program": lambda c: c.stop_program("stop program"),
    "pause program": lambda c: c.pause_program(),
    "resume program": lambda c: c.resume_program(),
}


class ScriptPort:
    """Text of one client: bytes in; whole programs go to ``run``.

    Args:
        controller: takes the commands.
        run: takes the text of a program.
        messages: whether the client reads messages: on the primary interface alone.
        read_only: whether this port takes nothing.

    Attributes:
        left: its connection has to end: what comes is no program.
    """

    def __init__(
        self, controller: Controller, run: Callable[[str], None], *, messages: bool = False, read_only: bool = False
    ) -> None:
        self._controller, self._run, self._messages = controller, run, messages
        self._rest = ""
        self._read_only = (
            "this port is read-only" if read_only else "" if controller.remote_control else "local control"
        )
        self.left = False

    def __call__(self, data: bytes) -> bytes:
        """Take bytes; nothing is answered, but to a program that is too long. In local control nothing is taken.

        Nor is it after a switch to remote control, over a connection that was opened before: it stays read-only, which
        the primary interface says.
        """
        if self._read_only or not self._controller.remote_control:
            self._controller.log("dropped", reason=self._read_only or "local control")
            notice = states.ErrorNotice(_READ_ONLY, 0, "The connection is read-only")
            return _encode_notice(self._controller.timestamp, notice) if self._messages else b""
        programs, self._rest = complete_programs(self._rest + data.decode("utf-8", "replace"))
        if len(self._rest) > MAX_LENGTH:
            self._rest, self.left = "", True
            problem = f"a program has at most {MAX_LENGTH} characters"
            self._controller.log("dropped", reason=problem)
            return _encode_notice(self._controller.timestamp, states.ProgramFailed(problem)) if self._messages else b""
        last = True  # of two that move the arm in one batch the first would never start
        kept = []
        for text in reversed(programs):
            moves = text.strip() not in _COMMAND_LINES and not text.lstrip().startswith("sec ")
            if last or not moves:
                kept.append(text)
            last = last and not moves
        for text in reversed(kept):
            command = _COMMAND_LINES.get(text.strip())
            if command is None:
                self._run(text)
            else:
                self._controller.log("command", line=text.strip())
                command(self._controller)
        return b""


def interpreter_reply(controller: Controller, line: str) -> str:
    """Take a line of the interpreter's port (30020): statements for the running program, or a command of its own.

    Source: Universal Robots, "The URScript Programming Language", chapter "Interpreter Mode".
    """
    statement, program = line.strip(), controller.program
    if not statement:
        return ""
    if program is None:
        return f"discard: no program is running: {statement}"
    interpreter = program.interpreter
    answers = {
        "statelastexecuted": interpreter.executed,
        "statelastinterpreted": interpreter.interpreted,
        "statelastcleared": interpreter.cleared,
        "stateunexecuted": len(interpreter.queue),
    }
    if statement in answers:
        return f"state: {answers[statement]}: {statement}"
    if statement == "skipbuffer":
        interpreter.queue.clear()
    elif statement == "abort":
        interpreter.aborts = isinstance(controller.arm.motion, Path)
    else:
        try:
            interpreter.take(statement)
        except ScriptError as exc:
            return f"discard: {exc}: {statement}"
    return f"ack: {interpreter.interpreted}: {statement}"
