from dataclasses import replace

import numpy as np
import pytest
from recordings import scans

from idem_ros.recording.results import result_messages
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay


@pytest.fixture
def frames(tmp_path, rng):
    write_mcap(tmp_path / 'scans.mcap', scans(rng))
    return replay(tmp_path / 'scans.mcap').frames


def test_each_frame_gives_its_transform_then_its_diagnostics(frames):
    messages = list(result_messages(frames))
    assert [topic for topic, _, _ in messages] == ['/idem_node/transform', '/diagnostics'] * 3
    assert [log_time for _, log_time, _ in messages][::2] == [frame.log_time for frame in frames]


def test_log_times_differ_where_one_message_completed_several_pairs(frames):
    together = [replace(frame, log_time=frames[0].log_time) for frame in frames]
    times = [log_time for _, log_time, _ in result_messages(together)]
    assert (np.diff(times) > 0).all()
