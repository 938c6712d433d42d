"""One frame of a recording as a picture: the clouds before and after, q_tot around the result."""

from itertools import islice

import numpy as np

from idem_ros.core import Cloud, IdemError, RegistrationConfig
from idem_ros.core.geometry import se3
from idem_ros.core.metric.landscape import Landscape, q_on_grid
from idem_ros.messages.pointcloud2 import read_points
from idem_ros.recording.reader import open_recording
from idem_ros.recording.topics import find_topics
from idem_ros.refinement.debug_clouds import REACH
from idem_ros.refinement.refiner import Refiner
from idem_ros.replay.pairs import pairs_of

VIEW = 10.0  # [m] around the source that are shown
STEPS = 41  # of the slice, along each axis
TARGET, SOURCE = '#2c6fbb', '#d1495b'


def draw_frame(bag, frame, path, config=None):
    """Write a PNG of the frame-th refined pair (from 0) of a recording.

    Raises:
        IdemError: the recording has fewer pairs, or none that can be refined.
    """
    config = RegistrationConfig() if config is None else config
    with open_recording(bag) as recording:
        pair = next(islice(pairs_of(recording, find_topics(recording)), frame, None), None)
        if pair is None:
            raise IdemError(f'{bag} has no pair number {frame}; pairs count from 0')
        refinement = Refiner(config).refine(pair)
        target, source = (read_points(message).points for message in (pair.target, pair.source))
    size = refinement.result.voxel_size
    clouds = [
        Cloud(points) if size is None else Cloud(points).reduced(size)
        for points in (target, source)
    ]
    _draw(path, target, source, refinement, _slice(*clouds, refinement.result, config))


def _slice(target, source, result, config):
    """Return shifts of the result in x and y [m], and q_tot [nat] there (rows: y)."""
    shifts = np.linspace(-REACH, REACH, STEPS) * result.radius
    landscape = Landscape(target, source, result.radius, config.length_scale)
    return shifts, q_on_grid(landscape, result.T_target_source, x=shifts, y=shifts).T


def _draw(path, target, source, refinement, landscape):
    import matplotlib as mpl

    mpl.use('Agg')
    from matplotlib import pyplot as plt

    result = refinement.result
    figure, axes = plt.subplots(1, 3, figsize=(13, 4.2), layout='constrained')
    for axis, T, title in (
        (axes[0], refinement.T_guess, 'initial guess'),
        (axes[1], result.T_target_source, 'refined'),
    ):
        _draw_clouds(axis, target, se3.transform_points(T, source), T[:3, 3], title)
    shifts, values = landscape
    image = axes[2].pcolormesh(shifts, shifts, values, cmap='viridis', rasterized=True)
    axes[2].plot(0, 0, 'o', mfc='none', mec='white', ms=9, label='refined')
    guess = refinement.T_guess[:2, 3] - result.T_target_source[:2, 3]
    axes[2].plot(*guess, 'x', color='white', ms=8, label='initial guess')
    axes[2].set(title='q_tot around the result', xlabel='shift in x [m]', ylabel='shift in y [m]')
    axes[2].legend(loc='upper right', facecolor='#444444', labelcolor='white', fontsize=8)
    axes[2].set_aspect('equal')
    figure.colorbar(image, ax=axes[2], label='q_tot [nat]')
    figure.savefig(path, dpi=110, format='png', metadata={'Software': None})
    plt.close(figure)


def _draw_clouds(axis, target, source, center, title):
    for points, color, name, size in (
        (target, TARGET, 'target', 1.2),
        (source, SOURCE, 'source', 0.8),
    ):
        near = np.abs(points[:, :2] - center[:2]).max(axis=1) < VIEW
        above = near & (points[:, 2] > center[2] - 1.2)  # the ground would hide the walls
        x, y = points[above, :2].T
        axis.plot(x, y, '.', ms=size, color=color, label=name, alpha=0.7)
    axis.set(title=f'{title}, from above', xlabel='x [m]', ylabel='y [m]')
    axis.set_aspect('equal')
    axis.legend(loc='upper right', markerscale=8, fontsize=8)
