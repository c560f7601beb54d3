"""What hostile user code gains: everything without walls, nothing with them; as this user and, from root, as nobody."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from plot import every_attack

from racecraft.reward.sandbox import find_confinement

RUNNER = Path(__file__).with_name("run_attacks.py")
NOBODY = 65534
USERS = ("root", "nobody") if os.geteuid() == 0 else ("this user",)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not find_confinement().is_complete, reason=f"no {find_confinement().missing} here"),
]


@pytest.fixture(scope="module", params=USERS)
def outcomes(request: pytest.FixtureRequest) -> dict[str, dict]:
    command = [sys.executable, str(RUNNER), *([str(NOBODY)] if request.param == "nobody" else [])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, check=False)
    if "PermissionError" in done.stderr and "must(libc" in done.stderr:
        pytest.skip("nobody cannot reach the interpreter here, and no private view can be made")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["root"] == (request.param == "root")
    return found["attacks"]


@pytest.mark.parametrize("name", sorted(every_attack()))
def test_an_attack_gains_nothing(outcomes: dict[str, dict], name: str):
    outcome = outcomes[name]
    if not outcome["here"]:
        pytest.skip(outcome["told"])
    assert outcome["unconfined"], "it fails without walls, too, and so proves nothing"
    assert not outcome["confined"], "it gets through the walls"


def test_there_are_at_least_forty(outcomes: dict[str, dict]):
    assert sum(outcome["here"] for outcome in outcomes.values()) >= 40


def test_what_has_no_business_here_ends_the_process(outcomes: dict[str, dict]):
    for name in ("trace_the_trainer", "read_the_trainers_memory", "faults_of_pages", "keys", "kill_by_a_descriptor"):
        assert "SIGSYS (a system call that no reward function has any business with)" in outcomes[name]["told"], name
