from node_bench import FIRST, MS, send

# isort: split
import numpy as np
import pytest
from rclpy.parameter import Parameter

from idem_ros.capsules import read_capsule
from idem_ros.core import InvalidConfig
from idem_ros.messages.transform_message import matrix_of
from idem_ros.node.capsules import QUIET, Capsules
from idem_ros.node.config import CapsuleConfig
from idem_ros.replay.run import replay_each


def names(folder):
    return sorted(path.name for path in folder.glob('idem_capsule_*'))


def test_what_the_node_published_is_refined_again_from_its_capsule_to_the_bit(
    bench, clouds, tmp_path
):
    folder = tmp_path / 'capsules'
    b = bench(**{'capsules.folder': str(folder), 'capsules.when': 'all'}).start()
    send(b, clouds, FIRST)
    published = matrix_of(b.transform_of(FIRST))
    b.until(lambda: names(folder))
    (capsule,) = folder.glob('idem_capsule_*')
    settings, guesses = read_capsule(capsule)
    (replayed,) = replay_each(capsule, [settings], guesses=guesses)
    (frame,) = replayed.frames
    np.testing.assert_allclose(frame.refinement.result.T_target_source, published, atol=1e-12)


def test_only_what_is_not_aligned_is_kept_unless_more_is_asked_for(bench, clouds, tmp_path):
    folder = tmp_path / 'capsules'
    b = bench(**{'capsules.folder': str(folder)}).start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    far = clouds[0], clouds[1] + 100.0
    send(b, far, FIRST + 100 * MS)
    b.until(lambda: names(folder))
    (name,) = names(folder)
    assert f'_{FIRST + 100 * MS:020d}_' in name
    assert 'aligned.mcap' not in name


def test_a_refused_source_is_kept_with_its_reason(bench, clouds, tmp_path):
    folder = tmp_path / 'capsules'
    b = bench(**{'capsules.folder': str(folder), 'capsules.when': 'refused'}).start()
    send(b, clouds, FIRST)
    b.transform_of(FIRST)
    nothing = clouds[0], clouds[1] * np.nan
    send(b, nothing, FIRST + 100 * MS)
    b.until(lambda: names(folder))
    assert names(folder) == [f'idem_capsule_{FIRST + 100 * MS:020d}_000_refused.mcap']


def test_the_folder_can_be_set_while_the_node_runs(bench, clouds, tmp_path):
    folder = tmp_path / 'capsules'
    b = bench(**{'capsules.when': 'all'}).start()
    b.node.set_parameters([Parameter('capsules.folder', value=str(folder))])
    send(b, clouds, FIRST)
    b.until(lambda: names(folder))


def test_a_folder_that_cannot_be_written_is_said_once_a_minute_and_the_node_lives(tmp_path):
    said = []
    logger = type('Logger', (), {'warning': said.append, 'debug': said.append})
    capsules = Capsules(logger)
    for _ in range(3):
        capsules._say('no capsule: the disk is full')
    assert said == ['no capsule: the disk is full']
    capsules._said_at -= QUIET
    capsules._say('no capsule: the disk is full')
    assert len(said) == 2


@pytest.mark.parametrize(
    ('name', 'value'), [('when', 'never'), ('most', 0), ('most_mb', -1), ('folder', 'a\0b')]
)
def test_parameters_that_make_no_sense_are_refused(name, value):
    with pytest.raises(InvalidConfig, match=f'capsules.{name} is '):
        CapsuleConfig(**{name: value})
