from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from clouds import motion, surface

from idem_ros.core import Cloud, register


def test_a_cloud_may_be_shared_by_threads(rng):
    points = surface(rng, 3000)
    target = Cloud(points)
    sources = [surface(rng, 2000) for _ in range(8)]
    guess = motion(rng, 2, 0.02)
    alone = [register(points, source, guess).T_target_source for source in sources]
    with ThreadPoolExecutor(4) as pool:
        found = pool.map(lambda s: register(target, s, guess).T_target_source, sources * 3)
    for T, expected in zip(found, alone * 3, strict=True):
        np.testing.assert_array_equal(T, expected)


def test_nobody_writes_to_a_cloud(rng):
    cloud = Cloud(surface(rng, 100))
    for array in (cloud.points, cloud.origin, cloud.finite):
        with pytest.raises(ValueError, match='read-only'):
            array[0] = 0
