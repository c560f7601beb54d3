import math
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from racecraft.errors import RunError
from racecraft.run import EventWriter
from racecraft.run.events import _crc_table, _masked_checksum, _varint


def read(folder):
    """What TensorBoard itself reads: (tag, step, value), in order."""
    from tensorboard.backend.event_processing.event_file_loader import LegacyEventFileLoader

    found = []
    for path in sorted(folder.iterdir()):
        for event in LegacyEventFileLoader(str(path)).Load():
            found += [(value.tag, event.step, value.simple_value) for value in event.summary.value]
    return found


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_tensorboard_reads_what_was_written(tmp_path):
    with EventWriter(tmp_path) as writer:
        writer.add_scalars({"train/reward": 1.5, "train/entropy": -0.25}, step=0)
        writer.add_scalars({"eval/completion": math.inf, "größe": 1e300}, step=2**40)
    with EventWriter(tmp_path) as writer:
        writer.add_scalars({"nothing": math.nan}, step=300)
    first, second, third, fourth, last = read(tmp_path)
    assert [first, second] == [("train/reward", 0, 1.5), ("train/entropy", 0, -0.25)]
    assert [third, fourth] == [("eval/completion", 2**40, math.inf), ("größe", 2**40, math.inf)]
    assert math.isnan(last[2])


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_what_a_killed_run_wrote_after_its_checkpoint_is_forgotten(tmp_path):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    with EventWriter(tmp_path) as writer:
        for step in (64, 128, 192, 256):
            writer.add_scalars({"training/reward": step}, step=step)
    with EventWriter(tmp_path, after_step=128) as writer:
        for step in (192, 256, 320):
            writer.add_scalars({"training/reward": step + 1}, step=step)
    accumulator = EventAccumulator(str(tmp_path))
    accumulator.Reload()
    found = [(event.step, event.value) for event in accumulator.Scalars("training/reward")]
    assert found == [(64, 64), (128, 128), (192, 193), (256, 257), (320, 321)]


def test_close_twice_and_numbers_appear_after_a_flush(tmp_path):
    writer = EventWriter(tmp_path / "events")
    size = writer.path.stat().st_size
    writer.add_scalars({"a": 1}, step=1)
    writer.flush()
    assert writer.path.stat().st_size > size
    writer.close()
    writer.close()


def test_folder_that_is_a_file(tmp_path):
    (tmp_path / "events").write_text("")
    with pytest.raises(RunError, match="cannot be written"):
        EventWriter(tmp_path / "events")


def test_checksum_is_crc32c():
    assert _crc_table()[1] == 0xF26B8303
    # CRC-32C of "123456789" is 0xE3069283, the polynomial's published check value
    masked = ((0xE3069283 >> 15 | 0xE3069283 << 17) + 0xA282EAD8) & 0xFFFFFFFF
    assert _masked_checksum(b"123456789") == masked.to_bytes(4, "little")


@given(st.integers(0, 2**63 - 1))
def test_varint_holds_seven_bits_a_byte(value):
    data = _varint(value)
    assert sum((byte & 0x7F) << 7 * place for place, byte in enumerate(data)) == value
    assert [byte >> 7 for byte in data] == [1] * (len(data) - 1) + [0]


def test_writer_does_not_import_tensorboard():
    code = "import sys, racecraft.run; print({'tensorboard', 'torch', 'pydantic', 'yaml'} & {*sys.modules})"
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONPATH": ":".join(sys.path)},
    )
    assert result.stdout == "set()\n"
