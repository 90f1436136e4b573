"""Types of arrays, and read-only arrays for frozen values."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import GeometryError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Complex = NDArray[np.complex128]


def frozen(values: ArrayLike, shape: tuple[int | None, ...], name: str) -> Floats:
    """Copy values into a read-only float64 array and check it.

    Args:
        values: anything that numpy can make an array of.
        shape: the shape required; None where any length will do.
        name: what to call the array in an error.

    Returns:
        a new array that cannot be written to.

    Raises:
        GeometryError: the shape is another, or a value is not finite.
    """
    array = np.array(values, dtype=np.float64)
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = "(" + ", ".join("n" if n is None else str(n) for n in shape) + ")"
        raise GeometryError(f"{name} must have shape {wanted}, got {array.shape}")
    if not np.isfinite(array).all():
        bad = array[~np.isfinite(array)].flat[0]
        raise GeometryError(f"{name} must be finite, got {bad}")
    array.setflags(write=False)
    return array
