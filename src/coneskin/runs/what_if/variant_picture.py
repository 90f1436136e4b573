"""Picture of variants: detection delay against false alarms, so that a threshold is chosen and not guessed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import RecordingError
from coneskin.core.picture_file import write_picture

from .variant_table import VariantScore, shared_settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LINE_HEIGHT = 0.19  # inch of a line of the key
_MIN_DELAY_SCALE = 1.0  # ms that the scale of the delays shows at least, above the largest


def draw_variants(scores: Sequence[VariantScore], path: Path) -> None:
    """Draw the variants into a file, in the format of its suffix.

    Raises:
        MissingExtra: matplotlib is not installed.
        RecordingError: the suffix is another, or the file cannot be written.
    """
    write_picture(path, "the picture of variants", lambda: _compose(scores), RecordingError)


def _compose(scores: Sequence[VariantScore]) -> Figure:
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    shared, names = shared_settings([score.variant for score in scores])
    drawn = [score for score in scores if not math.isnan(score.delay)]
    differ = len({_place(score) for score in drawn}) > 1  # one dot alone would say less than its numbers
    figure = Figure(figsize=(8.0, (4.6 if differ else 0.6) + _LINE_HEIGHT * len(scores)), layout="constrained")
    key = []
    for number, (score, name) in enumerate(zip(scores, names, strict=True), 1):
        seen = not math.isnan(score.delay)
        colour, marker = _look(score)
        said = (
            f"{score.missed} of {score.touches} touches missed" if score.missed else f"all {score.touches} touches seen"
        )
        words = f"{number}: {name}: {said}, {score.false_alarms} false alarm{'s'[: score.false_alarms != 1]}"
        words += f", {score.unlabeled} unlabeled" if score.unlabeled else ""
        words += f", delay {1e3 * score.delay:.1f} ms" if seen else "; not drawn, for it has no delay"
        if score.runs == 0:
            words, colour, marker = f"{number}: {name}: no run could be judged with it", "0.5", "x"
        key.append(Line2D([], [], color=colour, marker=marker, ls="", label=words))
    figure.legend(handles=key, loc="outside lower left", handlelength=1.0)
    runs = max((s.runs for s in scores), default=0)
    time = _duration_words(max((s.hours for s in scores), default=0.0))
    title = (
        f"{runs} run{'s'[: runs != 1]}"
        + ("" if differ else f", {time}")
        + (f", all with {', '.join(shared)}" if shared else "")
    )
    figure.suptitle(title, fontsize=9, x=0.02, ha="left", wrap=True)
    if differ:
        _draw_places(figure.add_subplot(), scores, time)
    return figure


def _duration_words(hours: float) -> str:
    """Return a duration [h] in the unit in which it is short."""
    if hours < 1.0 / 60.0:
        return f"{3600.0 * hours:.3g} s"
    return f"{60.0 * hours:.3g} min" if hours < 1.0 else f"{hours:.3g} h"


def _place(score: VariantScore) -> tuple[float, float]:
    """Return where a variant is drawn: false alarms and unlabeled contacts, delay [ms]."""
    return score.false_alarms + score.unlabeled, 1e3 * score.delay


def _look(score: VariantScore) -> tuple[str, str]:
    return ("#D55E00", "x") if score.missed > 0 else ("#0072B2", "o")


def _draw_places(axes: Any, scores: Sequence[VariantScore], time: str) -> None:
    from matplotlib.ticker import MaxNLocator

    places = {number: _place(score) for number, score in enumerate(scores, 1) if not math.isnan(score.delay)}
    axes.plot(*zip(*places.values(), strict=True), color="0.7", lw=1.0, zorder=1)
    for number, at in places.items():
        colour, marker = _look(scores[number - 1])
        axes.scatter(*at, color=colour, marker=marker, zorder=2)
        same = [str(other) for other, place in places.items() if place == at]
        if same[0] == str(number):  # one text for a point, or they would lie on each other
            axes.annotate(", ".join(same), at, xytext=(6, 6), textcoords="offset points", fontsize=9)
    axes.set_xlabel(f"false alarms and unlabeled contacts in {time}")
    axes.set_ylabel("delay of the detection, median [ms]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    counts, delays = zip(*places.values(), strict=True)
    axes.set_xlim(-0.5, max(counts) + 0.5 + 0.05 * len(places))
    axes.set_ylim(min(0.0, *delays), max(delays) + max(_MIN_DELAY_SCALE, 0.15 * (max(delays) - min(delays))))
    axes.grid()
