"""Failures of bench `ur-clients` that are explained: whose fault each is, and the evidence."""

from __future__ import annotations

from .urcl import Trial

#: words of a test's name, or of what it said -> whose fault its failure is, and the evidence
EXPLAINED: dict[str, str] = {
    "Did not receive a valid data packet from robot in 0.5": (
        "The machine's: the client gives up after 0.5 s without a packet (ursecmon.py, wait); beside a load of 14 for "
        "each core the simulator stood still for up to 1.2 s. At half of that load the test passed."
    ),
    "getDataPackage(data_pkg)": (
        "The machine's: the client gives up after 0.1 s without an RTDE packet (ur_driver.cpp, get_packet_timeout_)."
    ),
}


def explain(trial: Trial) -> str:
    """Return whose fault a failure is, and the evidence; empty where that is not known."""
    return next((why for words, why in EXPLAINED.items() if words in f"{trial.client} {trial.test} {trial.why}"), "")
