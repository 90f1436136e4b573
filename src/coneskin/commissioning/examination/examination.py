"""Examination of a scene's hardware, item by item: port, skin, wires, arm; and the patch of a scene that mends it.

Nothing is moved, and nothing is guarded.
"""

from __future__ import annotations

import difflib
import math
import os
import re
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.commissioning.skin_watch import skin_source
from coneskin.commissioning.touching import Mark, Notice
from coneskin.core.errors import ConeSkinError, SceneError, SkinConnectionError, SkinTimeout
from coneskin.core.finding import Finding
from coneskin.scene.build import known_sensors
from coneskin.scene.required_packages import missing_packages, required_packages
from coneskin.scene.summary import missing_parts
from coneskin.scene.suspicions import suspicions
from coneskin.scene.values.scene import ArmScene, Scene, SourceScene
from coneskin.skin.sensor import Sensor
from coneskin.skin.sources.kinds import is_simulated
from coneskin.skin.sources.serial_port import find_ports, port_group
from coneskin.skin.sources.source import Source
from coneskin.skin.wire import Frame

from .guided_touches import examine_touches, guided_touches
from .hold_ups import begin_measurement, examine_hold_ups
from .skin_examination import SensorStatistics, SkinStatistics, examine_line, examine_sensor
from .wires import WirePatch, examine_wires

if TYPE_CHECKING:
    from coneskin.session.skin_client import SkinClient

_LISTEN_TIME = 2.0  # s of an untouched skin
_READ_TIMEOUT = 0.05  # s
_START_TIME = 1.0  # s for the first bytes, after which the port counts as silent
_TOUCH_TIMEOUT = 60.0  # s for a person to touch
_TOUCH_FORCE, _TOUCH_TIME = 5.0, 3.0  # N and s, of the touches of a virtual skin


class Doctor:
    """Examination of one scene.

    Args:
        tell: called with each finding as it is made.
        ask: called with what a person is asked to do.
        touches: False to leave the guided touches out.
        hold_up_time: for which the hold-ups of this computer are measured [s]; 0 to leave them out.

    Attributes:
        findings: so far.
        patches: keys of the scene that would mend what was found.
    """

    def __init__(
        self,
        scene: Scene,
        tell: Callable[[Finding], None] = lambda _: None,
        ask: Callable[[str], None] = lambda _: None,
        touches: bool = True,
        clock: Callable[[], float] = time.monotonic,
        hold_up_time: float = 0.0,
    ) -> None:
        self.scene = scene
        self.findings: list[Finding] = []
        self.patches: list[WirePatch] = []
        self._tell, self._ask, self._touches, self._clock = tell, ask, touches, clock
        self._hold_up_time = hold_up_time

    def examine(self) -> None:
        """Examine everything that the scene names, and meanwhile the computer."""
        with begin_measurement(self._hold_up_time) if self._hold_up_time else nullcontext() as measurement:
            missing, remedy = missing_packages(self.scene)
            there = ", ".join(required_packages(self.scene).values()) or "none needed"
            value = f"{', '.join(missing)} missing" if missing else there
            self.note(Finding("packages", "bad" if missing else "ok", value, "", remedy if missing else ""))
            self.note(*(one for one in suspicions(self.scene) if one.item != "packages"))
            self._examine_source()
            if self.scene.arm is None:
                self.note(Finding("arm", "not tried", "the scene has no [arm]"))
            else:
                self.note(*_arm(self.scene, self.scene.arm))
            if measurement is not None:
                self.note(examine_hold_ups(measurement))

    def note(self, *findings: Finding) -> None:
        """Keep and tell findings."""
        for finding in findings:
            self.findings.append(finding)
            self._tell(finding)

    def _examine_source(self) -> None:
        scene, source = self.scene, self.scene.source
        if source is None or not scene.sensors:
            if scene.arm is None:  # there is nothing to examine at all
                remedy = "add it, or see coneskin init"
                self.note(*(Finding("scene", "bad", line, "", remedy) for line in missing_parts(scene)))
            self.note(Finding("skin", "not tried", "the scene has no [source], or no sensor"))
            return
        self.note(*_port(source))
        with ExitStack() as stack:
            try:
                opened, client = skin_source(scene, stack, scene if is_simulated(source.kind) else None)
                stack.enter_context(opened)
            except ConeSkinError as exc:
                self.note(Finding("skin, port", "bad", str(exc), "it can be opened"))
                self.note(*(Finding(item, "not tried", "no port") for item in ("skin, frames", "skin, wires")))
                return
            if getattr(opened, "low_latency", None) is not None:
                self.note(_latency_timer(source, opened))
            try:
                self.examine_skin(opened, source.settings, client)
            except SkinConnectionError as exc:
                self.note(Finding("skin, port", "bad", str(exc), "it stays open", "look at the plug and the cable"))

    def examine_skin(self, source: Source, settings: Mapping[str, Any], toucher: SkinClient | None = None) -> None:
        """Examine what an open source sends, untouched and touched.

        Args:
            settings: of the scene's source.
            toucher: touches a virtual skin as a person is asked to; None for a real one.

        Raises:
            SkinConnectionError: the source is gone.
        """
        sensors = known_sensors(self.scene)
        self._ask("do not touch the skin")
        _collect(source, _START_TIME, self._clock)  # a device that starts with its port, and what has piled up
        seen = _collect(source, _LISTEN_TIME, self._clock)
        self.note(*examine_line(seen, sensors, settings, self._clock()))
        limits, rate = self.scene.monitoring_limits, settings.get("rate", math.inf)  # a virtual skin's is the scene's
        for sensor in sensors:
            statistics = seen.sensors.get((sensor.device_id, sensor.sensor_id))
            if statistics is None:
                self.note(Finding(f"{sensor.name}, wires", "not tried", "it sends nothing"))
                continue
            self.note(*examine_sensor(sensor, statistics, limits.clock_drift, limits.skin_silence, rate))
            if self.findings[-1].item.endswith(", short"):
                self.note(Finding(f"{sensor.name}, wires", "not tried", "a short hides what touches would tell"))
                continue
            self._examine_wires(source, sensor, statistics, toucher)

    def _examine_wires(
        self, source: Source, sensor: Sensor, untouched: SensorStatistics, toucher: SkinClient | None
    ) -> None:
        if not self._touches:
            self.note(Finding(f"{sensor.name}, wires", "not tried", "no touches were asked for"))
            return

        def tell(notice: Notice, mark: Mark | None) -> None:
            self._ask(notice.text)
            if toucher is not None and mark is not None:
                toucher.touch(*mark.place, _TOUCH_FORCE, _TOUCH_TIME, sensor.name)
            elif toucher is not None:
                toucher.release()

        kept: list[Frame] = []
        touched = guided_touches(source, sensor, tell, _TOUCH_TIMEOUT, self._clock, kept.append)
        if touched is None:
            why = f"no touch that rests came within {_TOUCH_TIMEOUT:g} s"
            self.note(Finding(f"{sensor.name}, wires", "not tried", why, "", "a touch must change its readings by 4 %"))
            return
        finding, patch = examine_wires(sensor, touched)
        self.note(finding)
        if patch is not None:
            self.patches.append(patch)
        if finding.verdict == "ok":
            self.note(examine_touches(sensor, untouched.frames, kept, 1.0 / untouched.numbers().rate))
        else:
            self.note(Finding(f"{sensor.name}, chi-squared", "not tried", "the wires are not in order"))


def _port(source: SourceScene) -> Iterator[Finding]:
    """Look at a device file before it is opened."""
    name = str(source.settings.get("port", ""))
    if not name.startswith("/dev/"):
        return
    path, item = Path(name), "skin, permission"
    if not path.exists():
        there = ", ".join(map(str, find_ports())) or "none at all"
        yield Finding(item, "bad", f"there is no {name}; present: {there}", "", "plug it in, or correct source.port")
    elif not os.access(path, os.R_OK | os.W_OK):
        group = port_group(path)
        remedy = f"sudo usermod -aG {group} $USER, then log in again; or the udev rule in packaging/"
        yield Finding(item, "bad", f"{name} may not be read and written", f"group {group}", remedy)
    else:
        yield Finding(item, "ok", f"{name} may be read and written")


def _latency_timer(source: SourceScene, opened: Source) -> Finding:
    item, rule = "skin, latency timer", "1 ms, or a device that has none"
    name = Path(str(source.settings.get("port", ""))).resolve().name
    timer = Path(f"/sys/bus/usb-serial/devices/{name}/latency_timer")
    try:
        value = int(timer.read_text())
    except (OSError, ValueError):
        return Finding(item, "ok", "this port has none")
    if value <= 1 or getattr(opened, "low_latency", False):
        return Finding(item, "ok", f"{value} ms", rule)
    return Finding(item, "warning", f"{value} ms", rule, f"echo 1 | sudo tee {timer}, or the udev rule in packaging/")


def _arm(scene: Scene, arm: ArmScene) -> list[Finding]:
    from coneskin.robot.arm.models import arm_model
    from coneskin.robot.driver.protocol import ExaminationScope, ExaminedDriver, load_driver

    internal = arm.control == "internal"
    moves = scene.moves_away and not internal
    slows = "slow" in {scene.default_reaction.kind, *(rule.reaction.kind for rule in scene.rules)}
    scope = ExaminationScope(
        internal, arm.slider_stop or slows, moves, not internal, scene.default_reaction.deceleration
    )
    model = arm_model(arm.model)
    driver = load_driver(model.driver)
    if isinstance(driver, ExaminedDriver):
        return driver.examine(model, arm.host, scope)
    try:
        driver.check_model(model, arm.host)
        with driver.stop_connections(arm.host):
            return [Finding("arm", "ok", f"{model.name} at {arm.host}; it takes stops")]
    except ConeSkinError as exc:
        return [Finding("arm", "bad", str(exc), "it is the scene's arm, and takes stops")]


def _collect(source: Source, duration: float, clock: Callable[[], float]) -> SkinStatistics:
    """Take what an open source sends for a time [s]."""
    start = clock()
    seen, end = SkinStatistics(start), start + duration
    while (now := clock()) < end:
        with suppress(SkinTimeout):
            seen.add(clock(), source.read(min(_READ_TIMEOUT, end - now)))
    return seen


_SENSOR_HEADER = re.compile(r"^\s*\[\[\s*link\s*\.\s*sensor\s*\]\]")
_TABLE_HEADER = re.compile(r"^\s*\[")


def set_sensor_keys(text: str, number: int, keys: Mapping[str, str]) -> str:
    """Return the text of a scene in which a sensor has other keys.

    Args:
        number: of the ``[[link.sensor]]``, from 0 in the order of the file.
        keys: name -> value, a word; what the sensor's ``file`` says is overruled by it.

    Raises:
        SceneError: the text has no such table; it may be written in another way, as an inline table.
    """
    lines = text.splitlines(keepends=True)
    headers = [at for at, line in enumerate(lines) if _SENSOR_HEADER.match(line)]
    if number >= len(headers):
        wanted = ", ".join(f'{key} = "{value}"' for key, value in keys.items())
        raise SceneError([f"there is no [[link.sensor]] number {number + 1} to change: write {wanted} yourself"])
    start = headers[number]
    end = next((at for at in range(start + 1, len(lines)) if _TABLE_HEADER.match(lines[at])), len(lines))
    body = [line for line in lines[start + 1 : end] if not any(re.match(rf"\s*{key}\s*=", line) for key in keys)]
    new = [f'{key} = "{value}"\n' for key, value in keys.items()]
    head = lines[start] if lines[start].endswith("\n") else lines[start] + "\n"
    return "".join([*lines[:start], head, *new, *body, *lines[end:]])


def diff_texts(old: str, new: str, name: str) -> str:
    """Return what a patch changes, as ``diff -u`` shows it."""
    lines = difflib.unified_diff(old.splitlines(), new.splitlines(), name, f"{name}, patched", n=2, lineterm="")
    return "\n".join(lines)
