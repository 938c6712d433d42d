import numpy as np
import pytest

from idem_ros.core.geometry import se3
from idem_ros.smoothing import map_blocks
from idem_ros.smoothing.consistency import Consistency
from idem_ros.smoothing.map_blocks import MapBlocks


@pytest.fixture
def scans(rng):
    """Three scans of a floor 100 m wide, from poses on it."""
    floor = np.column_stack([rng.uniform(-50.0, 50.0, (60_000, 2)), rng.normal(0.5, 0.02, 60_000)])
    poses = [se3.exp(np.array([0.0, 0.0, turn, 3.0 * turn, 1.0, 0.0])) for turn in (0.0, 1.0, 2.0)]
    return [(se3.transform_points(se3.inverse(T), floor[k::3]), T) for k, T in enumerate(poses)]


def built(folder, scans, voxel_size=1.0):
    folder.mkdir()
    blocks = MapBlocks(folder, voxel_size)
    for k, (points, pose) in enumerate(scans):
        blocks.add(points, pose, 10.0 * k)
    return blocks


def summed(blocks):
    points, found = [], Consistency()
    for part in blocks.parts(gap=15.0):
        points.append(part.points)
        found = found.plus(part.consistency)
    return np.concatenate(points), found


def test_blocks_make_one_map_without_seams(tmp_path, scans):
    blocks = built(tmp_path / 'map', scans)
    points, found = summed(blocks)
    assert len(blocks.blocks) == 4
    places = np.floor(points).astype(int)
    assert len(np.unique(places, axis=0)) == len(points)
    assert len(points) == pytest.approx(100 * 100, rel=0.05)
    assert found.cells == pytest.approx(50 * 50, rel=0.1)
    assert abs(found.score) < 0.05
    assert found.points == pytest.approx(60_000, rel=0.01)


def test_a_block_of_many_rows_is_read_in_parts_and_the_map_is_the_same(
    tmp_path, scans, monkeypatch
):
    points, found = summed(built(tmp_path / 'whole', scans))
    monkeypatch.setattr(map_blocks, 'MOST_ROWS', 2000)
    again, parts = summed(built(tmp_path / 'parts', scans))
    order, other = (np.lexsort(each.T) for each in (points, again))
    np.testing.assert_allclose(points[order], again[other])
    assert parts.cells == found.cells
    assert parts.q == pytest.approx(found.q)
    assert parts.entropy == pytest.approx(found.entropy)
    assert parts.points == found.points


def test_scans_of_poses_that_are_off_score_more(tmp_path, scans):
    (points, pose), *others = scans
    lifted = (points, se3.translation((0.0, 0.0, 0.1)) @ pose)
    _, right = summed(built(tmp_path / 'right', scans))
    _, off = summed(built(tmp_path / 'off', [lifted, *others]))
    assert off.score > right.score + 0.15
