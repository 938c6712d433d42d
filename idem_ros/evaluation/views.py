"""Views of one pair of clouds: from above at a pose, and q_tot around a pose."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from idem_ros.core import Cloud
from idem_ros.core.landscape import Landscape
from idem_ros.evaluation.picture import SOURCE, TARGET

STEPS = 17  # of the slice, along each axis
REACH, WIDEST = 2.5, 10.0  # of the slice, in search radii: at least, at most
MOST_POINTS = 30_000  # of two clouds whose q_tot is evaluated at all steps
COARSER = 1.5  # voxels, until the clouds have no more than that
THREADS = 2
RADII_SEEN = 20.0  # from the middle of a view to its border
SIZE = (4.1, 3.7)  # [in]
WHOLE, BESIDE, BAR = (0.16, 0.13, 0.8, 0.8), (0.16, 0.13, 0.62, 0.8), (0.81, 0.2, 0.03, 0.66)


@dataclass(frozen=True)
class Slice:
    """q_tot on a grid of shifts around a pose, along x and y of the target frame."""

    shifts: NDArray
    """(S,), the same along both axes [m]."""
    q_tot: NDArray
    """(S, S) [nat]; rows: y."""
    voxel_size: float
    """Of the clouds it is evaluated on [m]."""
    radius: float
    """Of the neighbourhoods [m]."""


def slice_around(target, source, T_target_source, T_guess, radius, config):
    """Evaluate q_tot of two clouds of voxels around a pose, as far as the guess.

    Args:
        target, source: (N, 3) points.
        T_target_source, T_guess: (4, 4).
        radius: of the result.
        config: `RegistrationConfig` of the result. Without a `voxel_size` half the radius is
            taken; of clouds that are larger still, coarser voxels and a radius that suits them.

    Returns:
        `Slice`
    """
    offset = np.abs(T_guess[:2, 3] - T_target_source[:2, 3]).max()
    shifts = np.linspace(-1, 1, STEPS) * np.clip(1.2 * offset, REACH * radius, WIDEST * radius)
    size = config.voxel_size or radius / 2
    near = _near(target, source, T_target_source, shifts[-1] + 4 * radius)
    clouds = [Cloud(points).reduced(size) for points in (near, source)]
    while sum(map(len, clouds)) > MOST_POINTS:
        size, radius = COARSER * size, None
        clouds = [Cloud(points).reduced(size) for points in (near, source)]
    landscape = Landscape(*clouds, radius, config.length_scale, THREADS)
    dx, dy = (shift.ravel() for shift in np.meshgrid(shifts, shifts))
    transforms = np.repeat(T_target_source[None], STEPS**2, axis=0)
    transforms[:, 0, 3] += dx
    transforms[:, 1, 3] += dy
    values = landscape.at(transforms).reshape(STEPS, STEPS)
    return Slice(shifts, values, size, landscape.radius)


def draw_slice(slice_, guess):
    """Return a figure of a `Slice`; `guess` is the (2,) shift of the initial guess."""
    figure, axes = _canvas(
        f'voxels {slice_.voxel_size:.3g} m, radius {slice_.radius:.3g} m', BESIDE
    )
    image = axes.pcolormesh(slice_.shifts, slice_.shifts, slice_.q_tot, shading='gouraud')
    axes.plot(0, 0, 'o', mfc='none', mec='white', ms=9, label='refined')
    if np.abs(guess).max() <= slice_.shifts[-1]:
        axes.plot(*guess, 'x', color='white', ms=8, label='guess')
    axes.set(xlabel='shift in x [m]', ylabel='shift in y [m]')
    axes.legend(loc='upper right', facecolor='#444444', labelcolor='white')
    figure.colorbar(image, cax=figure.add_axes(BAR), label='q_tot [nat]')
    return figure


def draw_from_above(target, source, middle, half_width, title):
    """Return a figure of two clouds from above.

    Args:
        target, source: (N, 3) points in one frame.
        middle: (2,) of what is seen.
        half_width: of what is seen.
        title: says at which pose.
    """
    figure, axes = _canvas(title)
    for points, colour, name in ((target, TARGET, 'target'), (source, SOURCE, 'source')):
        seen = points[np.abs(points[:, :2] - middle).max(axis=1) <= half_width]
        x, y = _without_floor(seen, half_width / RADII_SEEN).T
        axes.plot(x, y, '.', ms=1.3, mew=0, color=colour, label=name, rasterized=True)
    low, high = middle - half_width, middle + half_width
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel='x [m]', ylabel='y [m]')
    axes.legend(loc='upper right', markerscale=8)
    return figure


def seen_from_above(source, radius):
    """Return the middle (2,) and half the width of the view of a source at its result."""
    x_y = source[:, :2]
    middle = np.median(x_y, axis=0)
    extent = np.percentile(np.abs(x_y - middle).max(axis=1), 98)
    return middle, float(min(RADII_SEEN * radius, extent) if radius else extent) or 1.0


def _near(target, source, T_target_source, margin):
    """Return the part of the target that any shift of the source can reach: a map is larger."""
    moved = source @ T_target_source[:3, :3].T + T_target_source[:3, 3]
    low, high = moved.min(axis=0) - margin, moved.max(axis=0) + margin
    near = ((target >= low) & (target <= high)).all(axis=1)
    return target[near] if near.any() else target


def _without_floor(points, height):
    """Leave out what lies at the bottom of its surroundings: it would hide the walls."""
    if not len(points):
        return points[:, :2]
    cells = np.floor(points[:, :2] / (4 * height)).astype(np.int64)
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    lowest = np.full(cell.max() + 1, np.inf)
    np.minimum.at(lowest, cell, points[:, 2])
    above = points[:, 2] > lowest[cell] + height
    return points[above if above.mean() > 0.1 else slice(None), :2]


def _canvas(title, box=WHOLE):
    figure = Figure(SIZE)  # fixed boxes: to lay out each figure takes as long as to draw it
    axes = figure.add_axes(box)
    axes.set_title(title)
    axes.set_aspect('equal')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5))
    return figure, axes
