"""Needs of a guard: what its arm's controller must offer, beside its states and a way to stop it."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["ControllerNeeds"]


@dataclass(frozen=True, slots=True)
class ControllerNeeds:
    """Needs of one guard of the controller; a guard without an arm needs nothing.

    Attributes:
        slider: the speed slider: a reaction, or the limit of the speed, may use it.
        stops_by_slider: the speed slider as a stop path, without which the guard does where another client has it.
        setpoints: a setpoint program: a reaction may move an arm that another program moves.
        heartbeat: a program that counts the guard's heartbeats: True where it must, False where it may, None where no
            other program moves the arm.
    """

    slider: bool = False
    stops_by_slider: bool = False
    setpoints: bool = False
    heartbeat: bool | None = None
