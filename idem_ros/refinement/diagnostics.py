"""What diagnostics say of a refinement, in the same words live and in a replay."""

from math import isfinite

import numpy as np

from idem_ros.core import Status, Verdict
from idem_ros.core.geometry.se3 import skew

OK, WARN, ERROR, STALE = range(4)
WRONG = (Verdict.MISALIGNED, Verdict.SEPARATED, Verdict.OUTSIDE_BASIN)
REASONS = {
    'converged': 'converged: no step moves the source any more',
    'max_iterations': 'max_iterations steps of a stage did not suffice',
    'late': 'budget_ms was spent: this is the best until then',
    'audited': 'mode is audit: the guess was judged, not moved',
    'no_overlap': 'no point of one cloud has a neighbour in the other: the guess is too far off, '
    'or they do not overlap',
    'degenerate': 'the clouds do not hold every motion: see free_motions',
    'too_few_points': 'a cloud has fewer than five points, or voxels',
}


def refinement_values(refinement, dropped):
    """Return the {key: value} strings of a refinement; `dropped` counts inputs never refined."""
    result = refinement.result
    return {
        'q_tot': repr(float(result.q_tot)),
        'q_mean': repr(float(result.q_mean)),
        'overlap': repr(float(result.overlap)),
        'overlap_source': repr(float(result.overlap_source)),
        'overlap_target': repr(float(result.overlap_target)),
        'radius': repr(float(result.radius)),
        'voxel_size': repr(float(result.voxel_size or 0.0)),  # as the parameter has it: 0.0: none
        'iterations': str(result.iterations),
        'status': result.status.value,
        'reason': reason(result),
        'milliseconds': f'{refinement.time_ms:.3f}',
        **assessment_values(refinement.result.assessment, refinement.source_frame),
        **{f'{stage}_ms': f'{ms:.3f}' for stage, ms in refinement.times._asdict().items()},
        'points_target': str(refinement.points_target),
        'points_source': str(refinement.points_source),
        'cropped': str(refinement.cropped),
        'thinned': str(refinement.thinned),
        'dropped': str(dropped),
        **({'point_times': refinement.point_times} if refinement.point_times else {}),
        **motion_values(refinement),
        **({'lost': refinement.lost} if refinement.lost else {}),
    }


def assessment_record(said):
    """Return an `Assessment` as what JSON holds; None where unknown, {} for None."""
    if said is None:
        return {}
    return {
        'verdict': said.verdict.value,
        'verdict_reason': said.reason,
        'p_aligned': known(said.p_aligned),
        'free_motions': said.free,
        'basin': known(said.basin),
        'swap_gap': known(said.swap_gap),
        'covariance': said.covariance.tolist(),
    }


def covariance_at(point, covariance, T_target_source):
    """Move the (6, 6) covariance of an `Assessment` from the source's origin to a point of it.

    Far from the origin the errors of rotation and translation cancel; at a point they do not.

    Args:
        point: (3,) in the source frame.
        covariance: x y z rx ry rz, of the source frame's pose in the target frame.
        T_target_source: (4, 4).
    """
    moved = np.eye(6)
    moved[:3, 3:] = -skew(T_target_source[:3, :3] @ np.asarray(point, dtype=np.float64))
    return moved @ covariance @ moved.T


def is_registered(result):
    """Return whether a registration found its pose: by the verdict, or without one converged."""
    said = result.assessment
    return result.converged if said is None else said.verdict is Verdict.ALIGNED


def known(number):
    """Return a number that JSON can hold: None for None, and for what is not finite."""
    return None if number is None or not isfinite(number) else float(number)


def level(refinement):
    """Return 0 (OK), 1 (WARN) or 2 (ERROR): by the verdict, or without one by the status.

    An error is a result that is wrong; of the others that are not aligned nobody knows.
    """
    said = refinement.result.assessment
    if refinement.lost:
        return ERROR
    if said is None:
        return OK if refinement.result.converged else WARN
    if said.verdict is Verdict.ALIGNED:
        return OK
    return ERROR if said.verdict in WRONG else WARN


def assessment_values(said, source_frame):
    """Return what an `Assessment` says, by name; nothing where there is none."""
    if said is None:
        return {}
    sigmas = said.covariance.diagonal() ** 0.5
    return {
        'verdict': said.verdict.value,
        'verdict_reason': said.reason,
        'p_aligned': repr(float(said.p_aligned)),
        'free_motions': f'{said.free} of {source_frame}' if said.free else 'none',
        'basin': repr(float(said.basin)),
        'swap_gap': repr(said.swap_gap),
        'sigma_xyz_m': _in_a_row(sigmas[:3]),
        'sigma_xyz_rad': _in_a_row(sigmas[3:]),
    }


def _in_a_row(numbers):
    return ' '.join(f'{number:.3g}' for number in numbers)


def message_of(refinement):
    """Say in a sentence what is to be thought of a refinement: that it is lost, or its result."""
    return f'lost: {refinement.lost}' if refinement.lost else headline(refinement.result)


def headline(result):
    """Say in a sentence what is to be thought of a result: its verdict leads, or its status."""
    said = result.assessment
    return reason(result) if said is None else f'{said.verdict.value}: {said.reason}'


def reason(result):
    """Say in words why a result has its status; of a pose that was only judged, its verdict."""
    if result.status is Status.AUDITED and result.assessment is not None:
        return headline(result)
    return REASONS.get(result.status.value, result.status.value)


def motion_record(result, reference):
    """Return the motion of a result as what JSON holds; {} where none was to be undone.

    reference: the instant that its pose is of, in seconds after the stamp.
    """
    if result.motion_flaw:
        return {'motion_flaw': result.motion_flaw}
    if result.twist is None:
        return {}
    covariance = None if result.assessment is None else result.assessment.twist_covariance
    return {
        'twist': result.twist.tolist(),
        **({} if covariance is None else {'twist_covariance': covariance.tolist()}),
        'moved': float(result.moved),
        'reference': float(reference),
    }


def motion_values(refinement):
    """Return the same of a `Refinement` as the {key: value} strings of diagnostics."""
    record = motion_record(refinement.result, refinement.reference)
    if 'motion_flaw' in record:
        return {'motion': 'none', 'motion_flaw': record['motion_flaw']}
    if not record:
        return {}
    covariance = record.pop('twist_covariance', None)
    values = {
        'motion': 'undone',
        'twist': ' '.join(f'{number:.6g}' for number in record['twist']),
        'moved_m': f'{record["moved"]:.6g}',
        'reference_s': f'{record["reference"]:.6g}',
    }
    if covariance is not None:
        sigmas = np.sqrt(np.diag(covariance))
        values['sigma_twist'] = ' '.join(f'{sigma:.3g}' for sigma in sigmas)
    return values


def motion_said(moved, flaws):
    """Yield in a line or a few what was undone in refinements; nothing where nothing was to be.

    Args:
        moved: how far half of the points moved [m], of each in which it was undone.
        flaws: {why it was not: in how many}.
    """
    if moved:
        yield (
            f'motion of the sweep undone: {len(moved)}; half of the points moved by '
            f'{np.median(moved):.3g} m or more'
        )
    for reason, count in flaws.items():
        yield f'motion of the sweep not undone: {count}: {reason}'
