"""Targets that are read and prepared before a source asks for them."""

from dataclasses import replace

import numpy as np
import pytest
from recordings import scans

from idem_ros.core import RegistrationConfig
from idem_ros.messages.transform_message import matrix_of
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.pair import Pair
from idem_ros.refinement.refiner import Refiner


@pytest.fixture
def pair(rng):
    (_, _, target), (_, _, source), (_, _, guess), _ = scans(rng, n=1)
    return Pair(target, source, Guess(matrix_of(guess), 'map', 'lidar'))


@pytest.mark.parametrize('voxel_size', [None, 'auto', 0.3])
def test_a_target_that_was_expected_is_read_before_and_gives_the_same(pair, voxel_size):
    config = RegistrationConfig(voxel_size=voxel_size)
    refiner, other = Refiner(config), Refiner(config)
    refiner.expect(pair.target)
    ahead, plain = refiner.refine(pair).result, other.refine(pair).result
    np.testing.assert_array_equal(ahead.T_target_source, plain.T_target_source)
    assert ahead.q_tot == plain.q_tot


class Watched:
    """A message that tells whether its points were read."""

    def __init__(self, message):
        self._message, self.is_read = message, False

    def __getattr__(self, name):
        self.is_read |= name == 'data'
        return getattr(self._message, name)


def test_of_targets_that_come_for_nothing_one_a_refinement_is_read_ahead(pair):
    targets = [Watched(pair.target) for _ in range(7)]
    refiner = Refiner()
    for target in targets[:5]:
        refiner.expect(target)
    assert [each.is_read for each in targets] == [True, *[False] * 6]
    refiner.refine(replace(pair, target=targets[4]))
    refiner.expect(targets[5])
    refiner.expect(targets[6])
    assert [each.is_read for each in targets] == [True, *[False] * 3, True, True, False]
