"""Failures of bench/ur_clients.py that are explained: whose fault each is, and the evidence."""

from __future__ import annotations

from ur_clients_urcl import Trial

#: words of a test's name -> whose fault its failure is, and the evidence
EXPLAINED: dict[str, str] = {}


def explain(trial: Trial) -> str:
    """Return whose fault a failure is, and the evidence; empty where that is not known."""
    return next((why for words, why in EXPLAINED.items() if words in f"{trial.client} {trial.test}"), "")
