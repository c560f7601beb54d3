"""A whole training as the page runs it, evaluations and averages included, against `racecraft train`: to the bit.

Node runs the page's own files; see test_core_bits.py for what it needs.
"""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import pytest
from test_core_bits import digest, in_node

from racecraft import train
from racecraft.importing import import_run
from racecraft.learn import NetworkSpec
from racecraft.learn.flat_weights import join_weights
from racecraft.learn.learner import below
from racecraft.learn.networks import weight_shapes
from racecraft.run import RunFolder
from racecraft.run.archive import archive_chunks
from racecraft.run.checkpoint import Checkpoint
from racecraft.sim.objects import objects_for_race
from racecraft.sim.saved_state import unseal
from racecraft.site.javascript import javascript
from racecraft.site.plan import packed, plan, track_file
from racecraft.track import load_track
from racecraft.training import resume

pytestmark = pytest.mark.slow
TRACK, SEED = "oval", 3
PAYS = """def reward_function(params):
    if params["is_offtrack"] or params["is_crashed"]:
        return -1.0
    reward = params["speed"] * (1.0 - params["distance_from_center"] / params["track_width"])
    if params["objects_location"]:
        for index in params["closest_objects"]:
            reward += 0.01 * abs(params["objects_distance"][index] - params["projection_distance"])
            if params["objects_left_of_center"][index] == params["is_left_of_center"]:
                reward -= 0.1
    return reward
"""  # what browsers and Python compute alike, to the bit
NEAR_THE_START = ((0.02, 1), (0.4, -1), (0.7, 1))  # so that trials begin in the other lane
RACES: dict[str, tuple[dict[str, Any], int]] = {  # what is chosen of a race's objects, and steps between evaluations
    "time-trial": ({}, 1500),
    "object-avoidance": ({"count": 3, "placement": "fixed", "positions": NEAR_THE_START}, 2500),
    "head-to-bot": ({"count": 2, "speed": 0.5, "changes_lane": True}, 2500),
}


def settings_of(race: str) -> dict[str, Any]:
    chosen, every = RACES[race]
    objects = objects_for_race(race, settings=chosen)
    common = {"algorithm": "ppo", "objects": objects, "evaluate_every": every, "until": f"{2 * every} steps"}
    return {**common, "actions": plan()["races"][race]["space"]}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, RunFolder]:
    """A native training of every race."""
    root = tmp_path_factory.mktemp("native")
    reward = root / "reward_function.py"
    reward.write_text(PAYS)
    options: dict[str, Any] = {"reward": reward, "seed": SEED, "num_threads": 1, "root": root}
    return {race: RunFolder(train(TRACK, name=race, **settings_of(race), **options).run) for race in RACES}


def asked(race: str, **more: Any) -> dict[str, Any]:
    """The same of the page."""
    planned, (_, every) = plan(), RACES[race]
    planned["races"][race]["evaluateEvery"] = every
    settings = settings_of(race)
    return {
        "what": "session",
        "plan": planned,
        "race": race,
        "objects": settings["objects"].to_dict(),
        "space": next(space for space in planned["spaces"] if space["name"] == settings["actions"]),
        "track": track_file(TRACK),
        "seed": SEED,
        "steps": 2 * every,
        "source": PAYS,
        "rewards": javascript({"own": PAYS}),
        **more,
    }


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    cases = [asked(race) for race in RACES]
    results = in_node("core", cases, tmp_path_factory.mktemp("bits"))["results"]
    return dict(zip(RACES, results, strict=True))


@pytest.mark.parametrize("race", RACES)
def test_a_training_in_the_page_is_the_installed_programs(
    found: dict[str, Any], runs: dict[str, RunFolder], race: str
) -> None:
    saved = runs[race].checkpoints.load("last")
    judged = saved.metadata["evaluator"]["last"]
    theirs = {name: value for name, value in found[race].items() if name != "download"}
    assert theirs == {**bits(saved), "completions": judged["completions"], "lapTimes": judged["lap_times"]}
    assert len(set(judged["completions"])) > 1  # trials of different starts


def bits(saved: Checkpoint) -> dict[str, Any]:
    """What the next iteration depends on."""
    spec = NetworkSpec(**{**saved.metadata["network"], "frame_shape": (120, 160)})
    return {
        "steps": saved.step,
        "learning": digest(join_weights(below("learning/", saved.arrays), spec)),
        "average": digest(join_weights(below("average/", saved.arrays), spec)),
        "simulation": digest(unseal(saved.arrays["simulation"], [load_track(TRACK)])),
        "totals": digest(saved.arrays["ppo/episode_returns"]),
        "lengths": digest(saved.arrays["ppo/episode_lengths"]),
        "returnScale": digest(saved.arrays["ppo/return_scale"]),
    }


def test_a_training_begins_from_a_models_weights_as_in_the_installed_program(
    runs: dict[str, RunFolder], tmp_path: Path
) -> None:
    options: dict[str, Any] = {"evaluate_every": 1500, "until": "1500 steps", "seed": SEED, "num_threads": 1}
    parent = runs["time-trial"]  # of ten actions; these are more, so the policy's head begins anew
    native = train(TRACK, reward=parent.reward_function, actions="aws", parent=parent.path, root=tmp_path, **options)
    best = parent.checkpoints.load("best")
    spec = NetworkSpec(**{**best.metadata["network"], "frame_shape": (120, 160)})
    begin = {
        "weights": packed(join_weights(below("weights/", best.arrays), spec)),
        "layout": [[name, list(shape)] for name, shape in weight_shapes(spec).items()],
    }
    case = asked("time-trial", begin=begin, steps=1500)
    case["space"] = next(space for space in case["plan"]["spaces"] if space["name"] == "aws")
    [theirs] = in_node("core", [case], tmp_path)["results"]
    ours = bits(RunFolder(native.run).checkpoints.load("last"))
    assert {name: theirs[name] for name in ours} == ours


@pytest.mark.parametrize("race", RACES)
def test_a_downloaded_training_goes_on_in_the_installed_program_to_the_same_bits(
    found: dict[str, Any], runs: dict[str, RunFolder], race: str, tmp_path: Path
) -> None:
    archive = tmp_path / f"{race}.tar.gz"
    archive.write_bytes(base64.b64decode(found[race]["download"]))
    imported = RunFolder(import_run(archive, root=tmp_path / "runs").run)
    begun, straight = imported.checkpoints.load("last"), runs[race].checkpoints.load("last")
    assert 0 < begun.step < straight.step
    resume(imported.path, until=f"{straight.step} steps")
    assert bits(imported.checkpoints.load("last")) == bits(straight)


def test_models_of_the_installed_program_and_of_the_page_arrive_and_drive_as_they_did(
    found: dict[str, Any], runs: dict[str, RunFolder], tmp_path: Path
) -> None:
    def case(race: str, file: bytes) -> dict[str, Any]:
        told = {"plan": asked(race)["plan"] | {"tracks": [TRACK]}, "track": track_file(TRACK)}
        return {"what": "arrival", **told, "file": base64.b64encode(file).decode()}

    packed_runs = {race: b"".join(archive_chunks(runs[race])) for race in RACES}
    downloads = [case(race, base64.b64decode(found[race]["download"])) for race in RACES]
    results = in_node("core", [case(race, file) for race, file in packed_runs.items()] + downloads, tmp_path)["results"]
    for race, arrived in zip(RACES, results, strict=False):
        best = runs[race].checkpoints.load("best")
        spec = NetworkSpec(**{**best.metadata["network"], "frame_shape": (120, 160)})
        assert arrived["weights"] == digest(join_weights(below("weights/", best.arrays), spec))
        judged = best.metadata["evaluator"]["last"]
        assert {"seed": SEED, "steps": best.step, "reward": PAYS}.items() <= arrived.items()
        assert arrived["completions"] == judged["completions"]
        assert arrived["lapTimes"] == judged["lap_times"]
    for race, arrived in zip(RACES, results[len(RACES) :], strict=True):
        assert (arrived["seed"], arrived["reward"]) == (SEED, PAYS), race
