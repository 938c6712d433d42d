import numpy as np
import pytest

from benchmarks.sweeps import cost, newer, odometry, page, pairs
from benchmarks.sweeps.cases import SWEEP, sweep
from idem_ros.core import RegistrationConfig, undistort
from idem_ros.core.geometry import se3


def config(voxel_size, motion):
    return RegistrationConfig(voxel_size=voxel_size, motion=motion, motion_reference='middle')


@pytest.fixture(scope='module')
def outcomes():
    return pairs.measure(config, 2, lambda steps: steps)


def test_every_way_is_tried_on_every_sweep(outcomes):
    ways = [each.way for each in outcomes]
    assert len(ways) == 12
    assert set(ways) == {
        pairs.STILL,
        pairs.RAW,
        pairs.EXACT,
        pairs.TOLD,
        pairs.SOLVED,
        pairs.SOLVED_ON,
    }
    assert [each.kind for each in outcomes] == ['street'] * 6 + ['forest'] * 6


def test_undoing_the_motion_brings_the_errors_down(outcomes):
    raw, exact, solved = (
        pairs.figures(pairs.of_way(outcomes, way))
        for way in (pairs.RAW, pairs.EXACT, pairs.SOLVED)
    )
    assert exact[2] < raw[2] / 3
    assert solved[2] < raw[2] / 3


def test_information_says_how_much_less_is_known_where_the_motion_is_solved(outcomes):
    solved, told = (pairs.of_way(outcomes, way) for way in (pairs.SOLVED, pairs.SOLVED_ON))
    for alone, with_a_twist in zip(solved, told, strict=True):
        for much, less in zip(alone.least, with_a_twist.least, strict=True):
            assert 1.0 < less <= much < 4.0


def test_what_fails_for_a_sensor_that_stands_still_is_left_out(outcomes):
    failed = [
        each._replace(is_right=False)
        if each.way == pairs.STILL and each.kind == 'forest'
        else each
        for each in outcomes
    ]
    assert {each.kind for each in pairs.with_standing_right(failed)} == {'street'}


def test_the_page_says_what_is_reached_and_what_is_missed(outcomes):
    rows = ((75.0, 4.0, 5.0), (39.0, 1.0, 1.0), (200.0, 7.0, 7.0))
    drives = {'street': (0.001, 0.01), 'tunnel': (0.5, None)}
    found = page.Found(outcomes, rows, drives, 2.0, 20.0, 40.0)
    goals = page.goals(found)
    reached = {goal.figure: goal.reached for goal in goals}
    assert reached['newer_06, sweep 0: points to their truth, median']
    assert not reached['newer_06, sweep 2: points to their truth, median']
    assert not reached['solving the motion, CPU time over the rigid refinement']
    assert not any('tunnel' in figure for figure in reached)
    text = page.markdown(found, goals, 2)
    assert 'MISSED' in text
    assert '| tunnel |' in text
    assert f'| {pairs.SOLVED}, by information ' in text


def test_a_sweep_is_undone_by_its_twist_to_where_the_standing_sensor_is():
    a_sweep = sweep('room', 3)
    undone = undistort(a_sweep.points, a_sweep.times, a_sweep.twist, SWEEP / 2)
    apart = [
        np.percentile(np.linalg.norm(points, axis=1), [10, 50, 90])
        for points in (undone, a_sweep.still.source)
    ]
    assert apart[0] == pytest.approx(apart[1], rel=0.05)


def test_a_path_that_is_the_truth_has_no_error():
    twists = np.tile([10.0, 0.0, 0.0, 0.0, 0.0, 0.5], (8, 1))
    poses = [np.eye(4)]
    for twist in twists:
        poses.append(poses[-1] @ se3.exp(SWEEP * twist[[3, 4, 5, 0, 1, 2]]))
    assert odometry._error(poses[:8], poses, twists, 0.0) < 1e-12


def test_undoing_takes_time():
    assert cost.undoing_ms(1) > 0.0


def test_the_real_sweeps_come_to_their_truth(shared_data):
    if not newer.FOLDER.is_dir():
        pytest.skip('newer_06 does not lie beside the checkout')
    assert all(goal.reached for goal in newer.goals(newer.measure(config)))


def test_too_few_trials_are_refused(capsys):
    from benchmarks.commands.main import main

    assert main(['sweeps', '--trials', '1']) != 0
    assert '--trials is 1; it must be from 4' in capsys.readouterr().err
