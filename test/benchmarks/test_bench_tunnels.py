import numpy as np
import pytest

from benchmarks.tunnels.page import Counts, goals, markdown
from benchmarks.tunnels.scenes import BARE
from benchmarks.tunnels.sensors import NOISE, PATTERNS, scanned
from benchmarks.tunnels.trials import Trial, setup, trial
from idem_ros.core.geometry import se3


def said(scene='niches', **changed):
    made = Trial(
        scene=scene,
        seed=0,
        pattern='32 rings',
        onto='scan',
        guessed='off',
        motion=2.0,
        off=1.0,
        in_sight=4,
        wanted=True,
        error=0.01,
        across=0.01,
        rotation=0.01,
        verdict='aligned',
        free='',
        named=True,
        drift=0.0,
        p=1.0,
        sigma=0.01,
    )
    return made._replace(**changed)


@pytest.mark.parametrize('pattern', PATTERNS)
def test_a_pattern_sees_the_level_ground_where_it_is(pattern):
    ground = BARE[-1](np.random.default_rng(0)).scene
    points = scanned(ground, se3.translation((0.0, 0.0, 1.6)), pattern, np.random.default_rng(1))
    assert len(points) > 1000
    assert np.abs(points[:, 2] + 1.6).max() < 5 * NOISE


def test_a_setup_is_drawn_from_its_seed_alone():
    one, again, other = setup('niches', 7), setup('niches', 7), setup('niches', 13)
    np.testing.assert_array_equal(one.source, again.source)
    assert one.pattern == other.pattern
    assert len(one.source) != len(other.source)


def test_a_bare_plane_is_named_free_in_its_three_motions():
    found = trial('open_plane', 5)
    assert found.named
    assert not found.aligned
    assert found.across < 0.05


def test_every_scene_and_every_group_gets_its_share_of_trials():
    tasks = Counts.of(24).tasks(100)
    assert len(tasks) == 24 + 12 + 12
    assert sum(name == 'bare_tunnel' for name, _ in tasks) == 6
    assert {seed for name, seed in tasks if name == 'posts'} == set(range(100, 106))


def test_wrong_results_called_aligned_miss_their_goal():
    fine = [said(), said('bare_tunnel', verdict='degenerate'), said('posts'), said('town')]
    assert all(goal.reached for goal in goals(fine))
    missed = [g.figure for g in goals([*fine, said(error=0.3)]) if not g.reached]
    assert [figure.split(':')[0] for figure in missed] == ['niches, posts', 'niches']
    assert '| niches ' in markdown(fine)
