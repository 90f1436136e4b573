"""Kinematics of one link of one arm as straight-line Python, generated once and run in every control cycle.

Terms that are zero and factors that are one in the arm's DH table are left out, loops are unrolled, and every value is
a local float: three to eight times faster than `kinematics` and `damped_least_squares`, which are the readable form of
the same and the reference of its tests. The generated text is in ``CompiledLink.source``.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from coneskin.core.errors import KinematicsError

from .damped_least_squares import DAMPING_FLOOR, SINGULAR_BELOW, SINGULAR_DAMPING
from .kinematics import JOINTS, cos_sin
from .model import ArmModel

#: number known when the text is written, or name of a local variable, perhaps with a minus sign
_Atom = float | str
_Triple = tuple[_Atom, _Atom, _Atom]


@dataclass(frozen=True, slots=True)
class CompiledLink:
    """Functions of floats for points that are fixed on one link of one arm.

    Attributes:
        link: the link, 1 to 6.
        place: (q0 .. q5, x, y, z, nx, ny, nz) -> point [m] and direction in the base frame (3 + 3), then the Jacobian
            columns of joints 1 .. link [m/rad] (3 each). Point and direction are given in the link's DH frame.
        drive: (q0 .. q5, x, y, z, vx, vy, vz) -> point in the base frame [m] (3), resulting speed along v [m/s],
            square of the damping [m^2], joint speeds of joints 1 .. link [rad/s]. The wanted velocity is in the base
            frame [m/s]; the speed along it is right only if its length is one.
        source: generated text of the two functions.
    """

    link: int
    place: Callable[..., tuple[float, ...]]
    drive: Callable[..., tuple[float, ...]]
    source: str = field(repr=False)


@functools.lru_cache(maxsize=64)
def compile_contact(model: ArmModel, link: int) -> CompiledLink:
    """Generate and compile the functions for one link; about 2 ms the first time, then cached.

    Raises:
        KinematicsError: no joint moves that link, or there is no such link.
    """
    if not 1 <= link <= JOINTS:
        raise KinematicsError(f"link must be 1 (shoulder) to 6 (flange) to be moved by joints, got {link}")
    source = _place_source(model, link) + "\n\n" + _drive_source(model, link)
    scope: dict[str, Callable[..., tuple[float, ...]]] = {}
    exec(compile(source, f"<{model.name} link {link}>", "exec"), scope)
    return CompiledLink(link, scope["place"], scope["drive"], source)


class _Text:
    """Lines of Python in which products and sums that are known are left out."""

    def __init__(self, signature: str) -> None:
        self.lines = ["from math import cos, sin", f"def {signature}:"]

    def add(self, line: str) -> None:
        self.lines.append("    " + line)

    def products(self, name: str, *pairs: tuple[_Atom, _Atom]) -> _Atom:
        """Write a sum of products; return its value if it is known, else the name of the variable that holds it."""
        number, terms = 0.0, []
        for left, right in pairs:
            if isinstance(left, str) and not isinstance(right, str):
                left, right = right, left
            if not isinstance(left, str) and not isinstance(right, str):
                number += left * right
            elif left == 1.0:
                terms.append(str(right))
            elif left == -1.0:
                terms.append(_minus(str(right)))
            elif left != 0.0:
                terms.append(f"{left!r} * {right}" if not isinstance(left, str) else f"{left} * {right}")
        if not terms:
            return number
        if number == 0.0 and len(terms) == 1 and "*" not in terms[0]:
            return terms[0]
        if number != 0.0:
            terms.insert(0, repr(number))
        self.add(f"{name} = " + " + ".join(terms))
        return name

    def turned(self, name: str, u: _Triple, v: _Triple, c: _Atom, s: _Atom) -> tuple[_Triple, _Triple]:
        """Write two axes turned in their own plane from u towards v."""
        minus_s = _minus(s) if isinstance(s, str) else -s
        return (
            self._triple(f"{name}u", *(((c, a), (s, b)) for a, b in zip(u, v, strict=True))),
            self._triple(f"{name}v", *(((minus_s, a), (c, b)) for a, b in zip(u, v, strict=True))),
        )

    def _triple(self, name: str, *components: Sequence[tuple[_Atom, _Atom]]) -> _Triple:
        x, y, z = (self.products(f"{name}{axis}", *pairs) for axis, pairs in zip("xyz", components, strict=True))
        return x, y, z

    def combined(self, name: str, *parts: tuple[_Atom, _Triple]) -> _Triple:
        """Write a sum of factors times vectors."""
        return self._triple(name, *([(factor, vector[k]) for factor, vector in parts] for k in range(3)))

    def __str__(self) -> str:
        return "\n".join(self.lines)


def _minus(atom: str) -> str:
    return atom[1:] if atom.startswith("-") else f"-{atom}"


def _kinematics(text: _Text, model: ArmModel, link: int) -> tuple[_Triple, list[_Triple], tuple[_Triple, ...]]:
    """Write the place of the point (x, y, z), its Jacobian columns, and the axes of the link's frame."""
    x: _Triple = (1.0, 0.0, 0.0)
    y: _Triple = (0.0, 1.0, 0.0)
    z: _Triple = (0.0, 0.0, 1.0)
    o: _Triple = (0.0, 0.0, 0.0)
    axes = []
    for i in range(link):
        axes.append((z, o))
        turn = f"q{i} + {model.theta[i]!r}" if model.theta[i] else f"q{i}"
        text.add(f"c{i} = cos({turn})")
        text.add(f"s{i} = sin({turn})")
        x, y = text.turned(f"a{i}", x, y, f"c{i}", f"s{i}")
        o = text.combined(f"o{i}", (1.0, o), (model.d[i], z), (model.a[i], x))
        y, z = text.turned(f"b{i}", y, z, *cos_sin(model.alpha[i]))
    p = text.combined("p", (1.0, o), ("x", x), ("y", y), ("z", z))
    columns = []
    for i, (axis, origin) in enumerate(axes):
        away = text.combined(f"r{i}", (1.0, p), (-1.0, origin))
        columns.append(
            (
                text.products(f"j{i}x", (axis[1], away[2]), (_opposite(axis[2]), away[1])),
                text.products(f"j{i}y", (axis[2], away[0]), (_opposite(axis[0]), away[2])),
                text.products(f"j{i}z", (axis[0], away[1]), (_opposite(axis[1]), away[0])),
            )
        )
    return p, columns, (x, y, z)


def _opposite(atom: _Atom) -> _Atom:
    return _minus(atom) if isinstance(atom, str) else -atom


def _place_source(model: ArmModel, link: int) -> str:
    text = _Text("place(q0, q1, q2, q3, q4, q5, x, y, z, nx, ny, nz)")
    p, columns, (x, y, z) = _kinematics(text, model, link)
    n = text.combined("m", ("nx", x), ("ny", y), ("nz", z))
    text.add(f"return ({', '.join(str(atom) for triple in (p, n, *columns) for atom in triple)})")
    return str(text)


def _drive_source(model: ArmModel, link: int) -> str:
    text = _Text("drive(q0, q1, q2, q3, q4, q5, x, y, z, vx, vy, vz)")
    p, columns, _ = _kinematics(text, model, link)
    v: _Triple = ("vx", "vy", "vz")
    if link < 3:
        speeds = _solve_in_joints(text, columns, v)
    else:
        speeds = _solve_in_space(text, columns, v)
    text.add(f"return ({', '.join(str(atom) for atom in (*p, 'along', 'damping', *speeds))})")
    return str(text)


def _dot(text: _Text, name: str, a: _Triple, b: _Triple) -> _Atom:
    return text.products(name, *zip(a, b, strict=True))


def _solve_in_joints(text: _Text, columns: list[_Triple], v: _Triple) -> list[str]:
    """Write the solution of (J^T J + damping) qd = J^T v, for one or two joints."""
    g = [_dot(text, f"g{i}", column, v) for i, column in enumerate(columns)]
    a = _dot(text, "m0", columns[0], columns[0])
    if len(columns) == 1:
        text.add(f"smallest = {a} + {DAMPING_FLOOR!r}")
        _write_damping(text)
        text.add(f"w0 = {g[0]} / ({a} + damping)")
        text.add(f"along = {g[0]} * w0")
        return ["w0"]
    b, ab = _dot(text, "m1", columns[1], columns[1]), _dot(text, "m01", columns[0], columns[1])
    text.add(f"fa = {a} + {DAMPING_FLOOR!r}")
    text.add(f"fb = {b} + {DAMPING_FLOOR!r}")
    text.add(f"smallest = (fa * fb - {ab} * {ab}) / (fa + fb)")
    _write_damping(text)
    text.add(f"fa = {a} + damping")
    text.add(f"fb = {b} + damping")
    text.add(f"det = fa * fb - {ab} * {ab}")
    text.add(f"w0 = (fb * {g[0]} - {ab} * {g[1]}) / det")
    text.add(f"w1 = (fa * {g[1]} - {ab} * {g[0]}) / det")
    text.add(f"along = {g[0]} * w0 + {g[1]} * w1")
    return ["w0", "w1"]


def _solve_in_space(text: _Text, columns: list[_Triple], v: _Triple) -> list[str]:
    """Write the solution qd = J^T t with (J J^T + damping) t = v, for three joints or more."""
    for name, i, j in (("xx", 0, 0), ("xy", 0, 1), ("xz", 0, 2), ("yy", 1, 1), ("yz", 1, 2), ("zz", 2, 2)):
        atom = text.products(f"m{name}", *((column[i], column[j]) for column in columns))
        text.add(f"{name} = {atom}" + (f" + {DAMPING_FLOOR!r}" if i == j else ""))
    minors = "kxx = yy * zz - yz * yz; kyy = xx * zz - xz * xz; kzz = xx * yy - xy * xy; "
    minors += "kxy = xz * yz - xy * zz; kxz = xy * yz - xz * yy"
    text.add(minors)
    text.add("smallest = (xx * kxx + xy * kxy + xz * kxz) / (kxx + kyy + kzz)")
    text.add("damping = " + repr(DAMPING_FLOOR))
    text.add(f"if smallest < {SINGULAR_BELOW!r}:")
    text.add(f"    extra = {SINGULAR_DAMPING!r} * (1.0 - smallest / {SINGULAR_BELOW!r}) ** 2")
    text.add(f"    damping = {DAMPING_FLOOR!r} + extra; xx += extra; yy += extra; zz += extra; {minors}")
    text.add("kyz = xy * xz - xx * yz")
    text.add("det = xx * kxx + xy * kxy + xz * kxz")
    for axis, k in (("x", ("kxx", "kxy", "kxz")), ("y", ("kxy", "kyy", "kyz")), ("z", ("kxz", "kyz", "kzz"))):
        text.add(f"t{axis} = ({k[0]} * vx + {k[1]} * vy + {k[2]} * vz) / det")
    # J qd = (J J^T) t = v - damping * t
    text.add("along = " + " + ".join(f"{a} * ({a} - damping * t{axis})" for a, axis in zip(v, "xyz", strict=True)))
    return [str(_dot(text, f"w{i}", column, ("tx", "ty", "tz"))) for i, column in enumerate(columns)]


def _write_damping(text: _Text) -> None:
    text.add(f"damping = {DAMPING_FLOOR!r}")
    text.add(f"if smallest < {SINGULAR_BELOW!r}:")
    text.add(f"    damping += {SINGULAR_DAMPING!r} * (1.0 - smallest / {SINGULAR_BELOW!r}) ** 2")
