import numpy as np
import pytest
from clouds import error_of, motion, surface

from idem_ros.core import (
    Cloud,
    MapCloud,
    RegistrationConfig,
    Status,
    Termination,
    Verdict,
    register,
)
from idem_ros.core.coarse_to_fine import HOPELESS, at_guess, descend
from idem_ros.core.config import MODES
from idem_ros.core.free_motions import left_as_guessed
from idem_ros.core.geometry.se3 import translation
from idem_ros.core.metric.balls import Balls
from idem_ros.core.metric.voxel_size import with_voxel_size
from idem_ros.core.several.edges import Audit
from idem_ros.core.several.joint_balls import JointBalls
from idem_ros.core.solve.pair import prepare, with_stages
from idem_ros.core.trust_tuning import TRUST
from idem_ros.core.tuning import SOLVER
from idem_ros.core.workers import ALONE, OutOfTime, Workers, in_blocks


def garbage(rng, n):
    """What a wrong byte order makes of a cloud: coordinates of any size."""
    return 10.0 ** rng.uniform(-8, 7, (n, 3)) * rng.choice([-1, 1], (n, 3))


HOSTILE = {
    'of any size': garbage,
    'of heavy tails': lambda rng, n: rng.standard_cauchy((n, 3)),
    'in two places': lambda rng, n: 1e3 * rng.integers(0, 2, (n, 1)) + rng.normal(size=(n, 3)),
    'in a line': lambda rng, n: np.linspace(1, 2, n)[:, None] * (1.0, 0.0, 0.0),
    'of fat tails': lambda rng, n: rng.normal(size=(n, 3)) / rng.uniform(1e-6, 1, (n, 1)),
    'of thin tails': lambda rng, n: 5.0 * rng.standard_t(3, (n, 3)),
    'a ball and far points': lambda rng, n: rng.normal(size=(n, 3)) * spread(rng, n, 0.1, 100.0),
    'a sheet of heavy tails': lambda rng, n: rng.standard_cauchy((n, 3)) * (3.0, 3.0, 1e-3),
    'on a lattice': lambda rng, n: rng.integers(0, 18, (n, 3)) * 1.0,
    'huge and small': lambda rng, n: rng.normal(size=(n, 3)) * spread(rng, n, 0.5, 1e6),
}


def spread(rng, n, share, far):
    return np.where(rng.random((n, 1)) < share, far, 1.0)


@pytest.mark.parametrize('name', HOSTILE)
@pytest.mark.parametrize('voxel_size', [None, 0.5, 1.0])
def test_the_pairs_of_a_cloud_are_bounded_by_its_points(rng, name, voxel_size):
    points = HOSTILE[name](rng, 6000)
    config = RegistrationConfig(voxel_size=voxel_size)
    pair = prepared([Cloud(points)] * 2, config=config)
    noise = rng.random((6000, 3))  # of scans and the like, that which has the most pairs
    as_given = RegistrationConfig(voxel_size=None)
    even = prepared([Cloud(noise)] * 2, config=as_given)
    honest = max(pairs_of(even, stage) for stage in even.stages)
    for stage in pair.stages:
        assert pairs_of(pair, stage) < (3.0 if voxel_size is None else 1.5) * honest


def test_clouds_that_agree_nowhere_are_gone_through_once(rng):
    config = RegistrationConfig(voxel_size=0.1)
    clouds = Cloud(surface(rng, 4000)), Cloud(rng.uniform(-1, 1, (4000, 3)))
    pair = prepared(clouds, config=config)
    descent = descend(pair, I4)
    assert descent.confidence < SOLVER.nowhere
    assert left_as_guessed(pair, I4, descent)[0] is descent


NOWHERE = 'of heavy tails', 'of thin tails', 'in two places', 'a ball and far points'


@pytest.mark.parametrize('name', NOWHERE)
def test_of_clouds_that_agree_nowhere_the_last_stage_ends_early(rng, name):
    clouds = [Cloud(HOSTILE[name](rng, 3000)) for _ in range(2)]
    descent = descend(prepared(clouds, config=RegistrationConfig(voxel_size=None)), I4)
    assert descent.confidence < HOPELESS
    assert descent.solution.iterations <= SOLVER.patience


def pairs_of(pair, stage):
    return pair.balls(stage).pairs(np.eye(4)).of_target.first[-1]


@pytest.mark.parametrize('budget_ms', [1e-3, 2.0, 8.0])
def test_whatever_the_budget_the_best_so_far_is_the_result(rng, budget_ms):
    target, source = surface(rng, 20_000), surface(rng, 20_000)
    guess = motion(rng, 3, 0.05)
    result = register(target, source, guess, RegistrationConfig(budget_ms=budget_ms))
    before, after = (error_of(T, np.eye(4))[0] for T in (guess, result.T_target_source))
    assert after <= before + 1e-9
    if result.termination is not Termination.CONVERGED:
        assert result.status in (Status.LATE, Status.DEGENERATE)
        assert not result.is_usable
        assert result.assessment.verdict is Verdict.NOT_CONVERGED


@pytest.mark.parametrize('mode', MODES)
def test_late_before_the_first_stage_the_guess_is_what_there_is(rng, mode):
    clouds, config = [Cloud(surface(rng, 500)) for _ in range(2)], RegistrationConfig(mode=mode)
    config = with_voxel_size(config, *clouds)
    pair = prepared(clouds, config=config)._replace(workers=LATE)
    descent = at_guess(pair, I4) if mode == 'audit' else descend(pair, I4)
    descent, observability = left_as_guessed(pair, I4, descent)
    assert descent.solution.termination is Termination.LATE
    assert np.array_equal(descent.solution.transform, I4)
    assert observability is None


def test_blocks_are_not_begun_after_the_deadline():
    begun = []
    with pytest.raises(OutOfTime):
        in_blocks(100_000, Workers(2, deadline=0.0), lambda begin, end: begun.append(begin))
    assert not begun


LATE = Workers(1, deadline=0.0)
I4, FAR = np.eye(4), translation((2.0, 0.0, 0.0))
AT_02 = RegistrationConfig(voxel_size=0.2)


def prepared(clouds, workers=ALONE, config=AT_02):
    return with_stages(prepare(*clouds, config, SOLVER, TRUST, workers))


def part_of_a_map(clouds, workers=ALONE):
    return MapCloud(clouds[0].points).in_reach(
        clouds[1], I4, RegistrationConfig(voxel_size=0.2), workers
    )


def late_balls(clouds):
    pair = prepared(clouds)
    balls = pair.balls(pair.stages[-1])
    balls.workers = LATE
    return balls


def late_sums(clouds):
    pair = prepared(clouds)
    cost = pair.cost(pair.stages[-1])
    cost.balls.pairs(I4)
    cost.balls.workers = LATE
    cost.linearize(I4)


def late_audit(clouds):
    Audit(np.array([I4, I4]), AT_02, TRUST, LATE).of(*clouds, I4)


STEPS = {
    'voxels and radii': lambda clouds: prepared(clouds, LATE),
    'moments of balls': lambda clouds: Balls(*clouds, 0.4, LATE),
    'pairs': lambda clouds: late_balls(clouds).pairs(I4),
    'sums': late_sums,
    'agreement': lambda clouds: late_balls(clouds).agreement(I4, 1.0),
    'part of a map': lambda clouds: part_of_a_map(clouds, LATE),
    'another part': lambda clouds: part_of_a_map(clouds).around(clouds[1], FAR, 0.4, LATE),
    'voxels of a part': lambda clouds: (
        part_of_a_map(clouds).around(clouds[1], I4, 0.4, LATE).reduced(0.8)
    ),
    'moments of a part': lambda clouds: Balls(part_of_a_map(clouds), clouds[1], 0.4, LATE),
    'audit of a pair of several': late_audit,
    'balls of several': lambda clouds: JointBalls(clouds, 0.4, LATE).pairs(np.array([I4, I4])),
}


@pytest.mark.parametrize('name', STEPS)
def test_every_long_step_looks_at_the_deadline(rng, name):
    clouds = [Cloud(surface(rng, 3000)) for _ in range(2)]
    with pytest.raises(OutOfTime):
        STEPS[name](clouds)
