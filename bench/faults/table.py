"""Table of the fault campaign: a line for each kind."""

from __future__ import annotations

from typing import Any

from bench.report import head, quantile

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
        "held_up": round(max(outcome.held_up for outcome in outcomes), 4),
        "failed": sum(bool(outcome.failures) for outcome in outcomes),
        "failures": list(dict.fromkeys(failures)),
        "said": next((outcome.why for outcome in outcomes if outcome.why), ""),
    }


def show(line: dict[str, Any]) -> None:
    """Print one line of the table, and what failed."""

    def cell(key: str, digits: int = 3) -> str:
        return f"{line[key]:8.{digits}f}" if line[key] is not None else f"{'-':>8}"

    name = f"{line['kind']} [{line['control']}]"
    times = "".join(cell(key) for key in ("median", "worst", "budget"))
    print(f"{name:58}{line['count']:6}{times}{cell('pushed_in_mm', 1)}{cell('held_up')}{line['failed']:8}")
    if line["repeated"]:
        print(f"    repeated {line['repeated']} failed trials: the machine held up the virtual skin, or the campaign")
    for failure in line["failures"][:5]:
        print(f"    FAILED: {failure}")


def show_head(parallel: int, slack_ms: float) -> None:
    """Print machine, commit and the names of the columns."""
    print(f"{head()}\n{parallel} at a time; budgets with {slack_ms:g} ms for this machine")
    print("pushed: mm that the surface went towards a touch beyond what a bare stop does, the worst\n")
    columns = "".join(f"{name:>8}" for name in ("median", "worst", "budget", "pushed", "held up", "failed"))
    print(f"{'s from the fault to standstill':58}{'count':>6}{columns}")
