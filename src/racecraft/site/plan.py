"""The trainings that the page runs, as numbers: the same car, network, PPO and evaluation as `racecraft train`."""

from __future__ import annotations

import base64
from dataclasses import asdict
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from racecraft.agent import ActionSpace, DiscreteActionSpace, ModelMetadata, action_space
from racecraft.learn import NetworkSpec, PPOConfig, networks
from racecraft.limits import known_limit
from racecraft.race.conditions import STANDARD_CAR
from racecraft.race.rules import RULE_SETS
from racecraft.replay.codec import DENSE_BYTES, MAX_BODY_BYTES, MAX_DENSITY, MAX_FILE_BYTES, MAX_HEADER_BYTES
from racecraft.replay.replay import MAX_CELLS, MAX_NUMBER
from racecraft.reward import situations
from racecraft.run.folder import RunInfo
from racecraft.run.simtrace import STEP_WIDTH
from racecraft.serve.rewards.routes import list_actions
from racecraft.serve.tracks.courses import geometry
from racecraft.sim.camera import CAMERAS, CameraSpec
from racecraft.sim.columns import OBJECT_COLUMNS, OBJECT_HEADER, ROW_COLUMNS, STATUS_NAMES
from racecraft.sim.objects import NO_OBJECTS, OBJECT_KINDS, RACE_TYPES, Objects, objects_for_race
from racecraft.sim.randomization import PRESETS as RANDOM
from racecraft.sim.simulation import CONTROL_DT, DIRECTIONS, START_MODES, Start, track_arrays
from racecraft.sim.vehicle import PRESETS as VEHICLES
from racecraft.track import Track, joint_digest, load_track
from racecraft.training.evaluator import SEED, SLOWEST
from racecraft.training.regimes import regime_of
from racecraft.training.settings import TrainSettings, make_settings
from racecraft.training.stop import Until

SEEDS: Final = range(1, 9)
"""Seeds that the page trains with, one after the other."""
SUBSTEPS, MAX_STEPS = 8, 100_000  # the defaults of `Simulation`
PALETTES: Final = ("2018", "2020", "2026")
PPO_SETTINGS: Final = (
    *("num_envs", "num_steps", "episodes_per_iteration", "max_steps_per_iteration", "rate_steps", "gamma"),
    *("gae_lambda", "minibatch_size", "update_epochs", "normalize_returns", "epsilon_start", "epsilon_end"),
    *("epsilon_steps", "learning_rate", "clip_coef", "ent_coef", "vf_coef", "max_grad_norm", "is_eps_hat"),
)
GAINS: Final = {"policy.head.weight": 0.01, "critic.head.weight": 1.0}  # of all others √2, see `initial_weights`


def packed(array: NDArray[Any]) -> dict[str, str]:
    """An array as JSON: its type, and its bytes in base64."""
    return {"dtype": str(array.dtype), "data": base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()}


def told_track(arrays: dict[str, Any]) -> dict[str, Any]:
    """A track, from `racecraft.sim.simulation.track_arrays`, as web/src/tab/core.ts takes it."""
    sides = ("", "reversed_")
    lines = np.stack([arrays[side + name] for side in sides for name in ("centerline", "inner", "outer")])
    tables = np.stack([arrays[side + name] for side in sides for name in ("widths", "curvatures")])
    return {
        "lines": packed(lines),
        "count": lines.shape[1],
        "tables": packed(tables),
        "waypoints": packed(np.stack([arrays["waypoints"], arrays["reversed_waypoints"]]).astype(np.int32)),
        "samplesPerMetre": arrays["samples_per_metre"],
        "isClosed": bool(arrays["is_closed"]),
    }


def told_road(track: Track) -> dict[str, Any]:
    """What web/src/tab/road.ts asks of a track in both directions, computed here: to the bit as a marshal's."""
    sides = (track, track.reversed())
    return {
        "arcs": packed(np.stack([side.arc_length for side in sides])),
        "headings": packed(np.stack([side.heading_at(side.arc_length[:-1]) for side in sides])),
        "innerIsLeft": [side.inner_is_left for side in sides],
        "repeats": list(track.repeats),
    }


def told_cars(
    camera: CameraSpec | None,
    start: Start,
    num_envs: int,
    *,
    seed: int,
    direction: str,
    max_steps: int = MAX_STEPS,
    has_lidar: bool = False,
) -> dict[str, float]:
    """What `racecraft.sim.Simulation` would be told, by the core's names; the rest are its defaults."""
    eye = camera or CameraSpec()
    return {
        "num_envs": num_envs,
        "cars_per_race": 1,
        "seed": seed % 2**32,
        "seed_high": seed >> 32,
        "substeps": SUBSTEPS,
        "laps": 1,
        "max_steps": max_steps,
        "time_limit": 0.0,
        "start_mode": START_MODES.index(start.mode),
        "start_offset": start.offset,
        "start_advance": start.advance,
        "start_spread": int(start.spread),
        "lateral_jitter": start.lateral_jitter,
        "heading_jitter": start.heading_jitter,
        "direction": DIRECTIONS.index(direction),
        "picture_age": round(eye.age / CONTROL_DT * SUBSTEPS),
        "palette": PALETTES.index(eye.palette),
        "has_camera": int(camera is not None),
        "has_lidar": int(has_lidar),
        "width": eye.width,
        "height": eye.height,
        "hfov": eye.horizontal_fov,
        "forward": eye.forward,
        "left": eye.left,
        "above": eye.above_ground,
        "pitch": eye.pitch,
        "baseline": eye.baseline,
    }


def told_network(spec: NetworkSpec) -> dict[str, Any]:
    """A network, as web/src/tab/core.ts takes it."""
    arch = networks.architecture_of(spec)
    height, width = spec.frame_shape
    return {
        "numbers": {
            "height": height,
            "width": width,
            "top": networks.sky_rows(spec),
            "pool": arch.pool,
            "block": networks.block_size(spec),
            "num_actions": spec.num_actions,
            "is_discrete": int(spec.is_discrete),
            "state_size": spec.state_size,
            "lidar_size": spec.lidar_size,
        },
        "convs": [[conv.filters, conv.kernel, conv.stride] for conv in arch.convs],
        "dense": list(arch.dense),
        "criticUnits": list(networks.CRITIC_UNITS),
        "lidarUnits": list(arch.lidar),
    }


def told_layers(spec: NetworkSpec) -> list[list[float]]:
    """Rows, columns and gain of every matrix that an untrained network begins with."""
    shapes = networks.weight_shapes(spec).items()
    return [
        [shape[0], int(np.prod(shape[1:])), GAINS.get(name, 2.0**0.5)]
        for name, shape in shapes
        if name.endswith(".weight")
    ]


def told_ppo(config: PPOConfig) -> dict[str, float]:
    """PPO's settings by the core's names."""
    return {
        **{name: float(getattr(config, name)) for name in PPO_SETTINGS},
        "is_greedy": int(config.exploration == "e-greedy"),
        "is_huber": int(config.value_loss == "huber"),
        "adam_eps": config.objective.adam_eps,
    }


def plan() -> dict[str, Any]:
    """What the page can train, whatever the track, the reward and the seed; those of a run it fills in itself."""
    settings = _settings(action_space("default"))
    return {
        "vehicle": asdict(settings.vehicle),
        "averageShare": settings.ppo.average_share,
        "slowest": SLOWEST,
        "evaluationSeed": SEED,
        "seeds": list(SEEDS),
        "columns": list(ROW_COLUMNS),
        "statuses": list(STATUS_NAMES),
        "objectKinds": list(OBJECT_KINDS),
        "traceWidth": STEP_WIDTH,
        "objectColumns": {"header": list(OBJECT_HEADER), "each": list(OBJECT_COLUMNS)},
        "spaces": [preset.model_dump() for preset in list_actions()],
        "races": {race: told_race(race) for race in RACE_TYPES},
        "known": known(),
        "replays": {
            **{"file": MAX_FILE_BYTES, "body": MAX_BODY_BYTES, "header": MAX_HEADER_BYTES},
            **{"dense": DENSE_BYTES, "density": MAX_DENSITY, "cells": MAX_CELLS, "number": MAX_NUMBER},
        },
    }


def told_race(race: str) -> dict[str, Any]:
    """What of the default training depends on the kind of race: its cars and evaluations, and what it begins with."""
    objects = objects_for_race(race)
    regime = regime_of(objects=objects)
    settings, suite = (
        _settings(action_space(regime.actions), objects),
        _metadata(action_space("default"), objects).suite,
    )
    camera = suite.camera(CAMERAS[settings.camera])
    line = Start(mode="fixed", offset=RULE_SETS["first_lap"].start_offset)
    common: dict[str, Any] = {"seed": 0, "has_lidar": bool(suite.lidar_name)}
    return {
        "reward": regime.reward,
        "space": regime.actions,
        "objects": objects.to_dict(),
        "laps": settings.until.laps,
        "good": regime.good,
        "evaluateEvery": settings.evaluate_every,
        "cars": told_cars(camera, settings.start, settings.num_envs, direction=settings.direction, **common),
        "trials": told_cars(camera, line, settings.evaluation_trials, direction="forward", **common),
        "policies": {name: told_policy(action_space(name), objects) for name in ("default", "continuous")},
    }


def _metadata(space: ActionSpace, objects: Objects) -> ModelMetadata:
    sensors = regime_of(objects=objects).sensors
    return ModelMetadata(action_space=space, sensors=sensors, neural_network="RACECRAFT_SMALL")


def _settings(space: ActionSpace, objects: Objects = NO_OBJECTS) -> TrainSettings:
    until = Until.parse(regime_of(objects=objects).until)
    return make_settings(metadata=_metadata(space, objects), objects=objects, until=until, algorithm="ppo")


def told_policy(space: ActionSpace, objects: Objects = NO_OBJECTS) -> dict[str, Any]:
    """What of a race's training depends on the actions: a network, how it learns, and what is written of a run."""
    metadata, settings = _metadata(space, objects), _settings(space, objects)
    spec = settings.network_spec(metadata)
    if isinstance(space, DiscreteActionSpace):
        table = space.to_commands(np.arange(space.size)).astype(np.float64)
    else:
        table = np.stack([space.low, space.high])
    return {
        "network": told_network(spec),
        "layers": told_layers(spec),
        "weights": [[name, list(shape)] for name, shape in networks.weight_shapes(spec).items()],
        "logStd": networks.architecture_of(spec).log_std,
        "ppo": told_ppo(settings.ppo),
        "table": table.ravel().tolist(),
        "run": _run(settings),
        "modelMetadata": metadata.to_dict(),
        "spec": asdict(spec),
    }


def known() -> dict[str, Any]:
    """By what a replay's conditions are named: the library's rules, cars (standard one first), randomisations."""
    cars = {STANDARD_CAR: VEHICLES[STANDARD_CAR], **VEHICLES}
    return {
        "rules": {name: rules.to_dict() for name, rules in RULE_SETS.items()},
        "vehicle": {name: asdict(car) for name, car in cars.items()},
        "randomize": {name: {key: list(ends) for key, ends in asdict(one).items()} for name, one in RANDOM.items()},
    }


def track_file(name: str) -> dict[str, Any]:
    """One track of the library: for the core, for the page to draw, and to put cars on it."""
    track = load_track(name)
    return {
        "told": told_track(track_arrays(track)),
        "waypoints": [one.waypoints.tolist() for one in (track, track.reversed())],
        "road": told_road(track),
        "geometry": geometry(name, track).model_dump(),
        "digest": joint_digest([track]),
        "situations": [
            {"name": one.name, "description": one.description, "row": one.row.tolist()} for one in situations(track)
        ],
    }


def told_medals(name: str) -> dict[str, float] | None:
    """Lap times to reach on a track in the car of the page's trainings, s; none where no limit is known."""
    limit = known_limit(load_track(name), _settings(action_space("default")).vehicle)
    return None if limit is None else asdict(limit.medals)


def _run(settings: TrainSettings) -> dict[str, Any]:
    """``run.json`` without what the page fills in: seed, track, its digest, when it began."""
    document = settings.to_dict()
    del document["seed"], document["track"]
    info = asdict(RunInfo(seed=0, track="", track_digest="", settings=document))
    return {"format": 1, **{name: info[name] for name in ("settings", "versions", "parent", "foreign")}}
