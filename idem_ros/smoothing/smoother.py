"""A trajectory made consistent: windows, then loops, then one graph of all keyframes."""

from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from idem_ros.core import Cloud, PosePrior
from idem_ros.core.geometry.se3 import ROS_ORDER, inverse, log
from idem_ros.core.metric.voxel_size import size_found, with_voxel_size
from idem_ros.core.several.pose_graph import solve_graph
from idem_ros.core.several.system import parts_of
from idem_ros.pairing.stamped_poses import interpolated
from idem_ros.smoothing.joining import Joint, Pairs, loops_of, priors_of, sigmas_of, windows_of
from idem_ros.smoothing.keyframes import SHARE_OF_RANGE

ROUNDS = 3  # of looking for loops where the last ones have brought the keyframes
AT_ONCE = 8  # pairs of a task
SIGMAS = 3.0  # from where a step is contradicted
LOOKED_AT = 4  # keyframes that tell the size of voxels


@dataclass
class Smoothed:
    """Keyframes in one frame, and what holds them there."""

    poses: NDArray
    """(K, 4, 4) of the keyframes; the first is as the trajectory has it."""
    covariances: NDArray
    """(K, 6, 6), x y z rx ry rz, in the common axes, relative to the first."""
    given: NDArray
    """(K, 4, 4) of the keyframes, by the trajectory."""
    sigmas: NDArray
    """(K - 1, 2): standard deviations of its steps [m], [rad]."""
    relations: list = field(default_factory=list)
    """Of pairs of keyframes, those that do not count, too."""
    failures: list = field(default_factory=list)
    """Why windows or pairs could not be done."""
    voxel_size: float | None = None

    @property
    def steps(self):
        """`PosePrior` of each step, by the trajectory, one after the other: they are not kept."""
        return priors_of(self.given, self.sigmas)

    @property
    def part(self):
        """The number of the part that each keyframe hangs together with others in, (K,)."""
        pairs = [(each.i, each.j) for each in self.relations if each.counts]
        return parts_of(np.array(pairs, int).reshape(-1, 2), len(self.poses))

    @property
    def contradicted(self):
        """Which steps of the trajectory the scans contradict, of those that were looked at."""
        return {each.i: self._contradicts(each) for each in self.relations if each.is_step}

    def _contradicts(self, relation):
        """Whether a relation says something else than the step of the trajectory, or nothing."""
        if not relation.counts:
            return True
        k = relation.i
        (step,) = priors_of(self.given[k : k + 2], self.sigmas[k : k + 1])
        off = log(inverse(step.transform) @ relation.T_i_j)[ROS_ORDER]
        square = off @ np.linalg.solve(step.covariance + relation.covariance, off)
        return square > 6 * SIGMAS**2


class Smoother:
    """Makes the poses of keyframes consistent.

    Args:
        clouds: `KeyframeClouds`.
        poses: (K, 4, 4) of the keyframes, by the trajectory.
        scale: [m] the median range of a scan.
        config: `SmoothingConfig`.
        registration: `RegistrationConfig`.
        run: does tasks, and yields (index, what `joined` returns) of each.
    """

    def __init__(self, clouds, poses, scale, config, registration, run):
        self._clouds, self._run, self._config = clouds, run, config
        self._reach = config.reach or scale
        distance = config.keyframe_distance or SHARE_OF_RANGE * scale
        looked_at = np.unique(np.linspace(0, len(poses) - 1, LOOKED_AT).astype(int))
        some = [Cloud(clouds.read(number)) for number in looked_at]
        self._registration = _tolerant(with_voxel_size(registration, *some), some[0], scale)
        self.smoothed = Smoothed(
            poses.copy(),
            np.zeros((len(poses), 6, 6)),
            poses,
            sigmas_of(poses, config, distance),
            voxel_size=size_found(self._registration),
        )

    def smooth(self, given_pairs=()):
        """Return the `Smoothed`.

        given_pairs: (i, j) of keyframes that are tried as loops, however far apart.
        """
        self._take(self._windows())
        pairs, tried = list(given_pairs), set()
        for _ in range(ROUNDS):
            tried.update(pairs)
            pairs += loops_of(self.smoothed.poses, self._reach, tried)
            if not pairs:
                break
            tried.update(pairs)
            self._take(self._loops(pairs))
            pairs = []
        return self.smoothed

    def _windows(self):
        found = self.smoothed
        folder = str(self._clouds.folder)
        return [
            Joint(
                f'keyframes {window[0]} to {window[-1]}',
                folder,
                tuple(window),
                found.given[window],
                found.sigmas[window[0] : window[-1]],
                told,
                self._registration,
            )
            for window, told in windows_of(len(found.given), self._config.window)
        ]

    def _loops(self, pairs):
        poses, tasks = self.smoothed.poses, []
        for begin in range(0, len(pairs), AT_ONCE):
            some = pairs[begin : begin + AT_ONCE]
            guesses = np.array([inverse(poses[i]) @ poses[j] for i, j in some])
            names = f'pairs {some[0][0]}-{some[0][1]} to {some[-1][0]}-{some[-1][1]}'
            folder = str(self._clouds.folder)
            tasks.append(Pairs(names, folder, tuple(some), guesses, self._registration))
        return tasks

    def _take(self, tasks):
        """Do tasks, and solve the graph with what they find."""
        found = self.smoothed
        outcomes = dict(self._run(tasks))
        for index in range(len(tasks)):  # whoever ended first, the sums are the same
            outcome = outcomes[index]
            if outcome.reason:
                found.failures.append(f'{outcome.path}: {outcome.reason}')
            else:
                found.relations.extend(outcome.relations)
        graph = solve_graph(found.poses, chain(found.steps, weighed(found.relations)))
        found.poses, found.covariances = graph.poses, graph.covariances


def _tolerant(registration, cloud, scale):
    """Return a `RegistrationConfig` by which a pair may differ from its window by half a voxel.

    Each pair alone has a minimum of its own; how far that is to be believed, its covariance says.
    """
    size = registration.voxel_size or cloud.fourth_neighbor_distance()
    angle = min(np.degrees(size / 2 / scale), 180.0)
    return replace(registration, audit_tolerance=(size / 2, angle))


def weighed(relations):
    """Yield those `Relation`s that count as `PosePrior`s."""
    for each in relations:
        if each.counts:
            yield PosePrior(source=each.j, T=each.T_i_j, covariance=each.covariance, target=each.i)


def between_keyframes(scans, poses):
    """Return the (S, 4, 4) poses of all scans, given those (K, 4, 4) of the keyframes.

    Between two keyframes a scan is where its trajectory leads from either, and it passes from the
    one to the other as time does.

    Args:
        scans: `Scans`.
        poses: of its keyframes.
    """
    given, stamps = scans.poses, scans.stamps
    result = np.empty((len(given), 4, 4))
    places = np.searchsorted(scans.keyframes, np.arange(len(given)), 'right') - 1
    for s, k in enumerate(places):
        at = scans.keyframes[k]
        ahead = poses[k] @ inverse(given[at]) @ given[s]
        if k + 1 < len(poses) and s != at:
            after = scans.keyframes[k + 1]
            back = poses[k + 1] @ inverse(given[after]) @ given[s]
            fraction = (stamps[s] - stamps[at]) / (stamps[after] - stamps[at])
            ahead = interpolated(ahead, back, fraction)
        result[s] = ahead
    return result
