"""Modules are loaded before user code runs, as no file can be opened then; what the source names is there in time."""

from __future__ import annotations

import sys

import pytest
from workers import function, running

from racecraft.errors import RewardError
from racecraft.reward.modules import needed_modules, used_words

LATE = {
    "an import inside a function": ("import statistics", "return statistics.mean([1, 3])"),
    "a part of numpy by attribute": ("import numpy as np", "return abs(np.fft.fft([1.0, 1.0]))[0]"),
    "a part of numpy by another name": (
        "import numpy as np",
        "other = np",
        "return getattr(other, 'polynomial').polynomial.polyval(1.0, [1.0, 1.0])",
    ),
    "everything of numpy": ("return float(add(1.0, 1.0))",),
    "a part of scipy by attribute": ("import scipy", "return float(scipy.interpolate.interp1d([0, 1], [2, 2])(0.5))"),
    "a part of scipy": ("from scipy import spatial", "return spatial.distance.euclidean([0, 0], [2, 0])"),
    "dates": ("import datetime", "return datetime.datetime.strptime('2', '%d').day"),
    "an optional package": ("try: import pandas", "except ImportError: return 2.0", "return 1.0"),
    "an error with its trace": (
        "import traceback",
        "try: 1 / 0",
        "except ZeroDivisionError: return float('ZeroDivisionError' in traceback.format_exc()) + 1.0",
    ),
    "a count": ("import collections", "return collections.Counter('abb').most_common(1)[0][1]"),
    "a seed of text": ("import random", "random.seed('x')", "return 2.0"),
    "a single dispatch": (
        "import functools",
        "f = functools.singledispatch(lambda x: 1.0)",
        "f.register(int, lambda x: 2.0)",
        "return f(3)",
    ),
    "a warning": ("import warnings", "warnings.warn('slow')", "return 2.0"),
    "random bytes": ("import secrets, uuid", "return 2.0 if secrets.token_bytes(4) and uuid.uuid4() else 0.0"),
    "exact numbers": ("import decimal, fractions", "return float(decimal.Decimal(1)) + float(fractions.Fraction(1))"),
    "the time": ("import time", "time.strftime('%H')", "return 2.0 * (time.time() > 1e9)"),
}


@pytest.mark.costly
@pytest.mark.parametrize("name", LATE)
def test_what_is_loaded_late_is_there(track, rows, name):
    top = "from numpy import *\n" if name == "everything of numpy" else ""
    body = LATE[name]
    if "scipy" in " ".join(body):
        pytest.importorskip("scipy")
    with running(function(*body, top=top), track, timeout_s=5.0) as worker:
        assert worker(rows).tolist() == [2.0] * len(rows)


def test_what_the_source_does_not_name_is_refused_in_words(track, rows):
    source = function("import importlib", "importlib.import_module('this' + 'is')", "return 1.0")
    with running(source, track) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert caught.value.line == 3
    assert "thisis cannot be loaded here: import it by its plain name" in str(caught.value)


def test_a_package_that_is_missing_is_named(track, rows):
    with running(function("import requests", "return 1.0"), track) as worker, pytest.raises(RewardError) as caught:
        worker(rows)
    assert "'requests'" in str(caught.value) or "requests cannot be loaded" in str(caught.value)


def test_no_file_can_be_read_while_user_code_runs(track, rows):
    source = function("return len(open('/etc/passwd').read())")
    with running(source, track) as worker, pytest.raises(RewardError, match="may not read files"):
        worker(rows)


def test_modules_are_read_from_the_source():
    source = function(
        "from collections import deque",
        "import os.path, requests, racecraft",
        "from . import secret",
        "time.strptime('', '')",
        top="import scipy.interpolate as s, numpy\nfrom math import *\n",
    )
    assert needed_modules(source) == [
        *("_strptime", "collections", "collections.deque", "math", "math.*", "numpy", "os.path", "scipy.interpolate"),
    ]
    assert {"params", "reward_function", "deque"} - set(used_words(source)) == {"params", "reward_function"}
    assert "fft" in used_words("getattr(np, 'fft')")
    assert needed_modules("größe = 1.0") == ["unicodedata"]  # what Python's compiler asks when it meets the name
    for broken in ("def", "\0", "(" * 10_000):
        assert needed_modules(broken) == used_words(broken) == []


def test_a_source_that_asks_for_the_trainers_packages_gets_none_of_them(track, rows):
    source = function("return float('racecraft' in sys.modules or 'torch' in sys.modules)", top="import sys\n")
    with running(f"try: import torch, racecraft\nexcept ImportError: pass\n{source}", track) as worker:
        assert worker(rows).sum() == 0.0
    assert "racecraft" in sys.modules
