"""Two arrays registered: the pose, whether to trust it, and what its covariance says.

python examples/arrays.py
"""

import numpy as np

from idem_ros.core import Cloud, register


def hills(rng, n):
    """Return (n, 3) points of a bumpy square, 10 m wide, with 5 mm of noise."""
    x, y = rng.uniform(-5, 5, (2, n))
    return np.c_[x, y, np.sin(x) * np.cos(y)] + rng.normal(0, 0.005, (n, 3))


rng = np.random.default_rng(1)
target = Cloud(hills(rng, 8000))  # prepared once; it serves every source
T_true = np.eye(4)
T_true[:3, 3] = 0.12, -0.08, 0.05
source = hills(rng, 6000) - T_true[:3, 3]

result = register(target, source, np.eye(4))

assessment = result.assessment
sigma = np.sqrt(np.diag(assessment.covariance))  # x y z [m] rx ry rz [rad]
print('T_target_source:', *np.round(result.T_target_source, 4), sep='\n')
print(f'verdict: {assessment.verdict.value}, p {assessment.p_aligned:.3f}: {assessment.reason}')
print('sigma [mm]:', *np.round(1e3 * sigma[:3], 2), ' [mrad]:', *np.round(1e3 * sigma[3:], 2))
print('off by [mm]:', *np.round(1e3 * (result.T_target_source - T_true)[:3, 3], 2))
if not result.is_usable:
    raise SystemExit('this result is not to be built upon')
