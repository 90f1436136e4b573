"""Contradictions of single frames: contacts that come or go between the phases, told from faults by their number."""

from __future__ import annotations

from .frame.faults import Fault

__all__ = ["Contradictions"]

#: Faults that a contact produces when it changes between the phases of one frame; over the seam it looks like a short.
_OF_CONTACTS = frozenset(
    {
        *(Fault.GUIDE_DRIVEN, Fault.OUT_OF_RANGE, Fault.GUIDES_DISAGREE, Fault.LEAK),
        *(Fault.SHORT_UPPER, Fault.SHORT_LOWER),
    }
)
_MAX_CONTRADICTIONS = 2.5  # frames; the fourth in a row is a fault, three may be a contact that closes slowly
_CONTRADICTION_DECAY = 0.1  # frames; each good frame takes so many off the count


class Contradictions:
    """The contradictory frames of one sensor.

    Attributes:
        count: of those that were taken for a change of contact, less what good frames have taken off.
    """

    __slots__ = ("count",)

    def __init__(self) -> None:
        self.count = 0.0

    def is_change(self, fault: Fault) -> bool:
        """Tell whether a fault may be a contact that came or went between the phases of this one frame.

        The phases are measured one after the other, so such a frame contradicts itself. A few frames later the contact
        rests, or has passed the threshold; if they go on, or come more often than now and then, it is a fault.

        Args:
            fault: of the frame.
        """
        if fault not in _OF_CONTACTS or self.count > _MAX_CONTRADICTIONS:
            return False
        self.count += 1.0
        return True

    def forget(self) -> None:
        """Take a good frame."""
        self.count = max(0.0, self.count - _CONTRADICTION_DECAY)
