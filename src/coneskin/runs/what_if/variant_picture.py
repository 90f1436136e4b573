"""Picture of variants: detection delay against false alarms, so that a threshold is chosen and not guessed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from coneskin.core.errors import RecordingError
from coneskin.core.picture_file import write_picture

from .variant_table import VariantScore, duration_words, shared_settings

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_variants"]

_LINE_HEIGHT = 0.19  # inch of a line of the key
_MIN_DELAY_SCALE = 1.0  # ms that the scale of the delays shows at least, to either side


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
    from matplotlib.ticker import MaxNLocator

    shared, names = shared_settings([score.variant for score in scores])
    figure = Figure(figsize=(8.0, 4.6 + _LINE_HEIGHT * len(scores)), layout="constrained")
    axes = figure.add_subplot()
    drawn = [score for score in scores if not math.isnan(score.delay)]
    axes.plot(
        [s.false_alarms + s.unlabeled for s in drawn], [1e3 * s.delay for s in drawn], color="0.7", lw=1.0, zorder=1
    )
    here: dict[tuple[float, float], list[str]] = {}
    key = []
    for number, (score, name) in enumerate(zip(scores, names, strict=True), 1):
        at_x = score.false_alarms + score.unlabeled
        seen, missed = not math.isnan(score.delay), score.missed > 0
        colour, marker = ("tab:red", "x") if missed else ("tab:blue", "o")
        said = f"{score.missed} of {score.touches} touches missed" if missed else f"all {score.touches} touches seen"
        if seen:
            axes.scatter([at_x], [1e3 * score.delay], color=colour, marker=marker, zorder=2)
            here.setdefault((at_x, 1e3 * score.delay), []).append(str(number))
        words = f"{number}: {name}: {said}, {score.false_alarms} false alarm{'s'[: score.false_alarms != 1]}"
        words += f", {score.unlabeled} unlabeled" if score.unlabeled else ""
        words += "" if seen else "; not drawn, for it has no delay"
        if score.runs == 0:
            words, colour, marker = f"{number}: {name}: no run could be judged with it", "0.5", "x"
        key.append(Line2D([], [], color=colour, marker=marker, ls="", label=words))
    for at, numbers in here.items():  # one text for a point, or they would lie on each other
        axes.annotate(", ".join(numbers), at, xytext=(6, 6), textcoords="offset points", fontsize=9)
    figure.legend(handles=key, loc="outside lower left", fontsize=8, frameon=False, handlelength=1.0)
    runs = max((s.runs for s in scores), default=0)
    title = f"{runs} run{'s'[: runs != 1]}" + (f", all with {', '.join(shared)}" if shared else "")
    axes.set_title(title, fontsize=9, loc="left", wrap=True)
    axes.set_xlabel(
        f"false alarms and unlabeled contacts in {duration_words(max((s.hours for s in scores), default=0.0))}"
    )
    axes.set_ylabel("delay of the detection, median [ms]")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    axes.set_xlim(-0.5, max((s.false_alarms + s.unlabeled for s in drawn), default=0) + 0.5 + 0.05 * len(drawn))
    delays = [1e3 * s.delay for s in drawn] or [0.0]
    pad = max(_MIN_DELAY_SCALE, 0.15 * (max(delays) - min(delays)))
    axes.set_ylim(min(delays) - pad, max(delays) + pad)
    axes.grid(alpha=0.3)
    return figure
