"""Table of the fault campaign: a line for each kind."""

from __future__ import annotations

from typing import Any

from bench.report import head, quantile, show

from .kind import FaultKind
from .setup import Outcome
from .verdict import budget_of


def summary(kind: FaultKind, control: str, outcomes: list[Outcome], slack: float) -> dict[str, Any]:
    """Return one line of the table [s]."""
    times = [outcome.seconds for outcome in outcomes if outcome.seconds is not None]
    pushed = [outcome.pushed_in for outcome in outcomes if outcome.pushed_in is not None]
    failures = [line for outcome in outcomes for line in outcome.failures]
    return {
        "kind": kind.name,
        "control": control,
        "count": len(outcomes),
        "median": round(quantile(times, 0.5), 4) if times else None,
        "worst": round(max(times), 4) if times else None,
        "pushed_in_mm": None if not pushed else round(1e3 * max(pushed), 1),
        "budget": None if kind.before else round(budget_of(kind, slack), 3),
        "repeated": sum(outcome.repeated for outcome in outcomes),
        "discarded": [line for outcome in outcomes for line in outcome.discarded][:3],
        "held_up": round(max(outcome.held_up for outcome in outcomes), 4),
        "failed": sum(bool(outcome.failures) for outcome in outcomes),
        "failures": list(dict.fromkeys(failures)),
        "said": next((outcome.why for outcome in outcomes if outcome.why), ""),
    }


def show_kinds(lines: list[dict[str, Any]], parallel: int, slack_ms: float) -> None:
    """Show a row for each kind, and print what failed."""

    def cell(line: dict[str, Any], key: str, digits: int = 3) -> str:
        return f"{line[key]:.{digits}f}" if line[key] is not None else "-"

    print(f"{head()}\n{parallel} at a time; budgets with {slack_ms:g} ms for this machine")
    rows = []
    for line in lines:
        times = [cell(line, key) for key in ("median", "worst", "budget")]
        pushed = [cell(line, "pushed_in_mm", 1), cell(line, "held_up")]
        rows.append([f"{line['kind']} [{line['control']}]", line["count"], *times, *pushed, line["failed"]])
    columns = ["kind", "count", "median", "worst", "budget", "pushed", "held up", "failed"]
    show("s from the fault to standstill; pushed: mm towards a touch beyond a bare stop, the worst", columns, rows)
    for line in lines:
        if line["repeated"]:
            words = "failed trials: the machine held them up, or nothing moved that a fault could stop"
            print(f"{line['kind']}: repeated {line['repeated']} {words}")
        for failure in line["failures"][:5]:
            print(f"{line['kind']}: FAILED: {failure}")
