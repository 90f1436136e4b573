"""Program of a user who knows nothing of coneskin: it turns the first joint with the maker's SDK, until it is refused.

python -m coneskin_xarm.program 127.0.0.1
"""

import sys
import time

from xarm.wrapper import XArmAPI

_SPEED = 0.5  # rad/s
_SIDE_TIME = 2.0  # s to one side


def main(host: str) -> None:
    """Turn until the controller is stopped."""
    arm = XArmAPI(host, is_radian=True, enable_report=False)
    arm.motion_enable(True)
    arm.set_mode(4)  # joint speeds
    arm.set_state(0)
    speed, until = _SPEED, 0.0
    print("moving", flush=True)
    while arm.get_state()[1] != 4:
        if time.monotonic() >= until:
            speed, until = -speed, time.monotonic() + _SIDE_TIME
            arm.vc_set_joint_velocity([speed, 0.0, 0.0, 0.0, 0.0, 0.0])
        time.sleep(0.05)
    print("stopped by another", flush=True)
    arm.disconnect()


if __name__ == "__main__":
    main(sys.argv[1])
