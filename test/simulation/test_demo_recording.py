"""bags/demo.mcap, and the same recording in the other formats."""

import numpy as np
import pytest
from conftest import ROOT
from recordings import transforms_of, write_rosbag1, write_sqlite3

from idem_ros.core import RegistrationConfig
from idem_ros.recording.reader import open_recording
from idem_ros.replay.run import replay

DEMO = ROOT / 'bags' / 'demo.mcap'
CONFIG = RegistrationConfig(voxel_size=0.5)


@pytest.fixture(scope='module')
def replayed():
    return replay(DEMO, CONFIG)


def test_every_scan_of_the_demo_is_refined_and_has_truth(replayed):
    assert len(replayed.frames) >= 20
    assert (len(replayed.refused), replayed.dropped, replayed.unpaired) == (0, 0, 0)
    assert all(frame.refinement.result.converged for frame in replayed.frames)
    assert all(frame.refinement.points_source >= 15_000 for frame in replayed.frames)
    for frame in replayed.frames:
        assert frame.error_after().translation_m < frame.error_before().translation_m


@pytest.mark.parametrize(('write', 'name'), [(write_sqlite3, 'demo'), (write_rosbag1, 'demo.bag')])
def test_rewritten_as_another_format_it_gives_the_same_transforms(replayed, tmp_path, write, name):
    with open_recording(DEMO) as recording:
        write(tmp_path / name, recording.messages(recording.topics))
    again = replay(tmp_path / name, CONFIG)
    np.testing.assert_array_equal(transforms_of(again), transforms_of(replayed))
    assert [f.refinement.stamp for f in again.frames] == [
        f.refinement.stamp for f in replayed.frames
    ]
