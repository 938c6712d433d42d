"""A replay in numbers: records for JSON, and a table to read."""

from collections import Counter
from dataclasses import asdict

import numpy as np

from idem_ros.diagnostics import assessment_record
from idem_ros.evaluation.trajectory_report import report

ERRORS = {'translation_error_m': 'translation_m', 'rotation_error_deg': 'rotation_deg'}
REASONS_SHOWN = 5


def json_record(replayed, made_by=None):
    """Return a `Replay` as what JSON holds; None where unknown.

    Args:
        replayed: `Replay`.
        made_by: how it was made, see `provenance.made_by`; None: it is not said.

    Returns:
        {'bag', 'method', 'made_by', 'frames', 'summary', 'notes', and of odometry 'sequence'}
    """
    sequence = replayed.sequence
    return {
        'bag': replayed.path,
        'method': replayed.method,
        **({} if made_by is None else {'made_by': made_by}),
        'frames': [_frame_record(frame) for frame in replayed.frames],
        'summary': summary(replayed),
        'notes': list(replayed.notes),
        **({} if sequence is None else {'sequence': asdict(sequence)}),
    }


def summary(replayed):
    """Return median and 90th percentile of the errors and of q_tot, and the milliseconds."""
    frames = replayed.frames
    result = {
        'frames': len(frames),
        'refused': len(replayed.refused),
        'dropped': replayed.dropped,
        'unpaired': replayed.unpaired,
        'interrupted': replayed.interrupted,
        'time_ms': _percentiles([f.refinement.time_ms for f in frames], median=50, p95=95),
        'q_tot': _before_and_after(
            [f.refinement.q_tot_before for f in frames],
            [f.refinement.result.q_tot for f in frames],
        ),
    }
    with_truth = [frame for frame in frames if frame.truth is not None]
    for key, attribute in ERRORS.items():
        result[key] = _before_and_after(
            [getattr(frame.error_before(), attribute) for frame in with_truth],
            [getattr(frame.error_after(), attribute) for frame in with_truth],
        )
    return result


def table(replayed):
    """Return the summary of a `Replay` as lines of text."""
    numbers = summary(replayed)
    topics = replayed.topics
    lines = [
        f'{replayed.path}: target {topics.target}, source {topics.source}, '
        f'guess {topics.guess or "none"}, truth {topics.truth or "none"}',
        '',
        f'{replayed.method:24}{"before":>12}{"":12}{"after":>12}',
        f'{"":24}{"median":>12}{"p90":>12}{"median":>12}{"p90":>12}',
    ]
    if topics.truth:
        lines.append(_row('translation error [m]', numbers['translation_error_m']))
        lines.append(_row('rotation error [deg]', numbers['rotation_error_deg']))
    lines.append(_row('q_tot [nat]', numbers['q_tot']))
    times = numbers['time_ms']
    lines.append(
        f'{"milliseconds":24}{"":24}{_number(times["median"])}{_number(times["p95"])} (p95)'
    )
    if replayed.sequence and replayed.sequence.errors:
        lines += [
            '',
            'the trajectory, begun on the truth:',
            report(replayed.sequence.errors).rstrip(),
        ]
    return '\n'.join([*lines, '', *_counts(replayed)])


def why_nothing(replayed):
    """Say why a `Replay` has no frames."""
    reasons = [refusal.reason for refusal in replayed.refused[:1]]
    if replayed.unpaired:
        reasons.append(
            f'{replayed.unpaired} sources wait for {replayed.unpaired_for} '
            f'({replayed.unpaired_why})'
        )
    reasons.extend(replayed.notes)
    return f'no source of {replayed.path} could be refined: {"; ".join(reasons) or "it has none"}'


def _frame_record(frame):
    refinement, result = frame.refinement, frame.refinement.result
    before, after = frame.error_before(), frame.error_after()
    record = {
        'stamp': refinement.stamp / 1e9,
        'stamp_ns': refinement.stamp,
        'target_frame': refinement.target_frame,
        'source_frame': refinement.source_frame,
        'T_target_source': result.T_target_source.tolist(),
        'T_guess': refinement.T_guess.tolist(),
        'status': result.status.value,
        'iterations': result.iterations,
        'q_tot': _known(result.q_tot),
        'q_tot_before': _known(refinement.q_tot_before),
        'q_mean': _known(result.q_mean),
        'overlap': _known(result.overlap),
        'radius': _known(result.radius),
        'time_ms': refinement.time_ms,
        'points_target': refinement.points_target,
        'points_source': refinement.points_source,
        'dropped_nonfinite': refinement.dropped_nonfinite,
        'dropped_zero': refinement.dropped_zero,
        'cropped': refinement.cropped,
        'thinned': refinement.thinned,
    }
    record |= assessment_record(result.assessment)
    for key, attribute in ERRORS.items():
        record[key] = None if after is None else getattr(after, attribute)
        record[f'{key}_before'] = None if before is None else getattr(before, attribute)
    return record


def _before_and_after(before, after):
    return {
        'before': _percentiles(before, median=50, p90=90),
        'after': _percentiles(after, median=50, p90=90),
    }


def _percentiles(values, **percentiles):
    known = [value for value in values if np.isfinite(value)]
    return {
        name: float(np.percentile(known, percent)) if known else None
        for name, percent in percentiles.items()
    }


def _known(value):
    """Return a number that JSON can hold: None for what is not finite."""
    return float(value) if np.isfinite(value) else None


def _row(name, values):
    numbers = [values[when][which] for when in ('before', 'after') for which in ('median', 'p90')]
    return f'{name:24}' + ''.join(map(_number, numbers))


def _number(value):
    return f'{"-":>12}' if value is None else f'{value:12.4g}'


def _counts(replayed):
    """Say what became of every source, so that nothing is left out in silence."""
    statuses = Counter(f.refinement.result.status.value for f in replayed.frames)
    how = ', '.join(f'{count} {status}' for status, count in statuses.most_common())
    yield f'{len(replayed.frames)} refined' + (f' ({how})' if how else '')
    said = [f.refinement.result.assessment for f in replayed.frames]
    verdicts = Counter(each.verdict.value for each in said if each)
    if verdicts:
        yield f'verdicts: {", ".join(f"{count} {name}" for name, count in verdicts.most_common())}'
    points = {
        'because they are not finite': 'dropped_nonfinite',
        'because they are exactly zero': 'dropped_zero',
        'by range or crop box': 'cropped',
        'for max_points': 'thinned',
    }
    for why, name in points.items():
        if count := sum(getattr(frame.refinement, name) for frame in replayed.frames):
            yield f'points left out {why}: {count}'
    if replayed.refused:
        yield f'{len(replayed.refused)} refused:'
        reasons = Counter(refusal.reason for refusal in replayed.refused).most_common()
        yield from (f'  {count} x {reason}' for reason, count in reasons[:REASONS_SHOWN])
        if len(reasons) > REASONS_SHOWN:
            yield f'  and {len(reasons) - REASONS_SHOWN} other reasons'
    if replayed.dropped:
        yield f'{replayed.dropped} dropped: newer sources came before their target or guess'
    if replayed.unpaired:
        yield f'{replayed.unpaired} unpaired at the end: no {replayed.unpaired_for} for them'
    yield from (f'note: {note}' for note in replayed.notes)
