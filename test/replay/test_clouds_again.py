import json
import shutil

import numpy as np
import pytest
from clouds import motion, surface
from replayed import changed, write_replayed

from idem_ros.commands.main import main
from idem_ros.core import IdemError
from idem_ros.core.geometry.se3 import inverse, transform_points
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording.messages import cloud_message
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.replay.clouds_again import clouds_of, settings_of
from idem_ros.replay.provenance import ForbiddenRecording, named_recording
from idem_ros.results.result_file import read_result


@pytest.fixture
def result(tmp_path):
    return write_replayed(tmp_path)


def clouds_on(path, topic):
    with open_recording(path) as recording:
        return [read_points(message).points for _, _, message in recording.messages([topic])]


def test_each_frame_has_its_own_clouds(result, tmp_path):
    found = {i: clouds for i, *clouds in clouds_of(read_result(result), [2, 0])}
    assert set(found) == {0, 2}
    (target,) = clouds_on(tmp_path / 'scans.mcap', '/target')
    sources = clouds_on(tmp_path / 'scans.mcap', '/source')
    for i, clouds in found.items():
        np.testing.assert_array_equal(clouds[0], target)
        np.testing.assert_array_equal(clouds[1], sources[i])


def test_points_that_took_no_part_are_left_out(result):
    made_by = {'parameters': {'max_points': 50}}
    limited = read_result(changed(result, lambda record: record.update(made_by=made_by)))
    ((_, target, source),) = clouds_of(limited, [1])
    assert len(target) <= 50
    assert len(source) <= 50


def test_settings_of_another_version_are_taken_as_by_default(result):
    made_by = {'parameters': {'of_the_future': 1}}
    unknown = read_result(changed(result, lambda record: record.update(made_by=made_by)))
    assert settings_of(unknown) == settings_of(read_result(result))


@pytest.mark.parametrize(('kind', 'scans_before'), [('scan', 1), ('submap', 3)])
def test_scans_of_a_sequence_have_those_before_them_as_target(tmp_path, rng, kind, scans_before):
    points, poses = surface(rng, 400), [np.eye(4)]
    for _ in range(3):
        poses.append(motion(rng, 1.0, 0.02) @ poses[-1])
    stamps = [10**9 + i * 10**8 for i in range(4)]
    scans = [transform_points(inverse(T), points) for T in poses]
    messages = (
        ('/source', stamp, cloud_message(scan, stamp, 'lidar'))
        for stamp, scan in zip(stamps, scans, strict=True)
    )
    write_mcap(tmp_path / 'drive.mcap', messages)
    out = tmp_path / 'result.json'
    replay = ['replay', str(tmp_path / 'drive.mcap'), '--sequence', kind, '--json', str(out)]
    assert main(replay) == 0
    result = read_result(out)
    ((i, target, source),) = clouds_of(result, [2])
    assert i == 2
    np.testing.assert_allclose(source, scans[3], atol=1e-6)
    assert len(target) == scans_before * 400
    found = [
        np.eye(4),
        *(np.array(f['T_target_source']) for f in json.loads(out.read_text())['frames']),
    ]
    newest = transform_points(found[2], scans[2])
    np.testing.assert_allclose(target[-400:], newest, atol=1e-6)


def test_another_recording_of_the_same_name_is_told_by_its_size(result):
    made_by = {'input': {'size': 7}, 'parameters': {}}
    other = read_result(changed(result, lambda record: record.update(made_by=made_by)))
    with pytest.raises(IdemError, match='and had 7 when it was replayed'):
        list(clouds_of(other, [0]))


def test_a_recording_is_found_beside_its_result(result, tmp_path):
    (tmp_path / 'moved').mkdir()
    for name in ('result.json', 'scans.mcap'):
        shutil.move(tmp_path / name, tmp_path / 'moved' / name)
    moved = read_result(tmp_path / 'moved' / 'result.json')
    assert named_recording(moved) == tmp_path / 'moved' / 'scans.mcap'
    assert len(list(clouds_of(moved, [3]))) == 1


def test_what_the_recording_does_not_hold_is_left_out(result):
    other = read_result(changed(result, lambda record: record['frames'][1].update(stamp_ns=5)))
    assert [i for i, *_ in clouds_of(other, [1, 3])] == [3]


def test_a_recording_is_opened_only_under_the_folder_that_it_must_lie_in(result, tmp_path):
    read = read_result(result)
    within = tmp_path / 'within'
    within.mkdir()
    assert list(clouds_of(read, [0], result.parent))
    with pytest.raises(ForbiddenRecording, match='does not lie in'):
        list(clouds_of(read, [0], within))
    (within / 'scans.mcap').symlink_to(result.parent / 'scans.mcap')
    for bag in (within / 'scans.mcap', within / '..' / 'scans.mcap', '/dev/zero', 'x' * 3000):
        named = read_result(changed(result, lambda record, bag=bag: record.update(bag=str(bag))))
        with pytest.raises(ForbiddenRecording):
            named_recording(named, within)
