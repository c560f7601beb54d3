import numpy as np
import pytest

from racecraft.film.lettering import Lettering, blend, disc_mask, pill_mask


def blank(background=0):
    return np.full((40, 100, 3), background, dtype=np.uint8)


def test_words_lie_between_their_anchors():
    letters = Lettering(20)
    for anchor, left in (("l", 50.0), ("m", 50.0 - letters.width("12.34") / 2), ("r", 50.0 - letters.width("12.34"))):
        frame = blank()
        letters.draw(frame, 50, 30, "12.34", (255, 255, 255), anchor=anchor)
        rows, columns = np.nonzero(frame[..., 0])
        assert columns.min() >= left - 2
        assert columns.max() <= left + letters.width("12.34") + 2
        assert rows.max() <= 30
        assert frame.max() == 255


def test_digits_are_equally_wide():
    for size in (10, 13, 22, 28):
        assert len({Lettering(size).width(digit) for digit in "0123456789"}) == 1


def test_blending_is_a_weighted_mean():
    frame = blank(100)
    blend(frame, 10, 10, np.full((2, 2, 1), 128, dtype=np.uint16), (200, 0, 100))
    assert frame[10, 10].tolist() == [150, 50, 100]
    blend(frame, 10, 10, np.full((2, 2, 1), 256, dtype=np.uint16), (255, 7, 0))
    assert frame[11, 11].tolist() == [255, 7, 0]
    assert (frame[12:, 12:] == 100).all()


@pytest.mark.parametrize(("x", "y"), [(-4, -4), (97, 37), (-100, 0), (0, 500), (200, -200)])
def test_what_falls_outside_is_cut(x, y):
    frame = blank()
    blend(frame, x, y, disc_mask(5.0), (255, 255, 255))
    Lettering(20).draw(frame, x, y, "lap", (255, 255, 255))


def test_shapes_are_symmetric():
    for mask in (disc_mask(4.5), pill_mask(40, 16)):
        np.testing.assert_array_equal(mask, mask[::-1])
        np.testing.assert_array_equal(mask, mask[:, ::-1])
        assert mask.max() == 256
        assert mask[0, 0, 0] == 0
