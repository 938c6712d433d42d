"""A recording refined offline: what came of each frame, as the live node would have said it.

python examples/recording.py bags/demo.mcap
"""

import argparse

from idem_ros.core import RegistrationConfig
from idem_ros.replay.run import replay

parser = argparse.ArgumentParser(description='Refine a recording offline.')
parser.add_argument('recording', help='such as bags/demo.mcap')
replayed = replay(parser.parse_args().recording, RegistrationConfig(voxel_size=0.5))
for frame in replayed.frames:
    refinement, error = frame.refinement, frame.error_after()
    verdict = refinement.result.assessment.verdict.value
    off = '' if error is None else f', off by {1e3 * error.translation_m:.1f} mm'
    print(f'{refinement.stamp}: {verdict}, overlap {refinement.result.overlap:.2f}{off}')
