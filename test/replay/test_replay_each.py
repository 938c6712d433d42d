import gc
import weakref

import numpy as np
import pytest
from recordings import scans, transforms_of
from replayed import replayed

from idem_ros.core import Cloud, RegistrationConfig
from idem_ros.pairing import stamped_poses
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.run import replay, replay_each
from idem_ros.replay.settings import Settings


@pytest.fixture
def messages(rng):
    return list(scans(rng))


def test_several_methods_refine_the_same_pairs(tmp_path, messages):
    pytest.importorskip('small_gicp')
    write_mcap(tmp_path / 'scans.mcap', messages)
    config = RegistrationConfig(voxel_size=0.1)
    alone = replay(tmp_path / 'scans.mcap', config)
    methods = ('idem', 'gicp', 'icp')
    replays = replay_each(tmp_path / 'scans.mcap', [Settings(config, method=m) for m in methods])
    assert [each.method for each in replays] == list(methods)
    np.testing.assert_array_equal(transforms_of(replays[0]), transforms_of(alone))
    for each in replays:
        for frame, of_idem in zip(each.frames, alone.frames, strict=True):
            ours, theirs = of_idem.refinement, frame.refinement
            assert theirs.stamp == ours.stamp
            assert theirs.q_tot_before == pytest.approx(ours.q_tot_before, rel=1e-12)
            assert theirs.result.radius == ours.result.radius
            assert theirs.result.q_tot < theirs.q_tot_before
            assert frame.truth is not None
    assert (transforms_of(replays[1]) != transforms_of(alone)).any()


def test_a_span_of_the_recording_keeps_the_map_from_before_it(tmp_path, messages):
    settings = Settings(start=0.15, duration=0.1)
    write_mcap(tmp_path / 'scans.mcap', messages)
    (result,) = replay_each(tmp_path / 'scans.mcap', [settings])
    assert [frame.refinement.stamp for frame in result.frames] == [1_200_000_000]
    assert result.frames[0].truth is not None
    assert result.notes == ('1 sources left out: one in 1 is taken, from 0.15 s on for 0.1 s',)


def test_reading_ends_with_the_span(tmp_path, rng):
    seen = []

    def progress(iterable, total):
        for item in iterable:
            seen.append(item[1])
            yield item

    write_mcap(tmp_path / 'scans.mcap', scans(rng, n=8))
    replay_each(tmp_path / 'scans.mcap', [Settings(duration=0.25)], progress=progress)
    assert 10**9 + 250_000_000 <= max(seen) < 10**9 + 400_000_000


def test_an_interruption_gives_what_was_done(tmp_path, messages):
    def interrupting(iterable, total):
        for item in iterable:
            if item[1] >= 1_300_000_000:
                raise KeyboardInterrupt
            yield item

    result = replayed(tmp_path, messages, progress=interrupting)
    assert len(result.frames) == 2
    assert result.interrupted
    assert 'interrupted' in result.notes[0]
    assert not replayed(tmp_path, messages).interrupted


def test_neither_messages_nor_clouds_are_kept(tmp_path, rng, monkeypatch):
    monkeypatch.setattr(stamped_poses, 'KEPT', 64)
    references, alive = [], []

    def watching(iterable, total):
        for item in iterable:
            references.append(weakref.ref(item[2]))
            alive.append(sum(reference() is not None for reference in references))
            yield item
            del item

    def clouds():
        gc.collect()
        return sum(type(each) is Cloud for each in gc.get_objects())

    write_mcap(tmp_path / 'scans.mcap', scans(rng, n=100, points=60))
    before = clouds()
    result = replay(tmp_path / 'scans.mcap', progress=watching)
    assert len(result.frames) == 100
    assert max(alive[250:]) == max(alive[200:250]) < 70  # the guesses are buffered
    assert clouds() == before
    assert not any(reference() is not None for reference in references)
