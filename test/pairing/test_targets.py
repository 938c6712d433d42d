"""Targets that cannot be used, and clouds that are source and target at once."""

import numpy as np
import pytest
from pairs import LATER, LONG_AGO, cloud, guess
from poses import SECOND, tf
from poses import transform as guess_message

from idem_ros.core import RegistrationConfig, Status
from idem_ros.messages.pointcloud2 import BLOCK, InvalidPointCloud2, require_points
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.pair import refined
from idem_ros.pairing.pairing import Pairing
from idem_ros.pairing.targets import FRAMES_KEPT, KEPT, PairingConfig, UnusableTarget
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.refinement.refiner import Refiner

PAIRINGS = ('latched', 'newest', 'nearest')
STEP = SECOND // 10


@pytest.fixture
def pairing():
    return Pairing(guess_config=GuessConfig('identity'))


def spoilt(stamp, **changes):
    message = cloud(stamp)
    for name, value in changes.items():
        setattr(message, name, value)
    return message


MALFORMED = {
    'without fields': lambda stamp: spoilt(stamp, fields=[]),
    'cut off': lambda stamp: spoilt(stamp, data=cloud(stamp).data[:-5]),
    'without points': lambda stamp: spoilt(stamp, width=0, data=np.empty(0, np.uint8)),
    'of no bytes': lambda stamp: spoilt(stamp, data=None),
    'of NaN': lambda stamp: cloud(stamp, points=np.full((10, 3), np.nan)),
    'of zeros': lambda stamp: cloud(stamp, points=np.zeros((10, 3))),
    'of four points': lambda stamp: cloud(stamp, points=np.eye(4)[:, :3] + 1.0),
}


@pytest.mark.parametrize('kind', MALFORMED)
@pytest.mark.parametrize('rule', ['latched', 'newest'])
def test_a_target_that_cannot_be_used_displaces_none_that_can(kind, rule):
    pairing = Pairing(PairingConfig(rule), GuessConfig('identity'))
    good = cloud(1)
    pairing.add_target(good)
    for stamp in range(2, 2 + 2 * KEPT):
        assert pairing.add_target(MALFORMED[kind](stamp)) == []
    (pair,) = pairing.add_source(cloud(100))
    assert pair.target is good
    assert (pairing.refused_targets, pairing.refused) == (2 * KEPT, 0)
    refusal = pairing.take_refusals()[-1]
    assert (refusal.role, refusal.stamp) == ('target', 1 + 2 * KEPT)
    assert refusal.reason.startswith('target: ')


def test_a_source_that_waits_for_a_target_says_why_the_last_is_none(pairing):
    pairing.add_target(spoilt(1, fields=[]))
    assert pairing.add_source(cloud(2)) == []
    assert pairing.waiting_for() == 'target'
    assert "the last: it has no field 'x'" in pairing.why_it_waits()
    assert len(pairing.add_target(cloud(3))) == 1


def plane(size):
    points = np.random.default_rng(0).uniform(0.0, size, (200, 3))
    return points * [1.0, 1.0, 0.01] + 1.0


def test_a_target_that_turns_out_unusable_when_read_gives_way_to_the_one_before(pairing):
    cropped = PreprocessingConfig(max_range=50.0, crop_target=True)
    refiner = Refiner(RegistrationConfig(voxel_size=0.2), preprocessing=cropped)
    good, far = cloud(1, points=plane(5.0)), cloud(2, points=plane(5.0) + 1000.0)
    few = cloud(3, points=plane(0.1))
    for target in (good, far, few):
        pairing.add_target(target)
    used = []

    def refine(pair):
        used.append(pair.target)
        return refiner.refine(pair)

    (pair,) = pairing.add_source(cloud(4, points=plane(5.0)))
    assert refined(refine, pair, pairing).points_target == 200
    assert [each is target for each, target in zip(used, (few, far, good), strict=True)]
    assert [each.role for each in pairing.take_refusals()] == ['target', 'target']
    (pair,) = pairing.add_source(cloud(5, points=plane(5.0)))
    assert pair.target is good
    pairing.configure(PairingConfig(), GuessConfig('identity'))
    (pair,) = pairing.add_source(cloud(6, points=plane(5.0)))
    assert pair.target is few


def test_where_no_other_target_is_there_the_source_is_refused_with_the_reason(pairing):
    refiner = Refiner(preprocessing=PreprocessingConfig(max_range=50.0, crop_target=True))
    pairing.add_target(cloud(1, points=plane(5.0) + 1000.0))
    (pair,) = pairing.add_source(cloud(2, points=plane(5.0)))
    with pytest.raises(UnusableTarget, match='200 farther than max_range 50.0 m'):
        refined(refiner.refine, pair, pairing)
    assert pairing.add_source(cloud(3)) == []
    assert 'farther than max_range' in pairing.why_it_waits()


def test_too_few_voxels_are_answered_as_such_where_no_other_target_is_there(pairing):
    refiner = Refiner(RegistrationConfig(voxel_size=50.0))
    pairing.add_target(cloud(1, points=plane(5.0)))
    for stamp in (2, 3):
        (pair,) = pairing.add_source(cloud(stamp, points=plane(5.0)))
        assert refined(refiner.refine, pair, pairing).result.status is Status.TOO_FEW_POINTS
    (refusal,) = pairing.take_refusals()
    assert refusal.reason == 'target: 1 voxels of 50 m are left; 5 are needed'


def test_targets_of_another_frame_than_the_guess_are_passed_over():
    pairing = Pairing()
    good = cloud(1, 'map')
    pairing.add_target(good)
    pairing.add_guess(guess_message(0, 0.0, 'map', 'lidar'))
    for stamp in range(2, 2 + 2 * KEPT):
        pairing.add_target(cloud(stamp, '/odom'))
    for stamp in (100, 101):
        (pair,) = pairing.add_source(cloud(stamp, 'lidar'))
        assert pair.target is good
    (refusal,) = pairing.take_refusals()
    assert refusal.role == 'target'
    assert "frame_id 'map', but the target cloud is in frame '/odom'" in refusal.reason


def test_a_target_that_tf_does_not_know_is_passed_over():
    pairing = Pairing(guess_config=GuessConfig('tf'))
    good = cloud(1, 'map')
    pairing.add_target(good)
    pairing.add_target(cloud(2, 'mars'))
    pairing.add_guess(tf(guess_message(LATER, 1.0, 'map', 'lidar')))
    (pair,) = pairing.add_source(cloud(LATER, 'lidar'))
    assert pair.target is good


def test_targets_of_many_frames_are_not_all_kept(pairing):
    for i in range(3 * FRAMES_KEPT):
        pairing.add_target(cloud(i, f'frame{i}'))
    assert len(pairing._targets._kept) == FRAMES_KEPT


@pytest.mark.parametrize('rule', PAIRINGS)
def test_scans_of_one_topic_are_each_paired_with_the_one_before(rule):
    pairing = Pairing(PairingConfig(rule, 0.2), GuessConfig('last'))
    scans = [cloud(LONG_AGO + i * STEP, 'lidar') for i in range(5)]
    pairs = [pair for scan in scans for pair in pairing.add_scan(scan)]
    assert [(pair.target, pair.source) for pair in pairs] == list(
        zip(scans, scans[1:], strict=False)
    )
    (refusal,) = pairing.take_refusals()
    assert (refusal.stamp, refusal.role) == (LONG_AGO, 'source')
    assert 'which is never its own target' in refusal.reason


def test_scans_of_one_topic_without_stamps_are_paired_in_the_order_they_came(pairing):
    scans = [cloud(0) for _ in range(4)]
    pairs = [pair for scan in scans for pair in pairing.add_scan(scan)]
    assert [pair.target for pair in pairs] == scans[:-1]


def test_scans_of_one_topic_wait_for_their_guess_and_are_then_paired_with_the_one_before():
    pairing = Pairing()
    scans = [cloud(LONG_AGO + i * STEP) for i in range(4)]
    assert [pair for scan in scans for pair in pairing.add_scan(scan)] == []
    pairs = pairing.add_guess(guess(0))
    assert [pair.target for pair in pairs] == scans[:-1]


def test_the_first_scan_of_a_loop_is_not_paired_with_the_last_of_the_pass_before(pairing):
    first = [cloud(LATER + i * STEP) for i in range(3)]
    second = [cloud(LONG_AGO + i * STEP) for i in range(3)]
    pairs = [pair for scan in first + second for pair in pairing.add_scan(scan)]
    assert [pair.target for pair in pairs] == [*first[:-1], *second[:-1]]


@pytest.mark.parametrize('order', ['target first', 'source first'])
def test_a_scan_sent_on_under_another_topic_is_not_its_own_target(pairing, order):
    """As a relay does it: the same bytes in other messages."""
    pairs, points = [], [np.arange(30.0).reshape(10, 3) + i for i in range(5)]
    for i in range(5):
        adds = [pairing.add_target, pairing.add_source]
        for add in adds if order == 'target first' else reversed(adds):
            pairs += add(cloud(LONG_AGO + i * STEP, 'lidar', points[i]))
    found = [(pair.stamp - LONG_AGO, pair.stamp - stamp_of(pair.target)) for pair in pairs]
    assert found == [(i * STEP, STEP) for i in range(1, 5)]


def stamp_of(message):
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


@pytest.mark.parametrize('shape', ['a row', 'a column', 'padded rows', 'big endian'])
def test_usable_points_are_found_wherever_they_are(shape):
    points = np.full((2 * BLOCK, 3), np.nan)
    points[-5:] = np.arange(15.0).reshape(5, 3) + 1.0
    message = cloud(1, points=points)
    if shape == 'a column':
        message.height, message.width, message.row_step = len(points), 1, message.point_step
    if shape == 'padded rows':
        rows = message.data.reshape(8, -1)
        message.data = np.pad(rows, ((0, 0), (0, 7))).reshape(-1)
        message.height, message.width, message.row_step = 8, len(points) // 8, rows.shape[1] + 7
    if shape == 'big endian':
        message.data = message.data.view('<f4').astype('>f4').view(np.uint8)
        message.is_bigendian = True
    require_points(message, 5)
    with pytest.raises(InvalidPointCloud2, match=f'of its {2 * BLOCK} points 5 are usable'):
        require_points(message, 6)
