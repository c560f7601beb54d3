"""Translates a purely numeric reward function to JavaScript: the Python of `racecraft.reward.numeric`, line by line.

    reward_function.py -> numeric_source (no dict any more) -> *javascript* -> the worker of the page

Both count in the same doubles, and where Python raises, a mistake is thrown. Anything else than arithmetic,
comparisons, if, for over a range, math's functions and waypoints is refused: that needs Python.
"""

from __future__ import annotations

import ast
import math
from typing import Final

from racecraft.reward.numeric import PREFIX, VALUES, NotNumeric, numeric_source

MATH: Final = {
    **{name: f"Math.{name}" for name in ("acos", "asin", "atan", "atan2", "ceil", "cos", "cosh", "exp", "floor")},
    **{name: f"Math.{name}" for name in ("hypot", "log", "log10", "log2", "sin", "sinh", "sqrt", "tan", "tanh")},
    **{"trunc": "Math.trunc", "fabs": "Math.abs", "radians": "radians", "degrees": "degrees", "pow": "power"},
}
BUILTINS: Final = {"abs": "Math.abs", "float": "Number", "int": "Math.trunc", "min": "lesser", "max": "greater"}
OPERATORS: Final = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
CHECKED: Final = {ast.Div: "divided", ast.Mod: "remainder", ast.FloorDiv: "floorDivided", ast.Pow: "power"}
COMPARISONS: Final = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "===", ast.NotEq: "!=="}

PRELUDE: Final = f"""const checked = (value) => {{
  if (Number.isFinite(value)) return value;
  throw new Error("The reward function computed something that is no number.");
}};
const radians = (angle) => angle * {math.pi / 180!r};
const degrees = (angle) => angle * {180 / math.pi!r};
const divided = (a, b) => checked(a / b);
const floorDivided = (a, b) => checked(Math.floor(a / b));
const remainder = (a, b) => {{
  const rest = checked(a % b);
  return rest !== 0 && rest < 0 !== b < 0 ? rest + b : rest;
}};
const power = (a, b) => checked(b === 2 ? a * a : a ** b);
const lesser = (...all) => all.reduce((least, one) => (one < least ? one : least));
const greater = (...all) => all.reduce((most, one) => (one > most ? one : most));
const at = (list, index) => {{
  const found = list[index < 0 ? index + list.length : index];
  if (found === undefined) throw new Error("The reward function looked for a waypoint that is not there.");
  return found;
}};
"""


def javascript(sources: dict[str, str]) -> str:
    """A module with ``rewards``: functions (row, waypoints) -> reward by name; waypoints (K, 2) of every track index.

    Args:
        sources: Texts of reward functions that passed the check, by name.

    Raises:
        NotNumeric: One does more than what can be translated.
    """
    rewards = ",\n".join(f'  "{name}": {_reward(source)}' for name, source in sources.items())
    return f"{PRELUDE}export const rewards = {{\n{rewards},\n}};\n"


def _reward(source: str) -> str:
    module = ast.parse(numeric_source(source))
    parts, main = [], None
    for statement in module.body:
        match statement:
            case ast.FunctionDef(name="kernel"):
                pass
            case ast.FunctionDef(name=name):
                parts.append(_function(statement))
                main = statement if name == "reward_function" else main
            case ast.Import(names=[ast.alias(name="math", asname=None)]) | ast.Expr(value=ast.Constant()):
                pass
            case ast.Assign(targets=[ast.Name(id=name)], value=value):
                parts.append(f"const v_{name} = {_value(value)};")
            case _:
                raise NotNumeric(f"line {statement.lineno} of it is not translated")
    assert main is not None  # numeric_source saw to that
    keys = [argument.arg.removeprefix(PREFIX) for argument in main.args.args]
    arguments = ", ".join(_value(ast.parse(VALUES[key], mode="eval").body) for key in keys)
    steps = _value(ast.parse(VALUES["steps"], mode="eval").body)
    body = "\n".join(parts)
    call = f"{steps} === 1 ? 0 : checked(Number(v_reward_function({arguments})))"
    return f"(() => {{\n{body}\nreturn (v_row, v_waypoints) => {call};\n}})()"


def _function(node: ast.FunctionDef) -> str:
    names = [argument.arg for argument in node.args.args]
    extra = node.args.vararg or node.args.kwarg or node.args.kwonlyargs or node.args.defaults
    if extra:
        raise NotNumeric(f"{node.name} is called in a way that is not translated")
    stored = {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    local = ", ".join(f"v_{name}" for name in sorted(stored - set(names)))
    declared = f"let {local};\n" if local else ""
    parameters = ", ".join(f"v_{name}" for name in names)
    return f"const v_{node.name} = ({parameters}) => {{\n{declared}{_block(node.body)}}};"


def _block(statements: list[ast.stmt]) -> str:
    return "".join(_statement(statement) for statement in statements)


def _statement(node: ast.stmt) -> str:
    match node:
        case ast.Pass() | ast.Expr(value=ast.Constant()):
            return ""
        case ast.Return(value=value) if value is not None:
            return f"return {_value(value)};\n"
        case ast.Assign(targets=[ast.Name(id=name)], value=value):
            return f"v_{name} = {_value(value)};\n"
        case ast.Assign(targets=[ast.Tuple(elts=targets)], value=value) if all(
            isinstance(target, ast.Name) for target in targets
        ):
            names = ", ".join(f"v_{target.id}" for target in targets if isinstance(target, ast.Name))
            return f"[{names}] = {_value(value)};\n"
        case ast.AugAssign(target=ast.Name(id=name), op=op, value=value):
            return f"v_{name} = {_operation(op, f'v_{name}', _value(value))};\n"
        case ast.If(test=test, body=body, orelse=orelse):
            otherwise = f" else {{\n{_block(orelse)}}}" if orelse else ""
            return f"if ({_value(test)}) {{\n{_block(body)}}}{otherwise}\n"
        case ast.For(
            target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=bounds, keywords=[]), orelse=[]
        ) if 1 <= len(bounds) <= 2:
            first, last = ("0" if len(bounds) == 1 else _value(bounds[0])), _value(bounds[-1])
            counter = f"i_{node.lineno}_{node.col_offset}"
            head = f"for (let {counter} = {first}, end = {last}; {counter} < end; {counter}++)"
            return f"{head} {{\nv_{name} = {counter};\n{_block(node.body)}}}\n"
        case ast.Break():
            return "break;\n"
        case ast.Continue():
            return "continue;\n"
        case _:
            raise NotNumeric(f"line {node.lineno} of it is not translated")


def _value(node: ast.expr) -> str:
    match node:
        case ast.Constant(value=bool() as value):
            return "true" if value else "false"
        case ast.Constant(value=int() | float() as value) if math.isfinite(value) and abs(value) <= 2**53:
            return repr(value)
        case ast.Name(id=name):
            return f"v_{name}"
        case ast.BinOp(left=left, op=op, right=right):
            return _operation(op, _value(left), _value(right))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return f"(-{_value(operand)})"
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return f"(!{_value(operand)})"
        case ast.Compare(left=left, ops=ops, comparators=comparators) if all(type(op) in COMPARISONS for op in ops):
            sides = [_value(side) for side in (left, *comparators)]
            pairs = zip(sides, ops, sides[1:], strict=False)
            return "(" + " && ".join(f"{a} {COMPARISONS[type(op)]} {b}" for a, op, b in pairs) + ")"
        case ast.BoolOp(op=op, values=values):
            return "(" + (" && " if isinstance(op, ast.And) else " || ").join(map(_value, values)) + ")"
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return f"({_value(test)} ? {_value(body)} : {_value(orelse)})"
        case ast.Tuple(elts=elements):
            return f"[{', '.join(map(_value, elements))}]"
        case ast.Subscript(value=value, slice=index):
            return f"at({_value(value)}, {_value(index)})"
        case ast.Attribute(value=ast.Name(id="math"), attr="pi" | "e" | "tau" as name):
            return repr(getattr(math, name))
        case ast.Call(func=function, args=arguments, keywords=[]):
            return _call(function, ", ".join(map(_value, arguments)))
    raise NotNumeric(f"it uses {type(node).__name__}, which is not translated")


def _operation(op: ast.operator, left: str, right: str) -> str:
    if type(op) in OPERATORS:
        return f"({left} {OPERATORS[type(op)]} {right})"
    if type(op) in CHECKED:
        return f"{CHECKED[type(op)]}({left}, {right})"
    raise NotNumeric(f"it uses {type(op).__name__}, which is not translated")


def _call(function: ast.expr, arguments: str) -> str:
    match function:
        case ast.Attribute(value=ast.Name(id="math"), attr=name) if name in MATH:
            return f"checked({MATH[name]}({arguments}))"
        case ast.Name(id="len"):
            return f"{arguments}.length"
        case ast.Name(id=name) if name in BUILTINS:
            return f"{BUILTINS[name]}({arguments})"
        case ast.Name(id=name):
            return f"v_{name}({arguments})"
    raise NotNumeric(f"it calls {ast.unparse(function)}, which is not translated")
