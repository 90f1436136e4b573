"""Examination of a controller: what it is asked to look at; the answers are findings."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["ExaminationScope"]


class ExaminationScope(NamedTuple):
    """What a scene needs of a controller."""

    control: bool  #: a program of ours moves the arm
    slider: bool  #: the guard takes the speed slider
    setpoints: bool  #: the guard moves the arm away although another program moves it
    heartbeat: bool  #: a program on the controller may depend on the guard's heartbeat
