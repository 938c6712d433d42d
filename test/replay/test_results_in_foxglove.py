"""What `idem replay --out` writes, read by Foxglove's own reader from the schemas in the file."""

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recordings import scans

from idem_ros.commands.main import main
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording.writer import write_mcap


@pytest.fixture(scope='module')
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp('recorded') / 'scans.mcap'
    write_mcap(path, scans(np.random.default_rng(0)))
    return path


def decoded(path):
    """Return [(topic, schema's name, message)] as Foxglove's reader has them."""
    with path.open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [(c.topic, s.name, m) for s, c, _, m in reader.iter_decoded_messages()]


def replayed(recording, folder, *options):
    out = folder / 'result.mcap'
    assert main(['replay', str(recording), '--out', str(out), *options]) == 0
    return decoded(out)


def test_transforms_and_diagnostics_have_their_schemas_and_can_be_plotted(recording, tmp_path):
    found = replayed(recording, tmp_path)
    schemas = {topic: schema for topic, schema, _ in found}
    assert schemas == {
        '/idem_node/transform': 'geometry_msgs/msg/TransformStamped',
        '/diagnostics': 'diagnostic_msgs/msg/DiagnosticArray',
    }
    transforms = [m for topic, _, m in found if topic == '/idem_node/transform']
    q = transforms[0].transform.rotation
    assert np.isclose(q.x**2 + q.y**2 + q.z**2 + q.w**2, 1)
    status = next(m for topic, _, m in found if topic == '/diagnostics').status[0]
    values = {each.key: each.value for each in status.values}
    assert status.name == '/idem_node: registration'
    assert all(np.isfinite(float(values[key])) for key in ('q_tot', 'overlap', 'p_aligned'))


def test_with_clouds_the_scene_is_there_and_the_transforms_place_it(recording, tmp_path):
    found = replayed(recording, tmp_path, '--clouds')
    by_topic = {topic: [m for t, _, m in found if t == topic] for topic, _, _ in found}
    transforms = by_topic['/idem_node/transform']
    assert len(by_topic['/source']) == len(transforms) == 3
    assert {m.header.frame_id for m in by_topic['/target']} == {transforms[0].header.frame_id}
    assert {m.header.frame_id for m in by_topic['/source']} == {transforms[0].child_frame_id}
    given = [m for topic, _, m in decoded(recording) if topic == '/source']
    for before, after in zip(given, by_topic['/source'], strict=True):
        np.testing.assert_array_equal(read_points(before).points, read_points(after).points)


def test_a_source_that_was_not_refined_is_left_out(recording, tmp_path):
    found = replayed(recording, tmp_path, '--clouds', '--every', '2')
    assert [topic for topic, _, _ in found].count('/source') == 2


def test_clouds_without_a_file_for_them_are_refused(recording, capsys):
    assert main(['replay', str(recording), '--clouds']) == 2
    assert '--clouds is for --out' in capsys.readouterr().err
