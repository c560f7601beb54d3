"""Translates a reward function to JavaScript, so that a page pays with it before it has any Python.

    reward_function.py -> *javascript* -> the worker of the page

Both count in the same doubles, and where Python raises, a mistake is thrown. ``params`` is an object over the row of
the simulation that computes what is asked for, as `racecraft.reward.make_params` does; a function that remembers is
made anew for every car. Translated is what the presets are written in: arithmetic, comparisons, conditions, loops over
lists and ranges, math's functions, and dicts of numbers. Anything else is refused: that needs Python.
"""

from __future__ import annotations

import ast
import math
from typing import Final

from racecraft.reward.params import (
    ANGLE_PARTS,
    ANGLE_PARTS_OF_RADIAN,
    FIRST_MOVING_KIND,
    OBJECT_HEADER_SIZE,
    OBJECT_SIZE,
    SPEED_PARTS,
    TEMPLATE,
    WHOLE,
)
from racecraft.reward.state import keeps_state
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS

MATH: Final = {
    **{name: f"Math.{name}" for name in ("acos", "asin", "atan", "atan2", "ceil", "cos", "cosh", "exp", "floor")},
    **{name: f"Math.{name}" for name in ("hypot", "log", "log10", "log2", "sin", "sinh", "sqrt", "tan", "tanh")},
    **{"trunc": "Math.trunc", "fabs": "Math.abs", "radians": "radians", "degrees": "degrees", "pow": "power"},
}
BUILTINS: Final = {"abs": "Math.abs", "float": "Number", "int": "Math.trunc", "min": "lesser", "max": "greater"}
OPERATORS: Final = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*"}
CHECKED: Final = {ast.Div: "divided", ast.Mod: "remainder", ast.FloorDiv: "floorDivided", ast.Pow: "power"}
COMPARISONS: Final = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "===", ast.NotEq: "!=="}


def _row(column: str) -> str:
    return f"this.row[{ROW_COLUMNS.index(column)}]"


def _header(column: str) -> str:
    return f"this.row[{len(ROW_COLUMNS) + OBJECT_HEADER.index(column)}] ?? 0"


def _each(value: str, *columns: str) -> str:
    """A list of a value of every object: `value` with @0, @1 for the columns."""
    for number, column in enumerate(columns):
        value = value.replace(f"@{number}", f"row[at + {OBJECT_COLUMNS.index(column)}]")
    return f"this.each((row, at) => {value})"


PARAMS: Final = {  # of every key, as `make_params` computes it
    **{key: _row(key) for key in ("x", "y", "steps", "projection_distance", "track_width", "track_length")},
    **{key: f"{_row(key)} !== 0" for key in ("all_wheels_on_track", "is_crashed", "is_offtrack", "is_reversed")},
    "heading": f"turned({_row('heading')} * 57.29577951308232)",
    "speed": f"({_row('speed')} * {SPEED_PARTS} + {WHOLE} - {WHOLE}) / {SPEED_PARTS}",
    "steering_angle": f"({_row('steering_angle')} * {ANGLE_PARTS_OF_RADIAN} + {WHOLE} - {WHOLE}) / {ANGLE_PARTS}",
    "progress": f"{_row('progress')} < 1 ? {_row('progress')} * 100 : 100",
    "distance_from_center": f"Math.abs({_row('offset')})",
    "is_left_of_center": f"{_row('offset')} > 0",
    "closest_waypoints": f"[{_row('closest_prev')}, {_row('closest_next')}]",
    "waypoints": f"this.lines[{_row('track_index')}]",
    "sim_time": _row("time"),
    "closest_objects": f"[{_header('closest_object_prev')}, {_header('closest_object_next')}]",
    "object_in_camera": f"({_header('object_in_camera')}) !== 0",
    "objects_location": _each("[@0, @1]", "object_x", "object_y"),
    "objects_left_of_center": _each("@0 > 0", "object_offset"),
    "objects_speed": _each("@0", "object_speed"),
    "objects_heading": _each(f"@0 >= {FIRST_MOVING_KIND:g} ? @1 : 0", "object_kind", "object_heading"),
    "objects_distance_from_center": _each("Math.abs(@0)", "object_offset"),
    "objects_distance": _each("@0", "object_distance"),
}
assert PARAMS.keys() == TEMPLATE.keys()

GETTERS: Final = "\n".join(f"  get {key}() {{ return {value}; }}" for key, value in PARAMS.items())
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
const isTrue = (value) => (Array.isArray(value) ? value.length > 0 : Boolean(value));
const turned = (angle) => (angle >= -180 && angle <= 180 ? angle : remainder(angle + 180, 360) - 180);
const at = (list, index) => {{
  const found = list[index < 0 ? index + list.length : index];
  if (found === undefined) throw new Error("The reward function looked for a place in a list that is not there.");
  return found;
}};
const known = (value) => {{
  if (value !== undefined) return value;
  throw new Error("The reward function looked for a key that is not there.");
}};
class Params {{
  row;
  lines;
  each(value) {{
    const all = [];
    for (let at = {len(ROW_COLUMNS) + OBJECT_HEADER_SIZE}; at < this.row.length; at += {OBJECT_SIZE}) all.push(value(this.row, at));
    return all;
  }}
{GETTERS}
}}
"""  # noqa: E501


class NotTranslated(Exception):
    """Why a reward function needs Python."""


def javascript(sources: dict[str, str]) -> str:
    """A module with ``rewards``, by name: whether it ``remembers``, and ``make()``: (row, waypoints) -> reward.

    Rows are those of one car; waypoints are (K, 2) of every track index.

    Args:
        sources: Texts of reward functions that passed the check, by name.

    Raises:
        NotTranslated: One does more than what can be translated.
    """
    rewards = ",\n".join(f'  "{name}": {_reward(source)}' for name, source in sources.items())
    return f"{PRELUDE}export const rewards = {{\n{rewards},\n}};\n"


def _reward(source: str) -> str:
    body = "\n".join(_at_top(statement) for statement in ast.parse(source).body)
    steps = ROW_COLUMNS.index("steps")
    pay = (
        f"row[{steps}] === 1 ? 0 : (params.row = row, params.lines = lines, checked(Number(v_reward_function(params))))"
    )
    remembers = "true" if keeps_state(source) else "false"
    made = f"const params = new Params();\n{body}\nreturn (row, lines) => {pay};"
    return f"{{ remembers: {remembers}, make: () => {{\n{made}\n}} }}"


def _at_top(node: ast.stmt) -> str:
    match node:
        case ast.FunctionDef(decorator_list=[]):
            return _function(node)
        case ast.Import(names=[ast.alias(name="math", asname=None)]) | ast.Expr(value=ast.Constant()):
            return ""
        case ast.Assign(targets=[ast.Name(id=name)], value=value):
            return f"const v_{name} = {_value(value)};"
        case _:
            raise NotTranslated(f"line {node.lineno} of it is not translated")


def _function(node: ast.FunctionDef) -> str:
    names = [argument.arg for argument in node.args.args]
    extra = node.args.vararg or node.args.kwarg or node.args.kwonlyargs or node.args.defaults
    if extra:
        raise NotTranslated(f"{node.name} is called in a way that is not translated")
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
        case ast.Assign(targets=[target], value=value):
            return f"{_target(target)} = {_value(value)};\n"
        case ast.AugAssign(target=ast.Name(id=name), op=op, value=value):
            return f"v_{name} = {_operation(op, f'v_{name}', _value(value))};\n"
        case ast.If(test=test, body=body, orelse=orelse):
            otherwise = f" else {{\n{_block(orelse)}}}" if orelse else ""
            return f"if ({_truth(test)}) {{\n{_block(body)}}}{otherwise}\n"
        case ast.For(
            target=ast.Name(id=name), iter=ast.Call(func=ast.Name(id="range"), args=bounds, keywords=[]), orelse=[]
        ) if 1 <= len(bounds) <= 2:
            first, last = ("0" if len(bounds) == 1 else _value(bounds[0])), _value(bounds[-1])
            counter = f"i_{node.lineno}_{node.col_offset}"
            head = f"for (let {counter} = {first}, end = {last}; {counter} < end; {counter}++)"
            return f"{head} {{\nv_{name} = {counter};\n{_block(node.body)}}}\n"
        case ast.For(target=target, iter=ast.Subscript() | ast.Name() as every, orelse=[]):
            return f"for ({_target(target)} of {_value(every)}) {{\n{_block(node.body)}}}\n"
        case ast.Break():
            return "break;\n"
        case ast.Continue():
            return "continue;\n"
        case _:
            raise NotTranslated(f"line {node.lineno} of it is not translated")


def _target(node: ast.expr) -> str:
    match node:
        case ast.Name(id=name):
            return f"v_{name}"
        case ast.Subscript(value=ast.Name(id=name), slice=ast.Constant(value=str() as key)) if key.isidentifier():
            return f"v_{name}.{key}"
        case ast.Tuple(elts=elements):
            return f"[{', '.join(map(_target, elements))}]"
    raise NotTranslated(f"it stores into {ast.unparse(node)}, which is not translated")


def _truth(node: ast.expr) -> str:
    """What Python takes for true: an empty list is not."""
    match node:
        case ast.BoolOp(op=op, values=values):
            return "(" + (" && " if isinstance(op, ast.And) else " || ").join(map(_truth, values)) + ")"
        case ast.Compare() | ast.UnaryOp(op=ast.Not()):
            return _value(node)
    return f"isTrue({_value(node)})"


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
            return f"(!{_truth(operand)})"
        case ast.Compare(left=left, ops=ops, comparators=comparators) if all(type(op) in COMPARISONS for op in ops):
            sides = [_value(side) for side in (left, *comparators)]
            pairs = zip(sides, ops, sides[1:], strict=False)
            return "(" + " && ".join(f"{a} {COMPARISONS[type(op)]} {b}" for a, op, b in pairs) + ")"
        case ast.BoolOp(op=op, values=values):
            return "(" + (" && " if isinstance(op, ast.And) else " || ").join(map(_value, values)) + ")"
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return f"({_truth(test)} ? {_value(body)} : {_value(orelse)})"
        case ast.Tuple(elts=elements):
            return f"[{', '.join(map(_value, elements))}]"
        case ast.Dict(keys=keys, values=values):
            return _dict(keys, values)
        case ast.Subscript(value=value, slice=ast.Constant(value=str() as key)) if key.isidentifier():
            return f"known({_value(value)}.{key})"
        case ast.Subscript(value=value, slice=index):
            return f"at({_value(value)}, {_value(index)})"
        case ast.Attribute(value=ast.Name(id="math"), attr="pi" | "e" | "tau" as name):
            return repr(getattr(math, name))
        case ast.Call(func=function, args=arguments, keywords=[]):
            return _call(function, ", ".join(map(_value, arguments)))
    raise NotTranslated(f"it uses {type(node).__name__}, which is not translated")


def _dict(keys: list[ast.expr | None], values: list[ast.expr]) -> str:
    names = [key.value for key in keys if isinstance(key, ast.Constant) and isinstance(key.value, str)]
    if len(names) < len(keys) or not all(map(str.isidentifier, names)):
        raise NotTranslated("it has a dict whose keys are no plain words")
    fields = [f"{name}: {_value(value)}" for name, value in zip(names, values, strict=True)]
    return "{" + ", ".join(["__proto__: null", *fields]) + "}"


def _operation(op: ast.operator, left: str, right: str) -> str:
    if type(op) in OPERATORS:
        return f"({left} {OPERATORS[type(op)]} {right})"
    if type(op) in CHECKED:
        return f"{CHECKED[type(op)]}({left}, {right})"
    raise NotTranslated(f"it uses {type(op).__name__}, which is not translated")


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
    raise NotTranslated(f"it calls {ast.unparse(function)}, which is not translated")
