"""The job: seeds, ends, files, going on, hostile files, and every setting that is refused."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from threadpoolctl import threadpool_info, threadpool_limits

from racecraft.classic import ALGORITHMS, RECIPES, Progress, default_algorithm, job, learn, ppo, recall, resume
from racecraft.classic.evaluation import play
from racecraft.classic.saved import load
from racecraft.classic.settings import Settings
from racecraft.classic.until import Goal
from racecraft.classic.worlds import Worlds
from racecraft.errors import ConfigError, RacecraftError, RunError, TrainingError

CLASSIC = Path(__file__).parents[2] / "src" / "racecraft" / "classic"
SHORT: dict[str, dict[str, Any]] = {
    "q-table": {},
    "sarsa": {},
    "dqn": {"warm_up": 100},
    "reinforce": {"episodes": 2},
    "a2c": {"num_envs": 4},
    "ppo": {"length": 16},
    "sac": {"warm_up": 100, "batch": 16},
}


def short(algorithm: str, **more: Any) -> Any:
    environment = "Pendulum-v1" if algorithm == "sac" else "CartPole-v1"
    options = {"seed": 1, "until": "600 steps", "settings": SHORT[algorithm]}
    return learn(environment, algorithm, **{**options, **more})


def test_every_algorithm_is_a_page_that_can_be_read() -> None:
    for module in ("q_table", "sarsa", "dqn", "reinforce", "a2c", "a3c", "ppo", "sac"):
        text = (CLASSIC / f"{module}.py").read_text()
        assert len(text.splitlines()) <= 200, module
        assert "import torch" not in text


@pytest.mark.costly
@pytest.mark.parametrize("algorithm", list(SHORT))
def test_the_same_seed_gives_the_same_bits_and_another_seed_others(algorithm: str) -> None:
    first, same, other = short(algorithm), short(algorithm), short(algorithm, seed=2)
    for name, array in first.policy.arrays.items():
        assert (array == same.policy.arrays[name]).all()
    assert any((array != other.policy.arrays[name]).any() for name, array in first.policy.arrays.items())
    assert (first.returns, first.curve, first.mean_return) == (same.returns, same.curve, same.mean_return)
    assert first.steps >= 600


def blas_threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


@pytest.mark.costly
def test_products_take_one_thread_while_it_learns_and_judges(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # with two, CartPole's DQN took another course, and forty times the processor on a busy machine
    import_module("scipy.linalg")  # brings a library of its own, after the one found when learning was imported
    seen = []

    def judged(*worlds: Any) -> Any:
        seen.append(blas_threads())
        return play(*worlds)

    monkeypatch.setattr(job, "play", judged)
    with threadpool_limits(limits=2, user_api="blas"):
        before = blas_threads()
        learned = short("ppo", root=tmp_path, on_progress=lambda _: seen.append(blas_threads()))
        assert learned.run is not None
        _ = learned.mean_return
        resume(learned.run, until="900 steps")
        assert blas_threads() == before
    assert len(seen) > 4
    assert seen == [{1}] * len(seen)


@pytest.mark.costly
@pytest.mark.parametrize("algorithm", list(SHORT))
def test_a_learning_rate_of_zero_changes_nothing(algorithm: str) -> None:
    still = {"learning_rate": 0.0}
    if algorithm == "reinforce":
        still["critic_learning_rate"] = 0.0
    if algorithm in ("q-table", "sarsa"):
        still["final_learning_rate"] = 0.0
    kept = short(algorithm, settings={**SHORT[algorithm], **still}).policy.arrays
    begun = short(algorithm, settings={**SHORT[algorithm], **still}, until="1 steps").policy.arrays
    moved = short(algorithm).policy.arrays
    assert all((kept[name] == begun[name]).all() for name in kept)
    assert any((moved[name] != begun[name]).any() for name in kept)


@pytest.mark.costly
@pytest.mark.parametrize("algorithm", list(SHORT))
def test_what_was_learned_is_saved_and_goes_on(algorithm: str, tmp_path: Path) -> None:
    seen: list[Progress] = []
    learned = short(algorithm, root=tmp_path, name="a", on_progress=seen.append)
    folder = tmp_path / "a"
    assert sorted(path.name for path in folder.iterdir()) == ["curve.jsonl", "learned.json", "policy.safetensors"]
    lesson, arrays, steps = load(folder)
    assert (lesson, steps) == (learned.lesson, learned.steps)
    assert all((arrays[name] == array).all() for name, array in learned.policy.arrays.items())
    assert [(one.steps, one.mean_return) for one in seen] == learned.curve
    document = json.loads((folder / "learned.json").read_text())
    assert document["mean_return"] == learned.mean_return

    again = resume(folder, until=f"{learned.steps} steps")  # nothing left to do: what was saved plays alike
    assert all((again.policy.arrays[name] == array).all() for name, array in learned.policy.arrays.items())
    more = resume(folder, until=f"{learned.steps + 400} steps")
    assert more.steps >= learned.steps + 400
    assert len(more.curve) == len(learned.curve) + 1
    assert load(folder)[2] == more.steps


@pytest.mark.costly
def test_the_cuts_of_a_table_are_saved_with_it(tmp_path: Path) -> None:
    learned = learn("racecraft:Racecraft-v0", "q-table", seed=1, until="1 steps", root=tmp_path, name="a")
    assert learned.lesson.settings.cuts
    assert load(tmp_path / "a")[0] == learned.lesson


def test_ppo_looks_at_every_step_once_in_every_epoch(monkeypatch: pytest.MonkeyPatch) -> None:
    looked, clipped = list[int](), ppo.clipped
    monkeypatch.setattr(ppo, "clipped", lambda ratio, *more: (looked.append(len(ratio)), clipped(ratio, *more))[1])
    learned = short("ppo", until="300 steps")
    assert sum(looked) == learned.lesson.settings.epochs * learned.steps


@pytest.mark.costly
def test_it_ends_when_it_should() -> None:
    easy = short("q-table", until="5 return or 50000 steps", settings={})
    assert (easy.reason, easy.steps) == ("return", 50_000) or easy.steps < 50_000
    assert short("q-table", until="0.2 s or 10000000 steps").reason == "seconds"
    assert short("q-table").reason == "steps"


def test_its_worlds_are_closed_however_it_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    made, closed = list[Worlds](), list[Worlds]()
    make, close = Worlds.__init__, Worlds.close
    monkeypatch.setattr(Worlds, "__init__", lambda self, *a, **k: (made.append(self), make(self, *a, **k))[1])
    monkeypatch.setattr(Worlds, "close", lambda self: (closed.append(self), close(self))[1])
    monkeypatch.setattr(job, "play", lambda worlds, policy: np.zeros(3))
    assert short("q-table", until="1 steps").mean_return == 0.0
    assert made

    def stop(progress: Progress) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        short("q-table", on_progress=stop)
    assert set(closed) == set(made)


@pytest.mark.costly
def test_who_goes_on_keeps_the_best_there_ever_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    means, seen = iter((50.0, 10.0, 30.0)), list[Progress]()
    monkeypatch.setattr(job._Classroom, "_evaluate", lambda *_, **__: next(means))
    short("a2c", root=tmp_path, name="a", until="40 steps", on_progress=seen.append)
    best = load(tmp_path / "a")[1]
    for steps in (80, 120):
        resume(tmp_path / "a", until=f"{steps} steps", on_progress=seen.append)
    assert [(one.mean_return, one.is_best) for one in seen] == [(50.0, True), (10.0, False), (30.0, False)]
    assert all((array == best[name]).all() for name, array in load(tmp_path / "a")[1].items())


def test_the_last_episodes_are_played_when_somebody_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    learned, played = short("q-table"), list[int]()
    monkeypatch.setattr(job, "play", lambda worlds, policy: played.append(worlds.num_envs) or np.full(3, 7.0))
    assert not played
    assert (learned.mean_return, learned.to_dict()["mean_return"]) == (7.0, 7.0)
    assert played == [100]


def test_an_interrupted_run_is_saved(tmp_path: Path) -> None:
    def stop(progress: Progress) -> None:
        raise KeyboardInterrupt

    learned = short("dqn", root=tmp_path, name="a", on_progress=stop)
    assert learned.reason == "interrupted"
    assert load(tmp_path / "a")[2] == learned.steps
    assert json.loads((tmp_path / "a" / "learned.json").read_text())["reason"] == "interrupted"


def test_who_stops_before_the_first_evaluation_keeps_what_was_learned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(worlds: Worlds, policy: Any, *_: Any) -> Any:
        policy.actor.parameters[:] = 7.0
        worlds.steps += 32
        yield
        raise KeyboardInterrupt

    monkeypatch.setitem(ALGORITHMS, "a2c", replace(ALGORITHMS["a2c"], learn=stop))
    assert short("a2c", root=tmp_path, name="a").reason == "interrupted"
    assert {7.0} in [set(array.ravel().tolist()) for array in load(tmp_path / "a")[1].values()]


def test_who_does_not_wait_for_the_last_episodes_keeps_what_was_learned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: Any) -> Any:
        raise KeyboardInterrupt

    monkeypatch.setattr(job, "play", stop)
    with pytest.raises(KeyboardInterrupt):
        short("q-table", root=tmp_path, name="a")
    assert load(tmp_path / "a")[2] > 0


@pytest.mark.costly
def test_processes_of_a3c_leave_ctrl_c_to_their_parent(monkeypatch: pytest.MonkeyPatch) -> None:
    groups, begin = list[int](), subprocess.Popen

    def watched(*arguments: Any, **options: Any) -> Any:
        process = begin(*arguments, **options)
        groups.append(os.getpgid(process.pid))
        return process

    monkeypatch.setattr(subprocess, "Popen", watched)
    learn("CartPole-v1", "a3c", until="64 steps")
    assert groups
    assert os.getpgid(0) not in groups


FAILING = """
import gymnasium
from gymnasium.envs.classic_control import CartPoleEnv
from gymnasium.envs.registration import register

class Failing(CartPoleEnv):
    steps = 0
    def step(self, action):
        self.steps += 1
        if self.steps > 40:
            raise KeyError("wheel")
        return super().step(action)

register("Failing-v0", entry_point=Failing, max_episode_steps=100)
"""


@pytest.mark.costly
def test_a_process_of_a3c_whose_world_fails_is_told_in_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "failing_world.py").write_text(FAILING)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    try:
        with pytest.raises(
            TrainingError, match=r"Failing-v0 has failed while it was played: KeyError: 'wheel'$"
        ) as told:
            learn("failing_world:Failing-v0", "a3c", until="2000 steps")
    finally:
        gymnasium.registry.pop("Failing-v0", None)
    assert "mistake is in the environment" in told.value.hint
    assert capfd.readouterr().err == ""


class Loud(gymnasium.Env[Any, Any]):
    """Pays more than a number can hold."""

    observation_space, action_space = spaces.Box(-1.0, 1.0, (1,)), spaces.Discrete(2)

    def reset(self, *, seed: int | None = None, options: Any = None) -> Any:
        return np.zeros(1, np.float32), {}

    def step(self, action: Any) -> Any:
        return np.zeros(1, np.float32), 1e60, True, False, {}


def test_numbers_that_leave_all_bounds_are_told_and_leave_no_run_without_anything(tmp_path: Path) -> None:
    gymnasium.register("Loud-v0", Loud)
    try:
        with pytest.raises(TrainingError, match="a2c has left all bounds") as told:
            learn("Loud-v0", "a2c", until="500 steps", root=tmp_path, name="a")
    finally:
        del gymnasium.registry["Loud-v0"]
    assert "learning_rate" in told.value.hint
    assert not (tmp_path / "a").exists()


@pytest.mark.costly
@pytest.mark.parametrize("environment", ["Blackjack-v1", "Taxi-v4", "MountainCarContinuous-v0"])
def test_other_environments_are_learned_too(environment: str) -> None:
    for algorithm in ("q-table", "ppo") if environment != "MountainCarContinuous-v0" else ("ppo", "sac"):
        settings = {"bins": 2} if algorithm == "q-table" else {}
        learned = learn(environment, algorithm, until="300 steps", settings=settings)
        assert np.isfinite(learned.mean_return)


@pytest.mark.parametrize(
    ("environment", "algorithm", "says"),
    [
        ("Pendulum-v1", "dqn", "its actions are numbers, and reinforce, a2c, a3c, ppo, sac are made for them"),
        ("Pendulum-v1", "q-table", "reinforce, a2c, a3c, ppo, sac are made for them"),
        ("CartPole-v1", "sac", "its actions are choices, and q-table, sarsa, dqn, reinforce, a2c, a3c, ppo are made"),
        ("Strange-v0", "ppo", "no algorithm here is made for them"),
        ("CartPole-v1", "dqm", "algorithm is 'dqm'; allowed are q-table"),
        ("CartPole-v1", "", "algorithm is ''"),
    ],
)
def test_an_algorithm_that_does_not_fit_names_those_that_do(environment: str, algorithm: str, says: str) -> None:
    class Strange(gymnasium.Env[Any, Any]):
        observation_space, action_space = spaces.Discrete(2), spaces.MultiDiscrete([2, 2])

        def reset(self, **_: Any) -> Any:
            return 0, {}

    gymnasium.register("Strange-v0", Strange)
    try:
        with pytest.raises(ConfigError, match=says):
            learn(environment, algorithm)
    finally:
        del gymnasium.registry["Strange-v0"]


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"gama": 0.9}, "There is no setting 'gama'"),
        ({"gamma": 1.5}, "gamma is 1.5; allowed is a number from 0 to 1"),
        ({"gamma": float("nan")}, "gamma is nan"),
        ({"gamma": "high"}, "gamma is 'high'"),
        ({"gamma": True}, "gamma is True"),
        ({"batch": 0}, "batch is 0"),
        ({"batch": 2.5}, "batch is 2.5"),
        ({"steps": -1}, "steps is -1"),
        ({"num_envs": 10**6}, "num_envs is 1000000"),
        ({"hidden": 64}, "hidden is 64"),
        ({"hidden": [0]}, "hidden is 0"),
        ({"hidden": [8] * 9}, "allowed is a list of units"),
        ({"memory": 10**9 + 1}, "memory is"),
    ],
)
def test_settings_that_are_not_allowed(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        learn("CartPole-v1", "dqn", settings=settings)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"environment": 5}, "environment is 5; use an id of Gymnasium, such as 'CartPole-v1'"),
        ({"settings": 5}, "settings is 5; allowed is a dict of names and values"),
        ({"settings": {5: 1}}, "settings is {5: 1}; allowed is a dict of names and values"),
        ({"make": ["is_slippery"]}, r"make is \['is_slippery'\]; allowed is a dict of names and values"),
        ({"on_progress": 5}, "on_progress is 5; allowed is a function of one Progress"),
    ],
)
def test_arguments_of_another_kind_are_told(given: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        learn(**{"environment": "CartPole-v1", "algorithm": "dqn", **given})


def test_what_is_no_run_to_go_on_with_is_told() -> None:
    for ask in (resume, recall):
        with pytest.raises(ConfigError, match=r"run is 5; use the path of a run's folder"):
            ask(5)  # type: ignore[operator]
    with pytest.raises(ConfigError, match="on_progress is 5; allowed is a function of one Progress"):
        resume("runs/none", on_progress=5)  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match="environment is None; use an id of Gymnasium"):
        default_algorithm(None)  # type: ignore[arg-type]


def test_cuts_are_no_setting_that_one_could_have_meant() -> None:
    with pytest.raises(ConfigError, match="There is no setting 'cuts'; there are bins") as told:
        learn("CartPole-v1", "q-table", settings={"cuts": []})
    assert told.value.hint == ""


def test_no_more_processes_are_begun_than_a_machine_can_have() -> None:
    with pytest.raises(ConfigError, match="processes is 65; allowed is a whole number from 1 to 64"):
        learn("CartPole-v1", "a3c", settings={"processes": 65})


@pytest.mark.parametrize("seed", [-1, 1.5, "a", True])
def test_seeds_that_are_not_allowed(seed: Any) -> None:
    with pytest.raises(ConfigError, match="seed is"):
        learn("CartPole-v1", "dqn", seed=seed)


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        ("475 return", Goal(mean_return=475.0)),
        ("return -110.5 or 2 minutes", Goal(mean_return=-110.5, seconds=120.0)),
        ("20,000 steps or 90 s", Goal(steps=20_000, seconds=90.0)),
    ],
)
def test_when_to_stop(text: str, goal: Goal) -> None:
    assert Goal.parse(text) == goal


@pytest.mark.parametrize(
    "text", ["soon", "5 laps", "8 s lap", "1 return or 2 return", "", "or", "nan return", "x" * 500]
)
def test_ends_that_are_not_understood(text: str) -> None:
    with pytest.raises(ConfigError, match="until is"):
        Goal.parse(text)


def test_recipes_name_what_exists() -> None:
    for environment, algorithm in RECIPES:
        assert algorithm in ALGORITHMS
        assert environment in gymnasium.registry or environment in ("Racecraft-v0", "ALE/Pong-v5")  # of another package
        assert isinstance(RECIPES[environment, algorithm].settings, ALGORITHMS[algorithm].settings)
    for algorithm in ALGORITHMS.values():
        assert isinstance(algorithm.settings(), Settings)


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    short("dqn", root=tmp_path, name="a")
    return tmp_path / "a"


def change(folder: Path, **values: Any) -> None:
    document = json.loads((folder / "learned.json").read_text())
    settings = values.pop("settings", {})
    document |= values
    document["settings"] |= settings
    (folder / "learned.json").write_text(json.dumps(document))


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"format": 2}, "format 2"),
        ({"algorithm": "pickle"}, "algorithm is 'pickle'"),
        ({"algorithm": ["dqn"]}, "algorithm is"),
        ({"environment": 7}, "environment is 7"),
        ({"environment": "Nothing-v0"}, "There is no environment 'Nothing-v0'"),
        ({"make": []}, "make is"),
        ({"seed": "1"}, "seed is '1'"),
        ({"steps": -5}, "steps is -5"),
        ({"settings": {"batch": 0}}, "batch is 0"),
        ({"settings": {"other": 0}}, "other"),
        ({"settings": {"hidden": [8]}}, "do not fit"),
        ({"algorithm": "ppo"}, "settings name"),
        ({"environment": "Pendulum-v1"}, "dqn does not fit"),
        ({"environment": "Acrobot-v1"}, "do not fit"),
    ],
)
def test_a_changed_run_is_refused(saved: Path, values: dict[str, Any], says: str) -> None:
    change(saved, **values)
    with pytest.raises(RacecraftError, match=says):
        resume(saved)


def test_damaged_files_are_refused(saved: Path, tmp_path: Path) -> None:
    from safetensors.numpy import save_file

    for content in (b"", b"\x80\x04.", (saved / "policy.safetensors").read_bytes()[:-9]):
        (saved / "policy.safetensors").write_bytes(content)
        with pytest.raises(RunError, match="damaged"):
            resume(saved)
    size = short("dqn", until="1 steps").policy.arrays["network"].size
    save_file({"network": np.full(size, np.nan, np.float32)}, saved / "policy.safetensors")
    with pytest.raises(ConfigError, match="numbers that are none"):
        resume(saved)
    (saved / "policy.safetensors").unlink()
    with pytest.raises(RunError, match="damaged"):
        resume(saved)
    (saved / "learned.json").write_text("{")
    with pytest.raises(RunError, match="not valid JSON"):
        resume(saved)
    with pytest.raises(RunError, match=r"learned\.json is missing"):
        resume(tmp_path / "nothing")


@pytest.mark.costly
def test_a_name_that_is_taken_or_not_allowed(saved: Path) -> None:
    for name in ("a", "../x"):
        with pytest.raises(RunError):
            short("dqn", root=saved.parent, name=name)
