"""Views of one pair of clouds: from above at a pose, and a slice of q_tot around a pose."""

import io

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from idem_ros.report.picture import SOURCE, TARGET

RADII_SEEN = 20.0  # from the middle of a view to its border
SIZE = (4.1, 3.7)  # [in]
WHOLE, BESIDE, BAR = (0.16, 0.13, 0.8, 0.8), (0.16, 0.13, 0.62, 0.8), (0.81, 0.2, 0.03, 0.66)


def draw_slice(slice_, guess):
    """Return a figure of a `QTotSlice`; `guess` is the (2,) shift of the initial guess."""
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


def png(figure):
    """Return a figure as PNG; the same bytes for the same figure."""
    file = io.BytesIO()
    figure.savefig(file, format='png', dpi=110, metadata={'Software': None})
    return file.getvalue()


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
