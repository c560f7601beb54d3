"""What a model is made of, as the request for a new one: so that all of a copy can be changed before it learns."""

from __future__ import annotations

from typing import Literal, cast

from racecraft.learn import PPOConfig
from racecraft.run import RunFolder
from racecraft.serve.conditions import told_randomization, told_vehicle
from racecraft.serve.models.garage import RACED, race_of
from racecraft.serve.models.schemas import ModelCard, NewModel, Tuning
from racecraft.serve.road import Lane, Place, Placement
from racecraft.sim.objects import Bots, Obstacles
from racecraft.track import single_names
from racecraft.training.opponents import SELF
from racecraft.training.start import read_settings


def again(folder: RunFolder, card: ModelCard) -> NewModel:
    """The request that would make this model once more.

    What a request cannot say, how far apart things are placed and how long bots stay in a lane, has its default.

    Raises:
        RacecraftError: Its files cannot be read.
    """
    settings, hyperparameters = read_settings(folder), folder.read_hyperparameters()
    race, objects = race_of(folder.read_info()), settings.objects
    group, bots, raced = objects.bots or objects.obstacles, objects.bots, settings.opponents
    rivals = () if raced is None else tuple(driver for driver in raced.drivers if driver != SELF)
    return NewModel(
        sensors=None,  # the metadata says them
        track=card.track,
        more_tracks=single_names(settings.track)[1:],
        direction=cast(Literal["forward", "reverse", "alternate"], settings.direction),
        reward=folder.read_reward_function(),
        model_metadata=folder.read_model_metadata().to_dict(),
        hyperparameters=None if hyperparameters is None else hyperparameters.to_dict(),
        tuning=_tuning(settings.ppo) if hyperparameters is None and settings.algorithm == "ppo" else None,
        race=race,
        opponents=[driver.rpartition("/")[2] for driver in rivals],
        cars=raced.cars if raced is not None else None,
        objects=objects.count or None if race != RACED else None,
        bot_speed=bots.speed if bots is not None else None,
        lane_changes=bots is not None and bots.changes_lane,
        parked_cars=objects.obstacles is not None and objects.obstacles.kind == "car",
        placement=cast(Placement, group.placement) if group is not None else None,
        positions=_places(group),
        randomize=told_randomization(settings.randomize),
        algorithm=settings.algorithm,
        critic=settings.critic,
        network=settings.network,
        vehicle=told_vehicle(settings.vehicle),
        seed=settings.seed,
        until=str(settings.until),
    )


def _places(group: Bots | Obstacles | None) -> list[Place]:
    if group is None or group.placement != "fixed":
        return []
    return [(at, cast(Lane, lane)) for at, lane in group.positions]


def _tuning(ppo: PPOConfig) -> Tuning:
    return Tuning(
        lr=ppo.learning_rate,
        beta_entropy=ppo.ent_coef,
        discount_factor=ppo.gamma,
        num_epochs=ppo.update_epochs,
        batch_size=ppo.minibatch_size,
        loss_type="huber" if ppo.value_loss == "huber" else "mean squared error",
    )
