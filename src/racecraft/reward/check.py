"""The static check of a reward function: what can be seen wrong without running it, with its place.

It follows AWS's validator (the same allowed and forbidden things, the same length) without its false
alarms: a variable ``payload``, a dict's own ``load`` or an import inside a function are fine. It is a help
to the user and no border against a hostile one; that border is the worker process.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Final, Literal

from racecraft.errors import RewardError, did_you_mean, printable
from racecraft.reward.imports import ImportRules
from racecraft.reward.keys import missing_keys
from racecraft.reward.names import bound_names, undefined_names
from racecraft.reward.params import TEMPLATE
from racecraft.reward.reading import reads
from racecraft.reward.source import MAX_CHARACTERS
from racecraft.reward.worker_process import FILENAME, POSITIONS
from racecraft.scoped_warnings import scoped_warnings

Function = ast.FunctionDef | ast.AsyncFunctionDef

MAX_PROBLEMS: Final = 1000
MAX_PARTS: Final = 100
"""Of a dotted name: Python's own parser takes seconds for an import of 46,000."""
SIGNS: Final = {
    r"^invalid (non-printable )?character": "A page or a chat that it was copied from put another sign there: type "
    "spaces, quotes and minus on the keyboard again.",
    r"inconsistent use of tabs": "Indent all lines with spaces alone, four for each step.",
}
"""What to do about signs in a source, by what Python says of them: patterns."""
_CHAIN: Final = re.compile(rf"(?<![\w.])(?:[^\W\d]\w*+[\s\\]*+\.[\s\\]*+){{{MAX_PARTS}}}")


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a reward function."""

    line: int
    """Line in the source, from 1."""
    column: int
    """Column in that line, from 1."""
    message: str
    """What is wrong, in one sentence."""
    hint: str = ""
    """What to do about it."""
    severity: Literal["error", "warning"] = "error"
    """Errors would stop a run or are not allowed; a warning may be what the user means."""

    def __str__(self) -> str:
        hint = f" {self.hint}" if self.hint else ""
        return f"{FILENAME}, line {self.line}, column {self.column}: {self.message}{hint}"


@reads
def check_reward(source: str) -> list[Problem]:
    """The problems that can be seen in the source, in the order of its lines; of very many the first that are found.

    Raises:
        ConfigError: The source is no text.
    """
    if not isinstance(source, str):
        from racecraft.checks import check_type  # with NumPy, which who reads a stranger's source goes without

        check_type("source", source, str, "use the text of a reward function, which load_reward(path) reads")
    try:
        with scoped_warnings("ignore"):  # Python's own are caught where the source is parsed
            problems = list(islice(_problems(source), MAX_PROBLEMS))
    except (RecursionError, MemoryError):
        problems = [Problem(1, 1, "The source is nested too deeply to be read.")]
    problems = [
        replace(problem, message=printable(problem.message), hint=printable(problem.hint)) for problem in problems
    ]
    return sorted(set(problems), key=lambda problem: (problem.line, problem.column, problem.severity))


def validate_reward(source: str) -> None:
    """Raise for the first error that `check_reward` finds; warnings pass.

    Raises:
        RewardError: The source has an error; ``line`` and ``column`` say where.
    """
    errors = [problem for problem in check_reward(source) if problem.severity == "error"]
    if errors:
        more = f" ({len(errors) - 1} more)" if len(errors) > 1 else ""
        raise RewardError(f"{errors[0]}{more}", line=errors[0].line, column=errors[0].column)


def _problems(source: str) -> Iterator[Problem]:
    if not source.strip():
        yield Problem(1, 1, "The source is empty.", "Write 'def reward_function(params):' and return a number.")
        return
    if len(source) > MAX_CHARACTERS:
        yield Problem(1, 1, f"The source has {len(source):,} characters; AWS accepts up to {MAX_CHARACTERS:,}.")
        return
    if (chain := _CHAIN.search(source)) is not None:
        line = source.count("\n", 0, chain.start()) + 1
        yield Problem(line, 1, f"A name has more than {MAX_PARTS} parts.")
        return
    tree, findings = _parse(source)
    yield from findings
    if tree is None:
        return
    yield from _check_reward_function(tree)
    yield from (_at(*finding) for finding in ImportRules(tree).findings())
    for node, name, known in undefined_names(source, tree):
        yield _at(node, f"The name '{name}' is not defined.", did_you_mean(name, known))


def _parse(source: str) -> tuple[ast.Module | None, list[Problem]]:
    """The syntax tree, or None; with Python's own errors and warnings about it."""
    findings = []
    tree: ast.Module | None = None
    with scoped_warnings("always") as caught:
        try:
            tree = ast.parse(source, FILENAME)
            compile(tree, FILENAME, "exec")  # finds more: a 'return' outside of a function, a 'nonlocal' without one
        except SyntaxError as error:
            tree = None
            is_question = error.msg.endswith("?")  # Did you mean print(...)?
            message = f"{type(error).__name__}: {error.msg}" + ("" if is_question else ".")
            hint = next((hint for pattern, hint in SIGNS.items() if re.search(pattern, error.msg)), "")
            if "```" in (error.text or ""):
                hint = "It is the frame of a text that shows a program: leave out the lines with ```."
            findings.append(Problem(max(error.lineno or 1, 1), max(error.offset or 1, 1), message, hint))
        except ValueError as error:  # a NUL, or half of a surrogate pair
            tree = None
            findings.append(Problem(1, 1, f"The source is not text that Python reads: {error}."))
    for warning in caught:
        if warning.filename != FILENAME:
            continue  # of what Python collected meanwhile
        text = str(warning.message).rstrip(".") + "."
        findings.append(Problem(warning.lineno or 1, 1, text, severity="warning"))
    return tree, findings


def _check_reward_function(tree: ast.Module) -> Iterator[Problem]:
    functions = [node for node in tree.body if isinstance(node, Function)]
    found = [function for function in functions if function.name == "reward_function"]
    if not found and "reward_function" in _names_at_top(tree):
        return  # assigned, imported or defined in a branch: the dry run calls whatever it is
    if not found:
        names = [function.name for function in functions]
        close = did_you_mean("reward_function", names)
        node = next((f for f in functions if f"'{f.name}'" in close), None)
        where = (node.lineno, node.col_offset + 1) if node else (1, 1)
        hint = close or "AWS calls 'def reward_function(params):' at the top level of the file."
        yield Problem(*where, "There is no function 'reward_function' at the top level.", hint)
        return
    for function in found[1:]:
        yield _at(function, f"'reward_function' is defined again; the first one is in line {found[0].lineno}.")
    function = found[-1]
    if isinstance(function, ast.AsyncFunctionDef):
        yield _at(function, "'reward_function' is 'async', expected a plain function.", "Remove 'async'.")
        return
    if not _is_by_position(function):
        yield from _check_signature(function)
        yield from _check_keys(tree, function)
        yield from _check_first_step(tree)
    yield from _check_returns(function)


def _names_at_top(tree: ast.Module) -> set[str]:
    """What the file itself defines when it is loaded, branches included."""
    names = bound_names(tree, into_functions=False)
    arguments = {node.arg for node in ast.walk(tree) if isinstance(node, ast.arg)}  # of lambdas
    return names - arguments


def _check_signature(function: Function) -> Iterator[Problem]:
    """AWS calls it with the dict and nothing else: further parameters need a default."""
    arguments = function.args
    positional = [*arguments.posonlyargs, *arguments.args]
    if not positional or len(positional) - len(arguments.defaults) > 1 or None in arguments.kw_defaults:
        count = len(positional) + len(arguments.kwonlyargs) + bool(arguments.vararg) + bool(arguments.kwarg)
        yield _at(
            function,
            f"'reward_function' has {count} parameters, expected exactly one.",
            "Write 'def reward_function(params):' and read params['speed'] and the others from the dict.",
        )


def _is_by_position(function: Function) -> bool:
    """Whether it takes twelve values instead of the dict, as AWS gave them in 2018."""
    given = function.args
    names = [argument.arg for argument in (*given.posonlyargs, *given.args)]
    is_more = bool(given.defaults) or None in given.kw_defaults
    return not is_more and len(names) == len(POSITIONS) + 1 and tuple(names[:-1]) == POSITIONS


def _check_returns(function: Function) -> Iterator[Problem]:
    nodes = list(_own_nodes(function))
    generator = next((node for node in nodes if isinstance(node, (ast.Yield, ast.YieldFrom))), None)
    if generator is not None:
        yield _at(generator, "'reward_function' has a 'yield', so it returns a generator instead of a number.")
        return
    returns = [node for node in nodes if isinstance(node, ast.Return)]
    empty = [node for node in returns if node.value is None or _is_constant(node.value, None)]
    falls_through = _completes(function.body)
    if len(returns) == len(empty) and (falls_through or empty):
        yield _at(function, "'reward_function' never returns a value.", "End it with 'return float(reward)'.")
        return
    for node in empty:
        yield _at(node, "This returns None, which stops the run.", "Return a number.", "warning")
    if falls_through:
        yield _at(
            function,
            "'reward_function' can reach its end without a 'return', which gives None and stops the run.",
            "End it with 'return float(reward)'.",
            "warning",
        )
    for node in returns:
        if isinstance(node.value, (ast.Constant, ast.JoinedStr)) and not _is_constant(node.value, None):
            value = node.value.value if isinstance(node.value, ast.Constant) else ""
            if not isinstance(value, (bool, int, float)):
                yield _at(node, f"This returns a value of type {type(value).__name__}, expected a number.")


def _check_keys(tree: ast.Module, function: Function) -> Iterator[Problem]:
    for where, name, key, is_sure in missing_keys(tree, function, set(TEMPLATE)):
        hint = did_you_mean(key, TEMPLATE) or f"The keys are {', '.join(TEMPLATE)}."
        yield _at(where, f"{name} has no key '{key}'.", hint, "error" if is_sure else "warning")


def _check_first_step(tree: ast.Module) -> Iterator[Problem]:
    """Functions of 2019 begin anew at step 0, those of 2020 at step 1, which no call sees any more."""
    for node in ast.walk(tree):
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[ast.Constant(value=int() | float() as number)]):
                unseen = number if isinstance(op, (ast.Eq, ast.LtE)) else number - 1 if isinstance(op, ast.Lt) else 2
                if unseen in (0, 1) and _is_steps(left):
                    told = "This is never true: an episode's first call has steps 2, as at AWS in its last years."
                    yield _at(node, told, "Compare with 2.", "warning")


def _is_steps(node: ast.expr) -> bool:
    match node:
        case ast.Name(id="steps") | ast.Attribute(attr="steps") | ast.Subscript(slice=ast.Constant(value="steps")):
            return True
        case _:
            return False


def _completes(body: list[ast.stmt]) -> bool:
    """Whether the run can get past the last of these statements."""
    return all(_can_pass(statement) for statement in body)


def _can_pass(statement: ast.stmt) -> bool:
    match statement:
        case ast.Return() | ast.Raise():
            return False
        case ast.If():
            return _completes(statement.body) or _completes(statement.orelse)
        case ast.While(test=ast.Constant(value=value)) if value:
            return any(isinstance(node, ast.Break) for node in ast.walk(statement))
        case ast.With():
            return _completes(statement.body)
        case ast.Try():
            handled = any(_completes(handler.body) for handler in statement.handlers)
            passes = _completes([*statement.body, *statement.orelse]) or handled
            return passes and _completes(statement.finalbody)
        case ast.Match():
            last = statement.cases[-1]
            is_total = last.guard is None and isinstance(last.pattern, ast.MatchAs) and last.pattern.pattern is None
            return not is_total or any(_completes(case.body) for case in statement.cases)
        case _:
            return True


def _own_nodes(function: Function) -> Iterator[ast.AST]:
    """The nodes of a function's body, without those of functions and classes inside it."""
    waiting: list[ast.AST] = list(function.body)
    while waiting:
        node = waiting.pop()
        yield node
        if not isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)):
            waiting.extend(ast.iter_child_nodes(node))


def _at(
    node: ast.expr | ast.stmt | ast.alias,
    message: str,
    hint: str = "",
    severity: Literal["error", "warning"] = "error",
) -> Problem:
    return Problem(node.lineno, node.col_offset + 1, message, hint, severity)


def _is_constant(node: ast.expr, value: object) -> bool:
    return isinstance(node, ast.Constant) and node.value is value
