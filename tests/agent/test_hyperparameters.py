import dataclasses
import json
from pathlib import Path

import pytest

from racecraft.agent import Hyperparameters
from racecraft.errors import ConfigError

SHARED = Path(__file__).parents[3] / "shared"


def test_real_file_is_read_and_written_to_the_byte(tmp_path):
    path = SHARED / "logs/drfc/hyperparameters.json"
    if not path.exists():
        pytest.skip("shared/logs is not there")
    settings = Hyperparameters.load(path)
    assert settings.discount_factor == 0.95
    assert settings.notes == ()
    settings.save(tmp_path / "hyperparameters.json")
    assert (tmp_path / "hyperparameters.json").read_bytes() == path.read_bytes()


def test_all_real_runs_are_accepted():
    files = sorted((SHARED / "traces").glob("*.json"))
    if not files:
        pytest.skip("shared/traces is not there")
    for path in files:
        document = json.loads(path.read_text())["hyperparameters"]
        assert Hyperparameters.from_dict(document).to_dict() == document


def test_missing_fields_get_the_defaults_of_aws_code():
    assert Hyperparameters.from_dict({}) == Hyperparameters()
    assert Hyperparameters().discount_factor == 0.999
    assert Hyperparameters().term_cond_max_episodes == Hyperparameters().term_cond_avg_score == 100_000


def test_numbers_may_be_strings():
    settings = Hyperparameters.from_dict({"batch_size": "128", "lr": "0.0005", "num_epochs": "5", "epsilon_steps": 1e4})
    assert (settings.batch_size, settings.lr, settings.num_epochs, settings.epsilon_steps) == (
        128,
        0.0005,
        5,
        10_000,
    )
    assert isinstance(settings.batch_size, int)


def test_unknown_fields_are_reported_and_kept():
    settings = Hyperparameters.from_dict({"learning_rate": 1, "num_epoch": 3}, name="h.json")
    assert settings.notes[1] == "h.json: unknown field 'num_epoch' has no effect. Did you mean 'num_epochs'?"
    assert settings.to_dict()["learning_rate"] == 1


def test_noise_of_sac_is_taken():
    settings = Hyperparameters.from_dict({"exploration_type": "Additive_noise", "sac_alpha": "0.2"}, name="h.json")
    assert (settings.exploration_type, settings.sac_alpha) == ("categorical", 0.2)
    assert settings.notes == (
        "h.json: exploration_type 'additive_noise' is what SAC does anyway, and 'categorical' elsewhere.",
    )


def test_a_model_metadata_in_its_place_is_recognised():
    with pytest.raises(
        ConfigError, match=r"^m\.json has an action_space and no hyperparameter: it is a model_metadata"
    ):
        Hyperparameters.from_dict({"action_space": [], "version": "5"}, name="m.json")
    assert Hyperparameters.from_dict({"action_space": [], "batch_size": 32}).batch_size == 32


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("batch_size", 100, "32, 64, 128, 256 or 512"),
        ("batch_size", 1024, "32, 64, 128, 256 or 512"),
        ("num_epochs", 2, "3 to 10"),
        ("num_epochs", 12, "3 to 10"),
        ("lr", 0.01, "1e-08 to 0.001"),
        ("lr", 1e-9, "1e-08 to 0.001"),
        ("beta_entropy", 1.5, "0 to 1"),
        ("num_episodes_between_training", 200, "1 to 100"),
    ],
)
def test_what_only_awss_console_refused_is_taken_with_a_note(field, value, allowed):
    settings = Hyperparameters.from_dict({field: value}, name="h.json")
    assert getattr(settings, field) == value
    assert settings.to_dict()[field] == value
    assert settings.notes == (f"h.json: {field} is {value:g}, and AWS's console allowed {allowed}.",)


def test_nothing_is_noted_of_what_the_console_allowed():
    ends = [
        {"batch_size": 32, "num_epochs": 3, "lr": 1e-8, "beta_entropy": 0, "num_episodes_between_training": 1},
        {"batch_size": 512, "num_epochs": 10, "lr": 1e-3, "beta_entropy": 1, "num_episodes_between_training": 100},
    ]
    assert [Hyperparameters.from_dict(document).notes for document in ({}, *ends)] == [(), (), ()]


def test_names_may_have_capital_letters():
    settings = Hyperparameters.from_dict({"loss_type": "Huber", "exploration_type": " Categorical"})
    assert (settings.loss_type, settings.exploration_type, settings.notes) == ("huber", "categorical", ())
    assert Hyperparameters(loss_type="Mean Squared Error").loss_type == "mean squared error"


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("batch_size", 0, "1 to 2048"),
        ("batch_size", 4096, "1 to 2048"),
        ("num_epochs", 0, "1 to 100"),
        ("num_epochs", 101, "1 to 100"),
        ("num_epochs", 3.5, "1 to 100"),
        ("lr", 0, "above 0, to 1"),
        ("lr", 1.1, "above 0, to 1"),
        ("lr", "nan", "above 0, to 1"),
        ("lr", True, "above 0, to 1"),
        ("lr", None, "above 0, to 1"),
        ("lr", [0.1], "above 0, to 1"),
        ("beta_entropy", -0.1, "0 to 100"),
        ("beta_entropy", 101, "0 to 100"),
        ("discount_factor", 1.01, "0 to 1"),
        ("loss_type", "Mean Square Error", "'huber' or 'mean squared error' (Did you mean 'mean squared error'?)"),
        ("loss_type", "hubert", "'huber' or 'mean squared error' (Did you mean 'huber'?)"),
        ("num_episodes_between_training", 0, "1 to 10000"),
        ("num_episodes_between_training", 10_001, "1 to 10000"),
        ("exploration_type", "greedy", "'categorical' or 'e-greedy'"),
        ("e_greedy_value", 2, "0 to 1"),
        ("epsilon_steps", 0, "1 or more"),
        ("stack_size", 0, "1 or more"),
        ("term_cond_max_episodes", -1, "1 or more"),
        ("term_cond_avg_score", "high", "a number"),
        ("sac_alpha", 1.5, "0 to 1"),
    ],
)
def test_wrong_field_names_itself_its_value_and_the_range(field, value, allowed):
    for make in (
        lambda: Hyperparameters.from_dict({field: value}),
        lambda: Hyperparameters(**{field: value}),
    ):
        with pytest.raises(ConfigError) as error:
            make()
        assert f"{field} is {value!r}; allowed is {allowed}" in str(error.value)


def test_every_field_has_a_range_in_words():
    from racecraft.agent.hyperparameters import _file

    assert all(field.description for field in _file().model_fields.values())
    assert len(_file().model_fields) == 14


def test_sac_trains_after_every_step_whatever_the_file_says():
    one = Hyperparameters(num_episodes_between_training=1)
    assert one.notes_for("continuous", "sac") == Hyperparameters().notes_for("continuous", "clipped_ppo") == ()
    told = "num_episodes_between_training 20 has no effect: SAC learns after every step."
    assert Hyperparameters().notes_for("continuous", "sac") == (told,)


def test_sac_is_that_of_aws_with_an_update_a_step_and_nothing_of_ours():
    found = Hyperparameters(lr=1e-4, batch_size=128, sac_alpha=0.3).to_sac()
    assert (found["learning_rate"], found["minibatch_size"], found["alpha"], found["gamma"]) == (1e-4, 128, 0.3, 0.999)
    assert (found["tau"], found["updates_per_step"], found["policy_frequency"]) == (1.0, 1.0, 1)
    assert (found["learns_alpha"], found["normalize_rewards"]) == (False, False)


def test_continuous_actions_are_drawn_by_chance_whatever_the_file_says():
    greedy = Hyperparameters.from_dict({"exploration_type": "e-greedy", "num_epochs": 2})
    assert greedy.to_ppo(is_continuous=True) == {**greedy.to_ppo(), "exploration": "categorical"}
    assert greedy.to_ppo()["exploration"] == "e-greedy"
    assert greedy.notes_for("discrete", "clipped_ppo") == greedy.notes
    told = "exploration_type 'e-greedy' has no effect: continuous actions are always drawn by chance."
    assert greedy.notes_for("continuous", "clipped_ppo") == (*greedy.notes, told)
    assert Hyperparameters().notes_for("continuous", "clipped_ppo") == ()


def test_ppo_settings_are_named_as_the_learner_names_them():
    ppo = pytest.importorskip("racecraft.learn.ppo")
    settings = Hyperparameters(batch_size=128, lr=1e-4, loss_type="huber", exploration_type="e-greedy")
    config = ppo.PPOConfig(**settings.to_ppo())
    assert (config.minibatch_size, config.learning_rate, config.value_loss) == (128, 1e-4, "huber")
    assert (config.gae_lambda, config.clip_coef, config.gamma) == (0.95, 0.2, 0.999)
    assert (config.exploration, config.epsilon_end, config.epsilon_steps) == ("e-greedy", 0.05, 10_000)
    assert config.episodes_per_iteration == 20
    assert set(settings.to_ppo()) <= {field.name for field in dataclasses.fields(ppo.PPOConfig)}
