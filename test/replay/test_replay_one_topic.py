"""A replay whose target and source are one topic, and one with targets that cannot be used."""

import numpy as np
from clouds import surface

from idem_ros.pairing.guesses import GuessConfig
from idem_ros.recording.messages import cloud_message
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay, replay_each
from idem_ros.replay.settings import Settings

STEP = 100_000_000
IDENTITY = GuessConfig(type='identity')


def test_the_scan_before_is_the_target_of_each_that_is_taken_be_it_taken_or_not(tmp_path, rng):
    sizes = [300, 310, 320, 330, 340]
    write_mcap(
        tmp_path / 'scans.mcap',
        [
            ('/points', stamp, cloud_message(surface(rng, size), stamp, 'lidar'))
            for stamp, size in zip(range(STEP, 6 * STEP, STEP), sizes, strict=True)
        ],
    )
    (found,) = replay_each(
        tmp_path / 'scans.mcap',
        [Settings(guess=IDENTITY, every=2)],
        target_topic='/points',
        source_topic='/points',
    )
    counted = [(f.refinement.points_target, f.refinement.points_source) for f in found.frames]
    assert counted == [(310, 320), (330, 340)]
    (refusal,) = found.refused
    assert refusal.stamp == STEP
    assert any('--sequence scan' in note for note in found.notes)


def test_targets_that_cannot_be_used_are_noted_and_the_map_serves_on(tmp_path, rng):
    bad = cloud_message(np.full((50, 3), np.nan), 2 * STEP, 'map')
    write_mcap(
        tmp_path / 'run.mcap',
        [
            ('/target', STEP, cloud_message(surface(rng, 300), STEP, 'map')),
            ('/target', 2 * STEP, bad),
            ('/source', 3 * STEP, cloud_message(surface(rng, 310), 3 * STEP, 'lidar')),
        ],
    )
    found = replay(tmp_path / 'run.mcap', guess=IDENTITY)
    assert [frame.refinement.points_target for frame in found.frames] == [300]
    assert len(found.refused) == 0
    (note,) = [note for note in found.notes if 'refused' in note]
    assert note.startswith('1 targets were refused and not used: target: of its 50 points 0')
