"""Dask cluster that judges runs: machines that see the same files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from coneskin.core.errors import MissingExtra, RecordingError

from .what_if import broken_rows

__all__ = ["judge_on_cluster"]

_CONNECT_TIMEOUT = 30.0  # s


def judge_on_cluster(
    address: str,
    paths: Sequence[Path],
    variants: Sequence[Mapping[str, Any]],
    judge: Callable[[Path, Sequence[Mapping[str, Any]]], list[dict[str, Any]]],
) -> Iterator[tuple[Path, list[dict[str, Any]]]]:
    """Yield each run with its rows, as the workers finish them.

    Args:
        address: of the scheduler, such as "tcp://10.0.0.5:8786".
        paths: of the recordings, as the workers see them.
        variants: settings.
        judge: what is done with a run; a run on which a worker dies three times is a row with its error.

    Raises:
        MissingExtra: distributed is not installed.
        RecordingError: the scheduler cannot be reached.
    """
    try:
        from distributed import Client, as_completed
    except ImportError as exc:
        raise MissingExtra("distributed", "a Dask cluster", "dask") from exc
    try:
        client = Client(address, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as exc:
        raise RecordingError(f"the Dask scheduler {address} cannot be reached: {exc}") from exc
    with client:
        futures = {}
        for number, path in enumerate(paths):
            settings = [dict(one) for one in variants]
            futures[client.submit(judge, path.resolve(), settings, pure=False, key=f"run-{number}-{path}")] = path
        for future in as_completed(futures, loop=client.loop):
            path = futures[future]
            if future.status == "finished":
                yield path, future.result()
            else:
                yield path, broken_rows(path, variants, f"{future.status}: {future.exception()}")
