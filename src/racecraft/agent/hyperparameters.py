"""AWS's ``hyperparameters.json``: read, checked, written, and mapped onto our PPO in one place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from racecraft.agent.aws_file import AwsModel, Number, Whole, file_model, unknown_fields, validate
from racecraft.errors import ConfigError
from racecraft.json_file import read_json_object, write_json_object

BATCH_SIZES = (32, 64, 128, 256, 512)
GAE_LAMBDA = 0.95  # AWS's, fixed
CLIP_COEF = 0.2  # AWS's, fixed


def _batch_size(value: int) -> int:
    if value not in BATCH_SIZES:
        raise ValueError("not a batch size")
    return value


@dataclass(frozen=True)
class Hyperparameters:
    """How AWS would train; the ranges are its console's, the defaults those of its training code.

    Raises:
        ConfigError: A value is outside its range.
    """

    batch_size: Annotated[Whole, AfterValidator(_batch_size), Field(description="32, 64, 128, 256 or 512 samples")] = 64
    """Samples in a minibatch."""
    num_epochs: Annotated[Whole, Field(ge=3, le=10, description="3 to 10")] = 10
    """Passes over each rollout."""
    lr: Annotated[Number, Field(ge=1e-8, le=1e-3, description="1e-08 to 0.001")] = 3e-4
    """Learning rate of Adam."""
    beta_entropy: Annotated[Number, Field(ge=0, le=1, description="0 to 1")] = 0.01
    """Weight of the entropy bonus."""
    discount_factor: Annotated[Number, Field(ge=0, le=1, description="0 to 1")] = 0.999
    """What a reward one step later is worth now."""
    loss_type: Annotated[
        Literal["huber", "mean squared error"], Field(description="'huber' or 'mean squared error'")
    ] = "mean squared error"
    """Loss of the value head."""
    num_episodes_between_training: Annotated[Whole, Field(ge=1, le=100, description="1 to 100")] = 20
    """Episodes of a rollout."""
    exploration_type: Annotated[
        Literal["categorical", "e-greedy"], Field(description="'categorical' or 'e-greedy'")
    ] = "categorical"
    """Sample the policy, or take its best action except for a share of random ones."""
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
    """Sentences for the user about what in the file has no effect."""

    def __post_init__(self) -> None:
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
        checked = validate(_file(), document, name=name)
        notes = list(unknown_fields(checked, name=name))
        if "stack_size" in document and document["stack_size"] not in (1, "1"):
            notes.append(f"{name}: stack_size {document['stack_size']} has no effect, the network sees one frame.")
        values = {field: getattr(checked, field) for field in _file().model_fields}
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

    def check_algorithm(self, algorithm: str) -> None:
        """Refuse what does not go with a training algorithm: SAC learns after every episode.

        Raises:
            ConfigError: SAC with more than one episode between training.
        """
        if algorithm == "sac" and self.num_episodes_between_training != 1:
            episodes = self.num_episodes_between_training
            raise ConfigError(f"num_episodes_between_training is {episodes}; allowed is 1 with 'sac'.")

    def to_ppo(self, *, is_exact: bool = False) -> dict[str, float | int | str]:
        """The same settings under the names of our PPO.

        AWS's PPO does not clip gradients, hence the norm of 0, which means never.

        Args:
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
            "exploration": self.exploration_type,
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
    return file_model(Hyperparameters)
