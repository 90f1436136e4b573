"""Ports of the guard's loop: every connection that it has, to processes, skin and controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from coneskin.core.channel import Channel
from coneskin.robot.driver.protocol import HeartbeatWriter, PayloadReader, SetpointWriter, SpeedSlider, StopConnections
from coneskin.skin.sources.source import Source, SourceReopening

__all__ = ["GuardPorts"]


@dataclass(slots=True)
class GuardPorts:
    """Connections of the loop; None for what the scene does not have.

    Attributes:
        session: the process that records and shows.
        source: of the skin's bytes, open.
        reader: of the controller's state, open.
        driver: the driver process, where it moves the arm.
        stops: connections for stops that do not need the driver process, open.
        slider: of the controller's speed, open.
        watchdog: the guard watchdog, where another program moves the arm.
        heartbeat: writer of the count that the controller's own watchdog waits for, open.
        setpoints: the reader once more, where it carries setpoints.
        reopen: begins to open a source that is gone again; None where it is gone for good.
        absent: connection of a stop path that the guard does without -> why.
    """

    session: Channel
    source: Source | None
    reader: PayloadReader | None = None
    driver: Channel | None = None
    stops: StopConnections | None = None
    slider: SpeedSlider | None = None
    watchdog: Channel | None = None
    heartbeat: HeartbeatWriter | None = None
    setpoints: SetpointWriter | None = None
    reopen: Callable[[Source], SourceReopening] | None = None
    absent: Mapping[str, str] = field(default_factory=dict)
