"""How likely a pose is right: the farther beyond the basin of its guess, the less."""

import pytest

from idem_ros.core.trust.verdict import probability

SEEN = 0.2, 0.2, 0.9  # discord nearby, contrast, overlap


def test_within_the_basin_it_does_not_matter_how_far_a_result_came():
    assert probability(*SEEN, 0.9) == probability(*SEEN, 0.0)


@pytest.mark.parametrize('way', [2.0, 8.0])
def test_beyond_it_the_odds_fall_with_the_cube_of_the_way(way):
    near, far = (probability(*SEEN, each) for each in (1.0, way))
    assert (far / (1 - far)) / (near / (1 - near)) == pytest.approx(way**-3)


def test_what_agrees_badly_far_from_its_guess_is_not_believed():
    badly = 0.4, 0.2, 0.5
    assert probability(*badly, 0.5) > 0.5 > probability(*badly, 2.5)
