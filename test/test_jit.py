import os
import subprocess
import sys

CODE = """
import numpy as np
from idem_ros.core.grid import bounds
bounds(np.zeros((2, 3)))
"""


def test_a_cold_cache_says_that_it_compiles_and_a_warm_one_is_silent(tmp_path):
    environment = os.environ | {'NUMBA_CACHE_DIR': str(tmp_path)}
    runs = [
        subprocess.run(
            [sys.executable, '-c', CODE],
            env=environment,
            capture_output=True,
            text=True,
            check=True,
        )
        for _ in range(2)
    ]
    assert runs[0].stderr == 'compiling kernels: once, some ten seconds\n'
    assert runs[1].stderr == ''
