"""Calls of the real wheel for the tests: each function runs alone in a child process (see `wheel`), returns JSON."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import dashboard_client
import rtde_control
import rtde_io
import rtde_receive

from coneskin.robot.driver.values import StopPath
from coneskin.robot.ur.stop_sockets import StopSockets
from coneskin.robot.ur.ur_rtde import UrArm

Joints = list[float]


def _until(condition: Callable[[], bool], limit: float = 60.0) -> bool:
    deadline = time.monotonic() + limit
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.002)
    return True


#: The wheel's destructors take half a second each; the child leaves without them (see `wheel`).
_KEPT: list[Any] = []


def _receive(host: str) -> Any:
    _KEPT.append(rtde_receive.RTDEReceiveInterface(host))
    return _KEPT[-1]


def _control(host: str) -> Any:
    _KEPT.append(rtde_control.RTDEControlInterface(host))
    return _KEPT[-1]


def _io(host: str) -> Any:
    _KEPT.append(rtde_io.RTDEIOInterface(host))
    return _KEPT[-1]


def _dashboard(host: str) -> Any:
    client = dashboard_client.DashboardClient(host)
    client.connect()
    return client


def _lead(values: Joints) -> float:
    return max(abs(value) for value in values)


def _settle(receive: Any) -> None:
    """Wait for the packet in which the arm stands: a command may return before the newest packet has come."""
    _until(lambda: _lead(receive.getActualQd()) == 0.0)


def _reach(receive: Any, speed: float) -> float:
    """Wait until the leading joint has a speed [rad/s]; return the speed that it has."""
    _until(lambda: abs(_lead(receive.getActualQd()) - speed) < 1e-9)
    return _lead(receive.getActualQd())


def _refusal(call: Callable[..., Any], *arguments: Any) -> str:
    try:
        call(*arguments)
    except Exception as exc:
        return str(exc)
    return ""


def receive_everything(host: str) -> dict[str, Any]:
    """All getters of the default list of variables."""
    receive = _receive(host)
    other = (
        "getDigitalInState",
        "getDigitalOutState",
        "getOutputIntRegister",
        "getOutputDoubleRegister",
        "getRobotStatus",
    )
    names = [name for name in dir(receive) if name.startswith("get") and name not in other]
    got = {name: getattr(receive, name)() for name in names}
    first = receive.getTimestamp()
    got["goes_on"] = _until(lambda: receive.getTimestamp() > first)
    got["register"] = receive.getOutputIntRegister(12) + receive.getOutputDoubleRegister(12)
    return got


def moves(host: str) -> dict[str, Any]:
    """Every kind of move, one after the other; how far from the target each ends."""
    receive = _receive(host)
    control = _control(host)
    home = receive.getActualQ()
    away = [q + 0.15 for q in home]
    out: dict[str, Any] = {}

    def joints_off(target: Joints) -> float:
        _settle(receive)
        return _lead([a - b for a, b in zip(receive.getActualQ(), target, strict=True)])

    def pose_off(target: Joints) -> float:
        _settle(receive)
        return _lead([a - b for a, b in zip(receive.getActualTCPPose(), target, strict=True)])

    out["moveJ_target"] = away
    out["moveJ"] = (control.moveJ(away, 2.0, 10.0), joints_off(away))
    pose = receive.getActualTCPPose()
    pose[2] += 0.03
    pose[0] += 0.03
    out["moveL"] = (control.moveL(pose, 1.0, 10.0), pose_off(pose))
    out["moveL_FK"] = (control.moveL_FK(away, 1.0, 10.0), joints_off(away))
    out["moveJ_IK"] = (control.moveJ_IK(pose, 2.0, 10.0), pose_off(pose))
    path = [[*away, 2.0, 10.0, 0.0], [*home, 2.0, 10.0, 0.0]]
    out["path"] = (control.moveJ(path), joints_off(home))
    poses = [[*pose, 1.0, 10.0, 0.0]]
    out["tool_path"] = (control.moveL(poses), pose_off(pose))

    before = control.getAsyncOperationProgressEx().operationId()
    out["async"] = [control.moveJ(home, 1.0, 5.0, True)]

    def running() -> bool:
        return bool(control.getAsyncOperationProgressEx().isAsyncOperationRunning())

    out["async"] += [_until(running), control.getAsyncOperationProgress()]
    out["async"] += [_until(lambda: not running()), joints_off(home)]
    out["async_id"] = (control.getAsyncOperationProgressEx().operationId() - before) % 128
    return out


def stops(host: str) -> dict[str, Any]:
    """Every stop on the motion that it can stop: how fast the arm was, how long the call took, what runs after it."""
    receive = _receive(host)
    control = _control(host)
    out: dict[str, Any] = {}
    home = receive.getActualQ()
    far = [home[0] + 2.0, *home[1:]]
    twist = [0.0, 0.1, 0.0, 0.0, 0.0, 0.0]

    def move() -> None:
        control.moveJ(far, 1.0, 10.0, True)

    def speed_joints() -> None:
        control.speedJ([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 10.0, 0.0)

    def speed_tool() -> None:
        control.speedL(twist, 1.0, 0.0)

    def servo() -> None:
        q = receive.getActualQ()
        control.servoJ([q[0] + 0.9, *q[1:]], 0.0, 0.0, 0.002, 0.2, 100)

    def tool_is_fast() -> bool:
        return abs(receive.getActualTCPSpeed()[1] - twist[1]) < 1e-3

    cases: list[tuple[str, Callable[[], None], Callable[[], bool], Callable[[], Any]]] = [
        ("stopJ after moveJ", move, lambda: _reach(receive, 1.0) == 1.0, lambda: control.stopJ(5.0)),
        ("speedStop after speedJ", speed_joints, lambda: _reach(receive, 0.5) == 0.5, lambda: control.speedStop(5.0)),
        ("speedStop after speedL", speed_tool, tool_is_fast, lambda: control.speedStop(2.0)),
        ("servoStop after servoJ", servo, lambda: _lead(receive.getActualQd()) > 0.05, lambda: control.servoStop(5.0)),
        ("stopL async after moveJ", move, lambda: _reach(receive, 1.0) == 1.0, lambda: control.stopL(5.0, True)),
    ]
    for name, begin, ready, stop in cases:
        begin()
        _until(ready)
        fast = _lead(receive.getActualQd())
        speed = receive.getActualTCPSpeed()
        start = time.monotonic()
        stop()
        taken = time.monotonic() - start
        _settle(receive)
        out[name] = (fast, speed, taken, control.isProgramRunning())
    control.moveJ(home, 3.0, 20.0)
    return out


def questions(host: str, q: Joints, tool: Joints) -> dict[str, Any]:
    """Kinematics and the other questions that move nothing."""
    receive = _receive(host)
    control = _control(host)
    out: dict[str, Any] = {"q": receive.getActualQ()}
    without_tool = receive.getActualTCPPose()
    out["fk_tool"] = control.getForwardKinematics(q, tool)
    out["setTcp"] = control.setTcp(tool)
    out["tcp_offset"] = control.getTCPOffset()
    out["fk_here"] = control.getForwardKinematics()
    _until(lambda: receive.getActualTCPPose() != without_tool)  # states that have the tool come later
    out["pose"] = receive.getActualTCPPose()
    out["ik"] = control.getInverseKinematics(out["pose"])
    out["ik_near"] = control.getInverseKinematics(out["fk_tool"], q)
    out["has"] = [control.getInverseKinematicsHasSolution(p) for p in (out["pose"], [3.0, 0, 0, 0, 0, 0])]
    out["jacobian"] = control.getJacobian()
    out["trans"] = control.poseTrans([1, 2, 3, 0, 0, 1.0], [0.1, 0, 0, 0.5, 0, 0])
    out["steady"] = control.isSteady()
    out["pose_within"] = [control.isPoseWithinSafetyLimits(p) for p in (out["pose"], [3.0, 0, 0, 0, 0, 0])]
    out["q_within"] = [control.isJointsWithinSafetyLimits(p) for p in (out["q"], [7.0, 0, 0, 0, 0, 0])]
    for _ in range(3):  # the first answers are stale: see the quirks
        out["step"] = control.getStepTime()
        time.sleep(0.01)
    for _ in range(3):
        out["flange"] = control.getActualToolFlangePose()
        time.sleep(0.01)
    control.setPayload(1.5, [0.0, 0.0, 0.1])
    _until(lambda: receive.getPayload() == 1.5)
    out["payload"] = (receive.getPayload(), receive.getPayloadCog())
    control.setTcp([0.0] * 6)
    return out


def inputs_and_outputs(host: str) -> dict[str, Any]:
    """Slider, digital and analog outputs, registers."""
    receive = _receive(host)
    control = _control(host)
    io = _io(host)
    io.setStandardDigitalOut(3, True)
    io.setConfigurableDigitalOut(1, True)
    io.setToolDigitalOut(0, True)
    io.setAnalogOutputVoltage(0, 0.5)
    wanted = 1 << 3 | 1 << 9 | 1 << 16
    out: dict[str, Any] = {"bits": _until(lambda: receive.getActualDigitalOutputBits() == wanted)}
    io.setStandardDigitalOut(3, False)
    out["off"] = _until(lambda: not receive.getDigitalOutState(3))
    out["analog"] = _until(lambda: receive.getStandardAnalogOutput0() == 5.0)  # volts: half of 10
    home = receive.getActualQ()
    control.moveJ([home[0] + 3.0, *home[1:]], 1.0, 10.0, True)
    out["full"] = _reach(receive, 1.0)
    io.setSpeedSlider(0.5)
    out["half"] = (_reach(receive, 0.5), receive.getTargetSpeedFraction())
    io.setSpeedSlider(0.0)
    out["none"] = _reach(receive, 0.0)
    control.stopJ(10.0)
    _until(control.isSteady)
    io.setSpeedSlider(1.0)  # not under a motion: that would be a protective stop
    _until(lambda: receive.getTargetSpeedFraction() == 1.0)
    control.moveJ([home[0] + 3.0, *home[1:]], 1.0, 10.0, True)  # home may be too near to reach that speed
    out["again"] = _reach(receive, 1.0)
    control.stopJ(10.0)
    control.moveJ(home, 3.0, 20.0)
    return out


def protective_stop(host: str) -> dict[str, Any]:
    """Protective stop in the middle of a move, unlock too early, unlock, play: the move goes on to its end."""
    receive = _receive(host)
    control = _control(host)
    dashboard = _dashboard(host)
    home = receive.getActualQ()
    target = [home[0] + 1.2, *home[1:]]
    control.moveJ(target, 1.0, 5.0, True)
    _reach(receive, 1.0)
    out: dict[str, Any] = {"returned": control.triggerProtectiveStop()}
    out["early"] = _refusal(dashboard.unlockProtectiveStop)
    _settle(receive)
    out["state"] = (receive.isProtectiveStopped(), receive.getSafetyMode(), receive.getSafetyStatusBits())
    out["runtime"] = receive.getRuntimeState()
    out["safety"] = (dashboard.safetymode(), dashboard.safetystatus())
    out["before"] = receive.getActualQ()[0] - home[0]
    out["play"] = _refusal(dashboard.play)
    out["unlocked"] = _until(lambda: not _refusal(dashboard.unlockProtectiveStop))
    unlocked_at = receive.getTimestamp()
    _until(lambda: receive.getTimestamp() > unlocked_at + 0.1)
    out["still"] = _lead(receive.getActualQd())
    dashboard.play()
    out["arrives"] = _until(lambda: _lead([a - b for a, b in zip(receive.getActualQ(), target, strict=True)]) == 0.0)
    control.moveJ(home, 3.0, 20.0)
    return out


def scripts(host: str) -> dict[str, Any]:
    """StopProgram, upload again, a script of one's own, pause and play."""
    receive = _receive(host)
    control = _control(host)
    dashboard = _dashboard(host)
    home = receive.getActualQ()
    control.stopScript()
    out: dict[str, Any] = {"stopped": control.isProgramRunning(), "refused": control.moveJ(home)}
    control.reuploadScript()
    out["again"] = (_until(control.isProgramRunning), control.moveJ(home))
    out["custom"] = control.sendCustomScriptFunction("mine", "movej([0.1, -1.5, 1.5, -1.5, -1.5, 0], a=20, v=3)")
    _settle(receive)
    out["custom_q"] = receive.getActualQ()
    control.moveJ([home[0] + 2.0, *home[1:]], 1.0, 10.0, True)
    _reach(receive, 1.0)
    dashboard.pause()
    out["paused"] = _until(lambda: _lead(receive.getActualQd()) == 0.0)
    out["paused_state"] = (dashboard.programState(), receive.getRuntimeState(), dashboard.running())
    dashboard.play()
    out["played"] = _until(lambda: _lead(receive.getActualQd()) == 1.0)
    dashboard.stop()
    out["ended"] = _until(lambda: _lead(receive.getActualQd()) == 0.0)
    out["ended_state"] = (dashboard.programState(), receive.getRuntimeState())
    return out


def dashboard_lines(host: str) -> dict[str, Any]:
    """All commands of the wheel's dashboard client."""
    client = _dashboard(host)
    out: dict[str, Any] = {}
    for name in ("polyscopeVersion", "getSerialNumber", "isInRemoteControl", "running", "programState", "robotmode"):
        out[name] = getattr(client, name)()
    for name in ("safetymode", "safetystatus", "isProgramSaved", "getRobotModel", "getLoadedProgram"):
        out[name] = getattr(client, name)()
    out["load"] = _refusal(client.loadURP, "a.urp")
    client.popup("hello")
    client.addToLog("hello")
    for name in ("closePopup", "closeSafetyPopup", "stop", "unlockProtectiveStop", "powerOff"):
        getattr(client, name)()
    out["off"] = client.robotmode()
    client.powerOn()
    client.brakeRelease()
    client.restartSafety()
    out["on"] = client.robotmode()
    out["play"] = _refusal(client.play)
    out["pause"] = _refusal(client.pause)
    client.quit()
    return out


def second_control(host: str) -> dict[str, Any]:
    """A second client that wants to control is refused, and the first goes on."""
    control = _control(host)
    home = _receive(host).getActualQ()
    refusal = _refusal(rtde_control.RTDEControlInterface, host)
    unknown = _refusal(rtde_receive.RTDEReceiveInterface, host, -1.0, ["timestamp", "actual_qqq"])
    return {"refusal": refusal, "unknown": unknown, "first": control.moveJ([home[0] + 0.05, *home[1:]], 3.0, 20.0)}


def watchdog(host: str) -> dict[str, Any]:
    """Fed, the program runs; not fed, it ends and the arm stops."""
    receive = _receive(host)
    control = _control(host)
    control.setWatchdog(1.0)
    begin = receive.getTimestamp()
    while receive.getTimestamp() < begin + 1.2:  # on the controller's clock, beyond one period of 1 s
        control.kickWatchdog()
        time.sleep(0.01)
    out: dict[str, Any] = {"fed": control.isProgramRunning()}
    control.speedJ([0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 10.0, 0.0)
    out["moved"] = _until(lambda: receive.getActualQd()[0] == 0.5)
    out["ended"] = _until(lambda: not control.isProgramRunning())
    out["stands"] = _until(lambda: receive.getActualQd()[0] == 0.0)
    return out


def speed_for_ever(host: str) -> None:
    """Start a speed under a watchdog and never come back: the test kills this process."""
    control = _control(host)
    control.setWatchdog(20.0)
    while True:
        control.speedJ([0.3, 0.0, 0.0, 0.0, 0.0, 0.0], 10.0, 0.0)
        time.sleep(0.01)


def sync_move_ignores_stops(host: str) -> dict[str, Any]:
    """While a synchronous move runs, a stop from another thread is lost; the dashboard's is not."""
    receive = _receive(host)
    control = _control(host)
    dashboard = _dashboard(host)
    home = receive.getActualQ()
    far = [home[0] + 1.5, *home[1:]]
    mover = threading.Thread(target=control.moveJ, args=(far, 0.5, 10.0))
    mover.start()
    out: dict[str, Any] = {"before_stopJ": _reach(receive, 0.5)}
    stopper = threading.Thread(target=control.stopJ, args=(10.0,))
    stopper.start()
    stopper.join()
    mover.join()
    _settle(receive)
    out["arrived"] = receive.getActualQ()[0] - home[0]
    threading.Thread(target=control.moveJ, args=(home, 0.5, 10.0), daemon=True).start()
    out["before_dashboard"] = _reach(receive, 0.5)
    dashboard.stop()
    _settle(receive)
    out["after_dashboard"] = _lead(receive.getActualQd())
    out["left"] = receive.getActualQ()[0] - home[0]
    return out


def stop_in_speed_mode(host: str) -> dict[str, Any]:
    """stopJ while the speed thread runs."""
    receive = _receive(host)
    control = _control(host)
    control.speedJ([0.2, 0.0, 0.0, 0.0, 0.0, 0.0], 10.0, 0.0)
    _until(lambda: receive.getActualQd()[0] == 0.2)
    control.stopJ(2.0)
    stands = _until(lambda: receive.getActualQd()[0] == 0.0)
    ended = _until(lambda: not control.isProgramRunning(), 1.0)
    return {"running": not ended, "stands": stands, "moves": control.moveJ(receive.getActualQ())}


def stop_types(host: str) -> dict[str, Any]:
    """stopJ(2.0) before and after one asynchronous stopL. The tool moves, and does not turn."""
    receive = _receive(host)
    control = _control(host)
    home = receive.getActualQ()
    for _ in range(2):
        control.moveJ([*home[:2], home[2] + 1.0, home[3] - 1.0, *home[4:]], 1.0, 20.0, True)
        _until(lambda: _lead(receive.getActualQd()) == 1.0)
        control.stopJ(2.0)
        control.moveJ(home, 3.0, 20.0)
        control.stopL(10.0, True)
        time.sleep(0.02)
    return {}


def latched_speed(host: str) -> dict[str, Any]:
    """After a dashboard stop in speed mode the command is still in its register: a new upload starts the arm."""
    receive = _receive(host)
    control = _control(host)
    dashboard = _dashboard(host)
    control.speedJ([0.2, 0.0, 0.0, 0.0, 0.0, 0.0], 10.0, 0.0)
    _until(lambda: receive.getActualQd()[0] == 0.2)
    dashboard.stop()
    out = {"stands": _until(lambda: receive.getActualQd()[0] == 0.0)}
    control.reuploadScript()
    out["moves"] = _until(lambda: receive.getActualQd()[0] == 0.2)
    control.speedStop(10.0)
    return out


def stale_forward_kinematics(host: str, q: Joints) -> dict[str, Any]:
    """getForwardKinematics(q) without a tool, after a command that used the same registers."""
    control = _control(host)
    here = _receive(host).getActualQ()
    control.moveJ(here, 1.0, 1.0)
    return {"fk": control.getForwardKinematics(q)}


def connect_and_move(host: str) -> dict[str, Any]:
    """The least that any version must do."""
    receive = _receive(host)
    control = _control(host)
    target = receive.getActualQ()
    target[0] += 0.1
    moved = control.moveJ(target, 3.0, 20.0)
    _settle(receive)
    return {"moved": moved, "off": _lead([a - b for a, b in zip(receive.getActualQ(), target, strict=True)])}


def notice_silence(host: str) -> dict[str, Any]:
    """Wait for the wheel to notice that the test has frozen the controller; connect again when the test says so."""
    receive = _receive(host)
    print("CONNECTED", flush=True)
    noticed = _until(lambda: not receive.isConnected(), 15.0)
    if noticed:
        print("NOTICED", flush=True)
        sys.stdin.readline()
    stopped_at = receive.getTimestamp()
    again = receive.reconnect()
    return {
        "again": again,
        "goes_on": _until(lambda: receive.getTimestamp() > stopped_at),
        "q": receive.getActualQ(),
    }


def notice_close(host: str) -> dict[str, Any]:
    """Wait for the test to close the RTDE connections."""
    receive = _receive(host)
    print("CONNECTED", flush=True)
    return {"noticed": _until(lambda: not receive.isConnected(), 15.0)}


def silent_dashboard(host: str) -> dict[str, Any]:
    """A dashboard that answers nothing: an error, not a hang."""
    return {"refusal": _refusal(_dashboard, host)}


def remaining_calls(host: str) -> dict[str, Any]:
    """Calls that the other functions leave out; none may end the control program.

    Not servoC: the wheel takes it for a realtime command, its program does not, and what follows it may be lost.
    """
    receive = _receive(host)
    control = _control(host)
    pose = receive.getActualTCPPose()
    out: dict[str, Any] = {}
    out["servoL"] = control.servoL(pose, 0.0, 0.0, 0.002, 0.1, 300)
    control.servoStop()
    out["jog"] = (control.jogStart([0.0, 0.02, 0.0, 0.0, 0.0, 0.0], 0), control.jogStop())
    out["contact"] = [control.startContactDetection(), control.readContactDetection(), control.stopContactDetection()]
    out["tool_contact"] = control.toolContact([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    out["teach"] = (control.teachMode(), control.endTeachMode())
    wrench = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    out["force"] = (control.forceMode([0.0] * 6, [0, 0, 1, 0, 0, 0], wrench, 2, [0.1] * 6), control.forceModeStop())
    out["zero"] = control.zeroFtSensor()
    out["freedrive"] = (control.freedriveMode(), control.getFreedriveStatus(), control.endFreedriveMode())
    out["gravity"] = control.setGravity([0.0, 0.0, 9.82])
    out["payload"] = control.setTargetPayload(1.0, [0.0, 0.0, 0.1], [0.1] * 6)
    out["history"] = len(control.getActualJointPositionsHistory(3))
    out["waypoint"] = control.getTargetWaypoint()
    out["derivative"] = len(control.getJacobianTimeDerivative())
    out["mass"] = [control.getMassMatrix() for _ in range(5)][-1]  # the first may be from before the call
    out["rests"] = receive.getActualQ()
    out["running"] = control.isProgramRunning()
    out["unreachable"] = control.moveL([3.0, 0.0, 0.0, 0.0, 0.0, 0.0], 0.2, 1.0)
    out["ended"] = not control.isProgramRunning()
    return out


def start_again_after_a_stop(host: str, revive: bool) -> dict[str, Any]:
    """Stop a speedJ by a program, then start the wheel's again: with our care, or as the wheel does it."""
    receive = _receive(host)
    arm = UrArm(host, 1.0).__enter__()
    _KEPT.append(arm)
    arm.speed("speed_j", [0.5, 0.0, 0.0, 0.0, 0.0, 0.0], 4.0)
    out: dict[str, Any] = {"moves": _until(lambda: receive.getActualQd()[0] > 0.45)}
    with StopSockets(host) as stops:
        out["sent"] = stops.use(StopPath.PROGRAM, 10.0)
        out["stands"] = _until(lambda: _lead(receive.getActualQd()) == 0.0 and receive.getRuntimeState() == 1)
        stood = receive.getActualQ()
        if revive:
            arm.revive()
        else:
            arm.control.reuploadScript()
        out["runs"] = _until(lambda: receive.getRuntimeState() == 2, 10.0)
        out["moved"] = _until(lambda: receive.getActualQ() != stood, 0.3 if revive else 5.0)
        stops.use(StopPath.PROGRAM, 10.0)
    return out
