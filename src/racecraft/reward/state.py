"""Whether a reward function remembers something between calls, as far as its source shows.

What remembers needs one copy of its globals for every car (``num_cars`` of the worker) to mean what it meant at
AWS, where one process drove one car. A wrong yes costs a slower start; a wrong no mixes the memories of all cars.
So a change in place counts, unless what it changes was made in the same call.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from typing import Final

from racecraft.reward.reading import reads
from racecraft.scoped_warnings import scoped_warnings

Function = ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda

CHANGERS: Final = frozenset(  # methods that change what they are called on
    (
        *("append", "appendleft", "extend", "extendleft", "insert", "add", "update", "setdefault", "pop", "popleft"),
        *("popitem", "clear", "remove", "discard", "sort", "reverse", "rotate", "subtract", "fill", "put", "send"),
        *("resize", "itemset", "intersection_update", "difference_update", "symmetric_difference_update"),
        *("__setitem__", "__setattr__", "__delitem__", "__next__", "move_to_end"),
    )
)
FIRST_ARGUMENT_CHANGERS: Final = frozenset(  # functions that change their first argument
    (
        *("next", "setattr", "delattr", "setitem", "delitem", "iadd", "shuffle", "copyto", "put", "place", "putmask"),
        *("heappush", "heappop", "heapify", "heappushpop", "heapreplace", "insort", "insort_left", "insort_right"),
        *("fill_diagonal",),
    )
)
NEW: Final = (  # expressions that make something new
    *(ast.Constant, ast.JoinedStr, ast.List, ast.Dict, ast.Set, ast.Tuple, ast.ListComp, ast.DictComp, ast.SetComp),
    *(ast.GeneratorExp, ast.BinOp, ast.UnaryOp, ast.Compare, ast.Lambda),
)
MAKERS: Final = frozenset(  # builtins that make something new
    (
        *("list", "dict", "set", "frozenset", "tuple", "bytearray", "sorted", "str", "int", "float", "bool", "range"),
        *("abs", "round", "iter", "map", "filter", "zip", "enumerate", "reversed"),
    )
)
IMMUTABLE: Final = (ast.Constant, ast.JoinedStr, ast.Lambda)
ASSIGNMENTS: Final = (ast.Assign, ast.AnnAssign, ast.NamedExpr)


@reads
def keeps_state(source: str) -> bool:
    """Whether the source remembers something between calls.

    Args:
        source: Text of a ``reward_function.py`` that Python can read.
    """
    with scoped_warnings("ignore"):
        tree = ast.parse(source)
    return _Reader(tree).remembers()


class _Reader:
    """Follows names from where something is changed to where it was made."""

    def __init__(self, tree: ast.Module) -> None:
        self._tree = tree
        self._imported = {
            alias.asname or alias.name.split(".")[0]
            for node in ast.walk(tree)
            if isinstance(node, (ast.Import, ast.ImportFrom))
            for alias in node.names
        }
        self._assigned = _assigned(tree)
        self._classes = {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
        functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        self._functions = set(functions)
        self._main = functions.get("reward_function")

    def remembers(self) -> bool:
        """Whether anything changes that outlives a call."""
        chains = list(_functions(self._tree, ()))
        for chain in chains:
            for node in _own(chain[-1]):
                if isinstance(node, (ast.Global, ast.Nonlocal)):
                    return True
                if isinstance(node, ast.Call) and _name(node.func) in ("globals", "vars"):
                    return True
        can_hold = self._can_hold(chains)
        for chain in chains:
            function = chain[-1]
            if isinstance(function, ast.FunctionDef) and function.name in ("__init__", "__post_init__", "__new__"):
                continue
            for changed in _changed(function):
                root = _root(changed)
                if isinstance(root, ast.Name) and root.id in self._functions and not self._is_local(root.id, chain):
                    return True  # an attribute of a function
                if can_hold and not self._is_new(changed, chain):
                    return True
        return False

    def _can_hold(self, chains: list[tuple[Function, ...]]) -> bool:
        """Whether anything outlives a call that could be changed in place."""
        if self._classes:
            return True
        for chain in chains:
            function = chain[-1]
            defaults = [*function.args.defaults, *filter(None, function.args.kw_defaults)]
            if not all(isinstance(default, ast.Name) or self._is_immutable(default) for default in defaults):
                return True
            if not isinstance(function, ast.Lambda) and function.decorator_list:
                return True
        values = [node.value for node in _own(self._tree) if isinstance(node, ASSIGNMENTS)]
        return any(value is not None and not self._is_immutable(value) for value in values)

    def _is_immutable(self, node: ast.expr) -> bool:
        """Whether the value of an assignment, or what a parameter is by default, surely cannot be changed in place.

        What operators make of numbers and texts cannot; of a list they make a list: ``[None] * 2``.
        """
        waiting: list[tuple[ast.expr, bool]] = [(node, False)]
        while waiting:
            part, is_operand = waiting.pop()
            match part:
                case ast.Tuple(elts=parts):
                    waiting += [(inner, is_operand) for inner in parts]
                case ast.BinOp(left=left, right=right):
                    waiting += [(left, True), (right, True)]
                case ast.UnaryOp(operand=operand):
                    waiting.append((operand, True))
                case ast.Compare(left=left, comparators=others):
                    waiting += [(inner, True) for inner in (left, *others)]
                case ast.Name() | ast.Attribute() if is_operand:
                    root = _root(part)
                    is_imported = isinstance(root, ast.Name) and root.id in self._imported
                    if not (is_imported or (isinstance(part, ast.Name) and part.id in self._assigned)):
                        return False
                case _:
                    if not isinstance(part, IMMUTABLE):
                        return False
        return True

    def _is_new(self, node: ast.expr, chain: tuple[Function, ...], depth: int = 0) -> bool:
        """Whether the expression's value was made in this call of the function, or is the caller's own params dict."""
        if depth > 20:
            return False
        if isinstance(node, NEW):
            return True
        if isinstance(node, (ast.Attribute, ast.Subscript, ast.Starred, ast.NamedExpr)):
            return self._is_new(node.value, chain, depth + 1)
        if isinstance(node, ast.IfExp):
            return all(self._is_new(part, chain, depth + 1) for part in (node.body, node.orelse))
        if isinstance(node, ast.BoolOp):
            return all(self._is_new(part, chain, depth + 1) for part in node.values)
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Attribute):
                return node.func.attr in ("copy", "tolist") or self._is_new(node.func.value, chain, depth + 1)
            name = _name(node.func)
            return name in self._classes | self._imported or (name in MAKERS and name not in self._functions)
        if isinstance(node, ast.Name):
            return self._is_new_name(node.id, chain, depth + 1)
        return False

    def _is_new_name(self, name: str, chain: tuple[Function, ...], depth: int) -> bool:
        for level in range(len(chain), 0, -1):
            function = chain[level - 1]
            if not self._is_local(name, (function,)):
                continue
            if level < len(chain) and chain[0] is not self._main:
                return False  # of a function around this one, which may have returned long ago
            if name in _parameters(function):
                return function is self._main and name == _parameters(function)[0]
            bindings = list(_bindings(name, function))
            return all(value is not None and self._is_new(value, chain[:level], depth) for value in bindings)
        return name in self._imported  # what a module offers is not the user's memory

    def _is_local(self, name: str, chain: tuple[Function, ...]) -> bool:
        return any(
            name in _parameters(function)
            or any(isinstance(node, ast.Name) and node.id == name and _binds(node) for node in _own(function))
            for function in chain
        )


def _functions(node: ast.AST, chain: tuple[Function, ...]) -> Iterator[tuple[Function, ...]]:
    """Every function, behind those it lies in, outermost first."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, Function):
            yield (*chain, child)
            yield from _functions(child, (*chain, child))
        else:
            yield from _functions(child, chain)


def _own(function: ast.AST) -> Iterator[ast.AST]:
    """The nodes inside a function or module, without those of functions and classes inside it."""
    waiting = list(ast.iter_child_nodes(function))
    while waiting:
        node = waiting.pop()
        yield node
        if not isinstance(node, (*Function.__args__, ast.ClassDef)):
            waiting.extend(ast.iter_child_nodes(node))


def _changed(function: Function) -> Iterator[ast.expr]:
    """What a function changes in place: the object, not the attribute or item of it."""
    for node in _own(function):
        if isinstance(node, (ast.Attribute, ast.Subscript)) and not isinstance(node.ctx, ast.Load):
            yield node.value
        elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            if isinstance(node.value, (ast.List, ast.ListComp, ast.Set, ast.SetComp, ast.Dict)):
                yield ast.Name(node.target.id, ast.Load())
        elif isinstance(node, ast.Call):
            if isinstance(node.func, ast.Attribute) and node.func.attr in CHANGERS:
                yield node.func.value
            if node.args and _name(node.func) in FIRST_ARGUMENT_CHANGERS:
                yield node.args[0]
            yield from (keyword.value for keyword in node.keywords if keyword.arg == "out")


def _bindings(name: str, function: Function) -> Iterator[ast.expr | None]:
    """The values that a function assigns to a name; None for those that are not seen, such as a loop's."""
    seen = set()
    for node in _own(function):
        targets: list[ast.expr] = []
        if isinstance(node, ast.Assign):
            targets = node.targets
        elif isinstance(node, (ast.AnnAssign, ast.NamedExpr)):
            targets = [node.target]
        for target in targets:
            if isinstance(target, ast.Name) and target.id == name:
                seen.add(id(target))
                yield node.value  # type: ignore[attr-defined]
        if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            seen.add(id(node.target))
    for node in _own(function):
        if isinstance(node, ast.Name) and node.id == name and _binds(node) and id(node) not in seen:
            yield None


def _assigned(tree: ast.Module) -> set[str]:
    """Names of the file that get their values by assignments alone: those say what they hold."""
    names, targets = list[ast.Name](), set[int]()
    for node in _own(tree):
        if isinstance(node, ast.Name) and _binds(node):
            names.append(node)
        elif isinstance(node, (*ASSIGNMENTS, ast.AugAssign)):
            goals = node.targets if isinstance(node, ast.Assign) else [node.target]
            targets |= {id(inner) for goal in goals for inner in ast.walk(goal)}
    return {node.id for node in names} - {node.id for node in names if id(node) not in targets}


def _parameters(function: Function) -> list[str]:
    arguments = function.args
    named = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs]
    return [argument.arg for argument in (*named, *filter(None, (arguments.vararg, arguments.kwarg)))]


def _binds(node: ast.Name) -> bool:
    return isinstance(node.ctx, ast.Store)


def _root(node: ast.expr) -> ast.expr:
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node


def _name(node: ast.expr) -> str:
    """The last part of a function's name: ``heappush`` of ``heapq.heappush``."""
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
