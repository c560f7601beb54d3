"""Translates a purely numeric reward function to CUDA C++: the Python of `numeric.py`, statement by statement.

    reward_function.py -> numeric_source (no dict any more) -> *cuda_source* -> NVRTC

Every number is a double, as every number of a row is; whole numbers are exact up to 2**53. Anything else than
arithmetic, comparisons, if, for over a range, math's functions and waypoints is refused: it is interpreted then.
"""

from __future__ import annotations

import ast
import math
from typing import Final

from racecraft.reward.numeric import PREFIX, VALUES, NotNumeric, numeric_source

NUMBER, PAIR, LINE = "double", "Pair", "Waypoints"
KINDS: Final = {PREFIX + "closest_waypoints": PAIR, PREFIX + "waypoints": LINE}
MATH_ONE: Final = {  # of one argument, by the same name in C
    *("acos", "asin", "atan", "ceil", "cos", "cosh", "exp", "fabs", "floor", "log", "log10", "log2"),
    *("sin", "sinh", "sqrt", "tan", "tanh", "trunc"),
}
MATH_TWO: Final = {"atan2", "fmod", "hypot"}
OPERATORS: Final = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
CHECKED: Final = {ast.Div: "divided", ast.Mod: "remainder_of", ast.FloorDiv: "floor_divided", ast.Pow: "power"}
COMPARISONS: Final = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
MAX_FUNCTIONS: Final = 50

Value = tuple[str, str]  # C++ expression, kind


def cuda_source(source: str) -> str:
    """A program with the kernel ``pay_cars``, for a ``reward_function.py`` that passed the check.

    Raises:
        NotNumeric: It does more than what can be translated; the message says what.
    """
    module = ast.parse(numeric_source(source))
    return _Program(module).text()


class _Program:
    """A module: constants, functions for the kinds they are called with, and the kernel."""

    def __init__(self, module: ast.Module) -> None:
        self.functions: dict[str, ast.FunctionDef] = {}
        self.constants: dict[str, str] = {}
        self.imported = set[str]()
        self.done: dict[tuple[str, tuple[str, ...]], tuple[str, str]] = {}
        self.parts: list[str] = []
        for statement in module.body:
            self._read(statement)

    def _read(self, statement: ast.stmt) -> None:
        match statement:
            case ast.FunctionDef():
                self.functions[statement.name] = statement
            case ast.Import(names=[ast.alias(name="math", asname=None)]):
                self.imported.add("math")
            case ast.ImportFrom(module="math", names=names) if all(alias.asname is None for alias in names):
                self.imported |= {alias.name for alias in names}
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                number, kind = _Function(self, {}).value(value)
                if kind != NUMBER or name in self.constants:
                    raise NotNumeric(f"{name} is not a number that stays what it is")
                self.parts.append(f"RC_HD double value_of_{name}(bool& bad) {{ return {number}; }}")
                self.constants[name] = f"value_of_{name}(bad)"
            case ast.Expr(value=ast.Constant(value=str())):
                pass
            case _:
                raise NotNumeric(f"line {statement.lineno} of it is neither a constant nor a function")

    def call(self, name: str, kinds: tuple[str, ...]) -> tuple[str, str]:
        """C++ name and kind of what a function returns for arguments of these kinds."""
        key = (name, kinds)
        if key in self.done:
            return self.done[key]
        function = self.functions[name]
        arguments = function.args
        extra = (
            arguments.vararg or arguments.kwarg or arguments.kwonlyargs or arguments.defaults or arguments.posonlyargs
        )
        if extra or len(arguments.args) != len(kinds):
            raise NotNumeric(f"{name} is called in a way that is not translated")
        if len(self.done) >= MAX_FUNCTIONS:
            raise NotNumeric("it has too many functions")
        self.done[key] = ("", "")  # a function that calls itself finds this
        c_name = f"f{len(self.done)}_{name}"
        names = [argument.arg for argument in arguments.args]
        body = _Function(self, dict(zip(names, kinds, strict=True)))
        text = body.block(function.body)
        returned = body.returned or NUMBER
        declared = "".join(
            f"    {kind} v_{local} = {_nothing(kind)};\n" for local, kind in body.kinds.items() if local not in names
        )
        parameters = "".join(f"{kind} v_{argument}, " for argument, kind in zip(names, kinds, strict=True))
        self.parts.append(
            f"RC_HD {returned} {c_name}({parameters}bool& bad) {{\n{declared}{text}"
            f"    bad = true;\n    return {_nothing(returned)};\n}}"
        )
        self.done[key] = (c_name, returned)
        return self.done[key]

    def text(self) -> str:
        main = self.functions["reward_function"]
        keys = [argument.arg.removeprefix(PREFIX) for argument in main.args.args]
        kinds = tuple(KINDS.get(PREFIX + key, NUMBER) for key in keys)
        name, returned = self.call("reward_function", kinds)
        if returned != NUMBER:
            raise NotNumeric("reward_function does not return a number")
        kernel = _Function(self, {})
        arguments = [kernel.value(ast.parse(VALUES[key], mode="eval").body)[0] for key in keys]
        steps = kernel.value(ast.parse(VALUES["steps"], mode="eval").body)[0]
        call = ", ".join([*arguments, "bad"])
        body = "\n\n".join(self.parts)
        return f"""#include "reward.hpp"

using namespace racecraft;

{body}

RC_REWARD_KERNEL {{
    RC_EACH_ROW(i) {{
        const double* row = task.rows + static_cast<size_t>(i) * static_cast<size_t>(task.width);
        bool bad = false;
        const double reward = {steps} == 1.0 ? 0.0 : {name}({call});
        task.rewards[i] = bad || !isfinite(reward) ? kNoNumber : reward;
    }}
}}
"""


class _Function:
    """The statements and expressions of one function."""

    def __init__(self, program: _Program, kinds: dict[str, str]) -> None:
        self.program = program
        self.kinds = dict(kinds)
        self.returned = ""

    # ---- statements

    def block(self, statements: list[ast.stmt], indent: str = "    ") -> str:
        return "".join(self.statement(statement, indent) for statement in statements)

    def statement(self, node: ast.stmt, indent: str) -> str:
        inner = indent + "    "
        match node:
            case ast.Pass() | ast.Expr(value=ast.Constant()):
                return ""
            case ast.Return(value=value) if value is not None:
                text, kind = self.value(value)
                if self.returned not in ("", kind):
                    raise NotNumeric(f"line {node.lineno} returns something of another kind")
                self.returned = kind
                return f"{indent}return {text};\n"
            case ast.Assign(targets=[target], value=value):
                return self._assign(target, value, indent)
            case ast.AnnAssign(target=ast.Name() as target, value=value) if value is not None:
                return self._assign(target, value, indent)
            case ast.AugAssign(target=ast.Name(id=name), op=op, value=value):
                step = ast.BinOp(ast.Name(name, ast.Load()), op, value)
                return self._assign(ast.Name(name, ast.Store()), ast.copy_location(step, node), indent)
            case ast.If(test=test, body=body, orelse=orelse):
                text = f"{indent}if ({self.truth(test)}) {{\n{self.block(body, inner)}{indent}}}"
                if orelse:
                    text += f" else {{\n{self.block(orelse, inner)}{indent}}}"
                return text + "\n"
            case ast.For(
                target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=bounds, keywords=[]), orelse=[]
            ) if 1 <= len(bounds) <= 2:
                first = self.number(bounds[0]) if len(bounds) == 2 else "0.0"
                last = self.number(bounds[-1])
                self._declare(name, NUMBER)
                counter = f"i_{node.lineno}_{node.col_offset}"
                head = (
                    f"for (double {counter} = {first}, end_{counter} = {last}; {counter} < end_{counter}; ++{counter})"
                )
                body_text = f"{inner}v_{name} = {counter};\n{self.block(node.body, inner)}"
                return f"{indent}{head} {{\n{body_text}{indent}}}\n"
            case ast.Break():
                return f"{indent}break;\n"
            case ast.Continue():
                return f"{indent}continue;\n"
            case _:
                raise NotNumeric(f"line {node.lineno} of it is not translated")

    def _assign(self, target: ast.expr, value: ast.expr, indent: str) -> str:
        if isinstance(target, ast.Name):
            text, kind = self.value(value)
            self._declare(target.id, kind)
            return f"{indent}v_{target.id} = {text};\n"
        match target:
            case ast.Tuple(elts=[ast.Name(id=first), ast.Name(id=second)]):
                text, kind = self.value(value)
                if kind != PAIR:
                    raise NotNumeric(f"line {target.lineno} takes something apart that is no pair")
                self._declare(first, NUMBER)
                self._declare(second, NUMBER)
                pair = f"const Pair pair = {text};"
                return f"{indent}{{ {pair} v_{first} = pair.first; v_{second} = pair.second; }}\n"
        raise NotNumeric(f"line {target.lineno} assigns to something that is no plain name")

    def _declare(self, name: str, kind: str) -> None:
        if self.kinds.setdefault(name, kind) != kind:
            raise NotNumeric(f"{name} is a number here and something else there")

    # ---- expressions

    def number(self, node: ast.expr) -> str:
        text, kind = self.value(node)
        if kind != NUMBER:
            raise NotNumeric("it computes with something that is no number")
        return text

    def truth(self, node: ast.expr) -> str:
        match node:
            case ast.Compare(ops=[op], left=left, comparators=[right]) if type(op) in COMPARISONS:
                return f"({self.number(left)} {COMPARISONS[type(op)]} {self.number(right)})"
            case ast.BoolOp(op=op, values=values):
                sign = " && " if isinstance(op, ast.And) else " || "
                return f"({sign.join(self.truth(value) for value in values)})"
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self.truth(operand)})"
            case _:
                return f"({self.number(node)} != 0.0)"

    def value(self, node: ast.expr) -> Value:
        match node:
            case ast.Constant(value=value) if isinstance(value, bool | int | float):
                is_exact = isinstance(value, float) or abs(value) <= 2**53
                if not is_exact or not math.isfinite(value):
                    raise NotNumeric(f"it holds the number {value!r}")
                return f"({float(value)!r})", NUMBER
            case ast.Name(id=name):
                return self._name(name)
            case ast.BinOp(left=left, op=op, right=right):
                return self._operation(op, self.number(left), self.number(right))
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return f"(-{self.number(operand)})", NUMBER
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.number(operand), NUMBER
            case ast.Compare(ops=[_]) | ast.UnaryOp(op=ast.Not()):
                return f"({self.truth(node)} ? 1.0 : 0.0)", NUMBER
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                sides = [left, *comparators]
                pairs = zip(sides, ops, comparators, strict=False)
                parts = [self.truth(ast.Compare(a, [op], [b])) for a, op, b in pairs]
                return f"(({' && '.join(parts)}) ? 1.0 : 0.0)", NUMBER
            case ast.BoolOp(op=op, values=[*firsts, last]):
                text = self.number(last)
                for first in reversed(firsts):
                    kept, test = self.number(first), self.truth(first)
                    text = f"({test} ? {text} : {kept})" if isinstance(op, ast.And) else f"({test} ? {kept} : {text})"
                return text, NUMBER
            case ast.IfExp(test=test, body=body, orelse=orelse):
                (yes, kind), (no, other) = self.value(body), self.value(orelse)
                if kind != other:
                    raise NotNumeric("a choice of it is between things of two kinds")
                return f"({self.truth(test)} ? {yes} : {no})", kind
            case ast.Tuple(elts=[first, second]):
                return f"Pair{{{self.number(first)}, {self.number(second)}}}", PAIR
            case ast.Subscript(value=value, slice=index):
                return self._item(value, index)
            case ast.Attribute(value=ast.Name(id="math"), attr=name) if "math" in self.program.imported:
                return self._math_constant(name)
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self._call(function, arguments)
            case _:
                raise NotNumeric(f"it uses {type(node).__name__}, which is not translated")

    def _name(self, name: str) -> Value:
        if name in self.kinds:
            return f"v_{name}", self.kinds[name]
        if name in self.program.constants:
            return self.program.constants[name], NUMBER
        if name in self.program.imported:
            return self._math_constant(name)
        raise NotNumeric(f"{name} is not known where it is used")

    @staticmethod
    def _math_constant(name: str) -> Value:
        if name not in ("pi", "e", "tau"):
            raise NotNumeric(f"it uses math.{name}")
        return f"({getattr(math, name)!r})", NUMBER

    @staticmethod
    def _operation(op: ast.operator, left: str, right: str) -> Value:
        if type(op) in OPERATORS:
            return f"({left} {OPERATORS[type(op)]} {right})", NUMBER
        if type(op) in CHECKED:
            return f"{CHECKED[type(op)]}({left}, {right}, bad)", NUMBER
        raise NotNumeric(f"it uses {type(op).__name__}, which is not translated")

    def _item(self, value: ast.expr, index: ast.expr) -> Value:
        match value, index:
            case ast.Name(id="row"), ast.Constant(value=int() as column) if "row" not in self.kinds:
                return f"row[{column}]", NUMBER
            case ast.Name(id="waypoints"), _ if "waypoints" not in self.kinds and not self.kinds:
                return f"line_of(task, {self.number(index)})", LINE
        text, kind = self.value(value)
        if kind == LINE:
            return f"waypoint({text}, {self.number(index)}, bad)", PAIR
        if kind == PAIR and isinstance(index, ast.Constant) and index.value in (0, 1):
            return f"{text}.{'second' if index.value else 'first'}", NUMBER
        raise NotNumeric("it looks into something that is neither a waypoint nor the waypoints")

    def _call(self, function: ast.expr, arguments: list[ast.expr]) -> Value:
        values = [self.value(argument) for argument in arguments]
        texts, kinds = [text for text, _ in values], tuple(kind for _, kind in values)
        name = ""
        match function:
            case ast.Attribute(value=ast.Name(id="math"), attr=attribute) if "math" in self.program.imported:
                name = attribute
            case ast.Name(id=own) if own in self.program.functions:
                c_name, returned = self.program.call(own, kinds)
                if not c_name:
                    raise NotNumeric(f"{own} calls itself")
                return f"{c_name}({', '.join([*texts, 'bad'])})", returned
            case ast.Name(id=builtin) if builtin in self.program.imported:
                name = builtin
            case ast.Name(id="len") if kinds == (LINE,):
                return f"{texts[0]}.count", NUMBER
            case ast.Name(id="min" | "max" as which) if len(texts) > 1 and set(kinds) == {NUMBER}:
                text = texts[0]
                for other in texts[1:]:  # the first of equal ones, as Python's
                    text = f"lesser({text}, {other})" if which == "min" else f"greater({text}, {other})"
                return text, NUMBER
            case ast.Name(id="abs" | "float" | "int" | "bool" as which) if kinds == (NUMBER,):
                forms = {"abs": "fabs({})", "float": "({})", "int": "trunc({})", "bool": "({} != 0.0 ? 1.0 : 0.0)"}
                return forms[which].format(texts[0]), NUMBER
        if kinds == (NUMBER,) and name in MATH_ONE:
            return f"valid({name}({texts[0]}), bad)", NUMBER
        if kinds == (NUMBER,) and name in ("radians", "degrees"):
            return f"({texts[0]} * {(math.pi / 180 if name == 'radians' else 180 / math.pi)!r})", NUMBER
        if kinds == (NUMBER, NUMBER) and name in MATH_TWO:
            return f"valid({name}({', '.join(texts)}), bad)", NUMBER
        if kinds == (NUMBER, NUMBER) and name == "pow":
            return f"power({', '.join(texts)}, bad)", NUMBER
        raise NotNumeric(f"it calls {ast.unparse(function)}, which is not translated")


def _nothing(kind: str) -> str:
    """What a variable holds before it is given a value: Python would raise, so it must not look like a number."""
    return {NUMBER: "kNoNumber", PAIR: "Pair{kNoNumber, kNoNumber}", LINE: "Waypoints{}"}[kind]
