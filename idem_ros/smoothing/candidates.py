"""Which keyframes are joined: windows along the way, and pairs that may close a loop."""

import numpy as np
from scipy.spatial import KDTree

TOLD = 2  # keyframes after each that it is related to
APART = 3.0  # times the reach along the way, at least, between the two of a loop


def windows_of(count, size):
    """Return windows that cover `count` keyframes, each half over the one before.

    Returns:
        [(range of keyframes, pairs of places in it that it is to tell of)]: each keyframe with
        the `TOLD` after it, told once, by the window that has both nearest to its middle.
    """
    step = max(size // 2, 1)
    begins = [*range(0, max(count - size, 0), step), max(count - size, 0)]
    windows = [range(begin, min(begin + size, count)) for begin in begins]
    told = [[] for _ in windows]
    for i in range(count - 1):
        for j in range(i + 1, min(i + 1 + TOLD, count)):
            near = {*range(max((i - size) // step, 0), min(i // step + 1, len(windows) - 1))}
            having = [k for k in near | {len(windows) - 1} if i in windows[k] and j in windows[k]]
            if having:
                best = min(having, key=lambda k: abs(i + j - windows[k][0] - windows[k][-1]))
                told[best].append((i - windows[best][0], j - windows[best][0]))
    return list(zip(windows, map(tuple, told), strict=True))


def way_along(poses):
    """Return how far along the way each pose (K, 4, 4) is, (K,)."""
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1)
    return np.r_[0.0, np.cumsum(steps)]


def loops_of(poses, reach, tried=()):
    """Return pairs (i, j), i < j, of keyframes that are near, and long after one another.

    Of each keyframe the nearest one of each earlier pass: a run of keyframes that are within
    reach of it.

    Args:
        poses: (K, 4, 4).
        reach: how far apart they may be.
        tried: pairs that are not asked for again.
    """
    positions, along = poses[:, :3, 3], way_along(poses)
    tree, known, found = KDTree(positions), set(tried), []
    for j, position in enumerate(positions):
        near = np.array(sorted(tree.query_ball_point(position, reach)), int)
        near = near[along[j] - along[near] > APART * reach]
        if not len(near):
            continue
        passes = np.split(near, np.flatnonzero(np.diff(along[near]) > APART * reach) + 1)
        for each in passes:
            i = int(each[np.argmin(np.linalg.norm(positions[each] - position, axis=1))])
            if (i, j) not in known:
                found.append((i, j))
    return found
