"""The frames of a run that went worst, with pictures from the recording where it is found.

One of them is also shown by itself: its clouds found again, registered again as then.
"""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from idem_ros.core import IdemError
from idem_ros.refinement.debug_clouds import slice_around
from idem_ros.replay.clouds_again import clouds_of, settings_of
from idem_ros.replay.settings import IDEM
from idem_ros.report.runs import read_runs
from idem_ros.viewer.page import STYLE, saved_as
from idem_ros.viewer.scene import CloudsView, scene_of, seen_again

SHOWN = 10
MOST_POINTS, MOST_OF_ALL = 10_000, 200_000  # of a cloud in 3D, and of all on the page
STEPS = 17  # of a slice of q_tot, along each axis
THREADS = 2
SIZE = (4.1, 3.7)  # [in]
BESIDE, BAR = (0.16, 0.13, 0.62, 0.8), (0.81, 0.2, 0.03, 0.66)
CONVERGED = 'converged'


@dataclass(frozen=True)
class Pictures:
    """What a frame looked like, or why that cannot be shown."""

    images: dict[str, bytes]
    """PNG by what it shows: 'q_tot'."""
    note: str = ''
    view: CloudsView | None = None


def worst(run):
    """Return the indices of the worst frames of a run, the worst first, and by what.

    By translation error; where no frame has one, those that did not converge come first, then
    the greatest q_mean, then the least overlap.

    Returns:
        (indices, sentence)
    """
    error = run.values('translation_error_m')
    if np.isfinite(error).any():
        order = np.argsort(-error, kind='stable')[: min(SHOWN, np.isfinite(error).sum())]
        unknown = int(np.isnan(error).sum())
        left_out = f'; {unknown} frames without ground truth are not ranked' if unknown else ''
        return order, f'by translation error{left_out}'
    converged = np.array([frame.get('status') == CONVERGED for frame in run.result.frames], bool)
    q_mean = np.nan_to_num(run.values('q_mean'), nan=-np.inf)
    overlap = np.nan_to_num(run.values('overlap'), nan=np.inf)
    order = np.lexsort((overlap, -q_mean, converged))[:SHOWN]
    return order, (
        'without ground truth: first what did not converge, then the greatest q_mean '
        '(the clouds disagree most), then the least overlap'
    )


def draw(runs, orders, progress=lambda steps, total: steps, under=None):
    """Return {(number of the run, frame): `Pictures`} of the frames in `orders`.

    The recording of each run is read once more, as far as the last frame that is wanted.

    Args:
        runs: [`Run`].
        orders: indices of frames for each run.
        progress: wraps the iteration over `total` frames to show how far it is.
        under: the folder that recordings must lie in; None: anywhere.
    """
    total = sum(len(order) for order in orders)
    most = min(MOST_POINTS, MOST_OF_ALL // max(2 * total, 1))
    return dict(progress(_drawn(runs, orders, under, most), total))


def config_of(result, frame):
    """Return the `RegistrationConfig` to see a frame with: a pose of others is audited."""
    config = replace(settings_of(result).config, threads=THREADS)  # the same for any number
    if result.record.get('method', IDEM) != IDEM:
        config = replace(config, mode='audit')
    if 'voxel_size' in frame:  # what "auto" was
        config = replace(config, voxel_size=frame['voxel_size'])
    return config


def poses_of(frame):
    """Return the guess of a frame and where it ended, (4, 4) each; None: unknown."""
    poses = (frame.get(name) for name in ('T_guess', 'T_target_source'))
    return [None if pose is None else np.array(pose) for pose in poses]


def draw_slice(slice_, guess):
    """Return a figure of a `QTotSlice`; `guess` is the (2,) shift of the initial guess."""
    figure = Figure(SIZE)  # fixed boxes: to lay out each figure takes as long as to draw it
    axes = figure.add_axes(BESIDE)
    axes.set_title(f'voxels {slice_.voxel_size:.3g} m, radius {slice_.radius:.3g} m')
    axes.set_aspect('equal')
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(5))
    image = axes.pcolormesh(slice_.shifts, slice_.shifts, slice_.q_tot, shading='gouraud')
    axes.plot(0, 0, 'o', mfc='none', mec='white', ms=9, label='refined')
    if np.abs(guess).max() <= slice_.shifts[-1]:
        axes.plot(*guess, 'x', color='white', ms=8, label='guess')
    axes.set(xlabel='shift in x [m]', ylabel='shift in y [m]')
    axes.legend(loc='upper right', facecolor='#444444', labelcolor='white')
    figure.colorbar(image, cax=figure.add_axes(BAR), label='q_tot [nat]')
    return figure


def _drawn(runs, orders, under, most):
    for number, (run, order) in enumerate(zip(runs, orders, strict=True)):
        missing = {int(i) for i in order}
        note = f'no pictures: {run.result.bag} holds no such pair'
        try:
            for i, target, source in clouds_of(run.result, order, under):
                missing.discard(i)
                yield (number, i), _pictures(run.result, i, target, source, most)
        except IdemError as error:
            note = f'no pictures: {error}'
        yield from (((number, i), Pictures({}, note)) for i in sorted(missing))


def _pictures(result, i, target, source, most):
    frame = result.frames[i]
    T_guess, T_refined = poses_of(frame)
    if T_guess is None or T_refined is None:
        return Pictures({}, 'no pictures: the result does not say the poses')
    config = config_of(result, frame)
    view, _ = seen_again(target, source, T_guess, config, most, T_refined)
    radius = frame.get('radius') or 0.0
    if not radius:
        return Pictures({}, 'no slice of q_tot: nothing was evaluated', view)
    slice_ = slice_around(target, source, T_refined, T_guess, radius, config, STEPS)
    with rc_context(STYLE):
        figure = draw_slice(slice_, T_guess[:2, 3] - T_refined[:2, 3])
        return Pictures({'q_tot': saved_as('png', figure, 110)}, view=view)


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
