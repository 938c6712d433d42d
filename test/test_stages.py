import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import Cloud, RegistrationConfig, se3, stages
from idem_ros.core.basin import FIRST, credibility, gauge, has_strayed
from idem_ros.core.contrast import contrasts, sums_at_each
from idem_ros.core.joint_entropy import JointEntropy
from idem_ros.core.landscape import Landscape


@pytest.fixture
def clouds(rng):
    return Cloud(surface(rng, 1500)), Cloud(surface(rng, 1400))


@pytest.fixture
def truth(clouds):
    """Between the clouds' origins."""
    return se3.translation(clouds[1].origin - clouds[0].origin)


def test_sums_are_those_of_the_landscape_where_every_point_is_taken(rng, clouds):
    joint = JointEntropy(*clouds, 0.25, 'radius')
    transforms = np.array([np.eye(4), motion(rng, 5.0, 0.1), motion(rng, 10.0, 0.3)])
    target, source = clouds
    between = [np.eye(4) for _ in transforms]
    for T, given in zip(between, transforms, strict=True):
        T[:] = given
        T[:3, 3] += given[:3, :3] @ source.origin - target.origin
    everything = [np.arange(len(cloud)) for cloud in clouds]
    q, within = sums_at_each(joint, np.array(between), everything, sample=10**9)
    expected = Landscape(*clouds, 0.25).values(transforms)
    assert q[0] == pytest.approx(expected.q_tot[0])
    assert within[0] == expected.within[0]
    # of points in reach at the first; all of them are here
    assert q[1] == pytest.approx(expected.q_tot[1], rel=0.05)


def test_every_way_out_of_the_truth_leads_up(clouds, truth):
    joint = JointEntropy(*clouds, 0.25, 'radius')
    everything = [np.arange(len(cloud)) for cloud in clouds]
    assert contrasts(joint, truth, np.eye(6), everything, 128).min() > 0


def test_the_truth_is_credible_and_an_upside_down_pose_is_not(clouds, truth):
    joint = JointEntropy(*clouds, 0.5, 'radius')
    assert credibility(joint, truth, FIRST) > 0.9
    away = se3.translation([1.8, 0, 0])
    assert credibility(joint, away @ truth, FIRST) < 0.5


def test_the_gauge_is_zero_at_the_minimum_and_grows_towards_the_rim(clouds, truth):
    joint = JointEntropy(*clouds, 0.25, 'radius')
    ways = [se3.translation([0.25 * way, 0, 0]) for way in (0.0, 0.2, 0.5, 2)]
    at = [gauge(joint, truth, way @ truth) for way in ways]
    assert at[0] == 0.0
    assert at[1] < at[2] < 1.0 < at[3]


def led_astray(monkeypatch, first):
    """Have the first stage end far off; return the list that it is noted in."""
    away, lost = se3.exp(np.array([0, 0, 1.5, 1.0, 0, 0])), []
    minimized = stages._minimized

    def misled(prepared, stage, T, motions, last=False):
        joint, solution = minimized(prepared, stage, T, motions, last)
        if stage.factor == first.factor:
            lost.append(stage)
            solution = solution._replace(transform=away @ solution.transform)
        return joint, solution

    monkeypatch.setattr(stages, '_minimized', misled)
    return lost


def test_stages_that_leave_the_basin_of_the_guess_are_left_out(clouds, truth, monkeypatch):
    prepared = stages.prepare(*clouds, RegistrationConfig())
    lost = led_astray(monkeypatch, prepared.stages[0])
    found = stages.descend(prepared, truth)
    assert lost
    np.testing.assert_allclose(found.solution.transform, truth, atol=0.05)


@pytest.mark.parametrize(('belief', 'again'), [(0.9, False), (0.1, True)])
def test_coarse_stages_that_find_no_valley_are_left_out_one_by_one(
    clouds, truth, monkeypatch, belief, again
):
    prepared = stages.prepare(*clouds, RegistrationConfig())
    monkeypatch.setattr(stages, 'has_strayed', lambda *_: False)
    monkeypatch.setattr(stages, 'credibility', lambda *_: belief)
    minimized, ends = stages._minimized, []

    def noted(prepared, stage, *rest, **more):
        ends.append(more.get('last', False))
        return minimized(prepared, stage, *rest, **more)

    monkeypatch.setattr(stages, '_minimized', noted)
    found = stages.descend(prepared, truth)
    assert sum(ends) == (len(prepared.stages) if again else 1)
    np.testing.assert_allclose(found.solution.transform, truth, atol=0.05)


def test_a_last_stage_that_circles_is_tried_again_too(clouds, truth, monkeypatch):
    prepared = stages.prepare(*clouds, RegistrationConfig())
    monkeypatch.setattr(stages, 'has_strayed', lambda *_: False)
    monkeypatch.setattr(stages, 'credibility', lambda *_: 0.8)
    lost = led_astray(monkeypatch, prepared.stages[0])
    minimized = stages._minimized

    def circling(prepared, stage, T, motions, last=False):
        joint, solution = minimized(prepared, stage, T, motions, last)
        if last and len(lost) == 1:
            lost.append(stage)
            solution = solution._replace(converged=False, iterations=50)
        return joint, solution

    monkeypatch.setattr(stages, '_minimized', circling)
    found = stages.descend(prepared, truth)
    assert len(lost) == 2
    np.testing.assert_allclose(found.solution.transform, truth, atol=0.05)


@pytest.mark.parametrize('voxel_size', [None, 0.1])
@pytest.mark.parametrize('sure_from', [0, 1, 9])
def test_once_sure_a_stage_among_voxels_is_left_out(
    clouds, truth, monkeypatch, sure_from, voxel_size
):
    prepared = stages.prepare(*clouds, RegistrationConfig(voxel_size=voxel_size))
    minimized, seen = stages._minimized, []

    def noted(prepared, stage, *rest, **more):
        seen.append(stage.factor)
        return minimized(prepared, stage, *rest, **more)

    monkeypatch.setattr(stages, '_minimized', noted)
    monkeypatch.setattr(stages, 'credibility', lambda *_: 0.95 if len(seen) > sure_from else 0.8)
    stages.descend(prepared, truth)
    every = [stage.factor for stage in prepared.stages]
    sure = sure_from == 0 or (sure_from == 1 and voxel_size is not None)
    assert seen == (every[:2] + every[3:] if sure else every)


def test_a_basin_is_left_only_by_more_than_a_radius_and_for_the_worse(clouds, truth):
    joint = JointEntropy(*clouds, 0.25, 'radius')
    near, far = (se3.translation([way, 0, 0]) @ truth for way in (0.2, 0.8))
    assert has_strayed(joint, far, truth, 2.0)
    assert not has_strayed(joint, truth, far, 2.0)
    assert not has_strayed(joint, near, truth, 2.0)
