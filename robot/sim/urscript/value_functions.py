"""URScript functions that compute with poses, lists, numbers and texts, and need no controller.

Source: Universal Robots, "The URScript Programming Language", modules urmath and internals (str_at to to_str).
"""

from __future__ import annotations

import math
import random
import re
from typing import Any

from coneskin.geometry.pose import Pose

from .values import (
    MAX_ITEMS,
    Array,
    PoseValue,
    ScriptError,
    interpolate,
    is_matrix,
    make_list,
    numbers,
    pose_of,
    show,
    solve_linear,
    values_of,
)


class ValueFunctions:
    """URScript functions of poses, lists, numbers and texts; places in a text are counted from 0."""

    _random = random.Random(0)

    def pose_trans(self, first: Any, second: Any) -> PoseValue:
        """Return one pose after another."""
        return values_of(pose_of(first) @ pose_of(second))

    def pose_inv(self, pose: Any) -> PoseValue:
        """Return the inverse of a pose."""
        return values_of(pose_of(pose).inverse())

    def pose_add(self, first: Any, second: Any) -> PoseValue:
        """Add positions, and turn by one rotation after the other, both in the base frame."""
        turn = Pose.from_rotation_vector(first[3:]) @ Pose.from_rotation_vector(second[3:])
        return PoseValue((*(a + b for a, b in zip(first[:3], second[:3], strict=True)), *turn.rotation_vector))

    def pose_sub(self, first: Any, second: Any) -> PoseValue:
        """Subtract positions, and return the rotation from the second to the first, in the base frame."""
        turn = Pose.from_rotation_vector(first[3:]) @ Pose.from_rotation_vector(second[3:]).inverse()
        return PoseValue((*(a - b for a, b in zip(first[:3], second[:3], strict=True)), *turn.rotation_vector))

    def inv(self, m: Any) -> Any:
        """Return the inverse of a pose or of a matrix."""
        if isinstance(m, PoseValue):
            return self.pose_inv(m)
        if not is_matrix(m) or any(len(row) != len(m) for row in m):
            raise ScriptError(f"inv takes a pose or a square matrix, got {show(m)}")
        units = [[float(i == j) for j in range(len(m))] for i in range(len(m))]
        columns = [solve_linear(m, unit, 1e-12) for unit in units]
        if None in columns:
            raise ScriptError("inv: the matrix is singular")
        return self.transpose(columns)

    def transpose(self, m: Any) -> Array:
        """Return a matrix, a list of rows, with its columns as rows."""
        if not all(isinstance(row, list) for row in m):
            raise ScriptError(f"transpose takes a list of lists, got {show(m)}")
        return Array(map(Array, zip(*m, strict=True)))

    def norm(self, values: Any) -> float:
        """Return the Euclidean length."""
        return math.hypot(*values) if isinstance(values, list) else abs(values)

    def length(self, values: Any) -> int:
        """Return the number of elements."""
        return len(values)

    get_list_length = size = length

    def point_dist(self, p_from: Any, p_to: Any) -> float:
        """Return the distance of two positions [m]."""
        return math.dist(p_from[:3], p_to[:3])

    def pose_dist(self, p_from: Any, p_to: Any) -> float:
        """Return the length of the difference of two poses, positions [m] and rotation vector [rad] together."""
        return math.hypot(*self.pose_sub(p_to, p_from))

    def interpolate_pose(self, p_from: Any, p_to: Any, alpha: float) -> PoseValue:
        """Return a pose on the straight path between two, turning about one axis; alpha is 0 at the first."""
        first, last = pose_of(p_from), pose_of(p_to)
        a, b = first.translation, last.translation
        shift = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
        return values_of(interpolate(first, shift, (first.inverse() @ last).rotation_vector, float(alpha)))

    def wrench_trans(self, T_from_to: Any, w_from: Any) -> Array:
        """Return force [N] and torque [N m] as another frame has them, whose pose in the first one is given."""
        pose, wrench = pose_of(T_from_to), numbers(w_from, 6, "a wrench")
        (x, y, z), (fx, fy, fz) = pose.translation, wrench[:3]
        about = (fy * z - fz * y, fz * x - fx * z, fx * y - fy * x)  # force x place: what the way to the frame adds
        back = Pose(pose.rotation).inverse()
        torque = [a + b for a, b in zip(wrench[3:], about, strict=True)]
        return Array((*back.rotate((fx, fy, fz)), *back.rotate((torque[0], torque[1], torque[2]))))

    def rotvec2rpy(self, rotation_vector: Any) -> Array:
        """Return roll, pitch and yaw [rad] of a rotation vector: about x, then y, then z, all fixed axes."""
        return Array(Pose.from_rotation_vector(rotation_vector).rpy)

    def rpy2rotvec(self, rpy_vector: Any) -> Array:
        """Return the rotation vector [rad] of roll, pitch and yaw."""
        return Array(Pose.from_xyz_rpy(rpy=rpy_vector).rotation_vector)

    def normalize(self, v: Any) -> Array:
        """Return a list of the same direction and of length 1."""
        return Array(value / math.hypot(*v) for value in v)

    def binary_list_to_integer(self, l: Any) -> int:  # noqa: E741 (its name in URScript)
        """Return the number of which a list has the bits, the lowest first."""
        if len(l) > 32:
            raise ScriptError(f"a list of at most 32 bits was expected, got {len(l)}")
        value = sum(1 << place for place, bit in enumerate(l) if bit)
        return value - (1 << 32) if value >= 1 << 31 else value

    def integer_to_binary_list(self, x: int) -> Array:
        """Return the 32 bits of a whole number, the lowest first."""
        return Array(bool(int(x) >> place & 1) for place in range(32))

    def make_list(self, length: int, initial_value: Any, capacity: int = 0) -> Array:
        """Return a list of a value, which may grow to a capacity."""
        if not 0 <= int(length) <= MAX_ITEMS or int(capacity) > MAX_ITEMS:
            raise ScriptError(f"a list has at most {MAX_ITEMS} elements, got {show(length)} and {show(capacity)}")
        return make_list([initial_value] * int(length), max(int(length), int(capacity)))

    def log(self, b: float, n: float) -> float:
        """Return the logarithm of n to the base b."""
        return math.log(n) / math.log(b)

    def random(self) -> float:
        """Return a number from 0 to 1; each controller has the same sequence."""
        return self._random.random()

    def d2r(self, degrees: float) -> float:
        """Convert degrees to radians."""
        return math.radians(degrees)

    def r2d(self, radians: float) -> float:
        """Convert radians to degrees."""
        return math.degrees(radians)

    def str_at(self, src: Any, index: int) -> str:
        """Return the character at a place."""
        text = _text(src)
        return text[_place(index, len(text) - 1)]

    def str_cat(self, op1: Any, op2: Any) -> str:
        """Return two values as one text."""
        text = text_of(op1) + text_of(op2)
        if len(text) > MAX_LINE:
            raise ScriptError(f"str_cat makes at most {MAX_LINE} characters, got {len(text)}")
        return text

    def str_empty(self, str: Any) -> bool:
        """Return whether a text is empty."""
        return not _text(str)

    def str_find(self, src: Any, target: Any, start_from: int = 0) -> int:
        """Return the first place of one text in another; -1 without one."""
        text = _text(src)
        return text.find(_text(target), _place(start_from, len(text)))

    def str_len(self, str: Any) -> int:
        """Return the number of characters."""
        return len(_text(str))

    def str_sub(self, src: Any, index: int, len: int | None = None) -> str:
        """Return a part of a text."""
        text = _text(src)
        start = _place(index, text.__len__())
        return text[start:] if len is None else text[start : start + _place(len, 2**31)]

    def to_num(self, str: Any) -> int | float:
        """Return the number that a text shows: whole where it has no decimals."""
        text = _text(str).strip()
        if _NUMBER_TEXT.fullmatch(text) is None:
            raise ScriptError(f"{show(text)!r} is not a number")
        number = float(text)
        whole = text.lstrip("+-").isdigit() and abs(number) < 2**31
        return int(number) if whole else number

    def to_str(self, val: Any) -> str:
        """Return a value as text."""
        return text_of(val)


for _name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "floor", "ceil", "pow"):
    setattr(ValueFunctions, _name, staticmethod(getattr(math, _name)))


MAX_LINE = 1023  #: characters that str_cat and to_str make
_NUMBER_TEXT = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def text_of(value: Any) -> str:
    """Return a value as str_cat and to_str write it: numbers with up to six decimals, lists and poses in brackets.

    Raises:
        ScriptError: it is no text, number, truth value, list or pose, or makes too long a text.
    """
    text = written(value)
    if len(text) > MAX_LINE:
        raise ScriptError(f"a text made of values has at most {MAX_LINE} characters, got {len(text)}")
    return text


def written(value: Any) -> str:
    """Return a value as text of any length."""
    if isinstance(value, float) and math.isfinite(value):
        return f"{value:.6f}".rstrip("0").removesuffix(".")
    if isinstance(value, str | int | float):
        return str(value)
    if isinstance(value, list):
        return f"{'p' * isinstance(value, PoseValue)}[{', '.join(map(written, value))}]"
    return show(value)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ScriptError(f"expected a text, got {show(value)}")
    return value


def _place(value: Any, last: int) -> int:
    if not isinstance(value, int | float) or value != value or not 0 <= int(value) <= last:
        raise ScriptError(f"a place or a length from 0 to {last} was expected, got {show(value)}")
    return int(value)
