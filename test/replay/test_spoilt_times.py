"""Clouds whose times cannot be used, among others of their stream: said, and taken as none."""

from dataclasses import replace

import numpy as np
import pytest
from sweeps import FRAMES, PERIOD, SPOILT, START, driven, map_message, sweep_message

from idem_ros.core import RegistrationConfig
from idem_ros.recording.messages import transform_message
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay_each
from idem_ros.replay.settings import Settings

CONFIG = RegistrationConfig(voxel_size=0.08)
COUNT, SPOILT_ONE = 4, 2


def recorded(path, rng, how):
    """A map, sweeps of a drive in it of which one has spoilt times, and a guess each 20 ms."""
    logged = [('/target', START, map_message(rng))]
    for k in range(COUNT):
        stamp, timed = START + k * PERIOD, how if k == SPOILT_ONE else True
        sweep = sweep_message(rng, driven, stamp, timed=timed, count=1500)
        logged.append(('/source', stamp + PERIOD, sweep))
    for stamp in range(START, START + (COUNT + 1) * PERIOD, PERIOD // 5):
        pose = driven((stamp - START) / 1e9)
        logged.append(('/initial_guess', stamp, transform_message(pose, stamp, *FRAMES)))
    write_mcap(path, sorted(logged, key=lambda each: each[1]))
    return path


@pytest.mark.parametrize(
    ('motion', 'sequence'), [('guess', None), ('solve', None), ('last', 'scan')]
)
@pytest.mark.parametrize('how', SPOILT)
def test_a_cloud_is_registered_as_it_is_and_the_others_are_undone(
    tmp_path, rng, how, motion, sequence
):
    path = recorded(tmp_path / 'drive.mcap', rng, how)
    settings = Settings(config=replace(CONFIG, motion=motion), sequence=sequence)
    (found,) = replay_each(path, [settings], source_topic='/source')
    assert len(found.refused) == 0
    flaws = {frame.refinement.stamp: frame.refinement.result.motion_flaw for frame in found.frames}
    spoilt = START + SPOILT_ONE * PERIOD
    assert flaws.pop(spoilt) == 'the source has no times of its points'
    assert not any(flaws.values())
    assert any(SPOILT[how][1] in note and 'taken as none' in note for note in found.notes)
    last = found.frames[-1].refinement
    truth = driven((last.stamp - START) / 1e9)
    atol = 0.02 if sequence is None else 0.06  # the chain leads over the one that is smeared
    np.testing.assert_allclose(last.result.T_target_source, truth, atol=atol)
