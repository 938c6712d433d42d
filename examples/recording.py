"""A recording refined offline: what came of each frame, as the live node would have said it.

python examples/recording.py bags/demo.mcap
"""

import sys

from idem_ros.core import RegistrationConfig
from idem_ros.replay.run import replay

replayed = replay(sys.argv[1], RegistrationConfig(voxel_size=0.5))
for frame in replayed.frames:
    refinement, error = frame.refinement, frame.error_after()
    verdict = refinement.result.assessment.verdict.value
    off = '' if error is None else f', off by {1e3 * error.translation_m:.1f} mm'
    print(f'{refinement.stamp}: {verdict}, overlap {refinement.result.overlap:.2f}{off}')
