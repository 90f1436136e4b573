"""Pick and place: paths with blends, a gripper on a digital output, an approach with speedL.

python demos/ur_rtde/pick_and_place.py [HOST]     with ur_rtde alone
python demos/ur_rtde/pick_and_place_guarded.py    the same, guarded: seven lines differ; scene.toml names the controller
"""

import sys

import rtde_control
import rtde_io
import rtde_receive

HOST = sys.argv[1] if len(sys.argv) > 1 else "127.0.0.1"
GRIPPER = 2  # standard digital output
HOVER, REACH = 0.10, 0.25  # m
APPROACH = 0.1  # m/s

control = rtde_control.RTDEControlInterface(HOST)
receive = rtde_receive.RTDEReceiveInterface(HOST)
io = rtde_io.RTDEIOInterface(HOST)


def beside(pose, x=0.0, y=0.0, z=0.0):
    return [pose[0] + x, pose[1] + y, pose[2] + z, *pose[3:]]


def lower(depth):
    """Go down with speedL, slower near the end, as a search for a part does."""
    start = receive.getActualTCPPose()[2]
    while (left := depth - (start - receive.getActualTCPPose()[2])) > 0.0005:
        begin = control.initPeriod()
        control.speedL([0.0, 0.0, -min(APPROACH, 8.0 * left), 0.0, 0.0, 0.0], 1.5)
        control.waitPeriod(begin)
    control.speedStop()


def close_gripper(closed):
    io.setStandardDigitalOut(GRIPPER, closed)
    while receive.getDigitalOutState(GRIPPER) != closed:
        control.waitPeriod(control.initPeriod())


control.setTcp([0.0, 0.0, 0.12, 0.0, 0.0, 0.0])
control.setPayload(0.8, [0.0, 0.0, 0.05])
home = receive.getActualQ()
pick = receive.getActualTCPPose()
place = beside(pick, x=-0.05, y=REACH)
print("hand at", [round(x, 4) for x in pick[:3]])

lower(0.03)
close_gripper(True)
control.setPayload(1.3, [0.0, 0.0, 0.08])
control.moveL(beside(pick, z=HOVER), 0.5, 3.0)
control.moveL(
    [
        [*beside(pick, y=REACH / 2, z=HOVER), 0.6, 3.0, 0.04],
        [*beside(place, z=HOVER), 0.6, 3.0, 0.02],
        [*place, 0.4, 3.0, 0.0],
    ],
    True,
)
passed = set()
while control.getAsyncOperationProgressEx().isAsyncOperationRunning():
    passed.add(control.getAsyncOperationProgressEx().progress())
    control.waitPeriod(control.initPeriod())
print("way points", sorted(passed))
close_gripper(False)
control.moveJ_IK(beside(place, z=HOVER), 1.5, 6.0)
control.moveJ([[*home[:5], 0.3, 2.0, 6.0, 0.05], [*home, 2.0, 6.0, 0.0]])
io.setAnalogOutputVoltage(0, 0.5)
print("home at", [round(q, 4) for q in receive.getActualQ()])
control.stopScript()
