from contextlib import contextmanager, suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.agent import Hyperparameters, ModelMetadata
from racecraft.errors import ConfigError
from racecraft.json_file import parse_json_object, read_json_object


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "not valid JSON"),
        (b"[]", "holds a JSON array, expected an object"),
        (b"3", "expected an object"),
        (b'"x"', "holds a JSON string"),
        (b"{", "line 1, column 2"),
        (b'{"a": 1, "a": 2}', "field 'a' is given twice"),
        (b'{"a": {"b": 1, "b": 1}}', "field 'b' is given twice"),
        (b'{"a": NaN}', "NaN is not a number"),
        (b'{"a": -Infinity}', "-Infinity is not a number"),
        (b'{"a": 1e999}', "1e999 is too large"),
        (b'{"a": ' + b"9" * 5000 + b"}", "not valid"),
        (b'{"a": ' + b"[" * 100_000 + b"]" * 100_000 + b"}", "nested too deeply"),
        (b"\xff{}", "not UTF-8 text: byte 0 is 0xff"),
        (b" " * (1 << 20) + b"{}", "larger than 1,048,576 bytes"),
    ],
    ids=range(14),
)
@pytest.mark.parametrize("reader", [read_json_object, Hyperparameters.load, ModelMetadata.load])
def test_bad_files_are_refused_with_their_name(tmp_path, data, words, reader):
    path = tmp_path / "file.json"
    path.write_bytes(data)
    with pytest.raises(ConfigError) as error:
        reader(path)
    assert words in str(error.value)
    assert str(path) in str(error.value)


def test_missing_files_and_folders_are_refused(tmp_path):
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(ConfigError, match="cannot be read"):
            read_json_object(path)


def test_byte_order_mark_is_fine():
    assert parse_json_object('{"a": "ü"}'.encode("utf-8-sig"), name="x") == {"a": "ü"}


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=9),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)


@pytest.mark.costly
@pytest.mark.parametrize("settings", [Hyperparameters, ModelMetadata])
@given(data=st.data())
def test_any_value_in_any_field_is_taken_or_refused_by_name(settings, data):
    good = {
        "action_space": [{"steering_angle": 1, "speed": 1}, {"steering_angle": -1, "speed": 1}],
        **Hyperparameters().to_dict(),
        **{"sensor": ["observation"], "neural_network": "DEEP_CONVOLUTIONAL_NETWORK", "version": "3"},
    }
    field = data.draw(st.sampled_from(sorted(good)))
    value = data.draw(json_values)
    with suppress(ConfigError), naming(field):
        settings.from_dict({**good, field: value}, name="file")


@contextmanager
def naming(field):
    try:
        yield
    except ConfigError as error:
        if field not in str(error):
            raise AssertionError(f"{field} is not named: {error}") from error
        raise
