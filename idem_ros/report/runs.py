"""Results as a report shows them: named apart, on one time axis, every number a column."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from idem_ros.core.geometry.se3 import checked_transform
from idem_ros.results.result_file import Result, read_result
from idem_ros.trajectory.errors import second_differences

SIGMAS = 'sigma_m', 'sigma_deg'
UNKNOWN = 0.5e6  # a variance of which nothing is known: see `trust.verdict.NOTHING_KNOWN`
POSES = {'T_target_source': '', 'T_guess': '_before'}


@dataclass(frozen=True)
class Measure:
    """A number of each frame that is worth a plot."""

    name: str
    title: str
    unit: str
    log: bool = False
    """Whether its axis is logarithmic."""

    @property
    def before(self):
        """The name of the same number at the initial guess."""
        return f'{self.name}_before'

    @property
    def label(self):
        """Title and unit, as on an axis."""
        return f'{self.title} [{self.unit}]'


MEASURES = (
    Measure('translation_error_m', 'translation error', 'm', log=True),
    Measure('rotation_error_deg', 'rotation error', 'deg', log=True),
    Measure('q_tot', 'q_tot', 'nat'),
    Measure('q_mean', 'q_mean', 'nat/point'),
    Measure('overlap', 'overlap', 'share'),
    Measure('second_difference_m', 'position, 2nd difference', 'm', log=True),
    Measure('second_difference_deg', 'rotation, 2nd difference', 'deg', log=True),
    Measure('time_ms', 'time of a frame', 'ms', log=True),
)


@dataclass(frozen=True)
class Run:
    """One result among those of a report."""

    name: str
    """Tells it from the others."""
    result: Result
    seconds: NDArray
    """(N,), from the first stamp of all runs of the same recording."""
    columns: dict[str, NDArray]
    """(N,) of each number; NaN where it is unknown."""

    def values(self, name):
        """Return a number of each frame, (N,); NaN where it is unknown."""
        return self.columns.get(name, np.full(len(self.result.frames), np.nan))


def read_runs(paths):
    """Read the results of a report.

    Args:
        paths: files, as `read_result` takes them.

    Returns:
        [`Run`]

    Raises:
        UnreadableResult: one of them is no result.
    """
    results = [read_result(path) for path in paths]
    stems = [Path(path).stem for path in paths]
    first = {
        bag: min(
            (stamp for result in results if result.bag == bag for stamp in _stamps(result)),
            default=0,
        )
        for bag in {result.bag for result in results}
    }
    return [
        Run(
            name=stem if stems.count(stem) == 1 else str(path),
            result=result,
            seconds=_seconds(result, first[result.bag]),
            columns={**_numbers(result), **_smoothness(result), **_sigmas(result)},
        )
        for path, stem, result in zip(paths, stems, results, strict=True)
    ]


def poses(result, name):
    """Return the transforms of that name, (N, 4, 4), or None where a frame has none."""
    if not (result.frames and all(frame.get(name) for frame in result.frames)):
        return None
    return np.array([checked_transform(frame[name], name) for frame in result.frames])


def _seconds(result, first):
    return np.array([(stamp - first) / 1e9 for stamp in _stamps(result)])


def _stamps(result):
    return [frame['stamp_ns'] for frame in result.frames]


def _numbers(result):
    return {name: result.values(name) for name in result.numbers()}


def _sigmas(result):
    """Return the largest standard deviation of each pose, of its position and its rotation."""
    found = np.array([_sigma(frame.get('covariance')) for frame in result.frames]).reshape(-1, 2)
    return dict(zip(SIGMAS, found.T, strict=True)) if np.isfinite(found).any() else {}


def _sigma(covariance):
    try:
        matrix = np.array(covariance, dtype=float).reshape(6, 6)
    except (TypeError, ValueError):
        return np.nan, np.nan
    if not np.isfinite(matrix).all():
        return np.nan, np.nan
    variances = [np.linalg.eigvalsh(matrix[k : k + 3, k : k + 3])[-1] for k in (0, 3)]
    position, rotation = (np.sqrt(v) if 0 <= v < UNKNOWN else np.nan for v in variances)
    return position, np.degrees(rotation)


def _smoothness(result):
    columns = {}
    for name, suffix in POSES.items():
        found = poses(result, name)
        if found is not None:
            positions, rotations = second_differences(_stamps(result), found)
            columns[f'second_difference_m{suffix}'] = positions
            columns[f'second_difference_deg{suffix}'] = rotations
    return columns
