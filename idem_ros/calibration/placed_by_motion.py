"""Sensors of a rig that share no view with the others: placed by how they and the others moved."""

from dataclasses import replace

import numpy as np

from idem_ros.calibration.hand_eye import hand_eye
from idem_ros.calibration.relative_motions import steps_of
from idem_ros.core import Verdict
from idem_ros.core.several.joint_result import USABLE, CloudVerdict


def with_motion(found, names, strides, config):
    """Return a `Calibration` whose sensors that clouds do not tell of are placed by motion.

    Args:
        found: `Calibration` by clouds.
        names: of the sensors.
        strides: `Stride`s.
        config: `RegistrationConfig` that the rig was calibrated with.

    Returns:
        the `Calibration`, and a line about each sensor that it places so.
    """
    config = replace(config, voxel_size=found.voxel_size)
    rows, spans = [], []
    for stride in strides:  # their clouds are many: one at a time
        rows.append(steps_of(stride, config))
        spans.append((stride.at, stride.at + stride.seconds))
    sensors, notes = list(found.sensors), []
    for s, (name, is_usable) in enumerate(zip(names, found.usable, strict=True)):
        pairs = [(row[0], row[s]) for row in rows if row[0] is not None and row[s] is not None]
        if s == 0 or is_usable or not pairs:
            continue
        placed = hand_eye(pairs, found.starts[s], config.audit_tolerance, _share(spans))
        if placed.verdict.verdict in USABLE:
            notes.append(f'{name} is placed by its motion: {placed.verdict.reason}')
        else:
            both = f'{sensors[s].verdict.reason}; by its motion: {placed.verdict.reason}'
            placed = placed._replace(verdict=replace(placed.verdict, reason=both))
        sensors[s] = placed
    if notes and not found.usable[0]:
        p = max(each.verdict.p_aligned for each in sensors[1:])
        said = CloudVerdict(Verdict.ALIGNED, p, 'others are placed by its motion')
        sensors[0] = sensors[0]._replace(verdict=said)
    return replace(found, sensors=tuple(sensors)), notes


def _share(spans):
    """Return which share of [(begin, end)] no other one covers: what lies in two errs in both."""
    covered, latest = 0.0, -np.inf
    for begin, end in sorted(spans):
        covered += max(end - max(begin, latest), 0.0)
        latest = max(latest, end)
    total = sum(end - begin for begin, end in spans)
    return covered / total if total > 0.0 else 1.0
