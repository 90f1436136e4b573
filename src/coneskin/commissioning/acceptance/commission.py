"""Run of a commissioning: skin, procedure and an arm that must not move, and the record that comes of it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime

from coneskin.commissioning.skin_watch import TouchSession
from coneskin.core.channel import wait_readable
from coneskin.core.errors import RobotRefused, RobotTimeout
from coneskin.core.version import __version__
from coneskin.robot.arm.model import Joints
from coneskin.robot.arm.models import arm_model
from coneskin.robot.driver.protocol import load_driver
from coneskin.scene.build import place_on_frusta
from coneskin.scene.commissioning_record import CommissioningRecord, fingerprint
from coneskin.scene.values.scene import ArmScene, Commissioning, Scene

from .marks import offer_marks
from .procedure import Procedure, SensorMarks

_START_TIMEOUT = 3.0  # s for the first state
_STATE_TIMEOUT = 1.0  # s without a state
_MAX_MOTION = 0.02  # rad; the words for the marks are of one posture


class _ArmWatch:
    """States of one arm, whose reader a stack closes; ``q``: joint positions at the beginning [rad]."""

    def __init__(self, arm: ArmScene, stack: ExitStack) -> None:
        model = arm_model(arm.model)
        self._driver = load_driver(model.driver)
        self._driver.check_model(model, arm.host)
        self._reader = stack.enter_context(self._driver.state_reader(arm.host))
        self._heard = 0.0
        self.q: Joints = (0.0,) * model.joints
        end = time.monotonic() + _START_TIMEOUT
        while not self._heard:
            if time.monotonic() > end:
                raise RobotTimeout(f"the controller has sent no state within {_START_TIMEOUT:g} s")
            wait_readable([self._reader], 0.05)
            self._read()

    def check(self) -> None:
        """Raise where the arm has moved, or its controller is silent or gone."""
        self._read()
        if time.monotonic() - self._heard > _STATE_TIMEOUT:
            raise RobotTimeout(f"the controller has sent no state for {_STATE_TIMEOUT:g} s")

    def _read(self) -> None:
        for payload in self._reader.read():
            now = time.monotonic()
            state = self._driver.decode_state(now, payload)
            if not self._heard:
                self.q = state.q
            self._heard = now
            off = max(abs(a - b) for a, b in zip(state.q, self.q, strict=True))
            if off > _MAX_MOTION:
                raise RobotRefused(
                    f"the arm has moved, a joint by {off:.3f} rad: the marks were described for where it stood; begin "
                    "again and leave it there"
                )


_SIMULATED_Q = (0.0, -math.pi / 2.0, math.pi / 2.0, -math.pi / 2.0, -math.pi / 2.0, 0.0)  # rad; no arm is asked
_VIRTUAL_DURATION = 0.5  # s, of the touches of a virtual skin


def prepare(scene: Scene, q: Sequence[float] | None) -> Procedure:
    """Return the procedure for a scene, its arm at joint positions q [rad]; None without an arm.

    Raises:
        RobotRefused: a sensor is too small for marks that show every misreading.
    """
    pairs = zip(scene.sensors, place_on_frusta(scene), strict=True)
    procedure = Procedure([SensorMarks(item.sensor, offer_marks(item.sensor, place, q)) for item, place in pairs])
    if procedure.incomplete:
        raise RobotRefused(procedure.incomplete)
    return procedure


class Commissioner:
    """One commissioning of a scene.

    Args:
        session: with the skin of the scene.
        q: joint positions, where no arm is asked [rad].
    """

    def __init__(self, session: TouchSession, q: Sequence[float] | None = None) -> None:
        self._session, self._scene, self._q = session, session.scene, q

    def plan(self) -> tuple[Procedure, Sequence[float] | None]:
        """Return the procedure with its marks, and the joint positions that they are described for [rad].

        Raises:
            RobotRefused: a sensor is too small.
            RobotConnectionError: the controller cannot be reached.
        """
        with ExitStack() as stack:
            q, _ = self._posture(stack)
        return prepare(self._scene, q), q

    def run(
        self, by: str = "", begin: Callable[[Procedure, Sequence[float] | None], None] = lambda *_: None
    ) -> CommissioningRecord:
        """Carry it out.

        Args:
            by: who touches.
            begin: called with what ``plan`` returns before the first mark.

        Returns:
            the record, passed or failed; it is not written.

        Raises:
            RobotRefused: the arm has moved, or the marks that can be reached do not suffice.
            RobotConnectionError: the controller cannot be reached.
            SkinError: the skin has a fault, or cannot be read.
        """
        with ExitStack() as stack:
            q, check_arm = self._posture(stack)
            procedure = prepare(self._scene, q)
            begin(procedure, q)
            watch = stack.enter_context(self._session.watch())
            self._session.carry_out(procedure, watch, _VIRTUAL_DURATION, check_arm)
            if procedure.incomplete:
                raise RobotRefused(procedure.incomplete)
        wrong = [watch.contradiction(item.sensor.name) for item in procedure.sensors]
        cause = procedure.cause or "; ".join(filter(None, wrong))
        results = tuple(result for item in procedure.sensors for result in item.results)
        ohms = watch.untouched_ohms()
        date, passed = datetime.now(UTC).isoformat(timespec="seconds"), procedure.passed and not cause
        return CommissioningRecord(date, __version__, fingerprint(self._scene), passed, cause, by, results, ohms)

    def _posture(self, stack: ExitStack) -> tuple[Sequence[float] | None, Callable[[], None]]:
        """Return the joint positions to describe marks for, and a check that they stay."""
        if self._scene.arm is None:
            return None, lambda: None
        if self._q is not None or self._session.simulated:
            return self._q or _SIMULATED_Q, lambda: None
        watch = _ArmWatch(self._scene.arm, stack)
        return watch.q, watch.check


def commission_virtual_skin(scene: Scene) -> Scene:
    """Commission a scene's virtual skin by touching it, and return the scene, whose arm may then move away.

    A real skin is commissioned by a person, with ``coneskin commission``.

    Raises:
        SkinConnectionError: the skin is not virtual.
        RobotRefused: it has not passed; the message says why.
    """
    record = Commissioner(TouchSession(scene, simulated=True)).run()
    if not record.passed:
        raise RobotRefused(f"the virtual skin of {scene.name} has not passed its commissioning: {record.cause}")
    note = f"virtual, {len(record.marks)} marks touched by this program"
    return replace(scene, commissioning=Commissioning(True, note, record.sheet_ohm))
