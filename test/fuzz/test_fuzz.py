"""Malformed messages are refused with a reason or handled, and the good one after is answered.

IDEM_FUZZ=5000 asks for so many examples (`make soak` does); some hundred without.
"""

import os
import tracemalloc

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from malformed import NOW, SECOND, SOURCE, T_TRUTH, TARGET, cloud, spoilt, transform

from idem_ros.core import IdemError, RegistrationConfig
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.pairing.pairing import Pairing
from idem_ros.refinement.refiner import Refiner

EXAMPLES = int(os.environ.get('IDEM_FUZZ', '200'))
SMALL = 200_000  # [bytes] that Python and numpy take for a message of no size
many = settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
some = settings(many, max_examples=max(EXAMPLES // 5, 50))
inputs = st.tuples(st.sampled_from(['target', 'source']), spoilt())


@many
@given(spoilt())
def test_message_is_read_or_refused_with_a_reason(message):
    reason = ''
    try:
        points = read_points(message).points
    except IdemError as error:
        reason = str(error)
    assert reason or (len(points) > 0 and np.isfinite(points).all())


@some
@given(spoilt())
def test_reading_takes_at_most_ten_times_the_size_of_the_message(message):
    tracemalloc.start()
    try:
        read_points(message)
    except IdemError:
        pass
    finally:
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
    assert peak <= 10 * len(message.data) + SMALL


@some
@given(messages=st.lists(inputs, min_size=1, max_size=3), voxel_size=st.sampled_from([None, 0.2]))
def test_good_pair_after_malformed_ones_is_refined(messages, voxel_size):
    pairing = Pairing()
    refiner = Refiner(RegistrationConfig(voxel_size=voxel_size, radius_schedule=(2.0, 1.0)))
    refine_all(pairing.add_target(cloud(TARGET, NOW - 2 * SECOND, 'map')), refiner)
    for role, message in messages:
        stamp = message.header.stamp.sec * SECOND + message.header.stamp.nanosec
        guess = transform(np.eye(4), stamp, '', '')
        add = pairing.add_target if role == 'target' else pairing.add_source
        refine_all([*add(message), *pairing.add_guess(guess)], refiner)
    after = NOW + SECOND
    pairs = [
        *pairing.add_target(cloud(TARGET, after, 'map')),
        *pairing.add_guess(transform(np.eye(4), after)),
        *pairing.add_source(cloud(SOURCE, after, 'lidar')),
    ]
    refined = refine_all(pairs, refiner)
    (refinement,) = [each for each in refined if each.stamp == after]
    assert refinement.result.converged
    np.testing.assert_allclose(refinement.result.T_target_source, T_TRUTH, rtol=0, atol=0.01)


def refine_all(pairs, refiner):
    """Refine pairs; refusals have a reason."""
    refined, reasons = [], []
    for pair in pairs:
        try:
            refined.append(refiner.refine(pair))
        except IdemError as error:
            reasons.append(str(error))
    assert all(reasons)
    return refined
