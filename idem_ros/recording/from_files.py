"""Cloud files as the messages of a recording; one cloud is in memory at a time."""

from functools import partial

import numpy as np

from idem_ros.core.geometry.se3 import inverse
from idem_ros.core.metric.measured_points import usual
from idem_ros.files.scan_folder import START, STEP
from idem_ros.files.timed_cloud import read_timed_cloud
from idem_ros.recording.messages import cloud_message, transform_message

FINEST_STEP = 1e-5  # of a cloud's extent
DELAY = 10**6  # [ns]: of equal log times no format keeps the order
FRAMES = 'target', 'source'


def file_messages(target, sources, guesses=(), truths=(), columns=None, point_times=None):
    """Yield (topic, log time, message) of one target and many sources, as in a live run.

    Args:
        target, sources: cloud files.
        guesses, truths: (4, 4) poses of each source in the target's frame, or none.
        columns, point_times: as `read_timed_cloud` takes them.
    """
    read = partial(read_timed_cloud, columns=columns, point_times=point_times)
    yield '/target', START, _message(read(target), START, 'target')
    for i, source in enumerate(sources):
        stamp = START + (i + 1) * STEP
        yield '/source', stamp, _message(read(source), stamp, 'source')
        for k, (topic, poses) in enumerate(_poses(guesses, truths), start=1):
            if len(poses):
                yield topic, stamp + k * DELAY, transform_message(poses[i], stamp, *FRAMES)


def folder_messages(folder, start='velocity', columns=None, point_times=None):
    """Yield (topic, log time, message) of a `ScanFolder`: each scan against the one before.

    A scan is a source at its stamp and a target half-way to the next one: whoever pairs them as
    they come has the scan before, and never the scan itself. The truth is the pose of a scan in
    the frame of the one before.

    Args:
        folder: `ScanFolder`.
        start: the guess. 'velocity': the true motion of the pair before (constant velocity),
            for the first pair the identity; 'identity': for every pair.
        columns, point_times: as `read_timed_cloud` takes them.
    """
    stamps = folder.stamps
    truths = [
        inverse(before) @ pose
        for before, pose in zip(folder.poses, folder.poses[1:], strict=False)
    ]
    guesses = [np.eye(4), *truths[:-1]] if start == 'velocity' else [np.eye(4)] * len(truths)
    for k, (scan, stamp) in enumerate(zip(folder.scans, stamps, strict=True)):
        gap = stamps[k + 1] - stamp if k + 1 < len(stamps) else STEP
        timed = read_timed_cloud(scan, columns, point_times, stamp if folder.are_stamped else 0)
        if k:
            yield '/source', stamp, _message(timed, stamp, 'source')
            for i, (topic, poses) in enumerate(_poses(guesses, truths), start=1):
                log_time = stamp + i * min(DELAY, gap // 8)
                yield topic, log_time, transform_message(poses[k - 1], stamp, *FRAMES)
        if k + 1 < len(stamps):
            yield '/target', stamp + gap // 2, _message(timed, stamp, 'target')


def _poses(guesses, truths):
    return ('/initial_guess', guesses), ('/ground_truth', truths)


def _message(timed, stamp, frame_id):
    points, times = timed
    columns = None if times is None else {'time': times}
    largest = np.abs(points).max()
    extent = np.ptp(usual(points - np.median(points, axis=0)), axis=0).max()
    # float32 unless it would blur the cloud: at map coordinates (1e6 m) its step is 6 cm
    is_fine = np.spacing(np.float32(largest)) <= FINEST_STEP * extent
    dtype = np.float32 if is_fine else np.float64
    return cloud_message(points, stamp, frame_id, dtype, columns)
