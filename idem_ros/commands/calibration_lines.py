"""What `idem calibrate` prints: a table of the sensors and what is to be known, or JSON."""

import json

import numpy as np

from idem_ros.calibration.result_files import (
    calibrated_edges,
    publishers,
    record_of,
    sensors_table,
)
from idem_ros.calibration.rig_motion import is_still


def text(calibrated, twists, notes, folder):
    """Return the lines of a calibration for people.

    Args:
        calibrated: names of the sensors, their `Calibration`, the `FrameTree` it started from.
        twists: {instant: twist (6,) of the reference, or None}.
        notes: lines about what was left out, and whatever else there is to know.
        folder: that it was written to; None: to none.
    """
    names, found, tree = calibrated
    size = found.voxel_size
    voxels = 'points as given' if size is None else f'voxels of {size:.6g}'
    lines = [
        f'{len(found.instants)} instants, {voxels}; each sensor in the frame of {names[0]}:',
        '',
        sensors_table(names, found),
        *_reasons(names, found),
        *_motion(found, twists),
        *(f'note: {each}' for each in notes),
    ]
    if folder:
        lines.append(f'{folder}: extrinsics.yaml, joints.urdf, publish.sh, overlay.png')
    else:
        lines += publishers(calibrated_edges(names, found, tree))
    return '\n'.join(lines)


def _reasons(names, found):
    for name, each, usable in zip(names, found.sensors, found.usable, strict=True):
        if not usable:
            yield f'{name} is not calibrated: {each.verdict.reason}'


def _motion(found, twists):
    known = [twist for twist in twists.values() if twist is not None]
    moving = [twist for twist in known if not is_still(twist)]
    if moving:
        speed = max(np.linalg.norm(twist[:3]) for twist in moving)
        rate = max(np.degrees(np.linalg.norm(twist[3:])) for twist in moving)
        yield (
            f'the rig moved, by up to {speed:.2f} m/s and {rate:.1f} deg/s: its clouds were put '
            'to one time each'
        )
    elif known:
        yield 'the rig stood'
    known = [step.T_target_source for step in found.steps if step is not None]
    moved = [np.linalg.norm(T[:3, 3]) for T in known]
    if moved:
        yield (
            f'from instant to instant it went {sum(moved):.2f} m, by {len(moved)} of '
            f'{len(found.steps)} steps; of the others nothing is known'
        )


def record_text(calibrated, twists, notes, folder):
    """Return the same as JSON."""
    names, found, tree = calibrated
    edges = tree.with_poses(names, found.poses)
    record = {
        'reference': names[0],
        'is_usable': found.is_usable,
        'voxel_size': found.voxel_size,
        'sensors': {
            name: {'T_reference_sensor': each.pose.tolist(), **record_of(each)}
            for name, each in zip(names, found.sensors, strict=True)
        },
        'transforms': [
            {'parent': parent, 'child': child, 'T_parent_child': T.tolist()}
            for child, (parent, T) in edges.items()
        ],
        'instants': [
            {
                'name': each.instant.name,
                'poses': each.poses.tolist(),
                'verdicts': [said.verdict.value for said in each.verdicts],
                'twist': _listed(twists[each.instant.name]),
            }
            for each in found.instants
        ],
        'notes': notes,
        'folder': folder,
    }
    return json.dumps(record, indent=2, allow_nan=False)


def _listed(twist):
    return None if twist is None else twist.tolist()
