"""Reports of one sensor's faults: which it has at present, and which were reported since it was ready last."""

from __future__ import annotations

from .events import SkinEvent, SkinFault
from .fault_diagnosis import DIAGNOSED_FAULTS, FaultDiagnosis
from .frame.faults import Fault

__all__ = ["FaultReports"]


class FaultReports:
    """Faults of one sensor until it is ready again: each is reported once, though they may alternate.

    Args:
        name: of the sensor.
        diagnosis: of its wires; it names a fault by its cause where that is known.

    Attributes:
        present: why the sensor cannot be believed at present, or None.
        reported: those that were.
    """

    __slots__ = ("_diagnosis", "_name", "present", "reported")

    def __init__(self, name: str, diagnosis: FaultDiagnosis) -> None:
        self.present: Fault | None = None
        self.reported: set[Fault | str] = set()
        self._name = name
        self._diagnosis = diagnosis

    def forget(self) -> None:
        """Forget them: the sensor is ready."""
        self.present = None
        self.reported.clear()

    def add(
        self, events: list[SkinEvent], fault: Fault, now: float, clock_us: int, sequence: int, detail: str = ""
    ) -> None:
        """Take a fault, and report it where it was not.

        Args:
            events: take the report.
            fault: what is wrong.
            now: host clock [s].
            clock_us: the device's clock [us].
            sequence: of the frame.
            detail: numbers that belong to it, or the diagnosis in words, which counts as another fault.
        """
        if fault in DIAGNOSED_FAULTS:
            fault = self._diagnosis.rename(fault)
        self.present = fault
        told = detail if detail and detail == self._diagnosis.words else fault
        if told not in self.reported:
            self.reported |= {told, fault}
            events.append(SkinFault(self._name, now, clock_us, sequence, fault, detail))
