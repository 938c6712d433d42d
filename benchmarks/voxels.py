"""What `voxel_size: auto` costs and gives, beside the best of several fixed sizes of each set."""

from dataclasses import dataclass, field, replace
from itertools import islice
from time import process_time
from zlib import crc32

import numpy as np

from benchmarks.case import displaced, errors
from idem_ros.core import Verdict, register, warm_up
from idem_ros.core.config import AUTO
from idem_ros.terminal.markdown import number, table

REPEATS = 3  # of which the quickest counts
MOST_ERROR, MOST_TIME = 1.2, 1.5  # of the best fixed size's


@dataclass
class OfSize:
    """What one setting of `voxel_size` gives on a set; lists have an item a pair."""

    right: list[bool] = field(default_factory=list)
    error: list[float] = field(default_factory=list)  # of the source's points, rms [m]
    ms: list[float] = field(default_factory=list)  # processor time from raw points to result
    aligned: list[bool] = field(default_factory=list)  # by the verdict
    voxels: list = field(default_factory=list)  # edge [m]; None: points as given

    def medians(self):
        """Return the medians of error [m] and time [ms]."""
        return float(np.median(self.error)), float(np.median(self.ms))


@dataclass
class SetResult:
    """A set, what each voxel size gives on it, and how far its truth may be off [m]."""

    name: str
    seen: bool
    of: dict
    truth: float

    @property
    def best(self):
        """The fixed size with the most right results, and of those with the least median error."""
        fixed = [size for size in self.of if size != AUTO]
        return min(fixed, key=lambda size: (-sum(self.of[size].right), self.of[size].medians()[0]))

    def ratios(self):
        """Return error and time of auto over those of the best; errors within the truth's are 1.

        Both medians are raised to how far the truth may be off: what is less tells nothing.
        """
        (error, ms), (best_error, best_ms) = (
            self.of[size].medians() for size in (AUTO, self.best)
        )
        floor = max(self.truth, 1e-9)
        return max(error, floor) / max(best_error, floor), ms / best_ms

    def reached(self):
        """Whether auto is right as often as the best fixed size, nearly as exact and as quick."""
        error, ms = self.ratios()
        as_right = sum(self.of[AUTO].right) >= sum(self.of[self.best].right)
        return as_right and error <= MOST_ERROR and ms <= MOST_TIME

    def record(self):
        """Return it as what JSON holds."""
        sizes = {
            'given' if size is None else str(size): vars(found) for size, found in self.of.items()
        }
        return {'set': self.name, 'truth_m': self.truth, 'seen': self.seen, 'sizes': sizes}


def measure_voxels(sets, config, most=None, progress=lambda sets: sets):
    """Return the `SetResult` of each `VoxelSet`.

    Args:
        sets: `VoxelSet`s.
        config: `RegistrationConfig`; of its voxel size nothing is taken.
        most: pairs of each set; None: all.
        progress: wraps the iteration over the sets.
    """
    warm_up()
    return [_measured(each, config, most) for each in progress(sets)]


def _measured(each, config, most):
    of, truths = {size: OfSize() for size in (AUTO, *each.sizes)}, []
    for case in islice(each.cases(), most):
        rng = np.random.default_rng(crc32(case.name.encode()))
        guess = displaced(case.truth, case.centroid, *each.start, rng)
        reach = np.sqrt(np.mean(np.sum((case.source - case.centroid) ** 2, axis=1)))
        truths.append(_moves(reach, case.truth_rotation_deg, case.truth_translation_m))
        for size, found in of.items():
            setting = replace(config, voxel_size=size)
            result, ms = _timed(case, guess, setting)
            rotation_deg, translation_m = errors(case, result.T_target_source)
            found.error.append(_moves(reach, rotation_deg, translation_m))
            found.right.append(rotation_deg < each.right[0] and translation_m < each.right[1])
            found.aligned.append(result.assessment.verdict is Verdict.ALIGNED)
            found.voxels.append(result.voxel_size)
            found.ms.append(ms)
    return SetResult(each.name, each.seen, of, float(np.median(truths)))


def _moves(reach, rotation_deg, translation_m):
    """Return how far errors move points, root mean square, that reach so far [m]."""
    return float(np.hypot(translation_m, np.radians(rotation_deg) * reach))


def _timed(case, guess, config):
    times = []
    for _ in range(REPEATS):
        begin = process_time()
        result = register(case.target, case.source, guess, config)
        times.append(1e3 * (process_time() - begin))
    return result, min(times)


def voxels_table(results):
    """Return `SetResult`s as a Markdown table."""
    header = (
        *('set', 'auto took', 'right, auto', 'aligned', 'error [mm]', 'ms'),
        *('best fixed', 'right', 'error [mm]', 'ms', 'error', 'time', 'reached'),
    )
    rows = []
    for result in results:
        auto, best = result.of[AUTO], result.of[result.best]
        error, ms = result.ratios()
        rows.append(
            [
                result.name + (' *' if result.seen else ''),
                ' '.join(sorted({_edge(size) for size in auto.voxels})),
                *(_share(auto.right), _share(auto.aligned)),
                *(number(auto.medians()[0], 1e3), number(auto.medians()[1])),
                *(_edge(result.best), _share(best.right)),
                *(number(best.medians()[0], 1e3), number(best.medians()[1])),
                *(f'{error:.2f} x', f'{ms:.2f} x', 'yes' if result.reached() else 'NO'),
            ]
        )
    return table(header, rows)


def _share(those):
    return f'{sum(those)} of {len(those)}'


def _edge(size):
    return 'given' if size is None else f'{size:.3g}'
