"""The stages of a registration, coarse to fine, and what keeps them in the basin of the guess."""

import itertools
from time import perf_counter
from typing import NamedTuple

import numpy as np

from idem_ros.core.basin import FIRST, LAST, best_of, credibility, has_strayed
from idem_ros.core.blocks import in_threads
from idem_ros.core.cloud import Cloud
from idem_ros.core.config import RegistrationConfig
from idem_ros.core.joint_entropy import JointEntropy
from idem_ros.core.noise import widening
from idem_ros.core.radii import rounded, stage_radii, widest_useful
from idem_ros.core.solver import PATIENCE, Solution, minimize_on_se3

EASE = 50.0  # of the tolerances before the last stage, which need only reach the next one's basin
CROWDED = 250.0  # points in a cell: from here on their voxels are as good, and much faster
FINE = 0.25  # of the radius
SPACING = 0.6  # of a stage's radius: voxels of points as given; their balls hold ten or so
COPIES = 1e-9  # of the extent: points as near as that are one
LEAST_POINTS = 5  # a point and its four neighbours
WIDER = 2.0  # than the first stage, where that did not find its way
SURE = 0.9  # of a coarse stage's valley: after the second, the next one is left out
DOUBT = 0.2  # of the first's and the last coarse one's: all is tried again without the first


class Stage(NamedTuple):
    """One minimisation."""

    radius: float
    factor: float  # of the last radius, and of the finest voxels


class Prepared(NamedTuple):
    """Two clouds, and the stages that they are registered in."""

    clouds: tuple[Cloud, Cloud]  # target and source, at the finest
    ours: tuple[bool, bool]  # whether the coarser clouds may be let go
    stages: tuple[Stage, ...]  # coarse to fine; none where there are too few points
    config: RegistrationConfig
    deadline: float  # of perf_counter [s]


class Descent(NamedTuple):
    """Where the stages ended."""

    joint: JointEntropy  # of the last stage
    solution: Solution
    iterations: int
    is_late: bool  # the budget was spent before it converged
    first: JointEntropy  # of the first stage
    credibility: float  # of the valley that the coarse stages ended in; nan: not asked for
    doubtful: bool  # neither the first nor the last coarse stage seems to have found a valley


class Coarse(NamedTuple):
    """Where the stages before the last one ended."""

    transform: np.ndarray  # (4, 4)
    iterations: int
    first: JointEntropy | None  # of the first stage; None: not asked for
    credibility: float  # of the valley that they ended in
    doubtful: bool


def prepare(target, source, config, ours=(False, False)):
    """Return the `Prepared` pair: voxels, radii of Eq. 9, the last one fit for noise."""
    deadline = perf_counter() + 1e-3 * config.budget_ms if config.budget_ms else np.inf
    clouds = (target, source)
    if config.voxel_size is not None:
        clouds = _reduced(clouds, config.voxel_size, config.threads)
    radii = _radii(clouds, config)
    if radii and radii[-1] == 0.0:
        clouds = tuple(map(_without_copies, clouds))
        radii = _radii(clouds, config)
    if not radii:
        return Prepared(clouds, ours, (), config, deadline)
    if config.voxel_size is None and radii[-1] > 0.0:
        clouds = [_uncrowded(cloud, radii[-1]) for cloud in clouds]
    if radii[-1] > 0.0:
        radii[-1] = _widened(*clouds, radii[-1], config)
    widest = widest_useful(*clouds)
    *earlier, last = map(Stage, radii, config.radius_schedule)
    stages = [stage for stage in earlier if stage.radius <= widest]
    return Prepared(tuple(clouds), ours, (*stages, last), config, deadline)


def stay(prepared, T):
    """Return the `Descent` that leads nowhere: everything as `descend` would see it at T."""
    joint = joint_entropy(prepared, prepared.stages[-1], slide=True)
    _, matrix = joint.linearize(T)
    return Descent(joint, Solution(T, matrix, 0, False, 0), 0, False, joint, np.nan, False)


def descend(prepared, T, motions=None):
    """Minimise from T through the stages; motions (6, k): those allowed, None: all.

    A first stage that ends in no valley starts again from a wider one. Where stages may have left
    the basin of T, the first ones are left out; of such tries the one that agrees best counts.
    """
    tries = []
    for first in range(len(prepared.stages)):
        stages = prepared.stages[first:]
        descent = _through(prepared, stages, T, motions)
        tries.append(descent)
        end = descent.solution.transform
        circles = not descent.solution.converged and descent.solution.iterations > PATIENCE
        lost = descent.doubtful or circles
        if descent.is_late or not (lost or has_strayed(descent.joint, end, T, stages[0].radius)):
            break
    ends = [descent.solution.transform for descent in tries]
    best = tries[best_of(descent.joint, ends)] if len(tries) > 1 else descent
    return best._replace(iterations=sum(descent.iterations for descent in tries))


def joint_entropy(prepared, stage, slide):
    """Return the `JointEntropy` of a stage, on voxels as coarse as it is wide."""
    config, clouds = prepared.config, prepared.clouds
    if stage.factor > 1.0:
        voxel_size = config.voxel_size
        spacing = SPACING * stage.radius if voxel_size is None else stage.factor * voxel_size
        clouds = _reduced(clouds, spacing, config.threads)
    return JointEntropy(*clouds, stage.radius, config.length_scale, config.threads, slide)


def _through(prepared, stages, T, motions):
    *coarse, last = stages
    said = prepared.config.assessment != 'none'
    way = Coarse(T, 0, None, np.nan, False)
    if coarse:
        way = _coarse(prepared, coarse, T, motions, said)
    joint, solution = _minimized(prepared, last, way.transform, motions, last=True)
    is_late = perf_counter() > prepared.deadline and not solution.converged
    iterations, belief = way.iterations + solution.iterations, way.credibility if said else np.nan
    return Descent(joint, solution, iterations, is_late, way.first or joint, belief, way.doubtful)


def _coarse(prepared, stages, T, motions, said):
    """Minimise from T in the stages before the last; leave out the next one where sure."""
    first, *rest = stages
    joint, solution, belief, iterations = _first(prepared, first, T, motions)
    first = joint if said else None  # or its neighbourhoods would last as long as the solve
    doubtful = belief < DOUBT
    while rest and perf_counter() < prepared.deadline:
        stage, *rest = rest
        joint = None  # let go of before the next is made: it is a third of its size
        joint, solution = _minimized(prepared, stage, solution.transform, motions)
        iterations += solution.iterations
        if rest and belief <= SURE and prepared.config.voxel_size is not None:
            belief = credibility(joint, solution.transform, LAST)
        if belief > SURE:
            rest = rest[1:]
    if belief <= SURE and (said or doubtful):
        belief = credibility(joint, solution.transform, LAST)
    doubtful = doubtful and belief < DOUBT
    return Coarse(solution.transform, iterations, first, belief, doubtful)


def _first(prepared, stage, T, motions):
    """Return `JointEntropy`, `Solution` and credibility of the first stage, and all its steps."""
    joint, solution = _minimized(prepared, stage, T, motions)
    belief = credibility(joint, solution.transform, FIRST)
    wider = Stage(WIDER * stage.radius, WIDER * stage.factor)
    if belief > 0.5 or wider.radius > widest_useful(*prepared.clouds):
        return joint, solution, belief, solution.iterations
    _, found = _minimized(prepared, wider, T, motions)
    joint, again = _minimized(prepared, stage, found.transform, motions)
    iterations = solution.iterations + found.iterations + again.iterations
    new_belief = credibility(joint, again.transform, FIRST)
    if new_belief > belief:
        solution, belief = again, new_belief
    return joint, solution, belief, iterations


def _minimized(prepared, stage, T, motions, last=False):
    """Minimise one stage from T; return its `JointEntropy` and the `Solution`."""
    config, joint = prepared.config, joint_entropy(prepared, stage, slide=last)
    ease = 1.0 if last else EASE
    solution = minimize_on_se3(
        joint.linearize,
        T,
        max_iterations=config.max_iterations,
        rotation_tolerance=ease * config.rotation_tolerance,
        distance_tolerance=ease * config.translation_tolerance * stage.radius,
        motions=motions,
        deadline=prepared.deadline,
    )
    for cloud in itertools.compress(prepared.clouds, prepared.ours):
        cloud.forget_reduced()
    return joint, solution


def _reduced(clouds, voxel_size, threads):
    for cloud in clouds:
        cloud.require_resolved(voxel_size)
    return in_threads(threads, lambda cloud: cloud.reduced(voxel_size), clouds)


def _radii(clouds, config):
    """Return the radius of each stage; none for clouds of too few points."""
    enough = min(len(cloud) for cloud in clouds) >= LEAST_POINTS
    return stage_radii(*clouds, config) if enough else []


def _without_copies(cloud):
    """Return a cloud with one point where points coincide; as it is, where all do."""
    edge = COPIES * float(np.ptp(cloud.points))
    return cloud.reduced(edge) if edge > 0.0 else cloud


def _widened(target, source, radius, config):
    in_threads(config.threads, lambda cloud: cloud.thickness(radius), (target, source))
    wider = rounded(radius * widening(target, source, radius))
    if wider != radius:
        target.forget(radius)
        source.forget(radius)
    return wider


def _uncrowded(cloud, radius):
    """Reduce a cloud of which a ball would hold hundreds of points: copies, or far denser."""
    return cloud if cloud.crowding(radius) <= CROWDED else cloud.reduced(FINE * radius)
