"""AWS's ``hyperparameters.json``: read, checked, written, and mapped onto our PPO in one place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

from racecraft.agent.metadata_words import plain
from racecraft.errors import ConfigError
from racecraft.json_file import read_json_object, write_json_object

if TYPE_CHECKING:  # `file_model` knows these names: pydantic is for whom a file is there
    from pydantic import BeforeValidator, Field

    from racecraft.agent.aws_file import AwsModel, Number, Whole

BATCH_SIZES = (32, 64, 128, 256, 512)  # those of AWS's console
GAE_LAMBDA = 0.95  # AWS's, fixed
CLIP_COEF = 0.2  # AWS's, fixed
SAC_NOISE: Final = "additive_noise"

CONSOLE: Final[Mapping[str, tuple[float, ...]]] = {
    "batch_size": BATCH_SIZES,
    "num_epochs": (3, 10),
    "lr": (1e-8, 1e-3),
    "beta_entropy": (0, 1),
    "num_episodes_between_training": (1, 100),
}
"""What AWS's console allowed, two ends or every value, where its training code takes more."""


def _words(allowed: tuple[float, ...]) -> str:
    *others, last = (f"{value:g}" for value in allowed)
    return f"{', '.join(others)} or {last}" if len(others) > 1 else f"{others[0]} to {last}"


def _exploration(value: object) -> object:
    """A plain name; AWS's notebooks for SAC, which reads none of them, name the noise that SAC draws."""
    return "categorical" if plain(value) == SAC_NOISE else plain(value)


@dataclass(frozen=True)
class Hyperparameters:
    """How AWS would train; the defaults are those of its training code.

    That code only casts its values, so the ranges here are wider than its console's: all that can train at all.

    Raises:
        ConfigError: A value is outside its range.
    """

    batch_size: Annotated[Whole, Field(ge=1, le=2048, description="1 to 2048 samples")] = 64
    """Samples in a minibatch; PPO of the largest of AWS's networks keeps about 1 MB for each."""
    num_epochs: Annotated[Whole, Field(ge=1, le=100, description="1 to 100")] = 10
    """Passes over each rollout."""
    lr: Annotated[Number, Field(gt=0, le=1, description="above 0, to 1")] = 3e-4
    """Learning rate of Adam."""
    beta_entropy: Annotated[Number, Field(ge=0, le=100, description="0 to 100")] = 0.01
    """Weight of the entropy bonus."""
    discount_factor: Annotated[Number, Field(ge=0, le=1, description="0 to 1")] = 0.999
    """What a reward one step later is worth now."""
    loss_type: Annotated[
        Literal["huber", "mean squared error"],
        BeforeValidator(plain),
        Field(description="'huber' or 'mean squared error'"),
    ] = "mean squared error"
    """Loss of the value head."""
    num_episodes_between_training: Annotated[Whole, Field(ge=1, le=10_000, description="1 to 10000")] = 20
    """Episodes of a rollout, which ends after 10,000 steps at the latest."""
    exploration_type: Annotated[
        Literal["categorical", "e-greedy"],
        BeforeValidator(_exploration),
        Field(description="'categorical' or 'e-greedy'"),
    ] = "categorical"
    """Sample the policy, or take its best action except for a share of random ones; continuous actions are sampled
    always."""
    e_greedy_value: Annotated[Number, Field(ge=0, le=1, description="0 to 1")] = 0.05
    """Share of random actions at the end of the schedule; only for e-greedy."""
    epsilon_steps: Annotated[Whole, Field(ge=1, description="1 or more steps")] = 10_000
    """Steps over which that share falls from 1; only for e-greedy."""
    stack_size: Annotated[Whole, Field(ge=1, description="1 or more frames")] = 1
    """Has no effect, at AWS neither: the network sees one frame."""
    term_cond_max_episodes: Annotated[Whole, Field(ge=1, description="1 or more episodes")] = 100_000
    """Training stops after this many episodes."""
    term_cond_avg_score: Annotated[Number, Field(description="a number")] = 100_000.0
    """Training stops at this mean reward per episode."""
    sac_alpha: Annotated[Number, Field(ge=0, le=1, description="0 to 1")] = 0.2
    """Weight of the entropy in SAC; PPO has no use for it."""

    extra: Mapping[str, Any] = field(default_factory=dict, hash=False)
    """Fields of the file that mean nothing here; kept and written back."""
    notes: tuple[str, ...] = field(default=(), compare=False, repr=False)
    """Sentences for the user about what in the file has no effect or is unusual."""

    def __post_init__(self) -> None:
        from racecraft.agent.aws_file import validate

        given = {name: getattr(self, name) for name in _file().model_fields}
        checked = validate(_file(), given, name="hyperparameters")
        for name in given:
            object.__setattr__(self, name, getattr(checked, name))

    @classmethod
    def load(cls, path: str | Path) -> Hyperparameters:
        """From AWS's file, of any year.

        Raises:
            ConfigError: Names the file, the field, its value and what is allowed.
        """
        return cls.from_dict(read_json_object(path), name=str(path))

    @classmethod
    def from_dict(cls, document: Mapping[str, Any], *, name: str = "hyperparameters") -> Hyperparameters:
        """From the file's content; ``name`` is what messages call it. Missing fields get AWS's defaults."""
        from racecraft.agent.aws_file import unknown_fields, validate

        checked = validate(_file(), document, name=name)
        if "action_space" in document and not checked.model_fields_set.intersection(_file().model_fields):
            raise ConfigError(f"{name} has an action_space and no hyperparameter: it is a model_metadata.json.")
        notes = list(unknown_fields(checked, name=name))
        if "stack_size" in document and document["stack_size"] not in (1, "1"):
            notes.append(f"{name}: stack_size {document['stack_size']} has no effect, the network sees one frame.")
        if plain(document.get("exploration_type")) == SAC_NOISE:
            notes.append(
                f"{name}: exploration_type '{SAC_NOISE}' is what SAC does anyway, and 'categorical' elsewhere."
            )
        values = {field: getattr(checked, field) for field in _file().model_fields}
        for setting, allowed in CONSOLE.items():
            value = values[setting]
            is_usual = value in allowed if len(allowed) > 2 else allowed[0] <= value <= allowed[1]
            if not is_usual:
                notes.append(f"{name}: {setting} is {value:g}, and AWS's console allowed {_words(allowed)}.")
        return cls(**values, extra=dict(checked.model_extra or {}), notes=tuple(notes))

    def save(self, path: str | Path) -> None:
        """Write AWS's file; ``sac_alpha`` only where it was changed, as its console does."""
        write_json_object(path, self.to_dict())

    def to_dict(self) -> dict[str, Any]:
        """The content of AWS's file, sorted by name as its console writes it."""
        document = {
            **self.extra,
            **{name: getattr(self, name) for name in _file().model_fields},
        }
        if self.sac_alpha == Hyperparameters.sac_alpha:
            del document["sac_alpha"]
        return dict(sorted(document.items()))

    def notes_for(self, actions: str, algorithm: str) -> tuple[str, ...]:
        """Sentences for the user: `notes`, and what has no effect with such actions and such an algorithm.

        Args:
            actions: ``discrete`` or ``continuous``.
            algorithm: As model_metadata.json calls it.
        """
        notes = list(self.notes)
        if algorithm == "sac" and (episodes := self.num_episodes_between_training) != 1:
            notes.append(f"num_episodes_between_training {episodes} has no effect: SAC learns after every step.")
        if actions == "continuous" and self.exploration_type == "e-greedy":
            notes.append("exploration_type 'e-greedy' has no effect: continuous actions are always drawn by chance.")
        return tuple(notes)

    def to_ppo(self, *, is_exact: bool = False, is_continuous: bool = False) -> dict[str, float | int | str]:
        """The same settings under the names of our PPO.

        AWS's PPO does not clip gradients, hence the norm of 0, which means never.

        Args:
            is_continuous: The policy's actions are; AWS draws such ones whatever the exploration is to be.
            is_exact: Also what AWS's learner does less well than ours: its networks begin with Glorot's weights, its
                critic predicts in units of reward and its squared error is not halved, its Adam is TensorFlow's.
        """
        exactly: dict[str, float | int | str] = {
            "initial_weights": "glorot",
            "is_eps_hat": True,
            "normalize_returns": False,
            "vf_coef": 1.0 if self.loss_type == "huber" else 2.0,
        }
        return {
            "learning_rate": self.lr,
            "gamma": self.discount_factor,
            "gae_lambda": GAE_LAMBDA,
            "clip_coef": CLIP_COEF,
            "ent_coef": self.beta_entropy,
            "vf_coef": 0.5,
            "max_grad_norm": 0.0,
            "average_share": 0.0,
            "update_epochs": self.num_epochs,
            "minibatch_size": self.batch_size,
            "episodes_per_iteration": self.num_episodes_between_training,
            "value_loss": "huber" if self.loss_type == "huber" else "mse",
            "exploration": "categorical" if is_continuous else self.exploration_type,
            "epsilon_start": 1.0,
            "epsilon_end": self.e_greedy_value,
            "epsilon_steps": self.epsilon_steps,
            **(exactly if is_exact else {}),
        }

    def to_sac(self) -> dict[str, float | int | bool]:
        """The same settings under the names of our SAC: one update for every step, targets copied, alpha fixed."""
        return {
            "learning_rate": self.lr,
            "gamma": self.discount_factor,
            "minibatch_size": self.batch_size,
            "tau": 1.0,
            "updates_per_step": 1.0,
            "policy_frequency": 1,
            "alpha": self.sac_alpha,
            "learns_alpha": False,
            "normalize_rewards": False,
        }


@cache
def _file() -> type[AwsModel]:
    from racecraft.agent.aws_file import file_model

    return file_model(Hyperparameters)
