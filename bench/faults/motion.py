"""Motion of the arm in a trial of the fault campaign, and how far the surface goes towards what touches it."""

from __future__ import annotations

import math
import select
import threading
import time
from bisect import bisect_left
from contextlib import ExitStack, suppress
from dataclasses import dataclass

from coneskin.core.errors import ConeSkinError
from coneskin.geometry.frustum import Frustum
from coneskin.geometry.placed_frustum import PlacedFrustum
from coneskin.geometry.pose import Pose
from coneskin.robot.arm.kinematics import LINK_INDEX, dh_mesh, link_pose, point_jacobian
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.values import ControllerState
from coneskin.robot.ur.driver import UR_DRIVER

from .setup import give_precedence

AHEAD, BEHIND = 1.55, 4.70  # rad; the side of the forearm that runs ahead while the base turns, and the other
ARM_MODEL = arm_model("UR5e")
#: by the sensor's name
SKIN_PLACES = {
    name: (LINK_INDEX[link], PlacedFrustum(shape, dh_mesh(ARM_MODEL, link) @ Pose(translation=(0.0, 0.0, 0.08))))
    for name, link, shape in (
        ("0", "forearm", Frustum(0.0376, 0.0372, 0.26)),
        ("1", "upper_arm", Frustum(0.048, 0.048, 0.26)),
    )
}
REACTION_TIME = 0.05  # s; from a contact to an arm that brakes, on a machine that does other things too
STOP_DECELERATION = 10.0  # rad/s2
STANDING_SPEED = 1e-3  # rad/s


@dataclass(frozen=True)
class Touch:
    """Touch of the virtual skin, at its true place.

    Attributes:
        u: [m].
        phi: [rad].
        after: the request [s]; once it is made, the time on the clock.
        duration: [s].
        force: at its firmest [N].
        rise: until then [s].
        sensor: "0" on the forearm, "1" on the upper arm.
        grown_force: to which it changes once it has risen [N]; 0: it stays.
        growth_time: in which it does so [s].
    """

    u: float = 0.13
    phi: float = AHEAD
    after: float = 0.0
    duration: float = 2.0
    force: float = 5.0
    rise: float = 0.01
    sensor: str = "0"
    grown_force: float = 0.0
    growth_time: float = 0.0


class ArmMotion:
    """States that the controller reports, kept by a thread; used in a ``with``.

    Attributes:
        states: in order.
    """

    def __init__(self, host: str) -> None:
        self.states: list[ControllerState] = []
        self._host = host
        self._stack = ExitStack()
        self._over = threading.Event()

    def __enter__(self) -> ArmMotion:
        reader = self._stack.enter_context(UR_DRIVER.state_reader(self._host))

        def read() -> None:
            give_precedence(threading.get_native_id())  # a state that is read late would look like a late motion
            with suppress(ConeSkinError, OSError, ValueError):
                while not self._over.is_set():
                    if select.select([reader], [], [], 0.1)[0]:
                        now = time.monotonic()
                        states = [UR_DRIVER.decode_state(now, payload) for payload in reader.read()]
                        # of states that are read at once all but the last had come before, by the controller's clock
                        ages = [states[-1].controller_time - state.controller_time for state in states]
                        self.states += [state._replace(time=now - age) for state, age in zip(states, ages, strict=True)]

        self._thread = threading.Thread(target=read, name="arm motion")
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self._stack.close()

    def moved_after(self, since: float) -> float:
        """Return for how long after a time the arm was still, or again, seen to move [s]; 0 where it was not."""
        return max(
            (state.time - since for state in self.states if state.time > since and state.speed > STANDING_SPEED),
            default=0.0,
        )

    def pushed_in(self, touch: Touch, notice: float = 0.0) -> float | None:
        """Return how far the surface went towards a touch, beyond what a bare stop does; None where nothing was seen.

        It is the larger of the way beyond a stop from the speed that the surface had, and the way after the first
        standstill.

        Args:
            touch: the touch.
            notice: time that even a bare stop takes longer, because a stop path has failed [s].
        """
        states = self.states[bisect_left(self.states, touch.after, key=lambda state: state.time) :]
        states = [state for state in states if state.time <= touch.after + touch.duration]
        if not states:
            return None
        link, cone = SKIN_PLACES[touch.sensor]
        point, first = cone.point(touch.u, touch.phi), states[0]
        normal = link_pose(ARM_MODEL, first.q, link).rotate(cone.normal(touch.phi))
        rows = point_jacobian(ARM_MODEL, first.q, link, point)
        speed = sum(
            n * sum(j * v for j, v in zip(row, first.qd, strict=True)) for n, row in zip(normal, rows, strict=True)
        )
        stop = max(0.0, speed) * (REACTION_TIME + notice + first.speed / (2.0 * STOP_DECELERATION))
        begin = math.nan
        furthest = stood = -math.inf
        for state in states[::2]:
            way = sum(n * x for n, x in zip(normal, link_pose(ARM_MODEL, state.q, link).apply(point), strict=True))
            begin = way if math.isnan(begin) else begin
            furthest = max(furthest, way)
            if stood == -math.inf and state.speed < STANDING_SPEED:
                stood = furthest = way
        excess = furthest - begin - stop
        return max(excess, furthest - stood) if stood > -math.inf else excess
