"""Small rigs: a bumpy body seen by three sensors at once, from several sides."""

import numpy as np
from clouds import motion, surface

from idem_ros.core.geometry import se3

SENSORS = 'top', 'left', 'right'
VIEWS = (0.0, 0.0, 1.0), (0.0, 0.9, 0.4), (0.0, -0.9, 0.4)  # of the body, that each looks along


def extrinsics(rng):
    """Where the three are in the frame of the first, (3, 4, 4)."""
    return np.array([np.eye(4), motion(rng, 60.0, 0.3), motion(rng, 80.0, 0.4)])


def sightings(rng, poses, instants=1, points=4000, noise=0.002):
    """What each sensor sees, [[(N, 3)]] by instant: of the body turned otherwise each time."""
    found = []
    for _ in range(instants):
        body = se3.transform_points(motion(rng, 90.0, 0.1), surface(rng, points))
        row = []
        for T, view in zip(poses, VIEWS, strict=True):
            seen = body[body @ view > -0.05]
            seen = seen[rng.random(len(seen)) < 0.7]
            seen = seen + rng.normal(0.0, noise, seen.shape)
            row.append(se3.transform_points(se3.inverse(T), seen))
        found.append(row)
    return found


def off(rng, poses, degrees, distance):
    """Return starts that are off by so much; the first is not."""
    return np.array(
        [T if k == 0 else T @ motion(rng, degrees, distance) for k, T in enumerate(poses)]
    )
