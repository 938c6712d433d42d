import subprocess
import sys

import pytest

AFTERWARDS = """
import sys
import numpy as np
from numba.core.dispatcher import Dispatcher
from idem_ros.core import Cloud, MapCloud, RegistrationConfig, register, warm_up
from idem_ros.simulation.drive import drive
from idem_ros.simulation.lidar import Lidar, scan
from idem_ros.simulation.street import street

def ready():
    of_package = [m for name, m in sys.modules.items() if name.startswith('idem_ros')]
    kernels = {v for m in of_package for v in vars(m).values() if isinstance(v, Dispatcher)}
    return {f'{k.py_func.__name__}{signature}' for k in kernels for signature in k.signatures}

motion = sys.argv[1]
rng = np.random.default_rng(1)
scene, lidar = street(rng), Lidar()
target, source = (scan(scene, pose, lidar, rng) for pose in drive(scene, 5, rng)[:2])
warm_up(motion)
before = ready()
for size in (None, 'auto', 0.3):
    config = RegistrationConfig(voxel_size=size, motion=motion, max_iterations=20)
    times = np.linspace(0, 0.1, len(source)) if motion != 'none' else None
    twist = np.zeros(6) if motion != 'none' else None
    for cloud in (target, MapCloud(target)) if motion == 'none' else (target,):
        register(cloud, Cloud(source, times), config=config, twist=twist)
print(*sorted(ready() - before), sep='\\n')
"""


@pytest.mark.parametrize('motion', ['none', 'solve'])
def test_a_first_scan_finds_every_kernel_ready(motion):
    script = [sys.executable, '-c', AFTERWARDS, motion]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ''
