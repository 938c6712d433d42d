"""What diagnostics say of a refinement, in the same words live and in a replay."""

OK, WARN, ERROR, STALE = range(4)
REASONS = {
    'converged': 'converged: no step moves the source any more',
    'max_iterations': 'max_iterations steps of a stage did not suffice',
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
        'radius': repr(float(result.radius)),
        'iterations': str(result.iterations),
        'status': result.status.value,
        'reason': reason(result),
        'milliseconds': f'{refinement.time_ms:.3f}',
        **{f'{stage}_ms': f'{ms:.3f}' for stage, ms in refinement.times._asdict().items()},
        'points_target': str(refinement.points_target),
        'points_source': str(refinement.points_source),
        'cropped': str(refinement.cropped),
        'thinned': str(refinement.thinned),
        'dropped': str(dropped),
    }


def level(refinement):
    """Return 0 (OK) where the refinement converged, else 1 (WARN)."""
    return OK if refinement.result.converged else WARN


def reason(result):
    """Say in words why a result has its status."""
    return REASONS.get(result.status.value, result.status.value)
