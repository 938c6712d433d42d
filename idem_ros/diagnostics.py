"""What diagnostics say of a refinement, in the same words live and in a replay."""

OK, WARN, ERROR = 0, 1, 2


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
        'milliseconds': f'{refinement.time_ms:.3f}',
        'points_target': str(refinement.points_target),
        'points_source': str(refinement.points_source),
        'cropped': str(refinement.cropped),
        'thinned': str(refinement.thinned),
        'dropped': str(dropped),
    }


def level(refinement):
    """Return 0 (OK) where the refinement converged, else 1 (WARN)."""
    return OK if refinement.result.converged else WARN
