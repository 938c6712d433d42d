"""The frames of a run that went worst, with pictures from the recording where it is found."""

from dataclasses import dataclass, replace

import numpy as np
from matplotlib import rc_context

from idem_ros.core import IdemError
from idem_ros.core.geometry.se3 import transform_points
from idem_ros.refinement.q_tot_slice import slice_around
from idem_ros.replay.clouds_again import clouds_of, settings_of
from idem_ros.report import views
from idem_ros.report.plots import STYLE

SHOWN = 10
STEPS = 17  # of a slice of q_tot, along each axis
THREADS = 2
CONVERGED = 'converged'


@dataclass(frozen=True)
class Pictures:
    """What a frame looked like, or why that cannot be shown."""

    images: dict[str, bytes]
    """PNG by what it shows: 'before', 'after', 'q_tot'."""
    note: str = ''


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
    return dict(progress(_drawn(runs, orders, under), total))


def _drawn(runs, orders, under):
    for number, (run, order) in enumerate(zip(runs, orders, strict=True)):
        missing = {int(i) for i in order}
        note = f'no pictures: {run.result.bag} holds no such pair'
        try:
            for i, target, source in clouds_of(run.result, order, under):
                missing.discard(i)
                yield (number, i), _pictures(run.result, i, target, source)
        except IdemError as error:
            note = f'no pictures: {error}'
        yield from (((number, i), Pictures({}, note)) for i in sorted(missing))


def _pictures(result, i, target, source):
    frame = result.frames[i]
    if not ('T_guess' in frame and 'T_target_source' in frame):
        return Pictures({}, 'no pictures: the result does not say the poses')
    T_guess, T_refined = (np.array(frame[name]) for name in ('T_guess', 'T_target_source'))
    radius = frame.get('radius') or 0.0
    refined = transform_points(T_refined, source)
    view = views.seen_from_above(refined, radius)
    images = {}
    with rc_context(STYLE):
        guessed = transform_points(T_guess, source)
        for key, moved, title in (
            ('before', guessed, 'at the initial guess, from above'),
            ('after', refined, 'refined, from above'),
        ):
            images[key] = views.png(views.draw_from_above(target, moved, *view, title))
        if not radius:
            return Pictures(images, 'no slice of q_tot: nothing was evaluated')
        config = replace(settings_of(result).config, threads=THREADS)  # the same for any number
        if 'voxel_size' in frame:  # what "auto" was
            config = replace(config, voxel_size=frame['voxel_size'])
        slice_ = slice_around(target, source, T_refined, T_guess, radius, config, STEPS)
        offset = T_guess[:2, 3] - T_refined[:2, 3]
        images['q_tot'] = views.png(views.draw_slice(slice_, offset))
    return Pictures(images)
