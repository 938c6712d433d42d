"""What the node that watches a rig says of it; no ROS."""

from typing import NamedTuple

from idem_ros.calibration.rig_watch import Watched
from idem_ros.refinement.diagnostics import ERROR, OK, STALE, WARN


class Status(NamedTuple):
    """One status of the diagnostics."""

    level: int
    text: str
    values: dict[str, str]
    about: tuple[str, ...] = ()
    """The sensors that are not as they should be: when these change, an operator is told."""


def watched(found: list[Watched], flaws: list[str]) -> Status:
    """Return the status of an instant.

    Args:
        found: of each sensor but the reference.
        flaws: what was left out, a line each.
    """
    moved = [each for each in found if each.drift is not None and each.drift.has_moved]
    unknown = [each for each in found if each.drift is None]
    said = [f'{each.name} has moved by {each.drift}' for each in moved]
    said += [f'{each.name} cannot be told: {each.verdict.reason}' for each in unknown]
    about = tuple(each.name for each in (*moved, *unknown))
    values = {name: value for each in found for name, value in _values(each).items()}
    if not (about or flaws):
        return Status(OK, f'{len(found) + 1} sensors are where they were calibrated', values)
    return Status(WARN, '; '.join([*said, *flaws]), values, (*about, *flaws))


def failed(reason: str) -> Status:
    """Return the status of an instant of which nothing can be said."""
    return Status(ERROR, reason, {}, (reason,))


def waiting(text: str) -> Status:
    """Return the status while nothing comes."""
    return Status(STALE, text, {}, (text,))


def _values(each: Watched) -> dict[str, str]:
    values = {f'{each.name}: verdict': each.verdict.verdict.value}
    if each.drift is not None:
        values[f'{each.name}: moved_m'] = f'{each.drift.metres:.6g}'
        values[f'{each.name}: moved_deg'] = f'{each.drift.degrees:.6g}'
        values[f'{each.name}: sigmas'] = f'{each.drift.sigmas:.4g}'
    return values
