"""Line of the skin as the guard has reported it: what is wrong with it, for the words of a refusal."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from coneskin.core.recording.block import Block
from coneskin.robot.guard.signals.journal import BlockKind

if TYPE_CHECKING:
    from coneskin.scene.values.scene import Scene
    from coneskin.skin.diagnosis.capture import CaptureWindow

__all__ = ["HeardLine"]


class HeardLine:
    """The newest bytes of the skin; whoever writes them and whoever asks may be different threads."""

    def __init__(self) -> None:
        self._window: CaptureWindow | None = None

    def take(self, blocks: Sequence[Block]) -> None:
        """Keep the skin's bytes among these blocks, for some seconds."""
        for block in blocks:
            if block.kind == BlockKind.SKIN:
                self._add(block)

    def _add(self, block: Block) -> None:
        if self._window is None:
            from coneskin.skin.diagnosis.capture import CaptureWindow

            self._window = CaptureWindow(block.time)
        self._window.add(block.payload, block.time)

    def describe(self, scene: Scene, reasons: Sequence[str]) -> str:
        """Return what is wrong with the line, where a guard waits for its skin.

        Args:
            scene: with the sensors and their source.
            reasons: why the guard waits or refuses; those of a sensor begin with its name.

        Returns:
            a sentence; empty where the reasons are others, and where frames come as they should.
        """
        names = tuple(f"{item.sensor.name}: " for item in scene.sensors)
        if scene.source is None or not any(reason.startswith(names) for reason in reasons):
            return ""
        from coneskin.skin.diagnosis.capture import Capture
        from coneskin.skin.diagnosis.diagnose import diagnose

        now = time.monotonic()
        capture = Capture((), now, since=now) if self._window is None else self._window.capture(now)
        found = diagnose(capture, [item.sensor for item in scene.sensors], scene.source.settings.get("baud"))
        if found.good:
            return ""
        if not capture.pieces:
            return f"no byte has come from {_source_name(scene)}: {found.cause.value}"
        return f"on {_source_name(scene)}, {found.line}"


def _source_name(scene: Scene) -> str:
    from coneskin.scene.tables.source_tables import source_label

    assert scene.source is not None
    return source_label(scene.source)
