"""Reward functions and action spaces: presets, the keys of params, and the check that paints a track."""

from __future__ import annotations

import ast
import math
from contextlib import suppress
from functools import cache
from typing import Final

from fastapi import APIRouter

from racecraft.agent import action_space
from racecraft.agent.action_space import PRESETS, DiscreteActionSpace
from racecraft.analysis import pay_laps
from racecraft.errors import RacecraftError
from racecraft.json_file import read_json_object
from racecraft.judging.trained import is_road_of, trained_objects
from racecraft.reward import check_reward, dry_run_on, load_preset, preset_names
from racecraft.reward.painting import paint_presets, paint_reward
from racecraft.serve.context import Computes, Context, InContext
from racecraft.serve.models.garage import RACED
from racecraft.serve.rewards.schemas import (
    Action,
    ActionPreset,
    PresetPictures,
    RewardCheck,
    RewardLap,
    RewardPainting,
    RewardPreset,
    RewardProblem,
    RewardSituation,
    RewardVerdict,
)
from racecraft.sim.objects import NO_OBJECTS, Objects, objects_for_race
from racecraft.track import Track, load_track
from racecraft.track.selection import load_tracks

PICTURED: Final = "hairpin"
"""The track of the presets' pictures: small, with bends both ways."""
router = APIRouter(prefix="/api", tags=["rewards"])

DESCRIPTIONS: Final = {
    "default": "Five steering angles at 1 and 2 m/s: learns in seconds.",
    "aws": "AWS's own: five steering angles at 0.5 and 1 m/s.",
    "fast": "Seven steering angles at up to 4 m/s: for records.",
    "safe": "Seven steering angles at 0.7 and 1.4 m/s: gets round everywhere.",
    "steady": "Five steering angles at 1 m/s: among boxes and other cars.",
    "continuous": "Any steering angle, any speed from 0.5 to 4 m/s.",
}


@router.get("/rewards")
def list_rewards() -> list[RewardPreset]:
    """The reward functions that ship with Racecraft."""
    listed = []
    for name in preset_names():
        source = load_preset(name)
        description = (ast.get_docstring(ast.parse(source)) or "").split("\n")[0]
        listed.append(RewardPreset(name=name, description=description, source=source))
    return listed


@router.get("/rewards/pictures")
def list_pictures() -> PresetPictures:
    """What each of them pays along a small track."""
    return _pictures()


@cache
def _pictures() -> PresetPictures:
    points, rewards = paint_presets(load_track(PICTURED))
    return PresetPictures(
        points=points.round(3).tolist(), rewards={name: paid.round(4).tolist() for name, paid in rewards.items()}
    )


@router.get("/actions")
def list_actions() -> list[ActionPreset]:
    """The action spaces that ship with Racecraft."""
    listed = []
    for name in PRESETS:
        space = action_space(name)
        text = DESCRIPTIONS.get(name, "")
        if isinstance(space, DiscreteActionSpace):
            actions = [Action(steering_angle=angle, speed=speed) for angle, speed in space.to_degrees()]
            listed.append(ActionPreset(name=name, description=text, kind="discrete", actions=actions))
        else:
            limits = space.to_aws()
            listed.append(
                ActionPreset(
                    name=name,
                    description=text,
                    kind="continuous",
                    actions=[],
                    steering_angle=[limits["steering_angle"]["low"], limits["steering_angle"]["high"]],
                    speed=[limits["speed"]["low"], limits["speed"]["high"]],
                )
            )
    return listed


@router.post("/rewards/check", dependencies=[Computes])
def check(request: RewardCheck, context: InContext) -> RewardVerdict:
    """Look at a reward function, try it in a car's situations, and paint it along a track."""
    problems = check_reward(request.source)
    found = [
        RewardProblem(line=p.line, column=p.column, severity=p.severity, message=p.message, hint=p.hint)
        for p in problems
    ]
    if any(problem.severity == "error" for problem in problems):
        return RewardVerdict(ok=False, problems=found, situations=[], painting=None)
    track = context.courses.load(request.track)
    foreign = context.garage.is_foreign(request.source)
    objects, cars = _among(request, context)
    tracks = [track, *_more_tracks(request, context)]
    outcomes, error = dry_run_on(request.source, tracks, objects=objects, cars_per_race=cars, foreign=foreign)
    if error is not None and error.line:
        found.append(
            RewardProblem(
                line=error.line, column=error.column or 1, severity="error", message=str(error), hint=error.hint
            )
        )
    situations = [
        RewardSituation(
            name=outcome.situation.name,
            description=outcome.situation.description,
            reward=outcome.reward,
            error=str(outcome.error) if outcome.error is not None else None,
            printed=outcome.printed[:4000],
        )
        for outcome in outcomes
    ]
    if error is not None:
        return RewardVerdict(ok=False, problems=found, situations=situations, painting=None)
    painted = paint_reward(request.source, track, objects=objects, cars_per_race=cars, foreign=foreign)
    painting = RewardPainting(
        places=painted.places.round(3).tolist(),
        offsets=painted.offsets.tolist(),
        points=painted.points.round(3).tolist(),
        rewards=[[value if math.isfinite(value) else None for value in row] for row in painted.rewards.tolist()],
        objects=painted.objects.round(3).tolist(),
    )
    laps = _laps(context, request, foreign=foreign) if request.run is not None else []
    return RewardVerdict(ok=True, problems=found, situations=situations, painting=painting, laps=laps)


def _more_tracks(request: RewardCheck, context: Context) -> list[Track]:
    """The others that are learned on."""
    if request.of is None:
        return [context.courses.load(name) for name in dict.fromkeys(request.more_tracks) if name != request.track]
    with suppress(RacecraftError):  # a folder of tracks that is gone says nothing of the function
        return list(load_tracks(context.garage.folder(request.of).read_info().track)[1:])
    return []


def _among(request: RewardCheck, context: Context) -> tuple[Objects, int]:
    """What the car that is paid is among: objects, and cars that share its track."""
    if request.of is not None:
        info = context.garage.folder(request.of).read_info()
        return trained_objects(info), (info.settings.get("opponents") or {}).get("cars", 1)
    if request.race == RACED:
        return NO_OBJECTS, request.cars or 2
    count = {} if request.objects is None or request.race == "time-trial" else {"count": request.objects}
    return objects_for_race(request.race, settings=count), 1


def _laps(context: Context, request: RewardCheck, *, foreign: bool) -> list[RewardLap]:
    """The last laps of the model that was asked for, where it was evaluated on the track."""
    folder = context.garage.folder(str(request.run))
    track, info = context.courses.load(request.track), folder.read_info()
    for path in sorted(folder.path.glob("evaluation-*/evaluation.json"), reverse=True)[:20]:
        trace = path.parent / "evaluation-simtrace" / "0-iteration.csv"
        with suppress(RacecraftError):
            if trace.is_file() and is_road_of(read_json_object(path), info, track):
                return [
                    RewardLap(
                        number=lap.number,
                        status=lap.status,
                        points=lap.points.round(3).tolist(),
                        rewards=[value if math.isfinite(value) else None for value in lap.rewards.tolist()],
                    )
                    for lap in pay_laps(request.source, track, trace, foreign=foreign)
                ]
    return []
