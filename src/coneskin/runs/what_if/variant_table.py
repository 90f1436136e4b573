"""Table of variants over many runs: touches missed, false alarms and delay of each."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from coneskin.core.text import finite
from coneskin.runs.export.parquet_file import write_parquet


class VariantScore(NamedTuple):
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
        delay: median of the runs' median delays [s]; NaN without any. Runs of which nobody knows what touched them
            count where there are no others.
        worst_delay: the largest [s].
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
    delay: float
    worst_delay: float
    hours: float

    def facts(self) -> dict[str, Any]:
        """Return the score as values for JSON, with units in the names."""
        facts = self._asdict()
        delays = {"delay_median_ms": 1e3 * facts.pop("delay"), "delay_max_ms": 1e3 * facts.pop("worst_delay")}
        return {**facts, **finite(delays)}


def score_variants(rows: Sequence[Mapping[str, Any]]) -> list[VariantScore]:
    """Return the score of each variant in the rows of ``judge_runs``, in their order."""
    scores = []
    for variant in dict.fromkeys(row["variant"] for row in rows):
        mine = [row for row in rows if row["variant"] == variant]
        good = [row for row in mine if not row["error"]]
        # against a recorded contact, a delay is by how much another variant differs from what was recorded
        known = [row for row in good if row["truth"] != "recorded"] or good
        delays = [row["delay_median_ms"] for row in known if row["delay_median_ms"] is not None]
        worst = [row["delay_max_ms"] for row in known if row["delay_max_ms"] is not None]
        scores.append(
            VariantScore(
                variant,
                len(good),
                len(mine) - len(good),
                sum(not row["same"] for row in good),
                sum(row["touches"] for row in good),
                sum(row["missed"] for row in good),
                sum(row["false_alarms"] for row in good),
                sum(row["unlabeled"] for row in good),
                1e-3 * statistics.median(delays) if delays else math.nan,
                1e-3 * max(worst) if worst else math.nan,
                sum(row["duration_s"] for row in good) / 3600.0,
            )
        )
    return scores


def variant_lines(scores: Sequence[VariantScore]) -> list[str]:
    """Return the table in lines."""
    shared, names = shared_settings([score.variant for score in scores])
    width = max([7, *map(len, names)])
    lines = [f"all with {', '.join(shared)}"] if shared else []
    lines.append(
        f"{'variant':{width}}  runs  broken  changed  touches  missed  false alarms  unlabeled  delay (median)  (worst)"
    )
    for name, s in zip(names, scores, strict=True):
        lines.append(
            f"{name:{width}}  {s.runs:4}  {s.broken:6}  {s.changed:7}  {s.touches:7}  {s.missed:6}  "
            f"{s.false_alarms:12}  {s.unlabeled:9}  {_ms(s.delay):>14}  {_ms(s.worst_delay):>7}"
        )
    return lines


def shared_settings(variants: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the settings that all variants share, and the name of each without them."""
    settings = [variant.split(", ") for variant in variants]
    shared = [one for one in settings[0] if all(one in other for other in settings)] if len(settings) > 1 else []
    names = [", ".join(one for one in own if one not in shared) or "without more" for own in settings]
    return shared, names


def write_rows(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write the rows of ``judge_runs`` as a Parquet file; errors as of ``write_parquet``."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    write_parquet(path, [{name: [row.get(name) for row in rows] for name in names}])


def _ms(seconds: float) -> str:
    return "-" if math.isnan(seconds) else f"{1e3 * seconds:.1f} ms"
