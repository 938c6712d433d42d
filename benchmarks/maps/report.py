"""What the maps showed, as a page and as JSON."""

from dataclasses import asdict

import numpy as np

from benchmarks.goal import goals_table
from benchmarks.maps.measure import (
    APART,
    GICP_UP_TO,
    GUESSES,
    LIDAR,
    PLACES,
    RATE,
    RIGHT,
    SPEED,
    START,
    VOXEL,
    goals,
)
from idem_ros.core import Verdict
from idem_ros.terminal.markdown import table

HEADER = (
    *('points of the map', 'first [s]', 'IDEM [ms] median', 'p95', 'GICP [ms] median'),
    *('IDEM [deg] median', 'worst', '[mm] median', 'worst', 'GICP [deg] median', '[mm] median'),
    *('aligned', 'kept [MB]'),
)
ABOUT = f"""A town, made of its lots where it is asked for, as a map of so many points (noise
20 mm), and simulated scans of about 60 000 points in its middle ({LIDAR.rings} rings,
{LIDAR.max_range_m:g} m): {PLACES} places and {GUESSES} guesses at each, {START[0]:g} deg and
{START[1]:g} m off; voxels of {VOXEL:g} m. Times are of one thread, raw scan to verdict, the maps
in turn, with blocks prepared; *first* is of a map of which none is, the making of its points
included. GICP is small_gicp's on voxels as large, its tree and covariances prepared (not beyond
{GICP_UP_TO:g} million points: memory). Right: to {RIGHT[0]:g} deg and {1e3 * RIGHT[1]:g} mm. The
drive is at {SPEED:g} m/s and {RATE:g} Hz in real time, each guess the last result moved on, blocks
prepared ahead.
"""

ON_DISK = f"""A map on disk, each in a process of its own with its kernels ready: from opening the
map to the result of a scan, from there to that of a scan {APART:g} m away, and by how much the
most memory that was resident exceeds that without a map.
"""
DISK_HEADER = 'map', 'points', 'first [s]', 'elsewhere [s]', 'memory [MB]', 'worst error [mm]'


def markdown(figures, drive, outside, disk):
    """Return the tables of `measure.measure` as Markdown."""
    median = f'{np.median(drive.ms):.3g} ms in the median, {drive.ms.max():.3g} ms at most'
    errors = f'{drive.errors[:, 0].max():.2g} deg, {1e3 * drive.errors[:, 1].max():.2g} mm at most'
    reached = goals_table([*goals(figures, drive, outside, disk)])
    return (
        f'## Maps\n\n{ABOUT}\n{table(HEADER, [_cells(each) for each in figures])}\n'
        f'The drive: {median}; {errors}.\n\n{ON_DISK}\n'
        f'{table(DISK_HEADER, [_disk_cells(each) for each in disk])}\n{reached}'
    )


def json_record(figures, drive, outside, disk):
    """Return the same as what JSON holds."""
    return {
        'maps': [_record(each) for each in figures],
        'drive': {'ms': drive.ms.tolist(), 'errors_deg_m': drive.errors.tolist()},
        'from_disk': [asdict(each) for each in disk],
        'goals': [goal.record() for goal in goals(figures, drive, outside, disk)],
    }


def _cells(figures):
    idem, gicp = figures.idem_errors, figures.gicp_errors
    aligned = sum(verdict is Verdict.ALIGNED for verdict in figures.verdicts)
    return (
        f'{figures.millions:g} M',
        f'{figures.first_s:.2f}',
        f'{np.median(figures.idem_ms):.1f}',
        f'{np.percentile(figures.idem_ms, 95):.1f}',
        _median(figures.gicp_ms, '.1f'),
        f'{np.median(idem[:, 0]):.4f}',
        f'{idem[:, 0].max():.4f}',
        f'{1e3 * np.median(idem[:, 1]):.2f}',
        f'{1e3 * idem[:, 1].max():.2f}',
        _median(gicp[:, 0], '.4f'),
        _median(1e3 * gicp[:, 1], '.2f'),
        f'{aligned} of {len(figures.verdicts)}',
        f'{figures.cache_mb:.0f}',
    )


def _disk_cells(disk):
    return (
        disk.form,
        disk.points,
        f'{disk.first_s:.2f}',
        f'{disk.other_s:.2f}',
        f'{disk.bytes / 1e6:.0f}',
        f'{1e3 * disk.worst_m:.2g}',
    )


def _median(values, digits):
    return f'{np.median(values):{digits}}' if len(values) else '-'


def _record(figures):
    return {
        'million_points': figures.millions,
        'first_s': figures.first_s,
        'idem_ms': figures.idem_ms.tolist(),
        'gicp_ms': figures.gicp_ms.tolist(),
        'idem_errors_deg_m': figures.idem_errors.tolist(),
        'gicp_errors_deg_m': figures.gicp_errors.tolist(),
        'verdicts': [verdict.value for verdict in figures.verdicts],
        'kept_mb': figures.cache_mb,
    }
