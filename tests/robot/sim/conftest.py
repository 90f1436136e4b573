"""Simulated controller without sockets."""

from __future__ import annotations

import pytest

from .program_bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()
