"""What a result tells of the motion of its sweep, in numbers and in words."""

import numpy as np


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
