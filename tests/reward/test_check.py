"""The static check finds mistakes with line and column, and does not cry wolf."""

from __future__ import annotations

import importlib.util
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from racecraft.errors import ConfigError, RewardError
from racecraft.reward.check import check_reward, validate_reward
from racecraft.reward.source import MAX_CHARACTERS, load_preset, preset_names


def body(*lines: str, top: str = "") -> str:
    return top + "def reward_function(params):\n" + "".join(f"    {line}\n" for line in lines)


RETURN = "return 1.0"

# source, line, column, part of the message
ERRORS = [
    ("", 1, 1, "empty"),
    (" \n\n", 1, 1, "empty"),
    ("x" * (MAX_CHARACTERS + 1), 1, 1, "140,001 characters"),
    ("def reward_function(params:\n    return 1", 1, 20, "SyntaxError"),
    ("def reward_function(params):\nreturn 1", 2, 1, "IndentationError"),
    ("return 1", 1, 1, "SyntaxError"),
    ("x = '\0'", 1, 1, "null bytes"),
    ("x =\u00a01", 1, 4, "type spaces, quotes and minus on the keyboard again"),
    ("x = \u2018speed\u2019", 1, 5, "type spaces, quotes and minus on the keyboard again"),
    ("if 1:\n    x = 1\n\ty = 2", 3, None, "Indent all lines with spaces"),
    ("```python\n" + body(RETURN) + "```\n", 1, None, "leave out the lines with ```"),
    ("x = '\ud800'", 1, 1, "not text that Python reads"),
    ("x = " + "(" * 5000, 1, None, ""),
    ("x = " + "-" * 100_000 + "1", 1, None, ""),
    ("x = 1", 1, 1, "no function 'reward_function'"),
    ("x = 1\ndef reward_fuction(params):\n    return 1.0", 2, 1, "Did you mean 'reward_fuction'?"),
    ("class A:\n    def reward_function(self, params):\n        return 1.0", 1, 1, "top level"),
    (body(RETURN) + body(RETURN), 3, 1, "defined again"),
    ("async " + body(RETURN), 1, 1, "async"),
    ("def reward_function():\n    return 1.0", 1, 1, "has 0 parameters"),
    ("def reward_function(self, params):\n    return 1.0", 1, 1, "has 2 parameters"),
    ("def reward_function(params, *, speed):\n    return 1.0", 1, 1, "has 2 parameters"),
    ("def reward_function(*, params):\n    return 1.0", 1, 1, "has 1 parameters"),
    ("def reward_function(*params):\n    return 1.0", 1, 1, "has 1 parameters"),
    ("def reward_function(*params):\n    return 1.0", 1, 1, "expected exactly one"),
    ("def reward_function(*, params):\n    return 1.0", 1, 1, "expected exactly one"),
    ("def reward_function(**params):\n    return 1.0", 1, 1, "expected exactly one"),
    (body("x = 1"), 1, 1, "never returns"),
    (body("pass"), 1, 1, "never returns"),
    (body("return"), 1, 1, "never returns"),
    (body("def inner():", "    return 1", "inner()"), 1, 1, "never returns"),
    (body("yield 1.0"), 2, 5, "yield"),
    (body("return 'fast'"), 2, 5, "type str"),
    (body("import ctypes", RETURN), 2, 5, "'import ctypes'"),
    ("import socket\n" + body(RETURN), 1, 1, "'import socket'"),
    ("import math, subprocess as s\n" + body(RETURN), 1, 1, "'import subprocess'"),
    ("import urllib.request\n" + body(RETURN), 1, 1, "'import urllib.request'"),
    ("from multiprocessing import Pool\n" + body(RETURN), 1, 1, "'import multiprocessing'"),
    ("from . import mine\n" + body(RETURN), 1, 1, "relative"),
    ("import nunpy as np\n" + body(RETURN), 1, 1, "Did you mean 'numpy'?"),
    ("import torch\n" + body(RETURN), 1, 1, "Allowed are math"),
    ("import scipy.io\n" + body(RETURN), 1, 1, "reads or writes files"),
    ("from scipy import io\n" + body(RETURN), 1, 1, "'scipy.io'"),
    ("from numpy import load\n" + body(RETURN), 1, 1, "'numpy.load'"),
    ("import numpy as np\nx = np.load('x')\n" + body(RETURN), 2, 5, "'numpy.load' reads or writes files"),
    ("import numpy\nx = numpy.lib.npyio.load\n" + body(RETURN), 2, 5, "not allowed"),
    (body("import numpy as np", "np.savetxt('x', [1])", RETURN), 3, 5, "numpy.savetxt"),
    ("import numpy as np\nnp.zeros(3).tofile('x')\n" + body(RETURN), 2, 1, "tofile"),
    ("import random\nrandom._os.system('x')\n" + body(RETURN), 2, 1, "'random._os'"),
    ("from random import _os\n" + body(RETURN), 1, 1, "'random._os'"),
    (body("open('x')", RETURN), 2, 5, "'open'"),
    (body("eval('1')", RETURN), 2, 5, "'eval'"),
    (body("f = exec", RETURN), 2, 9, "'exec'"),
    (body("compile('1', '', 'exec')", RETURN), 2, 5, "'compile'"),
    (body("input()", RETURN), 2, 5, "'input'"),
    (body("__import__('os')", RETURN), 2, 5, "'__import__'"),
    (body("x = __builtins__", RETURN), 2, 9, "'__builtins__'"),
    (body("x = ().__class__.__bases__", RETURN), 2, 9, "'.__bases__'"),
    (body("x = getattr(params, '__globals__')", RETURN), 2, 9, "'.__globals__'"),
    (body("exit()", RETURN), 2, 5, "'exit'"),
    (body("return params['speeed']"), 2, 19, "Did you mean 'speed'?"),
    (body("return params['Speed'] + params['on_track']"), 2, 19, "no key 'Speed'"),
    (body("return params['zzz']"), 2, 19, "The keys are all_wheels_on_track"),
    (
        "def help_me(params):\n    return params['progres']\n" + body("return help_me(params)"),
        2,
        19,
        "'progress'",
    ),
    (
        "def inner(p):\n    return p['progres']\ndef outer(a, *, q):\n    return inner(q)\n"
        + body("return outer(1, q=params)"),
        2,
        14,
        "p has no key 'progres'.",
    ),
    (
        body("def near():", "    return params['progres']", "return near()"),
        3,
        23,
        "'progress'",
    ),
    (
        body("w = max([{'k': 1}], key=lambda params: params['k'])", "return params['progres'] + w['k']"),
        3,
        19,
        "'progress'",
    ),
    (
        "def count(params, n):\n    return count(params, n - 1) if n else params['progres']\n"
        + body("return count(params, 3)"),
        2,
        50,
        "'progress'",
    ),
    (body("reward = 1.0", "return rewrad"), 3, 12, "'rewrad' is not defined. Did you mean 'reward'?"),
    (body("return math.pi"), 2, 12, "'math' is not defined"),
    (body("return [y for x in range(3)][0]"), 2, 13, "'y' is not defined"),
    ("x = undefined_thing\n" + body(RETURN), 1, 5, "'undefined_thing' is not defined"),
    ("def outer():\n    reward_function = 1\nx = outer()", 1, 1, "top level"),
    ("import requests\n" + body(RETURN), 1, 1, "'import requests'"),
    ("from tempfile import TemporaryFile\n" + body(RETURN), 1, 1, "'import tempfile'"),
    ("import racecraft\n" + body(RETURN), 1, 1, "'import racecraft'"),
    ("import test.support\n" + body(RETURN), 1, 1, "'import test.support'"),
    ("from os import _exit\n" + body(RETURN), 1, 1, "'os._exit'"),
    ("from numpy import save as payload\n" + body(RETURN), 1, 1, "'numpy.save'"),
    ("import numpy as load\nx = load.loadtxt('x')\n" + body(RETURN), 2, 5, "'numpy.loadtxt'"),
    ("import numpy as np\nx = np.memmap('x')\n" + body(RETURN), 2, 5, "'numpy.memmap'"),
    ("import numpy as np\nx = np.fromfile\n" + body(RETURN), 2, 5, "'numpy.fromfile'"),
    ("import numpy as np\nx = np.genfromtxt('x')\n" + body(RETURN), 2, 5, "'numpy.genfromtxt'"),
    ("import numpy as np\nnp.savez('x')\n" + body(RETURN), 2, 1, "'numpy.savez'"),
]


def test_a_question_of_python_s_ends_as_one():
    (problem,) = check_reward(body("print 'hello'", RETURN))
    assert str(problem).endswith("Did you mean print(...)?")


@pytest.mark.parametrize(("source", "line", "column", "text"), ERRORS, ids=range(len(ERRORS)))
def test_errors_have_a_place(source, line, column, text):
    errors = [problem for problem in check_reward(source) if problem.severity == "error"]
    assert errors
    first = errors[0]
    assert text in str(first)
    assert first.line == line
    assert first.column == column or column is None
    with pytest.raises(RewardError) as caught:
        validate_reward(source)
    assert (caught.value.line, caught.value.column) == (first.line, first.column)
    assert f"line {line}" in str(caught.value)


WARNINGS = [
    (body("if params['speed'] > 1:", "    return 1.0"), 1, "can reach its end without"),
    (body("if params['speed'] > 1:", "    return None", RETURN), 3, "returns None"),
    (body("for x in [1]:", "    return 1.0"), 1, "can reach its end"),
    (body("try:", "    return 1.0", "except KeyError:", "    pass"), 1, "can reach its end"),
    (body("while True:", "    if params['x']: break", "    return 1.0"), 1, "can reach its end"),
    (body("match params['x']:", "    case 1: return 1.0"), 1, "can reach its end"),
    (body("return params.get('speeed', 1.0)"), 2, "Did you mean 'speed'?"),
    (body("try:", "    return params['speeed']", "except KeyError:", "    return 1.0"), 3, "no key 'speeed'"),
    (
        "def weight(params):\n    return params.get('w', 1) + params['v']\n"
        + body("weight(params)", "return weight({'w': 1, 'v': 2})"),
        2,
        "no key 'w'",
    ),
    ("class R:\n    def pay(self, p):\n        return p['w']\n" + body("return R().pay(params)"), 3, "no key 'w'"),
    (
        "def pay(params):\n    return params['w']\n"
        + body("try:", "    return pay(params)", "except KeyError:", "    return 1.0"),
        2,
        "no key 'w'",
    ),
    (
        "def outer(params):\n    return inner(params)\ndef inner(params):\n    return params['w']\n"
        + body("outer({})", "return outer(params)"),
        4,
        "no key 'w'",
    ),
    (
        "@cached\ndef pay(params):\n    return params['w']\n".replace("cached", "staticmethod")
        + body("return pay(params)"),
        3,
        "no key 'w'",
    ),
    (body("same = params", "same['w'] = 1", "return params['w']"), 4, "no key 'w'"),
    (body("(same := params)['w'] = 1", "return params['w']"), 3, "no key 'w'"),
    ("add = lambda p: p.update(w=1)\n" + body("add(params)", "return params['w']"), 4, "no key 'w'"),
    (body("import time", "return time.time()"), 3, "clock on the wall"),
    ("import numpy as np\nrng = np.random.default_rng()\n" + body(RETURN), 2, "without a seed"),
    ("import random\nrandom.seed()\n" + body(RETURN), 2, "without a seed"),
    ("from numpy.random import PCG64, Generator\nrng = Generator(PCG64())\n" + body(RETURN), 2, "without a seed"),
    (body("import logging", "logging.info('x')", RETURN), 2, "'import logging' is refused by AWS; here it is allowed."),
    ("import io\n" + body(RETURN), 1, "'import io' is refused by AWS"),
    ("from pathlib import PurePath\n" + body(RETURN), 1, "'import pathlib' is refused by AWS"),
    ("import os.path\n" + body("return os.path.sep == '/'"), 1, "'import os.path' is refused by AWS"),
    ("import sys\n" + body("print('x', file=sys.stderr)", RETURN), 1, "'import sys' is refused by AWS"),
    (body("return 1.0 if params['x'] is 1 else 2.0"), 2, '"is" with'),
    (body(r"x = '\d'", RETURN), 2, "invalid escape sequence"),
]


@pytest.mark.parametrize(("source", "line", "text"), WARNINGS, ids=range(len(WARNINGS)))
def test_warnings_pass_validation(source, line, text):
    problems = check_reward(source)
    assert {problem.severity for problem in problems} == {"warning"}
    assert problems[0].line == line
    assert text in str(problems[0])
    validate_reward(source)


@pytest.mark.parametrize(
    "call",
    [
        "logging.basicConfig(filename='reward.log')",
        "logging.FileHandler('reward.log')",
        "logging.handlers.RotatingFileHandler('reward.log')",
    ],
)
def test_a_log_file_is_a_warning_that_says_where_its_lines_are(call):
    problems = check_reward(f"import logging, logging.handlers\n{call}\n" + body(RETURN))
    assert {problem.severity for problem in problems} == {"warning"}
    assert [problem.line for problem in problems] == [1, 1, 2]
    assert "No log file is written. Its lines are kept with what the function prints." in str(problems[2])
    assert "log file" not in str(check_reward("import logging\nlogging.basicConfig(level=10)\n" + body(RETURN)))


FINE = [
    body(RETURN),
    body("return int(params['speed'] > 1)"),
    body("payload = 3.0", "saved_speed = payload", "return saved_speed"),
    body("load = {'x': 1.0}", "save = load", "return save['x']"),
    body("return TABLE.load", top="class TABLE:\n    load = 1.0\n"),
    body("return TABLE.tofile()", top="class Table:\n    def tofile(self): return 1.0\nTABLE = Table()\n"),
    body("import math", "import numpy as np", "from scipy.spatial import distance", "return math.pi"),
    body("return float(np.linalg.norm([1]))", top="import numpy as np\n"),
    body("return next(itertools.count())", top="import itertools, collections, functools, statistics, bisect\n"),
    body("return json.loads('1')", top="import json\n"),
    body("def open(x): return x", "return open(1.0)"),
    body("input = 3.0", "return input"),
    body("return re.compile('1').pattern == '1'", top="import re\n"),
    body("pattern = params['x']", "return pattern.eval if False else 1.0"),
    body("return sqrt(2)", top="from math import *\n"),
    body("raise ValueError('not written yet')"),
    body("if params['x']:", "    return 1.0", "else:", "    return 2.0"),
    body("while True:", "    return 1.0"),
    body("with A() as a:", "    return a", top="class A:\n    __enter__ = __exit__ = None\n"),
    body("try:", "    return 1.0", "except KeyError:", "    return 2.0"),
    body("try:", "    x = 1", "finally:", "    return 2.0"),
    body("match params['x']:", "    case 1: return 1.0", "    case _: return 2.0"),
    body("params['mine'] = 1.0", "return params['mine']"),
    body("params = dict(params)", "return params['anything']"),
    body("params.update(a=1)", "return params['a']"),
    body("return params['sim_time'] if 'on_track' not in params else params['on_track']"),
    body("return params.get('speed')"),
    "def weight(params):\n    return params['w']\n" + body("return weight({'w': 2.0})"),
    body("w = max([{'k': 1}], key=lambda params: params['k'])", "return w['k']"),
    "class Car:\n    def opt(self, params):\n        return params['w']\n" + body("return Car().opt({'w': 2.0})"),
    body("def weight(params):", "    return params['w']", "return weight({'w': 2.0})"),
    "def add(p):\n    p['mine'] = 1.0\n" + body("add(params)", "return params['mine']"),
    "def add(p):\n    p.update(mine=1.0)\n" + body("add(params)", "return params['mine']"),
    "class Car:\n    @staticmethod\n    def add(p, q):\n        q['w'] = p\n"
    + body("Car.add(1, params)", "return params['w']"),
    "def where(params):\n    params = {'a': params['x']}\n    return params['a']\n" + body("return where(params)"),
    "def one(p):\n    p = {'w': 1}\n    return two(p)\ndef two(p):\n    return p['w']\n" + body("return one(params)"),
    body("def weight(params, other=params['x']):", "    return params['w'] + other", "return weight({'w': 2.0})"),
    "def reward_function(p, /):\n    return p['speed']",
    "def reward_function(params, verbose=True, *rest, k=1, **more):\n    return params['speed'] * k",
    body("global last", "last = 1.0", "return last"),
    body("return float(np.sqrt(4.0))", top="def load():\n    global np\n    import numpy as np\nload()\n"),
    body("return (lambda a, *b, **c: a)(1.0)"),
    body("return sum(x for x in range(3) if x)"),
    body("if __name__ == '__main__': return 1.0", "return 2.0"),
    body("try:", "    return 1 / 0", "except ZeroDivisionError as error:", "    print(error)", "    return 0.0"),
    body("if (n := len(params)) > 1: return n", RETURN),
    body(
        "return A().b",
        top="class A:\n    def __init__(self):\n        super().__init__()\n        self.b = 1.0\n",
    ),
    body("return float(type(params).__name__ == params.__class__.__name__)"),
    body("del params['x']", RETURN),
    "from __future__ import annotations\n" + body(RETURN),
    "# -*- coding: utf-8 -*-\n'''Grüße'''\n" + body(RETURN) + "print(reward_function({}))\n",
    body(RETURN).replace("\n", "\r\n"),
    body(RETURN).replace("    ", "\t"),
    "if True:\n    def reward_function(params):\n        return 1.0",
    "reward_function = lambda params: params['speed']",
    "class Reward:\n    def __call__(self, params):\n        return 1.0\nreward_function = Reward()",
    "from functools import partial\ndef f(k, params):\n    return k\nreward_function = partial(f, 1.0)",
    body(
        "download = upload = reload = autosave = 1.0", "loader = {'save': load_factor}", RETURN, top="load_factor = 2\n"
    ),
    body("return self_load(params)", top="def self_load(params):\n    return 1.0\n"),
    body("loads = [1]", "return max(loads)"),
    body("return Loader().load()", top="class Loader:\n    def load(self): return 1.0\n    def save(self): pass\n"),
    body("opened = evaluate = executed = compiled = 1.0", "return opened + evaluate + executed + compiled"),
    body("globals()['last'] = 1.0", "return last"),
    body("import pprint, textwrap, contextlib, traceback", RETURN),
    body("with contextlib.suppress(KeyError): return 1.0", RETURN, top="import contextlib\n"),
    body("x = params.copy()", "return x.pop('speed')"),
    "import numpy as np, scipy.spatial as sp, shapely\nfrom shapely.geometry import Point\n" + body(RETURN),
]


def test_what_is_no_text_is_no_source():
    for wrong in (None, b"def reward_function(params):\n    return 1.0\n"):
        for check in (check_reward, validate_reward):
            with pytest.raises(ConfigError, match=r"source is .*; use the text of a reward function"):
                check(wrong)


@pytest.mark.parametrize("source", FINE, ids=range(len(FINE)))
def test_no_false_alarms(source):
    assert check_reward(source) == []


@pytest.mark.parametrize(
    ("source", "severity"),
    [
        ("import shapely.geometry\n" + body(RETURN), "error"),
        (body("from scipy import interpolate", RETURN), "error"),
        ("try:\n    import scipy\nexcept ImportError:\n    scipy = None\n" + body(RETURN), "warning"),
    ],
)
def test_a_package_that_is_allowed_but_missing_says_how_to_get_it(monkeypatch, source, severity):
    installed = importlib.util.find_spec
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name: None if name in ("scipy", "shapely") else installed(name)
    )
    (problem,) = check_reward(source)
    assert problem.severity == severity
    assert "not installed" in problem.message
    assert problem.hint in ("Install it: pip install scipy", "Install it: pip install shapely")


@pytest.mark.parametrize("name", preset_names())
def test_presets_are_clean(name):
    assert check_reward(load_preset(name)) == []


def test_all_errors_are_counted():
    with pytest.raises(RewardError, match=r"\(2 more\)"):
        validate_reward("import socket\nimport ssl\n" + body("return params['speeed']"))


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=200))
def test_any_text_gives_problems_and_never_an_exception(text):
    for problem in check_reward(text):
        assert problem.line >= 1
        assert problem.column >= 1


@pytest.mark.parametrize(
    "source",
    [
        body(RETURN) + "".join(f"speedname{i} = 0\nspeednome{i}\n" for i in range(800)),
        body(RETURN) + "a" * 30_000 + "b = 0\n" + "a" * 30_000 + "c\n",
        "".join(f"def f{i}(p):\n return f{i + 1}(p, p)['k{i}']\n" for i in range(1200)) + body("return f0(params)"),
        "def f("
        + ", ".join(f"p{i}" for i in range(5000))
        + "):\n    return p0['k']\n"
        + body("return f(" + "params, " * 5000 + ")"),
        body(RETURN) + "import " + "os.\\\n" * 20_000 + "path\n",
    ],
    ids=[
        "names that resemble others",
        "long names that resemble each other",
        "helpers of helpers",
        "a long call",
        "a name of 20,000 parts",
    ],
)
def test_a_strangers_source_is_looked_at_soon(source: str) -> None:
    """A server looks at it while others wait."""
    begun = time.process_time()
    assert check_reward(source)
    assert time.process_time() - begun < 1.0


def test_a_name_of_another_function_is_not_what_was_meant():
    source = body("def paid(bonus):", "    return 2 * bonus", "return paid(bonus)")
    (problem,) = check_reward(source)
    assert (problem.line, problem.message) == (4, "The name 'bonus' is not defined.")
    assert "'bonus'" not in problem.hint
