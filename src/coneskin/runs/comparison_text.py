"""Comparison of runs as lines for people, and as facts for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .comparison import Comparison

__all__ = ["comparison_facts", "comparison_lines"]


def comparison_lines(comparison: Comparison, most: int = 40) -> list[str]:
    """Return a comparison in lines; at most so many differences are listed."""
    one, other = comparison.labels
    lines = [f"{one} -> {other}", *(f"  {what}" for what in comparison.other_code)]
    lines += [f"  {difference}" for difference in comparison.differences[:most]]
    if (more := len(comparison.differences) - most) > 0:
        lines.append(f"  ... and {more} more")
    if comparison.diverged is not None:
        left_out = _count(comparison.not_compared, "event")
        lines.append(
            f"  from {comparison.diverged:.4f} s on the arm is commanded otherwise: its motion in the recording is no "
            f"longer that of {other}; {left_out} about the arm not compared"
        )
    if comparison.until is not None:
        lines.append(f"  compared up to {comparison.until:.4f} s only: {comparison.lost}")
    elif comparison.lost:
        lines.append(f"  the recording is not whole: {comparison.lost}")
    return [*lines, f"  {_verdict(comparison)}"]


def comparison_facts(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison as values for JSON, with units in the names."""
    return {
        "labels": list(comparison.labels),
        "same": comparison.same,
        "paired": comparison.paired,
        "new": comparison.new,
        "missing": comparison.missing,
        "moved_mm": 1e3 * comparison.farthest,
        "diverged_s": comparison.diverged,
        "not_compared": comparison.not_compared,
        "compared_until_s": comparison.until,
        "lost": comparison.lost or None,
        "other_code": list(comparison.other_code),
        "differences": [
            {
                "subject": difference.subject,
                "words": list(difference.words),
                "moved_mm": None if difference.moved is None else 1e3 * difference.moved,
                "delay_ms": None if difference.delay is None else 1e3 * difference.delay,
            }
            for difference in comparison.differences
        ],
    }


def _verdict(comparison: Comparison) -> str:
    if comparison.same:
        return f"the same within the tolerances: {_count(comparison.paired, 'event')}"
    if not (comparison.paired or comparison.differences):
        return "there is nothing to compare: no event on either side"
    parts = [f"{_count(comparison.paired, 'event')} in pairs"]
    parts += [f"{count} {word}" for count, word in ((comparison.new, "new"), (comparison.missing, "missing")) if count]
    if comparison.farthest:
        parts.append(f"contacts moved by up to {1e3 * comparison.farthest:.2f} mm")
    delays = [d.delay for d in comparison.differences if d.delay is not None]
    if delays:
        parts.append(_delays(delays))
    return ("NOT the same: " if comparison.differences else "") + ", ".join(parts)


def _delays(delays: Sequence[float]) -> str:
    worst = max(delays, key=abs)
    return f"up to {1e3 * abs(worst):.1f} ms {'later' if worst > 0.0 else 'earlier'}"


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"
