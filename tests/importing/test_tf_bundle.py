"""Checkpoints of TensorFlow, whole, damaged and hostile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tensorflow_bundles import block, few_tensors, mask, slow_crc32c, table, write_checkpoint

from racecraft.errors import SourceError
from racecraft.importing.tf_bundle import TensorBundle
from tensorflow_graphs import bytes_field, number, shape_message, varint

HEADER = (b"", number(1, 1))


def open_checkpoint(index: Path) -> TensorBundle:
    return TensorBundle(index, index.with_suffix(".data-00000-of-00001"), name=index.stem)


def read_all(index: Path) -> dict[str, bytes]:
    bundle = open_checkpoint(index)
    return {name: bundle.read(name).tobytes() for name in bundle.shapes}


def test_every_tensor_is_read(tmp_path: Path) -> None:
    tensors = few_tensors()
    index = write_checkpoint(tmp_path, "4_Step-9.ckpt", tensors)
    bundle = open_checkpoint(index)
    assert bundle.shapes == {name: tensor.shape for name, tensor in tensors.items()}
    for name, tensor in tensors.items():
        assert np.array_equal(bundle.read(name), tensor)


@pytest.mark.costly
def test_whatever_bit_flips_it_is_a_sentence_or_nothing(tmp_path: Path) -> None:
    index = write_checkpoint(tmp_path, "4_Step-9.ckpt", few_tensors(6))
    data = index.with_suffix(".data-00000-of-00001")
    whole = {path: path.read_bytes() for path in (index, data)}
    good = read_all(index)
    rng = np.random.default_rng(11)
    messages = []
    for path in rng.choice(np.array([index, data]), 2000, p=[0.8, 0.2]):
        damaged = bytearray(whole[path])
        damaged[rng.integers(len(damaged))] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            found = read_all(index)
        except SourceError as error:
            messages.append(str(error))
        else:
            assert found == good  # the padding before the magic number has no meaning
        path.write_bytes(whole[path])
    assert len(messages) > 1800
    assert not any("\n" in message for message in messages)


@pytest.mark.costly
def test_wherever_it_is_cut_off_it_is_a_sentence(tmp_path: Path) -> None:
    index = write_checkpoint(tmp_path, "4_Step-9.ckpt", few_tensors(6))
    whole = index.read_bytes()
    for size in range(len(whole)):
        index.write_bytes(whole[:size])
        with pytest.raises(SourceError):
            open_checkpoint(index)
    index.write_bytes(whole)
    data = index.with_suffix(".data-00000-of-00001")
    data.write_bytes(data.read_bytes()[:-1])
    with pytest.raises(SourceError, match="its data end before"):
        read_all(index)


def entry(dtype: int = 1, shape: tuple[int, ...] = (2,), offset: int = 0, size: int = 8, more: bytes = b"") -> bytes:
    checksum = b"\x35" + mask(slow_crc32c(bytes(8))).to_bytes(4, "little")
    return (
        number(1, dtype) + bytes_field(2, shape_message(shape)) + number(4, offset) + number(5, size) + checksum + more
    )


HOSTILE = {
    "nothing": (b"", "its end is missing"),
    "zeros": (bytes(1000), "its end is missing"),
    "two pieces": (table([(b"", number(1, 2)), (b"a", entry())]), "in several pieces"),
    "big-endian": (table([(b"", number(1, 1) + number(2, 1)), (b"a", entry())]), "big-endian"),
    "a huge shape": (table([HEADER, (b"a", entry(shape=(1 << 40, 1 << 40)))]), "has the shape"),
    "a long name": (table([HEADER, (b"a" * 2000, entry())]), "longer than the block"),
    "too large": (bytes((1 << 20) + 1), "larger than 1,048,576 bytes"),
    "a block beyond the end": (
        (b"\0\0" + varint(1 << 40) + varint(9)).ljust(40, b"\0") + table([HEADER])[-8:],
        "a block lies beyond its end",
    ),
}


@pytest.mark.parametrize(("content", "says"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_index_is_one_sentence(content: bytes, says: str, tmp_path: Path) -> None:
    is_refused(content, says, tmp_path)


def test_a_block_that_is_listed_many_times_is_read_once(tmp_path: Path) -> None:
    def trailed(content: bytes) -> bytes:
        return content + b"\0" + mask(slow_crc32c(content + b"\0")).to_bytes(4, "little")

    empty = block([])
    listed = block([(b"%05d" % place, varint(0) + varint(len(empty))) for place in range(1000)])
    begin = len(trailed(empty))
    footer = varint(0) + varint(0) + varint(begin) + varint(len(listed))
    content = trailed(empty) + trailed(listed) + footer.ljust(40, b"\0") + table([HEADER])[-8:]
    is_refused(content, "do not lie one behind the other", tmp_path)


@pytest.mark.costly
def test_more_names_than_any_network_has_are_one_sentence(tmp_path: Path) -> None:
    names = ((b"%d" % i, entry()) for i in range(11_000))  # seconds to write, so not while tests are collected
    is_refused(table([HEADER, *names]), "more than 10,000 tensors", tmp_path)


def is_refused(content: bytes, says: str, tmp_path: Path) -> None:
    index = tmp_path / "4_Step-9.ckpt.index"
    index.write_bytes(content)
    with pytest.raises(SourceError) as caught:
        open_checkpoint(index)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("message", "says"),
    [
        (entry(offset=4), "its data end before 'a'"),
        (entry(offset=1 << 62), "its data end before 'a'"),
        (entry(size=4), "of shape .2,. takes 4 bytes"),
        (entry(shape=(1 << 27,), size=1 << 29), "takes 536,870,912 bytes"),
        (entry(shape=(1 << 25,), size=1 << 27), "its data end before 'a'"),
    ],
)
def test_a_tensor_is_read_only_where_it_lies(message: bytes, says: str, tmp_path: Path) -> None:
    index = tmp_path / "4_Step-9.ckpt.index"
    index.write_bytes(table([HEADER, (b"a", message)]))
    index.with_suffix(".data-00000-of-00001").write_bytes(bytes(8))
    with pytest.raises(SourceError, match=says):
        open_checkpoint(index).read("a")


def test_what_is_no_float_or_lies_elsewhere_is_left_out(tmp_path: Path) -> None:
    index = tmp_path / "4_Step-9.ckpt.index"
    pairs = [
        HEADER,
        (b"a", entry()),
        (b"b", entry(dtype=9)),
        (b"c", entry(more=bytes_field(7, b""))),
        (b"d", entry(more=number(3, 1))),
    ]
    index.write_bytes(table(pairs))
    assert open_checkpoint(index).shapes == {"a": (2,)}


def test_a_name_has_up_to_a_thousand_characters(tmp_path: Path) -> None:
    index = tmp_path / "4_Step-9.ckpt.index"
    index.write_bytes(table([HEADER, (b"a" * 1000, entry())]))
    assert list(open_checkpoint(index).shapes) == ["a" * 1000]


def test_names_share_their_beginnings() -> None:
    assert len(block([(b"x" * 100 + bytes([i]), b"") for i in range(65, 80)])) < 200
