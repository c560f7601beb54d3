"""Which keys a reward function reads that its dict does not have.

The dict is followed from the function's own parameter to the helpers that it is passed to. What else bears the
parameter's name, such as a helper's own table, is none of it.
"""

from __future__ import annotations

import ast
import builtins
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

Function = ast.FunctionDef | ast.AsyncFunctionDef
Place = tuple[int | str, bool]  # of an argument: its position or name; and whether the call is in no 'try'


@dataclass(eq=False)
class _Holder:
    """A function that has the dict, and what it does with it."""

    function: Function
    name: str  # of the parameter
    reads: list[tuple[ast.expr, str, bool]] = field(default_factory=list)  # where, key, does it raise
    written: set[str] = field(default_factory=set)
    passes: list[tuple[ast.expr, Place]] = field(default_factory=list)  # to what it calls
    is_rebound: bool = False
    """The name means something else from somewhere on."""
    escapes: bool = False
    """The dict gets another name, or goes where it is not followed: somebody may write keys into it."""
    is_filled: bool = False
    """Keys are added that are not seen."""


def missing_keys(tree: ast.Module, function: Function, known: set[str]) -> Iterator[tuple[ast.expr, str, str, bool]]:
    """Reads of keys that the dict does not have: where, what the dict is called there, the key, and is it sure to fail.

    A function that fills or replaces the dict is left alone.

    Args:
        tree: Of the file.
        function: The reward function in it.
        known: Keys of the dict.
    """
    parameters = [*function.args.posonlyargs, *function.args.args]
    if not parameters:
        return
    file = _File(tree)
    first = _read(function, parameters[0].arg, file.guarded)
    if first.is_rebound:
        return
    holders = {id(function): first}
    unsure = {id(function)} if function.decorator_list else set[int]()
    told: defaultdict[int, list[int]] = defaultdict(list)  # by helper: those that surely pass it the dict
    waiting = [first]
    while waiting:
        holder = waiting.pop()
        for called, (place, is_open) in holder.passes if not holder.is_rebound else ():
            found = file.named(called)
            holder.escapes |= not found and isinstance(called, ast.Name) and not hasattr(builtins, called.id)
            for helper, skipped in found:
                name = _parameter_at(helper, place, skipped)
                if not name:
                    continue
                if id(helper) not in holders:  # each is read once: a stranger's source is not to take long
                    holders[id(helper)] = _read(helper, name, file.guarded)
                    waiting.append(holders[id(helper)])
                is_sure = is_open and len(found) == 1 and isinstance(called, ast.Name)
                if is_sure and holders[id(helper)].name == name:
                    told[id(helper)].append(id(holder.function))
    if any(holder.is_filled for holder in holders.values()):
        return

    unsure |= {at for at in holders if at != id(function) and not file.is_always(holders[at], len(told[at]))}
    tells: defaultdict[int, list[int]] = defaultdict(list)
    for at, tellers in told.items():
        for teller in tellers:
            tells[teller].append(at)
    spreading = list(unsure)
    while spreading:
        for at in tells[spreading.pop()]:
            if at not in unsure:
                unsure.add(at)
                spreading.append(at)

    present = known.union(file.tested, *(holder.written for holder in holders.values()))
    escapes = any(holder.escapes for holder in holders.values())
    for at, holder in holders.items():
        is_sure = not escapes and at not in unsure
        for where, key, raises in holder.reads if not holder.is_rebound else ():
            if key not in present:
                yield where, holder.name, key, raises and is_sure and id(where) not in file.guarded


class _File:
    """The functions of a file by their names, and where it is careful."""

    def __init__(self, tree: ast.Module) -> None:
        self.guarded = set[int]()
        """What stands in a 'try'."""
        self.tested = set[str]()
        """Texts that are looked for in something."""
        self._functions: defaultdict[str, list[Function]] = defaultdict(list)
        self._methods: defaultdict[str, list[Function]] = defaultdict(list)
        self._uses: defaultdict[str, int] = defaultdict(int)
        methods = set[int]()
        for node in ast.walk(tree):  # outer ones first
            match node:
                case ast.Name(ctx=ast.Load()):
                    self._uses[node.id] += 1
                case ast.ClassDef():
                    methods |= {id(child) for child in node.body}
                case ast.FunctionDef() | ast.AsyncFunctionDef():
                    (self._methods if id(node) in methods else self._functions)[node.name].append(node)
                case ast.Try() if id(node) not in self.guarded:
                    self.guarded |= {id(inner) for inner in ast.walk(node)}
                case ast.Compare(left=left) if (text := _text(left)) is not None:
                    self.tested.add(text)

    def named(self, called: ast.expr) -> list[tuple[Function, int]]:
        """What a call may mean, with how many parameters Python fills by itself."""
        if isinstance(called, ast.Name):
            return [(function, 0) for function in self._functions.get(called.id, ())]
        if isinstance(called, ast.Attribute):
            return [(method, int(not _is_static(method))) for method in self._methods.get(called.attr, ())]
        return []

    def is_always(self, holder: _Holder, count: int) -> bool:
        """Whether so many calls with the dict are all that a function is used for."""
        name = holder.function.name
        return not holder.function.decorator_list and len(self._functions[name]) == 1 and self._uses[name] == count


def _read(function: Function, name: str, guarded: set[int]) -> _Holder:
    """What a function does with the parameter of this name."""
    holder = _Holder(function, name)
    waiting: list[ast.AST] = list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)) and name in _names(node):
            waiting += [*node.args.defaults, *filter(None, node.args.kw_defaults)]
            continue  # inside, the name is its own
        waiting.extend(ast.iter_child_nodes(node))
        match node:
            case ast.Name(id=found) if found == name and not isinstance(node.ctx, ast.Load):
                holder.is_rebound = True
            case ast.AugAssign(target=ast.Name(id=found)) if found == name:
                holder.is_filled = True
            case ast.Subscript(value=ast.Name(id=found)) if found == name and (key := _text(node.slice)) is not None:
                if isinstance(node.ctx, ast.Load):
                    holder.reads.append((node.slice, key, True))
                else:
                    holder.written.add(key)
            case ast.Assign(value=ast.Name(id=found)) | ast.AnnAssign(value=ast.Name(id=found)) if found == name:
                holder.escapes = True
            case ast.NamedExpr(value=ast.Name(id=found)) if found == name:
                holder.escapes = True
            case ast.Call():
                _read_call(node, holder, is_open=id(node) not in guarded)
    return holder


def _read_call(call: ast.Call, holder: _Holder, *, is_open: bool) -> None:
    if isinstance(call.func, ast.Attribute) and _is_name(call.func.value, holder.name):
        if call.func.attr in ("get", "pop") and call.args and (key := _text(call.args[0])) is not None:
            holder.reads.append((call.args[0], key, False))
        holder.is_filled |= call.func.attr in ("update", "setdefault")
    for position, argument in enumerate(call.args):
        if isinstance(argument, ast.Starred):
            break
        if _is_name(argument, holder.name):
            holder.passes.append((call.func, (position, is_open)))
    for keyword in call.keywords:
        if keyword.arg and _is_name(keyword.value, holder.name):
            holder.passes.append((call.func, (keyword.arg, is_open)))


def _parameter_at(function: Function, place: int | str, skipped: int) -> str:
    """The name under which a function gets an argument, or nothing."""
    given = function.args
    if isinstance(place, str):
        return place if any(argument.arg == place for argument in (*given.args, *given.kwonlyargs)) else ""
    place += skipped - len(given.posonlyargs)
    arguments = given.posonlyargs if place < 0 else given.args
    return arguments[place].arg if place < len(arguments) else ""


def _names(function: Function | ast.Lambda) -> set[str]:
    """Of all parameters."""
    given = function.args
    named = (*given.posonlyargs, *given.args, *given.kwonlyargs, *filter(None, (given.vararg, given.kwarg)))
    return {argument.arg for argument in named}


def _is_static(method: Function) -> bool:
    return any(_is_name(decorator, "staticmethod") for decorator in method.decorator_list)


def _is_name(node: ast.expr, name: str) -> bool:
    return isinstance(node, ast.Name) and node.id == name


def _text(node: ast.expr) -> str | None:
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else None
