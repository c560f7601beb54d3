"""Small faults to plant in Python source: what can be changed in a file, a seeded sample of it, and the changed text.

A fault is the kind of slip that a person makes: `<` for `<=`, plus for minus, one more, `and` for `or`, two branches
swapped, a statement forgotten. Messages, types, docstrings and decorators are left alone: no test need know them.
"""

from __future__ import annotations

import ast
import copy
import random
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

COMPARISONS: Final[dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.GtE),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.LtE),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATORS: Final[dict[type[ast.operator], type[ast.operator]]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}
TWINS: Final = {
    **{"min": "max", "max": "min", "any": "all", "all": "any", "sin": "cos", "cos": "sin"},
    **{"floor": "ceil", "ceil": "floor", "minimum": "maximum", "maximum": "minimum", "argmin": "argmax"},
}
"""Functions that are taken for each other."""
UNSEEN: Final = ("hint", "strict", "stacklevel", "encoding", "exist_ok", "parents", "missing_ok")
"""Keywords whose values no behaviour shows."""


@dataclass(frozen=True)
class Fault:
    """One change of a file."""

    line: int
    """From 1."""
    span: tuple[int, int]
    """Of the text that is replaced, in characters."""
    before: str
    after: str

    def plant(self, source: str) -> str:
        """The source with the fault."""
        start, end = self.span
        assert source[start:end] == self.before
        return source[:start] + self.after + source[end:]


def faults_of(source: str) -> list[Fault]:
    """Everything that can be planted in a file, from its beginning to its end."""
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))

    def place(line: int, column: int) -> int:
        return starts[line - 1] + len(lines[line - 1].encode()[:column].decode())

    found = []
    for node, changed in _changes(ast.parse(source)):
        assert isinstance(node, ast.expr | ast.stmt)
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        span = place(node.lineno, node.col_offset), place(node.end_lineno, node.end_col_offset)
        text = ast.unparse(ast.fix_missing_locations(changed))
        before = source[slice(*span)]
        after = text if isinstance(node, ast.stmt) else f"({text})"
        if ast.dump(ast.parse(after.strip())) != ast.dump(ast.parse(ast.unparse(node))):
            found.append(Fault(node.lineno, span, before, after))
    return found


def sample(source: str, number: int, *, seed: str) -> list[Fault]:
    """So many of a file's faults by chance, in the order of the file; of each place one at most."""
    places: dict[tuple[int, int], list[Fault]] = {}
    for fault in faults_of(source):
        places.setdefault(fault.span, []).append(fault)
    chance = random.Random(seed)
    chosen = chance.sample(sorted(places), min(number, len(places)))
    return [chance.choice(places[span]) for span in sorted(chosen)]


def _changes(tree: ast.Module) -> Iterator[tuple[ast.AST, ast.AST]]:
    for node in _visible(tree):
        for change in _expression(node) if isinstance(node, ast.expr) else _statement(node):
            yield node, change


def _visible(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes whose change behaviour can show."""
    skipped: list[ast.AST] = []
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        skipped += node.decorator_list
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.returns is not None:
        skipped.append(node.returns)
    if isinstance(node, ast.arg | ast.AnnAssign) and node.annotation is not None:
        skipped.append(node.annotation)
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        return
    for child in ast.iter_child_nodes(node):
        is_text = isinstance(child, ast.JoinedStr | ast.Raise | ast.Assert | ast.Import | ast.ImportFrom)
        is_unseen = isinstance(child, ast.keyword) and child.arg in UNSEEN
        if child in skipped or is_text or is_unseen:
            continue
        yield child
        yield from _visible(child)


def _expression(node: ast.expr) -> Iterator[ast.AST]:
    def with_(**values: object) -> ast.AST:
        changed = copy.deepcopy(node)
        for name, value in values.items():
            setattr(changed, name, value)
        return changed

    match node:
        case ast.Compare(ops=[operator]):
            for other in COMPARISONS[type(operator)]:
                yield with_(ops=[other()])
        case ast.BinOp(op=operator) if type(operator) in OPERATORS and not _is_sequence(node.left):
            yield with_(op=OPERATORS[type(operator)]())
        case ast.BoolOp(op=ast.And()):
            yield with_(op=ast.Or())
        case ast.BoolOp(op=ast.Or()):
            yield with_(op=ast.And())
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert()):
            yield node.operand
        case ast.IfExp():
            yield with_(body=node.orelse, orelse=node.body)
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield ast.Constant(2.0 * value if value else 1.0)
        case ast.Name(id=name) if name in TWINS:
            yield with_(id=TWINS[name])
        case ast.Attribute(attr=name) if name in TWINS:
            yield with_(attr=TWINS[name])


def _statement(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Break() | ast.Continue():
            yield ast.Pass()
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
            yield ast.Pass()
        case ast.Return(value=ast.expr() as value) if not isinstance(value, ast.Constant):
            yield ast.Return(value=ast.Constant(None))


def _is_sequence(node: ast.expr) -> bool:
    return isinstance(node, ast.List | ast.Tuple) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
