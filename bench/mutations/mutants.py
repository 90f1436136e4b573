"""Mutants of the product: one comparison, operator, condition or number of a file changed, at random."""

from __future__ import annotations

import ast
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

_COMPARISONS = {
    ast.Lt: ("<", ">"),
    ast.LtE: ("<=", ">="),
    ast.Gt: (">", "<"),
    ast.GtE: (">=", "<="),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
_ARITHMETIC = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Pow: ("**", "*"),
}


@dataclass(frozen=True)
class Mutant:
    """One change of one file.

    Attributes:
        file: its path in the repository.
        line: of the change, from 1.
        begin: byte at which the change begins.
        before: text that is replaced.
        after: text in its place.
        kind: comparison, arithmetic, logic, condition or number.
    """

    file: str
    line: int
    begin: int
    before: str
    after: str
    kind: str

    def apply(self, source: bytes) -> bytes:
        """Return the source with the change."""
        old = self.before.encode()
        assert source[self.begin : self.begin + len(old)] == old, self
        return source[: self.begin] + self.after.encode() + source[self.begin + len(old) :]


def draw(root: Path, files: Sequence[str], seed: str) -> Mutant:
    """Return a mutant of a random file; a file of twice the size is drawn twice as often."""
    rng = random.Random(seed)
    weights = [(root / file).stat().st_size for file in files]
    while True:
        file = rng.choices(files, weights)[0]
        if found := list(mutants_of(file, (root / file).read_bytes())):
            return rng.choice(found)


def mutants_of(file: str, source: bytes) -> Iterator[Mutant]:
    """Yield all mutants of a file. Strings, annotations, decorators and `__all__` have none."""
    starts = [0]
    for text in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(text))

    def at(line: int, column: int) -> int:
        return starts[line - 1] + column

    def span(node: ast.expr) -> tuple[int, int]:
        return at(node.lineno, node.col_offset), at(node.end_lineno or 0, node.end_col_offset or 0)

    def between(left: ast.expr, right: ast.expr, old: str, new: str, kind: str) -> Iterator[Mutant]:
        begin, end = span(left)[1], span(right)[0]
        found = source[begin:end].find(old.encode())
        if found >= 0 and b"#" not in source[begin:end]:
            begin += found
            yield Mutant(file, source.count(b"\n", 0, begin) + 1, begin, old, new, kind)

    def replaced(node: ast.expr, new: str, kind: str) -> Mutant:
        begin, end = span(node)
        return Mutant(file, node.lineno, begin, source[begin:end].decode(), new, kind)

    for node in _nodes(ast.parse(source)):
        match node:
            case ast.Compare():
                pairs = zip([node.left, *node.comparators], node.ops, node.comparators, strict=False)
                for left, comparison, right in pairs:
                    yield from between(left, right, *_COMPARISONS[type(comparison)], "comparison")
            case ast.BinOp(left=left, right=right) if type(node.op) in _ARITHMETIC and not _is_text(left, right):
                yield from between(left, right, *_ARITHMETIC[type(node.op)], "arithmetic")
            case ast.BoolOp(values=values):
                old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
                yield from between(values[0], values[1], old, new, "logic")
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                begin, end = span(operand)
                yield replaced(node, source[begin:end].decode(), "condition")
            case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
                begin, end = span(test)
                if not isinstance(test, ast.UnaryOp) and b"#" not in source[begin:end] and not _is_typing(test):
                    yield replaced(test, f"(not ({source[begin:end].decode()}))", "condition")
            case ast.Constant(value=value) if isinstance(value, bool):
                yield replaced(node, str(not value), "number")
            case ast.Constant(value=value) if isinstance(value, int):
                yield replaced(node, str(value + 1), "number")
            case ast.Constant(value=value) if isinstance(value, float):
                yield replaced(node, repr(1.5 * value if value else 1.0), "number")


def _nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes that may be changed."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "format_spec") or isinstance(node, ast.JoinedStr):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not _is_list_of_names(child):
                yield from _nodes(child)


def _is_list_of_names(node: ast.AST) -> bool:
    return isinstance(node, ast.Assign) and any(isinstance(x, ast.Name) and x.id == "__all__" for x in node.targets)


def _is_typing(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def _is_text(*operands: ast.expr) -> bool:
    texts = (ast.JoinedStr, ast.List, ast.Tuple)
    return any(
        isinstance(each, texts) or (isinstance(each, ast.Constant) and isinstance(each.value, str | bytes))
        for each in operands
    )
