import pytest

from idem_ros.commands.main import main
from idem_ros.core import RegistrationConfig
from idem_ros.replay.run import replay


@pytest.fixture(scope='module')
def drive(tmp_path_factory):
    path = tmp_path_factory.mktemp('drive') / 'drive.mcap'
    assert main(['simulate', '--speed', '10', '--scans', '8', '--out', str(path)]) == 0
    return path


def test_a_solved_sweep_may_move_what_of_a_map_it_meets(drive):
    replayed = replay(drive, RegistrationConfig(voxel_size=0.5, motion='solve'))
    assert len(replayed.frames) == 8
    assert not replayed.refused
    assert all(frame.refinement.result.is_usable for frame in replayed.frames)
    assert all(frame.error_after().translation_m < 0.05 for frame in replayed.frames)


def test_a_sweep_whose_motion_is_left_is_named_and_one_that_is_undone_is_not(drive):
    said = 'motion is none: what the sensor moves during a sweep is not undone'
    for motion in ('none', 'solve'):
        config = RegistrationConfig(voxel_size=1.0, motion=motion)
        notes = replay(drive, config).notes
        assert any(note.startswith(said) for note in notes) == (motion == 'none')
