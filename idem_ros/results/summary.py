"""A replay in numbers: records for JSON, and a table to read; both are of the frames' records."""

from array import array
from collections import Counter
from dataclasses import asdict, dataclass, field

import numpy as np

from idem_ros.core import Status, Verdict
from idem_ros.recording.part import LOSSES
from idem_ros.refinement.diagnostics import assessment_record, known, motion_record, motion_said
from idem_ros.terminal.printable import printable
from idem_ros.trajectory.comparison_table import report

ERRORS = {'translation_error_m': 'translation_m', 'rotation_error_deg': 'rotation_deg'}
BEFORE_AND_AFTER = ('q_tot', *ERRORS)
NUMBERS = ('time_ms', *BEFORE_AND_AFTER, *(f'{name}_before' for name in BEFORE_AND_AFTER))
LEFT_OUT = {
    'dropped_nonfinite': 'because they are not finite',
    'dropped_zero': 'because they are exactly zero',
    'dropped_stray': 'because they are far from all the rest',
    'cropped': 'by range or crop box',
    'thinned': 'for max_points',
}
REASONS_SHOWN = 5


def json_record(replayed, made_by=None):
    """Return a `Replay` as what JSON holds; None where unknown.

    Args:
        replayed: `Replay`.
        made_by: how it was made, see `provenance.made_by`; None: it is not said.

    Returns:
        {'bag', 'method', 'made_by', 'frames', 'summary', 'notes', and of odometry 'sequence'};
        the frames are an iterator, see `record_text`
    """
    sequence = replayed.sequence
    return {
        'bag': replayed.path,
        'method': replayed.method,
        **({} if made_by is None else {'made_by': made_by}),
        'frames': map(frame_record, replayed.frames),
        'summary': summary(replayed),
        'notes': list(replayed.notes),
        **({} if sequence is None else {'sequence': asdict(sequence)}),
    }


def summary(replayed):
    """Return median and 90th percentile of the errors and of q_tot, and the milliseconds."""
    return _summed_up(replayed, _tally_of(replayed.frames))


def _summed_up(replayed, tally):
    return {
        'frames': len(replayed.frames),
        'refused': len(replayed.refused),
        'dropped': replayed.dropped,
        'unpaired': replayed.unpaired,
        'interrupted': replayed.interrupted,
        **{name: replayed.lost.get(name, 0) for name in LOSSES},
        'time_ms': percentiles(tally.numbers['time_ms'], median=50, p95=95),
        'voxel_sizes': dict(tally.voxel_sizes.most_common()),
        **{
            name: {
                when: percentiles(tally.numbers[each], median=50, p90=90)
                for when, each in (('before', f'{name}_before'), ('after', name))
            }
            for name in BEFORE_AND_AFTER
        },
    }


def table(replayed, audit=False):
    """Return the summary of a `Replay` as lines of text.

    Args:
        replayed: `Replay`.
        audit: whether the guesses were judged and nothing moved: then before is after.
    """
    tally, topics = _tally_of(replayed.frames), replayed.topics
    numbers = _summed_up(replayed, tally)
    lines = [
        printable(
            f'{replayed.path}: target {topics.target or "from a file"}, source {topics.source}, '
            f'guess {topics.guess or "none"}, truth {topics.truth or "none"}'
        ),
        '',
        *_header(replayed.method, audit),
    ]
    columns = ('after',) if audit else ('before', 'after')
    if topics.truth:
        lines.append(_row('translation error [m]', numbers['translation_error_m'], columns))
        lines.append(_row('rotation error [deg]', numbers['rotation_error_deg'], columns))
    lines.append(_row('q_tot [nat]', numbers['q_tot'], columns))
    lines += _voxels(tally.voxel_sizes)
    median, p95 = map(_number, numbers['time_ms'].values())
    lines.append(f'{"milliseconds":24}{"" if audit else " " * 24}{median}{p95} (p95)')
    if replayed.sequence and replayed.sequence.errors:
        lines += [
            '',
            'the trajectory, begun on the truth:',
            report(replayed.sequence.errors).rstrip(),
        ]
    return '\n'.join([*lines, '', *map(printable, _counts(replayed, tally, audit))])


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


def frame_record(frame):
    """Return a `Frame` as JSON holds it, see `result_schema.Frame`; None where unknown."""
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
        'q_tot': known(result.q_tot),
        'q_tot_before': known(refinement.q_tot_before),
        'q_mean': known(result.q_mean),
        'overlap': known(result.overlap),
        'overlap_source': known(result.overlap_source),
        'overlap_target': known(result.overlap_target),
        'radius': known(result.radius),
        'voxel_size': result.voxel_size,
        'time_ms': refinement.time_ms,
        'points_target': refinement.points_target,
        'points_source': refinement.points_source,
        'dropped_nonfinite': refinement.dropped_nonfinite,
        'dropped_zero': refinement.dropped_zero,
        'dropped_stray': refinement.dropped_stray,
        'cropped': refinement.cropped,
        'thinned': refinement.thinned,
    }
    record |= assessment_record(result.assessment) | motion_record(result, refinement.reference)
    if refinement.point_times:
        record['point_times'] = refinement.point_times
    if refinement.lost:
        record['lost'] = refinement.lost
    for key, attribute in ERRORS.items():
        record[key] = None if after is None else getattr(after, attribute)
        record[f'{key}_before'] = None if before is None else getattr(before, attribute)
    return record


@dataclass
class _Tally:
    """What records of frames come to; seven numbers of each are kept."""

    numbers: dict[str, array] = field(
        default_factory=lambda: {name: array('d') for name in NUMBERS}
    )
    voxel_sizes: Counter = field(default_factory=Counter)
    """{edge [m] in words: how many frames}."""
    registered: Counter = field(default_factory=Counter)
    """How what is registered ended; so `others`, the rest."""
    others: Counter = field(default_factory=Counter)
    verdicts: Counter = field(default_factory=Counter)
    left_out: Counter = field(default_factory=Counter)
    """Points, by why."""
    moved: array = field(default_factory=lambda: array('d'))
    """See `motion_said`; so `motion_flaws`."""
    motion_flaws: Counter = field(default_factory=Counter)

    def add(self, record):
        for name, values in self.numbers.items():
            value = record[name]
            values.append(np.nan if value is None else value)
        size, status, verdict = (record.get(name) for name in ('voxel_size', 'status', 'verdict'))
        self.voxel_sizes['points as given' if size is None else f'{size:.4g} m'] += 1
        converged = status == Status.CONVERGED.value
        if converged if verdict is None else verdict == Verdict.ALIGNED.value:
            self.registered[status] += 1
        else:  # what converged and is not aligned: in a wrong place, or too little to judge
            self.others[verdict if converged else status] += 1
        if verdict is not None:
            self.verdicts[verdict] += 1
        self.left_out.update({name: record[name] for name in LEFT_OUT})
        if 'moved' in record:
            self.moved.append(record['moved'])
        if 'motion_flaw' in record:
            self.motion_flaws[record['motion_flaw']] += 1


def _tally_of(frames):
    tally = _Tally()
    for frame in frames:
        tally.add(frame_record(frame))
    return tally


def percentiles(values, **percents):
    """Return {name: percentile} of what of (N,) numbers is finite; None where none is."""
    values = np.asarray(values)
    known = values[np.isfinite(values)]
    return {
        name: float(np.percentile(known, percent)) if len(known) else None
        for name, percent in percents.items()
    }


def _header(method, audit):
    percentiles = f'{"median":>12}{"p90":>12}'
    if audit:
        return [f'{method + ", audit":24}{percentiles}']
    return [f'{method:24}{"before":>12}{"":12}{"after":>12}', f'{"":24}{percentiles}{percentiles}']


def _row(name, values, columns):
    numbers = [values[when][which] for when in columns for which in ('median', 'p90')]
    return f'{name:24}' + ''.join(map(_number, numbers))


def _number(value):
    return f'{"-":>12}' if value is None else f'{value:12.4g}'


def _voxels(sizes):
    """Say the edge of the voxels; of several how many frames had each."""
    said = [
        each if len(sizes) == 1 else f'{each} ({count})' for each, count in sizes.most_common()
    ]
    return [f'{"voxels":24}    {", ".join(said)}'] if said else []


def _counts(replayed, tally, audit):
    """Say what became of every source, so that nothing is left out in silence."""
    if audit:
        yield _counted('judged, none moved', tally.registered + tally.others)
    else:
        yield _counted('registered', tally.registered)
        if tally.others:
            yield _counted('not registered', tally.others)
    if tally.verdicts:
        yield f'verdicts: {_listed(tally.verdicts)}'
    for name, why in LEFT_OUT.items():
        if count := tally.left_out[name]:
            yield f'points left out {why}: {count}'
    yield from motion_said(tally.moved, tally.motion_flaws)
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


def _counted(what, statuses):
    return f'{statuses.total()} {what}' + (f' ({_listed(statuses)})' if statuses else '')


def _listed(counts):
    return ', '.join(f'{count} {name}' for name, count in counts.most_common())
