import os
import subprocess
import sys

EVALUATE = """
import gc
import numpy as np
from idem_ros.core import q_per_point
often = gc.get_threshold()
rng = np.random.default_rng(0)
def surface():
    x, y = 10 * rng.random((2, 4000))
    return np.c_[x, y, np.sin(x) + np.cos(2 * y) / 2 + 0.02 * rng.normal(size=len(x))]
guess = np.eye(4)
guess[:3, 3] = 0.1, 0.05, -0.1
print(*(x.hex() for q in q_per_point(surface(), surface(), guess) for x in q))
assert gc.get_threshold() == often, 'the collector is left as it was'
"""


def test_a_process_that_compiles_says_so_and_gives_the_bits_of_one_that_need_not(tmp_path):
    environment = os.environ | {'NUMBA_CACHE_DIR': str(tmp_path)}
    cold, warm = (
        subprocess.run(
            [sys.executable, '-c', EVALUATE],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        for _ in range(2)
    )
    (said,) = cold.stderr.splitlines()
    assert 'compiling kernels' in said
    assert warm.stderr == ''
    assert len(cold.stdout.split()) == 8000
    assert cold.stdout == warm.stdout
