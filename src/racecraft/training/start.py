"""The beginning of a run: everything checked, written into a new run folder, and nothing trained yet."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from racecraft.agent import Hyperparameters, ModelMetadata
from racecraft.errors import ConfigError
from racecraft.learn import DistillConfig, PPOConfig, SACConfig
from racecraft.learn.networks import PERCEPTION
from racecraft.learn.sb3 import SB3Config
from racecraft.reward import dry_run_on, load_preset, preset_names, validate_reward
from racecraft.run import RunFolder, RunInfo, change_reward
from racecraft.run.training_params import TrainingParams
from racecraft.track import Track, joint_digest, load_tracks
from racecraft.training.parent import WEIGHTS, Parent
from racecraft.training.regimes import METHODS, AlgorithmConfig
from racecraft.training.settings import TrainSettings
from racecraft.training.taught import teachers_arrays


def start_run(
    settings: TrainSettings,
    *,
    reward: str,
    metadata: ModelMetadata,
    hyperparameters: Hyperparameters | None = None,
    root: str | Path = "runs",
    name: str | None = None,
    parent: Parent | None = None,
    foreign: bool = False,
) -> RunFolder:
    """Make a run folder that `Training` can train.

    Args:
        settings: How to train.
        reward: Source of the reward function.
        metadata: Action space, sensors, network.
        hyperparameters: AWS's, when the run follows them.
        root: Where runs lie.
        name: Name of the run; by default a new one.
        parent: The checkpoint whose weights it begins with; by default it begins with random ones.
        foreign: The reward function is somebody else's: it runs locked in, or not at all.

    Raises:
        RewardError: The reward function has a mistake that can be seen before training.
        ConfigError: A setting is not allowed, or two do not go together.
        TrackNotFound: No such track.
        RunError: The folder cannot be made, or the name is taken.
    """
    require_trainable(settings, metadata)
    if parent is not None:
        if settings.algorithm not in ("ppo", "distill"):
            raise ConfigError(f"A run of {settings.algorithm} cannot begin from another one; only ppo and distill can.")
        parent.check(settings.network_spec(metadata), metadata)
    tracks = load_tracks(settings.track)
    track = tracks[0]
    require_valid_reward(reward, settings, tracks, foreign=foreign)
    prefix = track.name if len(tracks) == 1 else f"{len(tracks)}-tracks"
    folder = RunFolder.create(root, name=name, prefix=prefix)
    params = TrainingParams(
        world_name=track.name,
        reverse_dir=settings.direction == "reverse",
        alternate_driving_direction=settings.direction == "alternate",
        change_start_position=settings.start.mode != "fixed",
        round_robin_advance_dist=settings.start.advance % 1.0,
        start_position_offset=settings.start.offset % 1.0,
        min_eval_trials=settings.evaluation_trials,
    )
    try:
        write_run(folder, settings, tracks, reward, metadata, hyperparameters, params, parent=parent, foreign=foreign)
    except BaseException:
        shutil.rmtree(folder.path, ignore_errors=True)
        raise
    return folder


def write_run(
    folder: RunFolder,
    settings: TrainSettings,
    tracks: Sequence[Track],
    reward: str,
    metadata: ModelMetadata,
    hyperparameters: Hyperparameters | None,
    params: TrainingParams,
    *,
    parent: Parent | None = None,
    foreign: bool = False,
) -> None:
    """Write everything that a run starts from; ``run.json``, which makes the folder a run, comes last."""
    folder.write_inputs(
        reward_function=reward,
        model_metadata=metadata,
        hyperparameters=hyperparameters,
        equivalent=aws_hyperparameters(settings.learning, hyperparameters),
        training_params=params,
    )
    document = settings.to_dict()
    del document["seed"], document["track"]  # they have places of their own
    digest = joint_digest(tracks)
    record = None
    if parent is not None:
        saved, record = parent.saved, parent.record()
        arrays = {f"{WEIGHTS}{name}": array for name, array in parent.weights.items()}
        arrays |= teachers_arrays(saved, settings, metadata)
        folder.parent_checkpoint.save(saved.step, arrays, metadata={"network": saved.metadata["network"], **record})
    folder.write_info(
        RunInfo(
            seed=settings.seed,
            track=settings.track,
            track_digest=digest,
            settings=document,
            parent=record,
            foreign=foreign,
        )
    )


def aws_hyperparameters(config: AlgorithmConfig, given: Hyperparameters | None = None) -> dict[str, Any]:
    """How a run learns by AWS's names, for its tools; ours may lie outside of AWS's ranges."""
    if given is not None:
        return given.to_dict()
    document: dict[str, Any] = {
        "num_episodes_between_training": Hyperparameters.num_episodes_between_training,
        "stack_size": 1,
        "term_cond_avg_score": Hyperparameters.term_cond_avg_score,
        "term_cond_max_episodes": Hyperparameters.term_cond_max_episodes,
    }
    batch_size = config.batch_size if isinstance(config, SB3Config) else config.minibatch_size
    document |= {name: value for name, value in (("batch_size", batch_size), ("lr", config.learning_rate)) if value}
    if not isinstance(config, DistillConfig):  # its student looks no further than the next action
        document["discount_factor"] = config.gamma
    if isinstance(config, SACConfig):
        document["sac_alpha"] = config.alpha
    if isinstance(config, PPOConfig):
        document |= {
            "beta_entropy": config.ent_coef,
            "e_greedy_value": config.epsilon_end,
            "epsilon_steps": config.epsilon_steps,
            "exploration_type": config.exploration,
            "loss_type": "huber" if config.value_loss == "huber" else "mean squared error",
            "lr": config.learning_rate,
            "num_epochs": config.update_epochs,
        }
        if config.episodes_per_iteration:
            document["num_episodes_between_training"] = config.episodes_per_iteration
    return dict(sorted(document.items()))


def read_settings(folder: RunFolder) -> TrainSettings:
    """The settings a run was started with."""
    info = folder.read_info()
    return TrainSettings.from_dict({**info.settings, "seed": info.seed, "track": info.track})


def replace_reward(folder: RunFolder, source: str, *, foreign: bool = False) -> None:
    """Give a run another reward function, from its next step on.

    Args:
        folder: The run's.
        source: Of the function.
        foreign: It is somebody else's; what a run has once is so for good.

    Raises:
        RewardError: The function has a mistake that can be seen before training.
        RunError: The run is in use, or cannot be read or written.
    """
    info = folder.read_info()
    is_foreign = foreign or info.foreign
    require_valid_reward(source, read_settings(folder), load_tracks(info.track), foreign=is_foreign)
    with folder.lock():
        if is_foreign != info.foreign:
            folder.write_info(replace(info, foreign=True))
        change_reward(folder, source)


def require_trainable(settings: TrainSettings, metadata: ModelMetadata) -> None:
    """Refuse what this version cannot train.

    Raises:
        ConfigError: Settings exclude each other.
    """
    suite = metadata.suite
    if settings.network == PERCEPTION and suite.lenses != 1:
        raise ConfigError(
            f"sensor is {', '.join(suite.names)}; the network {PERCEPTION} looks through one lens.",
            hint="Train with FRONT_FACING_CAMERA, and a LIDAR if need be.",
        )
    if not METHODS[settings.algorithm].sees_all and (suite.lenses != 1 or suite.lidar_name):
        raise ConfigError(
            f"sensor is {', '.join(suite.names)}; allowed with {settings.algorithm} is one camera of one lens.",
            hint="Train with ppo or sac, which see every sensor.",
        )
    if (
        settings.algorithm == "ppo"
        and settings.ppo.exploration == "e-greedy"
        and metadata.action_space.kind != "discrete"
    ):
        raise ConfigError(
            "exploration is 'e-greedy', which needs a discrete action space; this one is continuous.",
            hint="Set exploration to 'categorical'.",
        )


def require_valid_reward(
    source: str, settings: TrainSettings, tracks: Sequence[Track], *, foreign: bool = False
) -> None:
    """Refuse a reward function that cannot be right, before anything is trained with it.

    A preset, to the letter, was tried when Racecraft was tested, and is not made to wait.

    Raises:
        RewardError: The static check finds a mistake, a call fails in a situation of one of the tracks, or the source
            is foreign and cannot be locked in.
    """
    if not foreign and source in map(load_preset, preset_names()):
        return
    validate_reward(source)
    _, error = dry_run_on(
        source, tracks, objects=settings.objects, cars_per_race=settings.cars_per_race, foreign=foreign
    )
    if error is not None:
        raise error
