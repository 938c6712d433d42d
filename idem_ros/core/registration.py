"""Register two clouds by minimising q_tot (Eq. 8): the algorithm on one page.

`registered` goes in the order of the paper; each of its lines is a module. Costs (Eq. 4 to 8) are
in `cost`; linearise, solve, accept and terminate are the loop of `newton.minimize`.
"""

import numpy as np
from numpy.typing import ArrayLike

from idem_ros.core.assessed_result import assessed, late, unsolved
from idem_ros.core.coarse_to_fine import at_guess, descend
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.exceptions import InvalidConfig
from idem_ros.core.free_motions import ended, left_as_guessed
from idem_ros.core.geometry import se3
from idem_ros.core.maps.target import (
    Target,
    TargetLike,
    as_target_and_source,
    in_reach,
    with_common_voxel_size,
)
from idem_ros.core.metric.balls import between_origins, from_origins
from idem_ros.core.metric.cloud import CloudLike
from idem_ros.core.result import RegistrationResult, result_at
from idem_ros.core.solve.pair import prepare, with_stages
from idem_ros.core.solve.sweep import Sweep, sweep_of
from idem_ros.core.trust.prior import Guess, information_of_guess
from idem_ros.core.trust_tuning import TRUST, TrustTuning
from idem_ros.core.tuning import SOLVER, SolverTuning
from idem_ros.core.workers import OutOfTime, Workers, workers_of


def register(
    target: TargetLike,
    source: CloudLike,
    T_target_source: ArrayLike | None = None,
    config: RegistrationConfig | None = None,
    *,
    twist: ArrayLike | None = None,
    guess_covariance: ArrayLike | None = None,
    tuning: SolverTuning = SOLVER,
    trust: TrustTuning = TRUST,
) -> RegistrationResult:
    """Refine the pose of the source in the target frame by minimising q_tot (Eq. 8).

    With `mode="audit"` nothing moves: the guess itself is judged.

    Args:
        target: (N, 3) points, a `Cloud` or a `MapCloud`, in the target frame.
        source: (M, 3) points or a `Cloud`, in the source frame.
        T_target_source: (4, 4) initial guess; None: identity.
        config: `RegistrationConfig`; None: its defaults.
        twist: (6,) x y z [length/s] rx ry rz [rad/s] of the source frame in its own axes during
            the sweep of a source with times; what `config.motion` undoes. The guess, like the
            result, is the pose at `config.motion_reference`.
        guess_covariance: (6, 6) x y z rx ry rz of the guess: of the source frame's pose in the
            target frame, about its own origin; a variance of 0 says nothing of its axis. What the
            clouds determine weakly is weighed against it, unless the result is farther from the
            guess than it allows; of an audit, or with assessment none, it counts for nothing.
            None: `config.guess_sigma`.
        tuning: other numbers for the solver to go by.
        trust: other numbers for the verdict to go by.

    Returns:
        A `RegistrationResult`; whether it converged is a value, not an exception.

    Raises:
        InvalidCloud, InvalidTransform, InvalidConfig: for input that is no cloud, no rigid
            transform or twist, no covariance, or no `RegistrationConfig`.
    """
    config = RegistrationConfig() if config is None else config
    if not isinstance(config, RegistrationConfig):
        raise InvalidConfig(f'config is {config!r}; it must be a RegistrationConfig')
    workers = workers_of(config.threads, config.budget_ms)
    T = np.eye(4) if T_target_source is None else se3.checked_transform(T_target_source)
    target, source = as_target_and_source(target, source, config.threads)
    sweep = sweep_of(source, twist, config)  # what is known of the sensor's motion
    guess = Guess(T, information_of_guess(guess_covariance, config))
    return registered(target, sweep, guess, config, tuning, trust, workers)


def registered(
    target: Target,
    sweep: Sweep,
    guess: Guess,
    config: RegistrationConfig,
    tuning: SolverTuning,
    trust: TrustTuning,
    both_workers: tuple[Workers, Workers],
) -> RegistrationResult:
    """Return the result of a target and the source of a `Sweep`, from a `Guess`.

    both_workers: those of the solve, and those of the verdict of a late result.
    """
    (workers, late_workers), source = both_workers, sweep.undone()
    T, iterations = guess.transform, 0
    config = with_common_voxel_size(config, target, source, tuning)
    try:
        # Prepare: of a map what the source can meet; voxels.
        near = in_reach(target, source, T, config, workers)
        pair = prepare(near, source, config, tuning, trust, workers)
        # Radius (Eq. 9), and by it the stages.
        pair = with_stages(pair)
        if not pair.stages:
            return unsolved(target, pair, T)
        pair = pair.swept_as(sweep)
        # Stages, coarse to fine; in each: linearise (Eq. 4 to 8), solve, accept, terminate.
        guess = guess._replace(transform=between_origins(near, source, T))
        follow = at_guess if config.mode == 'audit' else descend
        descent = follow(pair, guess.transform)
        # Motions that no surface determines stay as guessed.
        descent, observability = left_as_guessed(pair, guess.transform, descent)
        T, iterations = from_origins(near, source, descent.solution.transform), descent.iterations
        # Result: the points' agreement (Eq. 7), q_tot (Eq. 8).
        pair = pair._replace(workers=late_workers)
        pair, descent, observability = ended(pair, descent, observability)
        result, agreement = result_at(pair, descent, observability)
        # Assessment: verdict and covariance.
        if config.assessment == 'none':
            return result
        return assessed(result, pair, (near, source), guess, descent, agreement, observability)
    except OutOfTime:
        return late(T, config, iterations)
