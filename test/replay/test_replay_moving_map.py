import pytest

from idem_ros.commands.main import main
from idem_ros.core import RegistrationConfig
from idem_ros.replay.run import replay


@pytest.fixture(scope='module')
def drive(tmp_path_factory):
    path = tmp_path_factory.mktemp('drive') / 'drive.mcap'
    assert main(['simulate', '--speed', '10', '--out', str(path)]) == 0
    return path


def test_a_solved_sweep_may_move_what_of_a_map_it_meets(drive):
    replayed = replay(drive, RegistrationConfig(voxel_size=0.5, motion='solve'))
    assert len(replayed.frames) == 21
    assert not replayed.refused
    assert all(frame.refinement.result.is_usable for frame in replayed.frames)
    assert all(frame.error_after().translation_m < 0.05 for frame in replayed.frames)
