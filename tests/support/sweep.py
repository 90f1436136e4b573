"""Sweeps: parameters of which the first few run always and the others only in the long run."""

from collections.abc import Iterable
from typing import Any

import pytest


def sweep(cases: Iterable[Any], short: int = 1) -> list[Any]:
    """Return the cases for ``parametrize``, all but the first ``short`` of them marked ``long``."""
    return [case if index < short else _long(case) for index, case in enumerate(cases)]


def _long(case: Any) -> Any:
    return pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.long)
