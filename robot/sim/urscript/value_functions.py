"""URScript functions that compute with poses, lists, numbers and texts, and need no controller.

Source: Universal Robots, "The URScript Programming Language", modules urmath and internals (str_at to to_str).
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable
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
    """URScript functions of poses, lists, numbers and texts; places in a text are counted from 0.

    Those of one expression are in `_EXPRESSIONS`.
    """

    def inv(self, m: Any) -> Any:
        """Return the inverse of a pose or of a matrix."""
        if isinstance(m, PoseValue):
            return values_of(pose_of(m).inverse())
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

    def binary_list_to_integer(self, l: Any) -> int:  # noqa: E741 (its name in URScript)
        """Return the number of which a list has the bits, the lowest first."""
        if len(l) > 32:
            raise ScriptError(f"a list of at most 32 bits was expected, got {len(l)}")
        value = sum(1 << place for place, bit in enumerate(l) if bit)
        return value - (1 << 32) if value >= 1 << 31 else value

    def make_list(self, length: int, initial_value: Any, capacity: int = 0) -> Array:
        """Return a list of a value, which may grow to a capacity."""
        if not 0 <= int(length) <= MAX_ITEMS or int(capacity) > MAX_ITEMS:
            raise ScriptError(f"a list has at most {MAX_ITEMS} elements, got {show(length)} and {show(capacity)}")
        return make_list([initial_value] * int(length), max(int(length), int(capacity)))

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


def _turn(pose: Any) -> Pose:
    return Pose.from_rotation_vector(pose[3:])


def _moved(first: Any, second: Any, sign: int, turn: Pose) -> PoseValue:
    """Return a position moved by another, or back by it, with a rotation."""
    return PoseValue((*(a + sign * b for a, b in zip(first[:3], second[:3], strict=True)), *turn.rotation_vector))


def _pose_sub(first: Any, second: Any) -> PoseValue:
    return _moved(first, second, -1, _turn(first) @ _turn(second).inverse())


#: function of one expression -> what it returns
_EXPRESSIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(math, name) for name in ("sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2")},
    **{name: getattr(math, name) for name in ("floor", "ceil", "pow")},
    "d2r": lambda degrees: math.radians(degrees),
    "r2d": lambda radians: math.degrees(radians),
    "log": lambda b, n: math.log(n) / math.log(b),
    "random": random.Random(0).random,  # each controller has the same sequence
    # both rotations of pose_add and pose_sub are in the base frame
    "pose_add": lambda first, second: _moved(first, second, 1, _turn(first) @ _turn(second)),
    "pose_sub": _pose_sub,
    "pose_dist": lambda p_from, p_to: math.hypot(*_pose_sub(p_to, p_from)),  # rotation vector [rad] and all
    "pose_trans": lambda first, second: values_of(pose_of(first) @ pose_of(second)),
    "pose_inv": lambda pose: values_of(pose_of(pose).inverse()),
    "point_dist": lambda p_from, p_to: math.dist(p_from[:3], p_to[:3]),
    "rotvec2rpy": lambda rotation_vector: Array(Pose.from_rotation_vector(rotation_vector).rpy),
    "rpy2rotvec": lambda rpy_vector: Array(Pose.from_xyz_rpy(rpy=rpy_vector).rotation_vector),
    **dict.fromkeys(("length", "get_list_length", "size"), lambda values: len(values)),
    "norm": lambda values: math.hypot(*values) if isinstance(values, list) else abs(values),
    "normalize": lambda v: Array(value / math.hypot(*v) for value in v),
    "integer_to_binary_list": lambda x: Array(bool(int(x) >> place & 1) for place in range(32)),
    "str_empty": lambda str: not _text(str),
    "str_find": lambda src, target, start_from=0: _text(src).find(_text(target), _place(start_from, len(_text(src)))),
    "str_len": lambda str: len(_text(str)),
    "to_str": lambda val: text_of(val),
}


def named(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a function without a name the one by which a program calls it, and by which its errors call it."""
    if getattr(function, "__name__", "") == "<lambda>":
        function.__qualname__ = function.__name__ = name
    return function


for _name, _function in _EXPRESSIONS.items():
    setattr(ValueFunctions, _name, staticmethod(named(_name, _function)))


MAX_LINE = 1023  #: characters that str_cat, to_str and a read of a socket make
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
