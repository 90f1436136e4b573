"""Run of a commissioning: skin, arm and procedure together, and the record that comes of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING

from coneskin.core.errors import RobotRefused, SceneError, SkinConnectionError
from coneskin.core.version import __version__
from coneskin.scene.commissioning_record import CommissioningRecord, fingerprint
from coneskin.scene.summary import missing_parts
from coneskin.scene.values.scene import Commissioning, Scene
from coneskin.skin.sources.kinds import is_simulated

from .mark_touching import touch_marks
from .mark_words import offer_marks, place_sensors
from .procedure import Notice, Procedure
from .sensor_marks import SensorMarks
from .skin_watch import SkinWatch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from coneskin.session.skin_client import SkinClient
    from coneskin.skin.detection.frame.touch_reading import TouchReading

__all__ = ["VIRTUAL_FORCE", "Commissioner", "check_touchable", "commission_virtual_skin", "prepare", "start_skin"]

_SIMULATED_Q = (0.0, -math.pi / 2.0, math.pi / 2.0, -math.pi / 2.0, -math.pi / 2.0, 0.0)  # rad; no arm is asked
VIRTUAL_FORCE = 5.0  #: N, of the touches of a virtual skin
_VIRTUAL_DURATION = 0.5  # s


def check_touchable(scene: Scene, simulated: bool) -> None:
    """Refuse a scene whose marks nobody can touch.

    Args:
        scene: whose skin is to be touched.
        simulated: its virtual skin is touched by this program, not by a person.

    Raises:
        SceneError: the scene has no source, or no sensor.
        SkinConnectionError: it is to be simulated, and its skin is not virtual, or the other way round.
    """
    if missing := missing_parts(scene):
        raise SceneError(missing, scene.name)
    assert scene.source is not None
    if simulated and not is_simulated(scene.source.kind):
        raise SkinConnectionError(
            f"the skin of {scene.name} is not virtual: only a person can touch it, so leave --simulated out"
        )
    if not simulated and is_simulated(scene.source.kind):
        raise SkinConnectionError(f"the skin of {scene.name} is virtual, and nobody can touch it: use --simulated")


def start_skin(scene: Scene, stack: ExitStack) -> SkinClient:
    """Start the process of a scene's virtual skin, without its script of touches; it ends with the stack."""
    from coneskin.session.skin_client import SkinClient

    start = {"scene": scene.text, "name": scene.name, "folder": str(scene.folder.resolve()), "script": False}
    client = SkinClient(start, [item.sensor for item in scene.sensors])
    stack.callback(client.process.wait, 10.0)
    stack.callback(client.channel.close)
    return client


def prepare(scene: Scene, q: Sequence[float] | None) -> Procedure:
    """Return the procedure for a scene.

    Args:
        scene: whose sensors are commissioned.
        q: joint positions of its arm now [rad]; None without an arm.

    Raises:
        RobotRefused: a sensor is too small for marks that show every misreading.
    """
    placed = place_sensors(scene)
    sensors = [
        SensorMarks(item.sensor, place.link_name, offer_marks(item.sensor, place, q))
        for item, place in zip(scene.sensors, placed, strict=True)
    ]
    procedure = Procedure(sensors)
    if procedure.incomplete:
        raise RobotRefused(procedure.incomplete)
    return procedure


class Commissioner:
    """One commissioning of a scene.

    Args:
        scene: with a source.
        notice: called with what the person is told.
        reading: called some 50 times a second with what the sensors read now.
        refused: tells whether the person has said since the last call that a mark cannot be reached.
        q: joint positions, where no arm is asked [rad].
        simulated: touch the scene's virtual skin as the marks say.
        wired_as: scene from which the virtual skin is made, where it is another: a wrong wiring, for tests.

    Raises:
        SceneError: the scene has no source, or no sensor.
        SkinConnectionError: it is to be simulated, and its skin is not virtual, or the other way round.
    """

    def __init__(
        self,
        scene: Scene,
        notice: Callable[[Notice], None] = lambda _: None,
        reading: Callable[[dict[str, TouchReading | None]], None] = lambda _: None,
        refused: Callable[[], bool] = lambda: False,
        q: Sequence[float] | None = None,
        simulated: bool = False,
        wired_as: Scene | None = None,
    ) -> None:
        check_touchable(scene, simulated)
        self.scene = scene
        self._notice, self._reading, self._refused = notice, reading, refused
        self._q = q
        self._simulated, self._wired_as = simulated, wired_as or scene
        self._client: SkinClient | None = None

    def plan(self) -> tuple[Procedure, Sequence[float] | None]:
        """Return the procedure with its marks, and the joint positions that they are described for [rad].

        Raises:
            RobotRefused: a sensor is too small.
            RobotConnectionError: the controller cannot be reached.
        """
        with ExitStack() as stack:
            q, _ = self._posture(stack)
        return prepare(self.scene, q), q

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
            port = self._start_skin(stack) if self._simulated else ""
            procedure = prepare(self.scene, q)
            begin(procedure, q)
            watch = stack.enter_context(SkinWatch(self.scene, port))
            watch.await_ready()
            tell = partial(self._tell, procedure)
            touch_marks(procedure, watch, tell, self._reading, self._refused, check_arm)
            if procedure.incomplete:
                raise RobotRefused(procedure.incomplete)
        wrong = [watch.contradiction(item.sensor.name) for item in procedure.sensors]
        cause = procedure.cause or "; ".join(filter(None, wrong))
        results = tuple(result for item in procedure.sensors for result in item.results)
        date = datetime.now(UTC).isoformat(timespec="seconds")
        scene_hash = fingerprint(self.scene)
        return CommissioningRecord(date, __version__, scene_hash, procedure.passed and not cause, cause, by, results)

    def _posture(self, stack: ExitStack) -> tuple[Sequence[float] | None, Callable[[], None]]:
        """Return the joint positions to describe marks for, and a check that they stay."""
        if self.scene.arm is None:
            return None, lambda: None
        if self._q is not None or self._simulated:
            return self._q or _SIMULATED_Q, lambda: None
        from .arm_watch import ArmWatch

        watch = stack.enter_context(ArmWatch(self.scene.arm))
        return watch.q, watch.check

    def _start_skin(self, stack: ExitStack) -> str:
        self._client = start_skin(self._wired_as, stack)
        return self._client.port()

    def _tell(self, procedure: Procedure, notices: list[Notice]) -> None:
        for notice in notices:
            self._notice(notice)
            if self._client is not None and notice.kind in ("mark", "again") and procedure.mark is not None:
                sensor = procedure.current.sensor.name
                self._client.touch(*procedure.mark.place, VIRTUAL_FORCE, _VIRTUAL_DURATION, sensor)


def commission_virtual_skin(scene: Scene) -> Scene:
    """Commission a scene's virtual skin by touching it, and return the scene, whose arm may then move away.

    A real skin is commissioned by a person, with ``coneskin commission``.

    Raises:
        SkinConnectionError: the skin is not virtual.
        RobotRefused: it has not passed; the message says why.
    """
    record = Commissioner(scene, simulated=True).run()
    if not record.passed:
        raise RobotRefused(f"the virtual skin of {scene.name} has not passed its commissioning: {record.cause}")
    note = f"virtual, {len(record.marks)} marks touched by this program"
    return replace(scene, commissioning=Commissioning(True, note))
