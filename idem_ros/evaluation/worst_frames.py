"""The frames of a run that went worst, with pictures from the recording where it is found."""

import io
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib import rc_context

from idem_ros.core import IdemError
from idem_ros.core.se3 import transform_points
from idem_ros.evaluation import views
from idem_ros.evaluation.replay import pairs_of
from idem_ros.evaluation.report_plots import STYLE
from idem_ros.evaluation.settings import Settings, from_record
from idem_ros.pointcloud2 import read_points
from idem_ros.preprocessing import preprocess
from idem_ros.recording.reader import open_recording, recording_files
from idem_ros.recording.topics import find_topics

SHOWN = 10
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


def draw(runs, orders, progress=lambda steps, total: steps):
    """Return {(number of the run, frame): `Pictures`} of the frames in `orders`.

    Each recording is read once more, as far as the last frame that is wanted.

    Args:
        runs: [`Run`].
        orders: indices of frames for each run.
        progress: wraps the iteration over `total` frames to show how far it is.
    """
    wanted = {}
    for number, (run, order) in enumerate(zip(runs, orders, strict=True)):
        by_stamp = wanted.setdefault((recording_of(run.result), _clouds_of(run.result)), {})
        for i in order:
            stamp = run.result.frames[i]['stamp_ns']
            by_stamp.setdefault(stamp, []).append((number, int(i)))
    total = sum(len(order) for order in orders)
    return dict(progress(_drawn(runs, wanted), total))


def recording_of(result):
    """Return the path of a result's recording: as it was named, else beside the result."""
    named = Path(result.bag)
    beside = Path(result.path).parent / named.name
    return beside if not named.exists() and beside.exists() else named


def _clouds_of(result):
    """Return the topics of target and source as the result names them; None: find them."""
    topics = (result.made_by or {}).get('topics', {})
    return topics.get('target'), topics.get('source')


def _drawn(runs, wanted):
    for (recording, clouds), by_stamp in wanted.items():
        missing = {frame for frames in by_stamp.values() for frame in frames}
        note = f'no pictures: {recording} holds no such pair'
        try:
            for number in {number for number, _ in missing}:
                _require_same_size(recording, runs[number].result)
            for frame, pair in _found(recording, clouds, by_stamp, missing):
                missing.discard(frame)
                yield frame, _pictures(runs[frame[0]].result, frame[1], pair)
        except IdemError as error:
            note = f'no pictures: {error}'
        yield from ((frame, Pictures({}, note)) for frame in sorted(missing))


def _require_same_size(recording, result):
    """Tell at once that a recording has changed; its checksum would take reading all of it."""
    size = sum(file.stat().st_size for file in recording_files(recording))
    then = ((result.made_by or {}).get('input') or {}).get('size', size)
    if size != then:
        raise IdemError(f'{recording} has {size} bytes, and had {then} when it was replayed')


def _found(recording, clouds, by_stamp, missing):
    """Yield each wanted frame with its `Pair`; stop reading when none is missing."""
    with open_recording(recording) as opened:
        # whatever the guess was, the result says it: sources need not wait for one here
        topics = replace(find_topics(opened, *clouds), guess=None, truth=None)
        for pair in pairs_of(opened, topics):
            for frame in by_stamp.get(pair.stamp, ()):
                if frame in missing:
                    yield frame, pair
            if not missing:
                return


def _settings(result):
    try:
        return from_record({'parameters': (result.made_by or {}).get('parameters', {})})
    except IdemError:  # of another version: its clouds are shown, and judged by the defaults
        return Settings()


def _pictures(result, i, pair):
    frame, settings = result.frames[i], _settings(result)
    try:
        target, source = (
            preprocess(read_points(message).points, settings.preprocessing, is_target).points
            for message, is_target in ((pair.target, True), (pair.source, False))
        )
        T_guess, T_refined = (np.array(frame[name]) for name in ('T_guess', 'T_target_source'))
    except (IdemError, KeyError) as error:
        return Pictures({}, f'no pictures: {error}')
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
            images[key] = _png(views.draw_from_above(target, moved, *view, title))
        if not radius:
            return Pictures(images, 'no slice of q_tot: nothing was evaluated')
        slice_ = views.slice_around(target, source, T_refined, T_guess, radius, settings.config)
        offset = T_guess[:2, 3] - T_refined[:2, 3]
        images['q_tot'] = _png(views.draw_slice(slice_, offset))
    return Pictures(images)


def _png(figure):
    file = io.BytesIO()
    figure.savefig(file, format='png', dpi=110, metadata={'Software': None})
    return file.getvalue()
