"""Doubts about the place of a touch, in words for people; the place is certain where there is none."""

from __future__ import annotations

__all__ = ["CONTRADICTS", "MOVES", "WEAK"]

WEAK = "it presses too lightly for a place"  #: below the level from which places are told
CONTRADICTS = "the guides of a phase differ too much for one contact"  #: the frame itself
MOVES = "it has only begun, or moves"  #: the place is not that of the frame before
