"""What a reward function remembers between calls is seen in its source: a no must be right, a yes may be careful."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from racecraft.reward import keeps_state, load_preset, preset_names

FUNCTIONS = sorted((Path(__file__).parent / "functions").glob("*.py"))


def body(*lines: str, top: str = "") -> str:
    return top + "def reward_function(params):\n" + "".join(f"    {line}\n" for line in lines)


RETURN = "return 1.0"
CLASS = "class R:\n    def step(self):\n        {}\n        return 1.0\nreward = R()\n"

STATEFUL = [
    body("global last", "last = 1.0", "return last"),
    body("globals()['last'] = 1.0", RETURN),
    body("memory['x'] = 1.0", RETURN, top="memory = {}\n"),
    body("memory['x']['y'] += 1.0", RETURN, top="memory = {'x': {'y': 0}}\n"),
    body("del memory[0]", RETURN, top="memory = [1, 2, 3]\n"),
    body("memory.append(1.0)", RETURN, top="memory = []\n"),
    body("memory.popleft()", RETURN, top="from collections import deque\nmemory = deque()\n"),
    body("memory[0] = 1.0", RETURN, top="memory = [None] * 2\n"),
    body("memory[0] = 1.0", RETURN, top="N = 3\nmemory = N * [0.0]\n"),
    body("memory[0] = 1.0", RETURN, top="memory = ([0.0] + [1.0], 2)\n"),
    body("memory[0] = 1.0", RETURN, top="for x in [[0.0]]: memory = x * 2\n"),
    body("memory['x'] = 1.0", RETURN, top="memory = dict(x=0) | {'y': 1}\n"),
    body("memory[0] = 1.0", RETURN, top="import numpy as np\nmemory = -np.zeros(3)\n"),
    body("memory[0] = 1.0", RETURN, top="import numpy as np\nmemory = np.zeros(3) > 1\n"),
    body("return smooth(1.0)", top="def smooth(x, window=[0.0] * 3):\n    window[0] = x\n    return x\n"),
    body("m = memory", "m['x'] = 1", RETURN, top="memory = {}\n"),
    body("m = memory['a']", "n = m if params['x'] else {}", "n['x'] = 1", RETURN, top="memory = {'a': {}}\n"),
    body("for m in memory: m['x'] = 1", RETURN, top="memory = [{}]\n"),
    body("a, b = memory", "a['x'] = 1", RETURN, top="memory = ({}, {})\n"),
    body("with memory as m: m.x = 1", RETURN, top="class M: pass\nmemory = M()\n"),
    body("change(memory)", RETURN, top="memory = []\ndef change(m):\n    m += [1]\n"),
    body("change(m=memory)", RETURN, top="memory = []\ndef change(*, m):\n    m.append(1)\n"),
    body("get().append(1)", RETURN, top="memory = []\ndef get():\n    return memory\n"),
    body("return next(ticks)", top="import itertools\nticks = itertools.count()\n"),
    body("heapq.heappush(memory, 1)", RETURN, top="import heapq\nmemory = []\n"),
    body("insort(memory, 1)", RETURN, top="from bisect import insort\nmemory = []\n"),
    body("setattr(Memory, 'x', 1)", RETURN, top="class Memory: pass\n"),
    body("np.copyto(buffer, 1.0)", RETURN, top="import numpy as np\nbuffer = np.zeros(3)\n"),
    body("np.add(buffer, 1.0, out=buffer)", RETURN, top="import numpy as np\nbuffer = np.zeros(3)\n"),
    body("buffer[:] = 1.0", RETURN, top="import numpy as np\nbuffer = np.zeros(3)\n"),
    body("Memory.last = 1.0", RETURN, top="class Memory:\n    last = 0.0\n"),
    body("return smooth(1.0)", top="def smooth(x, window=[]):\n    window.append(x)\n    return x\n"),
    body("return smooth(1.0)", top="smooth = lambda x, w=[]: w.append(x) or x\n"),
    body("reward_function.count = 1", RETURN),
    body("return update()", top="def make():\n    m = []\n    def f(): m.append(1)\n    return f\nupdate = make()\n"),
    body("return reward.step()", top=CLASS.format("self.n = 1")),
    body("return reward.step()", top=CLASS.format("self.n.append(1)")),
    body("return reward.step()", top=CLASS.format("type(self).n = 1")),
    body("return reward.step()", top=CLASS.format("self.__dict__.update(n=1)")),
    load_preset("duel"),
    load_preset("lap_time"),
    load_preset("touring"),
    load_preset("overtake"),
]
STATELESS = [
    body(RETURN),
    body("x = []", "x.append(1)", "params['x'] = 2", "params['waypoints'].sort()", RETURN),
    body("w = params['waypoints']", "w[0] = (0, 0)", "w.reverse()", RETURN, top="LINE = [1]\n"),
    body(
        "x = [1] + LINE",
        "x.append(1)",
        "y = list(LINE)",
        "y.sort()",
        "z = LINE.copy()",
        "z.pop()",
        RETURN,
        top="LINE = [1]\n",
    ),
    body(
        "c = Counter()",
        "c.update('a')",
        "d = {}",
        "d.setdefault('a', []).append(1)",
        RETURN,
        top="from collections import Counter\n",
    ),
    body("x = np.zeros(3)", "x[0] = 1", "np.add(x, 1, out=x)", RETURN, top="import numpy as np\nLINE = np.ones(3)\n"),
    body("def inner(): out.append(1)", "out = []", "inner()", RETURN, top="LINE = [1]\n"),
    body("reward = 1.0", "reward += params['x']", "return reward", top="LINE = [1]\n"),
    body("return next(x for x in LINE)", top="LINE = [1]\n"),
    body("change(params)", RETURN, top="LIMIT = 3\nNAME = 'x'\ndef change(p):\n    p['x'] = LIMIT\n"),
    body(
        "change(params)",
        RETURN,
        top="import math\nA, B = 3, -math.pi / 2\nC = (2 * A + B, not A, B < A)\ndef change(p):\n    p['x'] = C\n",
    ),
    body("return A(1).x", top="class A:\n    def __init__(self, x):\n        self.x = x\n"),
    body("memory = {}", "memory['x'] = 1", RETURN),
    body("return LINE[0]", top="LINE = []\nLINE.append(1.0)\nLINE[0] = 2.0\n"),
    body("import random", "random.shuffle(params['waypoints'])", RETURN, top="LINE = [1]\n"),
    *(load_preset(name) for name in preset_names() if name not in ("duel", "lap_time", "overtake", "touring")),
]


def functions(*, stateful: bool) -> Iterator[str]:
    """The sources of `functions/`, which say in their first line when they remember."""
    for path in FUNCTIONS:
        source = path.read_text(encoding="utf-8")
        if source.startswith("'''Keeps state") == stateful:
            yield source


@pytest.mark.parametrize("source", [*STATEFUL, *functions(stateful=True)], ids=lambda source: source[:60])
def test_state_is_seen(source):
    assert keeps_state(source)


@pytest.mark.parametrize("source", [*STATELESS, *functions(stateful=False)], ids=lambda source: source[:60])
def test_no_state_is_seen_where_there_is_none(source):
    assert not keeps_state(source)
