"""Several clouds in one picture, each in its own colour, at two sets of poses."""

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from idem_ros.core.geometry import se3
from idem_ros.files.atomic_file import replacing

MOST_SHOWN = 200_000  # points, of all clouds
SHOWN = 0.995  # of the points lie within the picture's border
SIZE = (11.0, 5.6)  # [in]


def draw_clouds(path, clouds, before, after):
    """Write a PNG of clouds before and after, seen along the axis they are thinnest in.

    Args:
        path: of the PNG.
        clouds: (N, 3) points of each, in its own frame.
        before, after: (K, 4, 4) poses.
    """
    most = max(MOST_SHOWN // len(clouds), 1)
    clouds = [cloud[:: max(len(cloud) // most, 1)] for cloud in clouds]
    placed = [
        [se3.transform_points(T, cloud) for T, cloud in zip(poses, clouds, strict=True)]
        for poses in (before, after)
    ]
    union = np.concatenate(placed[1])
    low, high = np.quantile(union, [1 - SHOWN, SHOWN], axis=0)
    across = sorted(np.argsort(high - low)[1:])  # the two widest axes
    figure = Figure(SIZE, layout='constrained')
    colours = colormaps['turbo'](np.linspace(0.05, 0.95, len(clouds)))
    titles = 'before', 'after'
    for axes, at_poses, title in zip(figure.subplots(1, 2), placed, titles, strict=True):
        for points, colour in zip(at_poses, colours, strict=True):
            axes.plot(*points[:, across].T, '.', ms=0.8, mew=0, color=colour, rasterized=True)
        margin = 0.05 * (high - low).max()
        axes.set(
            title=title,
            xlim=(low[across[0]] - margin, high[across[0]] + margin),
            ylim=(low[across[1]] - margin, high[across[1]] + margin),
            xlabel='xyz'[across[0]],
            ylabel='xyz'[across[1]],
        )
        axes.set_aspect('equal')
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=110, format='png', metadata={'Software': None})
