"""How a registration ended."""

from enum import Enum


class Status(Enum):
    """How a registration ended."""

    CONVERGED = 'converged'
    MAX_ITERATIONS = 'max_iterations'
    LATE = 'late'
    NO_OVERLAP = 'no_overlap'
    DEGENERATE = 'degenerate'
    TOO_FEW_POINTS = 'too_few_points'
    AUDITED = 'audited'
