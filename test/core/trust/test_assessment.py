import numpy as np
import pytest
from clouds import error_of, motion, surface
from costs import joint_entropy

from benchmarks.bare_scenes import bare_case
from benchmarks.case import displaced
from benchmarks.trust.sensors import depth_case
from idem_ros.core import Cloud, RegistrationConfig, Status, Verdict, register
from idem_ros.core.geometry import se3
from idem_ros.core.trust.observability import observability_of
from idem_ros.core.trust.reasons import free_in_words

AUDIT = RegistrationConfig(mode='audit')


@pytest.fixture
def pair(rng):
    """Two samplings of a surface, the second in a frame of its own, and the truth."""
    truth = motion(rng, 40.0, 3.0)
    source = se3.transform_points(se3.inverse(truth), surface(rng, 3000, 0.005))
    return surface(rng, 3000, 0.005), source, truth


def test_a_good_result_is_aligned_and_says_why(rng, pair):
    target, source, truth = pair
    result = register(target, source, motion(rng, 3.0, 0.05) @ truth)
    said = result.assessment
    assert said.verdict is Verdict.ALIGNED
    assert said.p_aligned > 0.9
    assert said.reason
    assert said.free == ''
    assert 0 < said.basin < 1
    assert result.confidence > 0.8


def test_a_displaced_pose_is_misaligned_and_stays_where_it_is(rng, pair):
    target, source, truth = pair
    right = register(target, source, truth, AUDIT)
    wrong = register(target, source, truth @ motion(rng, 2.0, 0.1), AUDIT)
    assert right.status is wrong.status is Status.AUDITED
    np.testing.assert_array_equal(right.T_target_source, truth)
    assert right.assessment.p_aligned > 0.8
    assert wrong.assessment.verdict is Verdict.MISALIGNED
    assert wrong.assessment.p_aligned < 0.2


def test_what_is_seen_of_a_pose_has_no_unit(rng, pair):
    target, source, truth = pair
    near = displaced(truth, source.mean(axis=0), 2.0, 0.02, rng)
    seen = [
        register(scale * target, scale * source, scaled(near, scale), config).assessment
        for scale in (1.0, 1024.0)  # radii are rounded to eighths of an octave
        for config in (AUDIT, RegistrationConfig(mode='audit', length_scale='none'))
    ]
    assert seen[0].discord > 0.1
    for said in seen[1:]:
        for name in ('discord', 'contrast', 'step'):
            assert getattr(said, name) == pytest.approx(getattr(seen[0], name), rel=0.02), name


def scaled(T, scale):
    T = T.copy()
    T[:3, 3] *= scale
    return T


def test_a_rim_that_meets_is_no_confident_number(rng):
    surfaces = surface(rng, 3000), surface(rng, 3000)
    left, right = (points[:, 0] for points in surfaces)
    target, source = surfaces[0][left < 0.01], surfaces[1][right > -0.01]
    said = register(target, source, None, AUDIT).assessment
    assert 0 < said.overlap < 0.05
    assert said.verdict is Verdict.LOW_OVERLAP
    assert np.isnan(said.p_aligned)
    assert 'of the points have a neighbour' in said.reason


def test_surfaces_that_stand_apart_are_in_discord(rng, pair):
    target, source, truth = pair
    there = register(target, source, truth, AUDIT).assessment
    away = register(target, source, displaced(truth, source.mean(axis=0), 20.0, 0, rng), AUDIT)
    assert there.discord < 0.45 < away.assessment.discord
    assert away.assessment.contrast < there.contrast


def test_clouds_apart_are_separated(pair):
    target, source, truth = pair
    far = truth.copy()
    far[:3, 3] += 100.0
    said = register(target, source, far, AUDIT).assessment
    assert (said.verdict, said.p_aligned) == (Verdict.SEPARATED, 0.0)
    assert said.covariance[0, 0] == 1e6


@pytest.mark.parametrize('scale', [1.0, 1000.0])
def test_clouds_apart_are_told_how_far_and_how_wide_they_are(rng, scale):
    target = np.vstack([rng.uniform(-1.0, 1.0, (500, 3)), -np.ones(3), np.ones(3)])
    source = scale * target + (0.0, 300.0 * scale, 0.0)
    guess = np.eye(4)
    guess[:3, 3] = 500.0, -300.0 * scale, 0.0
    reason = register(target, source, guess, AUDIT).assessment.reason
    assert 'their middles are 500 apart at the guess' in reason
    if scale == 1.0:
        assert reason.endswith('at the guess: is the guess right?')
    else:
        assert reason.endswith('the target is 2 wide, the source 2e+03: the same unit?')


def test_a_wrong_valley_is_not_believed(rng, pair):
    target, source, truth = pair
    turned = displaced(truth, source.mean(axis=0), 170.0, 0.0, rng)
    result = register(target, source, turned, RegistrationConfig(radius_schedule=(1.0,)))
    degrees, _ = error_of(result.T_target_source, truth)
    assert degrees > 20
    assert result.assessment.p_aligned < 0.1
    assert result.assessment.verdict in (Verdict.MISALIGNED, Verdict.OUTSIDE_BASIN)


@pytest.mark.parametrize(
    ('points', 'reason'),
    [
        (np.zeros((3, 3)), '3 and 3 points (or voxels): 5 are needed'),
        (np.ones((50, 3)), '50 and 50 points (or voxels): all in one place'),
    ],
)
def test_too_little_is_no_confident_number(points, reason):
    said = register(points, points).assessment
    assert said.verdict is Verdict.NOT_CONVERGED
    assert np.isnan(said.p_aligned)
    assert said.reason == reason


@pytest.mark.parametrize('count', [5, 10, 20, 50])
def test_a_target_of_few_points_confirms_nothing(rng, count):
    """Wherever it lies, its points have neighbours on a dense surface, which agree with it."""
    target, source = surface(rng, count), surface(rng, 4000)
    said = register(target, source, motion(rng, 60.0, 0.1)).assessment
    assert said.verdict is not Verdict.ALIGNED
    assert np.isnan(said.p_aligned)


def test_identical_clouds_are_aligned_with_a_covariance_that_can_be_inverted(rng):
    points = surface(rng, 2000)
    said = register(points, points).assessment
    assert said.verdict is Verdict.ALIGNED
    assert np.linalg.eigvalsh(said.covariance).min() > 0


@pytest.mark.parametrize(('name', 'along'), [('corridor', 'free along'), ('sphere', 'free about')])
def test_what_is_free_is_named_and_has_no_small_variance(name, along):
    case = bare_case(name, 0, 0.15)
    result = register(
        case.target, case.source, case.truth, RegistrationConfig(voxel_size=case.voxel_size)
    )
    said = result.assessment
    assert said.verdict is Verdict.DEGENERATE
    assert said.free.startswith(along)
    for motion_ in result.free_motions:  # in the target's frame; the covariance is at the source
        moved = motion_.copy()
        moved[:3] += np.cross(motion_[3:], result.T_target_source[:3, 3])
        assert moved @ said.covariance @ moved / (moved @ moved) > 0.3


def test_free_motions_are_named_by_the_axes_of_the_source(rng):
    case = bare_case('corridor', 1)
    cost = joint_entropy(Cloud(case.target), Cloud(case.source), 0.4)
    T = case.truth.copy()
    T[:3, 3] += T[:3, :3] @ origin_of(case.source) - origin_of(case.target)
    found = observability_of(cost, T)
    assert free_in_words(found, np.eye(3)) == 'free along x'
    turned = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    assert free_in_words(found, turned) == 'free along y'


def origin_of(points):
    return Cloud(points).origin


def test_both_ways_end_in_the_same_place(rng, pair):
    target, source, truth = pair
    config = RegistrationConfig(assessment='swap')
    said = register(target, source, motion(rng, 3.0, 0.05) @ truth, config).assessment
    assert said.swap_gap < 1e-6
    assert np.isnan(register(target, source, truth).assessment.swap_gap)


def test_the_covariance_holds_over_many_noisy_samplings():
    nees = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        target, source = surface(rng, 3000, 0.005), surface(rng, 3000, 0.005)
        result = register(target, source)
        off = se3.log(result.T_target_source)[[3, 4, 5, 0, 1, 2]]
        nees.append(off @ np.linalg.solve(result.assessment.covariance, off))
    assert 3.0 < np.mean(nees) < 12.0  # 6, were it exact


def test_no_assessment_is_made_where_none_is_asked_for(pair):
    target, source, truth = pair
    assert (
        register(target, source, truth, RegistrationConfig(assessment='none')).assessment is None
    )


@pytest.mark.parametrize(('apart', 'beams'), [(0.4, 3000), (0.05, 375)])
def test_rings_that_lie_apart_are_not_taken_for_surfaces(rng, apart, beams):
    """They slide along walls: such scans fit each other anywhere."""

    def scan(x):
        around = np.linspace(1e-3, 2 * np.pi, beams, endpoint=False)
        ways = np.stack([np.cos(around), np.sin(around)], -1)
        reach = np.min(np.abs((np.where(ways > 0, 4.0, -4.0) - [x, 0]) / ways), axis=1)
        heights = np.arange(-1.0, 1.0, apart)
        rings = [np.c_[reach[:, None] * ways, np.full(beams, height)] for height in heights]
        return np.vstack(rings) + 0.001 * rng.normal(size=(len(heights) * beams, 3))

    as_given = RegistrationConfig(voxel_size=None)
    said = register(scan(0.0), scan(0.3), config=as_given).assessment
    assert np.isnan(said.p_aligned) == (apart == 0.4)
    assert ('lines, as rings of a LiDAR' in said.reason) == (apart == 0.4)


def test_a_spent_budget_ends_with_the_best_so_far(rng, pair):
    target, source, truth = pair
    guess = motion(rng, 3.0, 0.05) @ truth
    late = register(target, source, guess, RegistrationConfig(budget_ms=1e-6))
    assert late.status is Status.LATE
    assert not late.converged
    assert late.assessment.verdict is not Verdict.ALIGNED
    assert register(target, source, guess, RegistrationConfig(budget_ms=1e6)).converged


@pytest.mark.parametrize(
    ('off', 'tolerance', 'verdict'),
    [
        ((0.05, 0.02), (0.05, 0.3), Verdict.ALIGNED),
        ((0.57, 0.1), (0.05, 0.3), Verdict.MISALIGNED),
        ((0.57, 0.1), (0.2, 1.0), Verdict.ALIGNED),
        ((0.05, 0.02), (0.01, 0.3), Verdict.MISALIGNED),
        ((0.5, 0.0), (0.05, 0.3), Verdict.MISALIGNED),
    ],
)
def test_an_audited_pose_is_aligned_within_the_tolerance(off, tolerance, verdict):
    case = bare_case('box in corridor', 3)
    pose = displaced(case.truth, np.zeros(3), *off, np.random.default_rng(1))
    config = RegistrationConfig(mode='audit', audit_tolerance=tolerance)
    result = register(case.target, case.source, pose, config)
    np.testing.assert_array_equal(result.T_target_source, pose)
    said = result.assessment
    assert said.verdict is verdict
    # how far it may be off is told too
    off_by = np.sqrt(np.trace(said.covariance[:3, :3]))
    assert off_by == pytest.approx(off[1], abs=0.05)


def test_an_audit_that_finds_another_minimum_says_how_far_it_is():
    case = bare_case('box in corridor', 4)
    pose = displaced(case.truth, np.zeros(3), 0.1, 0.2, np.random.default_rng(2))
    said = register(case.target, case.source, pose, AUDIT).assessment
    assert '0.2 and 0.087 deg away, where 0.05 and 0.3 deg are tolerated' in said.reason


def test_the_error_of_the_model_is_added_to_the_covariance(pair):
    target, source, truth = pair
    plain, wider = (
        register(target, source, truth, RegistrationConfig(model_error=error)).assessment
        for error in ((0.0, 0.0), (0.03, 0.2))
    )
    added = np.diag([0.03**2] * 3 + [np.radians(0.2) ** 2] * 3)
    np.testing.assert_allclose(wider.covariance - plain.covariance, added, atol=1e-12)


def test_a_depth_cameras_own_noise_is_no_discord():
    case = depth_case(6, 0.05)
    config = RegistrationConfig(voxel_size=0.05)
    said = register(case.target, case.source, case.truth, config).assessment
    assert said.verdict is Verdict.ALIGNED
    wrong = displaced(case.truth, case.centroid, 0.57, 0.1, np.random.default_rng(1))
    audit = RegistrationConfig(voxel_size=0.05, mode='audit')
    assert register(case.target, case.source, wrong, audit).assessment.p_aligned < 0.1
