"""Variants over many runs: touches missed, false alarms and delay of each, as a table and as a picture.

The picture has the delays against the false alarms, so that a threshold is chosen and not guessed.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from coneskin.core.errors import RecordingError
from coneskin.core.picture_file import write_picture
from coneskin.runs.export.tables import write_parquet


class _VariantScore(NamedTuple):
    """Score of one variant over all runs.

    Attributes:
        variant: its name.
        runs: that could be judged.
        broken: that could not.
        changed: runs whose decisions differ from the recorded ones.
        touches: that there were.
        missed: of them.
        false_alarms: contacts without a touch, in runs of which someone knows what touched them.
        unlabeled: contacts beyond the recorded ones in other runs, touches or false alarms.
        delay_median_ms: median of the runs' median delays; NaN without any. Runs of which nobody knows what touched
            them count where there are no others.
        delay_max_ms: the largest.
        hours: of the recordings [h].
    """

    variant: str
    runs: int
    broken: int
    changed: int
    touches: int
    missed: int
    false_alarms: int
    unlabeled: int
    delay_median_ms: float
    delay_max_ms: float
    hours: float


def score_variants(rows: Sequence[Mapping[str, Any]]) -> list[_VariantScore]:
    """Return the score of each variant in the rows of ``judge_runs``, in their order."""
    scores = []
    for variant in dict.fromkeys(row["variant"] for row in rows):
        mine = [row for row in rows if row["variant"] == variant]
        good = [row for row in mine if not row["error"]]
        # against a recorded contact, a delay is by how much another variant differs from what was recorded
        known = [row for row in good if row["truth"] != "recorded"] or good
        delays = [row["delay_median_ms"] for row in known if row["delay_median_ms"] is not None]
        worst = [row["delay_max_ms"] for row in known if row["delay_max_ms"] is not None]
        changed = sum(not row["same"] for row in good)
        sums = [sum(row[name] for row in good) for name in ("touches", "missed", "false_alarms", "unlabeled")]
        median = statistics.median(delays) if delays else math.nan
        hours = sum(row["duration_s"] for row in good) / 3600.0
        facts = (variant, len(good), len(mine) - len(good), changed, *sums, median, max(worst, default=math.nan), hours)
        scores.append(_VariantScore._make(facts))
    return scores


def variant_lines(scores: Sequence[_VariantScore]) -> list[str]:
    """Return the table in lines."""
    shared, names = _shared_settings([score.variant for score in scores])
    width = max([7, *map(len, names)])
    lines = [f"all with {', '.join(shared)}"] if shared else []
    lines.append(
        f"{'variant':{width}}  runs  broken  changed  touches  missed  false alarms  unlabeled  delay (median)  (worst)"
    )
    for name, s in zip(names, scores, strict=True):
        lines.append(
            f"{name:{width}}  {s.runs:4}  {s.broken:6}  {s.changed:7}  {s.touches:7}  {s.missed:6}  "
            f"{s.false_alarms:12}  {s.unlabeled:9}  {_ms(s.delay_median_ms):>14}  {_ms(s.delay_max_ms):>7}"
        )
    return lines


def _shared_settings(variants: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the settings that all variants share, and the name of each without them."""
    settings = [variant.split(", ") for variant in variants]
    shared = [one for one in settings[0] if all(one in other for other in settings)] if len(settings) > 1 else []
    names = [", ".join(one for one in own if one not in shared) or "without more" for own in settings]
    return shared, names


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write the rows of ``judge_runs`` as a Parquet file; errors as of ``write_parquet``."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    write_parquet(path, [{name: [row.get(name) for row in rows] for name in names}])


def _ms(delay: float) -> str:
    return "-" if math.isnan(delay) else f"{delay:.1f} ms"


_LINE_HEIGHT = 0.19  # inch of a line of the key
_MIN_DELAY_SCALE = 1.0  # ms that the scale of the delays shows at least, above the largest


def draw_variants(scores: Sequence[_VariantScore], path: Path) -> None:
    """Draw the variants into a file, in the format of its suffix.

    Raises:
        MissingExtra: matplotlib is not installed.
        RecordingError: the suffix is another, or the file cannot be written.
    """
    write_picture(path, "the picture of variants", lambda figure: _compose(figure, scores), RecordingError)


def _compose(figure: Any, scores: Sequence[_VariantScore]) -> None:
    from matplotlib.lines import Line2D

    shared, names = _shared_settings([score.variant for score in scores])
    drawn = [score for score in scores if not math.isnan(score.delay_median_ms)]
    differ = len({_place(score) for score in drawn}) > 1  # one dot alone would say less than its numbers
    figure.set_size_inches(8.0, (4.6 if differ else 0.6) + _LINE_HEIGHT * len(scores))
    key = []
    for number, (score, name) in enumerate(zip(scores, names, strict=True), 1):
        seen = not math.isnan(score.delay_median_ms)
        colour, marker = _look(score)
        said = (
            f"{score.missed} of {score.touches} touches missed" if score.missed else f"all {score.touches} touches seen"
        )
        words = f"{number}: {name}: {said}, {score.false_alarms} false alarm{'s'[: score.false_alarms != 1]}"
        words += f", {score.unlabeled} unlabeled" if score.unlabeled else ""
        words += f", delay {score.delay_median_ms:.1f} ms" if seen else "; not drawn, for it has no delay"
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


def _duration_words(hours: float) -> str:
    """Return a duration [h] in the unit in which it is short."""
    if hours < 1.0 / 60.0:
        return f"{3600.0 * hours:.3g} s"
    return f"{60.0 * hours:.3g} min" if hours < 1.0 else f"{hours:.3g} h"


def _place(score: _VariantScore) -> tuple[float, float]:
    """Return where a variant is drawn: false alarms and unlabeled contacts, delay [ms]."""
    return score.false_alarms + score.unlabeled, score.delay_median_ms


def _look(score: _VariantScore) -> tuple[str, str]:
    return ("#D55E00", "x") if score.missed > 0 else ("#0072B2", "o")


def _draw_places(axes: Any, scores: Sequence[_VariantScore], time: str) -> None:
    from matplotlib.ticker import MaxNLocator

    places = {number: _place(score) for number, score in enumerate(scores, 1) if not math.isnan(score.delay_median_ms)}
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
