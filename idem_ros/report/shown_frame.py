"""A frame of a result to look at: its clouds found again, registered again as then."""

from idem_ros.core import IdemError
from idem_ros.replay.clouds_again import clouds_of
from idem_ros.report.runs import read_runs
from idem_ros.report.worst_frames import config_of, poses_of, worst
from idem_ros.viewer.scene import scene_of


class NothingToShow(IdemError):
    """A frame that a result or its recording does not hold."""


def shown_frame(path, number=None, under=None):
    """Return the `Scene` of one frame of a result.

    Args:
        path: what `idem replay` wrote.
        number: of the frame, from 0; None: the worst, see `worst`.
        under: the folder that the recording must lie in; None: anywhere.

    Raises:
        NothingToShow: there is no such frame, or its recording lacks the clouds.
        IdemError: the result or its recording cannot be read.
    """
    (run,) = read_runs([path])
    frames = run.result.frames
    if number is None:
        number = int(next(iter(worst(run)[0]), 0))
    if not 0 <= number < len(frames):
        raise NothingToShow(f'{path} has no frame {number}: it has {len(frames)}, from 0')
    frame = frames[number]
    if 'T_guess' not in frame:
        raise NothingToShow(f'{path} does not say where frame {number} started')
    for _, target, source in clouds_of(run.result, [number], under):
        title = f'{run.name}, frame {number}'
        T_guess, T_found = poses_of(frame)
        return scene_of(title, target, source, T_guess, config_of(run.result, frame), T_found)
    raise NothingToShow(f'{run.result.bag} holds no clouds of frame {number}')
