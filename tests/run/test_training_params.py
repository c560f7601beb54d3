import pytest
import yaml
from hypothesis import example, given
from hypothesis import strategies as st

from racecraft.errors import ConfigError
from racecraft.run.training_params import TrainingParams

AWS = """\
JOB_TYPE: "TRAINING"
WORLD_NAME: "2022_april_open"
RACE_TYPE: ["TIME_TRIAL"]
REVERSE_DIR: "True"
CHANGE_START_POSITION: "false"
ROUND_ROBIN_ADVANCE_DIST: "0.1"
MIN_EVAL_TRIALS: "7"
MODEL_METADATA_FILE_S3_KEY: ["model/model_metadata.json"]
"""


def test_aws_file_with_strings_and_lists():
    params = TrainingParams.from_yaml(AWS)
    assert (params.world_name, params.race_type, params.min_eval_trials) == (
        "2022_april_open",
        "TIME_TRIAL",
        7,
    )
    assert (params.reverse_dir, params.change_start_position, params.round_robin_advance_dist) == (
        True,
        False,
        0.1,
    )
    assert params.extra == {
        "JOB_TYPE": "TRAINING",
        "MODEL_METADATA_FILE_S3_KEY": ["model/model_metadata.json"],
    }
    assert TrainingParams.from_yaml(params.to_yaml()) == params


scalars = st.text(max_size=12) | st.booleans() | st.integers() | st.floats() | st.none() | st.lists(st.integers())


@given(
    name=st.text(min_size=1, max_size=12), share=st.floats(0, 1), extra=st.dictionaries(st.text(max_size=6), scalars)
)
@example(name="No", share=0.05, extra={})
@example(name="oval", share=1e-5, extra={})
@example(name="oval", share=0.05, extra={"on": "e1", "Null": -0.0, "A": float("inf"), "B": "", "C": "a b", "D": 1e22})
def test_the_text_is_that_of_a_writer_of_yaml(name, share, extra):
    params = TrainingParams(world_name=name, round_robin_advance_dist=share, extra=extra)
    own = {field.upper(): getattr(params, field) for field in vars(params) if field not in ("extra", "given")}
    assert params.to_yaml() == yaml.safe_dump({**own, **extra}, sort_keys=False)


def test_defaults(tmp_path):
    assert TrainingParams.from_yaml("") == TrainingParams()
    TrainingParams().save(tmp_path / "p.yaml")
    assert TrainingParams.load(tmp_path / "p.yaml") == TrainingParams()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("- 1", "is not a list of settings"),
        ("just text", "is not a list of settings"),
        ("A: [", "not valid YAML at line"),
        ("A: !!python/object/apply:os.system ['true']", "has a YAML tag"),
        ("a: &x [1, 1]\nb: *x", "YAML alias"),
        (
            "RACE_TYPE: DRAG",
            "RACE_TYPE is 'DRAG'; allowed is TIME_TRIAL, OBJECT_AVOIDANCE, HEAD_TO_BOT, HEAD_TO_MODEL, F1",
        ),
        ("WORLD_NAME: oval\nWORLD_NAME: hairpin\n", "gives 'WORLD_NAME' twice."),
        ("{A: 1, B: A, 'A': 2}", "gives 'A' twice."),
        ("WORLD_NAME: 3", "WORLD_NAME is 3; allowed is a track's name"),
        ("REVERSE_DIR: maybe", "REVERSE_DIR is 'maybe'; allowed is true or false"),
        ("ROUND_ROBIN_ADVANCE_DIST: 1.5", "ROUND_ROBIN_ADVANCE_DIST is 1.5; allowed is 0 to 1"),
        ("START_POSITION_OFFSET: .nan", "START_POSITION_OFFSET is nan"),
        ("MIN_EVAL_TRIALS: 0", "MIN_EVAL_TRIALS is 0; allowed is 1 to 1000"),
        ("BEST_MODEL_METRIC: speed", "BEST_MODEL_METRIC is 'speed'; allowed is 'progress'"),
        ("[" * 200_000, "nested too deeply"),
        ("- " * 100_000, "nested too deeply"),
        ("WORLD_NAME: !!timestamp never", "has a YAML tag"),
        ("EXTRA: !!bool perhaps", "has a YAML tag"),
        ("EXTRA: 0x" + "f" * 4000, "a value of 4,002 characters without quotes"),
    ],
)
def test_bad_files(text, words):
    with pytest.raises(ConfigError) as error:
        TrainingParams.from_yaml(text, name="t.yaml")
    assert words in str(error.value)
    assert str(error.value).startswith("t.yaml")


def test_names_inside_of_values_are_none_of_the_file():
    params = TrainingParams.from_yaml("A:\n  B: 1\nB: [A, A]\nC:\n- A: 1\n- A: 2\nD: A\n")
    assert params.extra == {"A": {"B": 1}, "B": ["A", "A"], "C": [{"A": 1}, {"A": 2}], "D": "A"}


def test_unreadable_files(tmp_path):
    for data, words in ((b"\xff", "UTF-8"), (b" " * (1 << 19), "larger than")):
        (tmp_path / "p.yaml").write_bytes(data)
        with pytest.raises(ConfigError, match=words):
            TrainingParams.load(tmp_path / "p.yaml")
    with pytest.raises(ConfigError, match="cannot be read"):
        TrainingParams.load(tmp_path)
