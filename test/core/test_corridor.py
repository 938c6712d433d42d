"""A drive along a corridor: what its walls determine is refined and kept, the rest as guessed."""

import numpy as np
import pytest
from recordings import FRAMES, START, STEP
from replayed import replayed

from idem_ros.core import RegistrationConfig, Status, Verdict
from idem_ros.core.geometry import se3
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.recording.messages import cloud_message, transform_message
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings

CONFIG = RegistrationConfig(voxel_size=0.15)
HALF = np.array([12.0, 1.5, 1.25])  # of the corridor, along x
SWAY, TURN = 0.08, np.radians(1.5)  # a scan
SCANS = 7


def corridor(rng, n=6000):
    points = rng.uniform(-1, 1, (n, 3))
    points[np.arange(n), 1 + rng.integers(0, 2, n)] = rng.choice([-1.0, 1.0], n)
    return points * HALF + 0.01 * rng.normal(size=(n, 3))


def pose(k):
    """Swaying to the left and turning all the way: by the last scan far beyond any one basin."""
    return se3.exp(np.array([0, 0, k * TURN, 0, k * SWAY, 0]))


def scans(rng, moving=range(SCANS)):
    for k in moving:
        points = se3.transform_points(se3.inverse(pose(k)), corridor(rng))
        yield k, cloud_message(points, START + k * STEP, FRAMES[1])


def across(T, k):
    """How far a pose is off along y and about z, which the walls determine."""
    off = se3.inverse(pose(k)) @ T
    return abs(off[1, 3]), abs(np.arctan2(off[1, 0], off[0, 0]))


def test_the_last_result_goes_on_from_the_axes_that_the_walls_determine(tmp_path, rng):
    messages = [('/target', 1, cloud_message(corridor(rng), 1, FRAMES[0]))]
    messages += [('/source', START + k * STEP, scan) for k, scan in scans(rng)]
    result = replayed(tmp_path, messages, config=CONFIG, guess=GuessConfig(type='last'))
    assert len(result.frames) == SCANS
    for k, frame in enumerate(result.frames):
        found = frame.refinement.result
        assert found.status is Status.DEGENERATE
        assert found.assessment.verdict is Verdict.DEGENERATE
        assert found.assessment.free == 'free along x'
        assert found.observable.sum() == 5
        assert found.is_usable
        y, yaw = across(found.T_target_source, k)
        assert y < 0.01
        assert yaw < np.radians(0.1)


@pytest.mark.parametrize('sequence', ['scan', 'submap'])
def test_odometry_keeps_the_axes_that_the_walls_determine(tmp_path, rng, sequence):
    path = tmp_path / 'corridor.mcap'
    messages = [('/points', START + k * STEP, scan) for k, scan in scans(rng)]
    truth = [
        ('/ground_truth', START + k * STEP, transform_message(pose(k), START + k * STEP, *FRAMES))
        for k in range(SCANS)
    ]
    write_mcap(path, sorted(messages + truth, key=lambda each: each[1]))
    (result,) = replay_each(path, [Settings(config=CONFIG, sequence=sequence)])
    found = result.frames[-1].refinement.result
    assert found.status is Status.DEGENERATE
    y, yaw = across(found.T_target_source, SCANS - 1)
    assert y < 0.03
    assert yaw < np.radians(0.3)
