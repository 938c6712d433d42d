"""A fast drive, with the motion during each sweep solved for and left as it is.

python examples/sweeps.py bags/fast.mcap
"""

import argparse

import numpy as np

from idem_ros.core import RegistrationConfig
from idem_ros.replay.run import replay

parser = argparse.ArgumentParser(description='Refine a drive whose points have their times.')
parser.add_argument('recording', help='with the true poses, such as bags/fast.mcap')
recording = parser.parse_args().recording
for motion in ('none', 'solve'):
    config = RegistrationConfig(voxel_size=0.5, motion=motion)
    replayed = replay(recording, config)
    off = np.median([frame.error_after().translation_m for frame in replayed.frames])
    moved = np.median([frame.refinement.result.moved for frame in replayed.frames])
    print(f'motion {motion}: {1e3 * off:.1f} mm off; points moved by {moved:.2f} m')
    twist = replayed.frames[-1].refinement.result.twist
    if twist is not None:
        speed, turn = np.linalg.norm(twist[:3]), np.degrees(twist[5])
        print(f'the last sweep: {speed:.1f} m/s, turning at {turn:.0f} deg/s')
