"""Twin of the ur_rtde wheel that notes every call, and the driver process on it."""

from types import SimpleNamespace

from coneskin.core.channel import decode_json, encode_json
from coneskin.robot.driver.values import Waypoint
from coneskin.robot.ur.ur_rtde import UrArm


class FakeWheel:
    """RTDEControlInterface as far as UrArm uses it; notes every call."""

    def __init__(self, accepts=True):
        self.calls = []
        self.accepts = accepts
        self.running = False
        self.playing = True
        self.late = 0  # looks at a program that plays, at which it does not run yet

    def isProgramRunning(self):
        self.late -= self.playing
        return self.playing and self.late < 0

    def reuploadScript(self):
        self.playing = True
        return self._note("reuploadScript")

    def setWatchdog(self, frequency):
        return self._note("setWatchdog", frequency)

    def _note(self, name, *values):
        self.calls.append((name, *values))
        return self.accepts

    def moveJ(self, q, v, a, asynchronous):
        assert asynchronous  # during a synchronous move the wheel cannot deliver a stop
        self.running = True
        return self._note("moveJ", v, a)

    def moveL(self, pose, v, a, asynchronous):
        assert asynchronous
        return self._note("moveL", v, a)

    def moveJ_IK(self, pose, v, a, asynchronous):
        assert asynchronous
        self.running = True
        return self._note("moveJ_IK", v, a)

    def moveL_FK(self, q, v, a, asynchronous):
        assert asynchronous
        self.running = True
        return self._note("moveL_FK", v, a)

    def movePath(self, path, asynchronous):
        assert asynchronous
        self.running = True
        return self._note("movePath", *path.entries)

    def speedL(self, twist, a, t):
        assert t == 0.002
        return self._note("speedL", a, twist[0])

    def servoL(self, pose, *rest):
        return self._note("servoL", *rest)

    def getTCPOffset(self):
        return [0.0] * 6

    def getForwardKinematics(self, *values):
        self._note("getForwardKinematics", *values)
        return [0.5] * 6

    def setTcp(self, pose):
        return self._note("setTcp", *pose)

    def setPayload(self, mass, centre):
        return self._note("setPayload", mass, *centre)

    def speedJ(self, qd, a, t):
        assert t == 0.002  # a new target in the next cycle
        return self._note("speedJ", a, qd[0])

    def servoJ(self, q, *rest):
        return self._note("servoJ")

    def stopJ(self, a):
        self.running = False
        self._note("stopJ", a)

    def speedStop(self, a):
        self._note("speedStop", a)

    def servoStop(self, a):
        self._note("servoStop", a)

    def kickWatchdog(self):
        self._note("kick")

    def getAsyncOperationProgressEx(self):
        running = self.running

        class Status:
            def isAsyncOperationRunning(self):
                return running

            def progress(self):
                return 2

        return Status()


class FakePath:
    """Path of the wheel's module."""

    def __init__(self):
        self.entries = []

    def addEntry(self, entry):
        self.entries.append(entry)


class FakeEntry:
    """PathEntry of the wheel's module."""

    MoveJ, MoveL, MoveP, PositionTcpPose, PositionJoints = "movej", "movel", "movep", "pose", "joints"

    def __new__(cls, kind, position, values):
        return (kind, position, values[6:])


def arm(accepts=True):
    made = UrArm("test", 4.0)
    made.wheel = SimpleNamespace(Path=FakePath, PathEntry=FakeEntry)
    made.control = FakeWheel(accepts)
    return made


def stops(wheel):
    return [call[0] for call in wheel.calls if call[0] not in ("kick", "setWatchdog")]


def ask(program, **request):
    program.send(encode_json({"number": 1, "sent": 10.0, **request}))


def answers(channel):
    return [decode_json(message) for message in channel.receive()]


def move(program, sent=10.0):
    ask(program, do="move_j", q=[0.0] * 6, speed=1.0, acceleration=2.0, sent=sent)


def path(program, sent=10.0, **more):
    points = [Waypoint.move_j([0.1] * 6, blend=0.02), Waypoint.move_l([0.2] * 6, speed=0.3), Waypoint.move_p([0.3] * 6)]
    ask(program, do="move_path", waypoints=points, sent=sent, **more)
