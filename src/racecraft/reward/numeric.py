"""Rewrites a purely numeric reward function so that it can be compiled: no dict, one loop over rows of numbers.

    def reward_function(params):            def reward_function(speed, x):
        return params["speed"] * 2    ->        return speed * 2
                                            def kernel(rows, rewards, waypoints): ... one call a row

Nothing is run here. The worker process compiles the result with numba, where it is installed, and believes it only
after it gave the interpreter's rewards on the first rows.
"""

from __future__ import annotations

import ast
from typing import Final

from racecraft.reward.params import ANGLE_PARTS, ANGLE_PARTS_OF_RADIAN, SPEED_PARTS, WHOLE
from racecraft.reward.state import keeps_state
from racecraft.sim.columns import ROW_COLUMNS

PREFIX: Final = "_params_"


class NotNumeric(Exception):
    """Why a reward function cannot be compiled."""


def numeric_source(source: str) -> str:
    """The source of a module with ``kernel(rows, rewards, waypoints)``.

    Args:
        source: Text of a ``reward_function.py`` that passed the check.

    Raises:
        NotNumeric: It does more than compute with the numbers of one call.
    """
    if keeps_state(source):
        raise NotNumeric("it remembers something between calls")
    if "random" in source:
        raise NotNumeric("it draws random numbers")
    tree = ast.parse(source)
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    main = next((function for function in functions if function.name == "reward_function"), None)
    if main is None:
        raise NotNumeric("reward_function is not a plain function")
    if any(isinstance(node, ast.Name) and node.id == "print" for node in ast.walk(tree)):
        raise NotNumeric("it prints")
    if sum(isinstance(node, ast.arg) for node in ast.walk(main.args)) != 1 or not main.args.args:
        raise NotNumeric("it takes more than params")
    name = main.args.args[0].arg
    rewriter = _Rewriter(name)
    main.body = [rewriter.visit(statement) for statement in main.body]
    if any(isinstance(node, ast.Name) and node.id == name for node in ast.walk(main)):
        raise NotNumeric(f"it uses {name} as a whole, not only single keys of it")
    keys = sorted(rewriter.keys)
    main.args.args = [ast.arg(PREFIX + key) for key in keys]
    main.decorator_list, main.returns = [], None
    arguments = ", ".join(f"({VALUES[key]})" for key in keys)
    tree.body += ast.parse(KERNEL.format(arguments=arguments)).body
    return ast.unparse(ast.fix_missing_locations(tree))


class _Rewriter(ast.NodeTransformer):
    """Makes ``params["speed"]`` and ``params.get("speed")`` a variable of its own."""

    def __init__(self, params: str) -> None:
        self.params = params
        self.keys = set[str]()

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        self.generic_visit(node)
        if isinstance(node.value, ast.Name) and node.value.id == self.params and isinstance(node.ctx, ast.Load):
            return self._variable(node.slice) or node
        return node

    def visit_Call(self, node: ast.Call) -> ast.expr:
        self.generic_visit(node)
        function = node.func
        match function:
            case ast.Attribute(value=ast.Name(id=self.params), attr="get") if node.args:
                return self._variable(node.args[0]) or node
            case _:
                return node

    def _variable(self, key: ast.expr) -> ast.expr | None:
        if not isinstance(key, ast.Constant) or key.value not in VALUES:
            return None
        self.keys.add(key.value)
        return ast.Name(PREFIX + key.value, ast.Load())


def _at(column: str) -> str:
    return f"row[{ROW_COLUMNS.index(column)}]"


VALUES: Final = {  # of every key that is a number or made of numbers, as `make_params` computes it
    **{key: _at(key) for key in ("x", "y", "steps", "projection_distance", "track_width", "track_length")},
    **{key: f"{_at(key)} != 0.0" for key in ("all_wheels_on_track", "is_crashed", "is_offtrack", "is_reversed")},
    "heading": f"_degrees({_at('heading')})",
    "speed": f"({_at('speed')} * {SPEED_PARTS} + {WHOLE} - {WHOLE}) / {SPEED_PARTS}",
    "steering_angle": f"({_at('steering_angle')} * {ANGLE_PARTS_OF_RADIAN} + {WHOLE} - {WHOLE}) / {ANGLE_PARTS}",
    "progress": f"{_at('progress')} * 100.0 if {_at('progress')} < 1.0 else 100.0",
    "distance_from_center": f"abs({_at('offset')})",
    "is_left_of_center": f"{_at('offset')} > 0.0",
    "closest_waypoints": f"(int({_at('closest_prev')}), int({_at('closest_next')}))",
    "waypoints": f"waypoints[int({_at('track_index')})]",
    "sim_time": _at("time"),
}
KERNEL: Final = f"""
def _degrees(angle):
    degrees = angle * 57.29577951308232
    if not -180.0 <= degrees <= 180.0:
        degrees = (degrees + 180.0) % 360.0 - 180.0
    return degrees

def kernel(rows, rewards, waypoints):
    for index in range(rows.shape[0]):
        row = rows[index]
        if {_at("steps")} == 1.0:
            rewards[index] = 0.0
        else:
            rewards[index] = reward_function({{arguments}})
"""
