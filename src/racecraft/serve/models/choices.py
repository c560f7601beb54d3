"""What a new model can be made of."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict
from typing import Final

from fastapi import APIRouter

from racecraft.agent import Hyperparameters
from racecraft.agent.hyperparameters import BATCH_SIZES
from racecraft.agent.sensors import SENSOR_NAMES
from racecraft.errors import RacecraftError
from racecraft.learn import PPOConfig
from racecraft.learn.networks import network_names
from racecraft.serve.conditions import VEHICLES
from racecraft.serve.context import Context, InContext
from racecraft.serve.models.garage import RACED, race_of
from racecraft.serve.models.schemas import Choices, NumberChoice
from racecraft.sim.objects import RACE_TYPES
from racecraft.sim.randomization import PRESETS as RANDOMIZATIONS
from racecraft.sim.vehicle import load_vehicle
from racecraft.training.regimes import METHODS
from racecraft.training.settings import CRITICS
from racecraft.training.start import aws_hyperparameters

router = APIRouter(prefix="/api/choices", tags=["choices"])

OLD_NAMES: Final = ("observation",)
"""Of sensors; files may have them, nobody needs to choose them."""


@router.get("")
def list_choices(context: InContext) -> Choices:
    """Networks, cars, sensors, races and numbers that a new model can have."""
    names = ("batch_size", "num_epochs", "lr", "beta_entropy", "discount_factor", "loss_type")
    fast = aws_hyperparameters(PPOConfig())
    return Choices(
        networks=list(network_names()),
        vehicles=list(VEHICLES),
        sensors=[name for name in SENSOR_NAMES if name not in OLD_NAMES],
        algorithms=[name for name in METHODS if ":" not in name],
        races=[*RACE_TYPES, RACED],
        critics=list(CRITICS),
        randomizations=list(RANDOMIZATIONS),
        cars={name: asdict(load_vehicle(name)) for name in VEHICLES},
        ranges={name: asdict(preset) for name, preset in RANDOMIZATIONS.items()},
        hyperparameters=_numbers(),
        aws=Hyperparameters().to_dict(),
        fast={name: fast[name] for name in names},
        paces=_paces(context),
    )


def _numbers() -> list[NumberChoice]:
    """AWS's hyperparameters with their ranges, and those that people do well with."""
    default = Hyperparameters()

    def number(
        name: str, low: float, high: float, safe: tuple[float, float], *, logarithmic: bool = False
    ) -> NumberChoice:
        value = getattr(default, name)
        return NumberChoice(
            name=name,
            default=value,
            low=low,
            high=high,
            safe_low=safe[0],
            safe_high=safe[1],
            is_whole=isinstance(value, int),
            is_logarithmic=logarithmic,
            allowed=list(BATCH_SIZES) if name == "batch_size" else None,
        )

    return [
        number("lr", 1e-5, 1e-2, (1e-4, 2e-3), logarithmic=True),
        number("beta_entropy", 0.0, 0.1, (0.001, 0.03)),
        number("discount_factor", 0.9, 0.9999, (0.97, 0.999)),
        number("num_epochs", 1, 10, (3, 10)),
        number("batch_size", BATCH_SIZES[0], BATCH_SIZES[-1], (64, 256)),
        number("num_episodes_between_training", 1, 100, (10, 40)),
    ]


def _paces(context: Context) -> dict[str, float]:
    """Camera steps a second of the latest training of each type of race that ended."""
    found: dict[str, float] = {}
    for job in context.queue.list(kind="train", limit=40):
        result = job.result or {}
        if job.started and job.finished and result.get("steps"):
            seconds = (job.finished - job.started).total_seconds()
            with suppress(RacecraftError):
                race = race_of(context.garage.folder(job.run).read_info())
                if seconds > 1 and result["steps"] > 2000 and race not in found:
                    found[race] = float(round(result["steps"] / seconds, 1))
    return found
