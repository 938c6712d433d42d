"""A calibration as what robots read: YAML, URDF, static_transform_publisher; and in words."""

import shlex

import numpy as np
import yaml

from idem_ros.calibration.frame_tree import bare
from idem_ros.calibration.fusion import drift_of
from idem_ros.calibration.urdf import joint_text, roll_pitch_yaw
from idem_ros.core.geometry import se3
from idem_ros.files.atomic_file import filling
from idem_ros.messages.transform_message import translation_and_quaternion
from idem_ros.refinement.diagnostics import known
from idem_ros.terminal.markdown import table

YAML, URDF, PUBLISHERS, PICTURE = 'extrinsics.yaml', 'joints.urdf', 'publish.sh', 'overlay.png'
NO_JOINT = '<!-- no sensor could be calibrated -->\n'
DIGITS = 9


def write_calibration(folder, names, found, tree):
    """Write a new folder: YAML, URDF joints, publishers, and a picture of all clouds overlaid.

    Args:
        folder: to be made; nothing, or an empty folder, may stand there.
        names: of the sensors.
        found: `Calibration`.
        tree: `FrameTree` that it started from: who is whose parent.

    Raises:
        UnwritableFile: it cannot be made; then nothing is.
    """
    from idem_ros.report.clouds_picture import draw_clouds  # who draws nothing needs no matplotlib

    edges = calibrated_edges(names, found, tree)
    with filling(folder) as place:
        (place / YAML).write_text(yaml_text(names, found))
        joints = ''.join(joint_text(p, c, T) for c, (p, T) in edges.items())
        (place / URDF).write_text(joints or NO_JOINT)
        (place / PUBLISHERS).write_text('#!/bin/sh\n' + '\n'.join([*publishers(edges), 'wait\n']))
        shown = found.instants[0]
        clouds = [cloud for cloud in shown.instant.clouds if cloud is not None]
        heard = shown.instant.heard
        points = [cloud.points + cloud.origin for cloud in clouds]
        before, after = (np.array(poses)[heard] for poses in (found.starts, found.poses))
        draw_clouds(place / PICTURE, points, before, after)


def calibrated_edges(names, found, tree):
    """Return {frame: (parent, (4, 4) in it)} of the sensors whose verdict lets them be used."""
    usable = {name for name, is_usable in zip(names, found.usable, strict=True) if is_usable}
    edges = tree.with_poses(names, found.poses)
    return {name: edge for name, edge in edges.items() if name in usable}


def publishers(edges):
    """Return a line of static_transform_publisher for each {child: (parent, (4, 4))}."""
    lines = []
    for child, (parent, T) in edges.items():
        (x, y, z), (qx, qy, qz, qw) = translation_and_quaternion(T)
        numbers = {'x': x, 'y': y, 'z': z, 'qx': qx, 'qy': qy, 'qz': qz, 'qw': qw}
        words = ' '.join(f'--{name} {_rounded(value)!r}' for name, value in numbers.items())
        lines.append(
            f'ros2 run tf2_ros static_transform_publisher {words} '
            f'--frame-id {shlex.quote(parent)} --child-frame-id {shlex.quote(child)} &'
        )
    return lines


def yaml_text(names, found):
    """Return the YAML, which `--start` reads again: each sensor in the frame of the first."""
    sensors = {
        name: {'parent': names[0], **record_of(each)}
        for name, each in zip(names, found.sensors, strict=True)
    }
    head = '# Each sensor in the frame of its parent: m, quaternion x y z w; covariance of\n'
    head += '# x y z rx ry rz, m and rad, in the axes of the parent, about the sensor.\n'
    return head + _yaml({'reference': names[0], 'sensors': sensors})


def places_text(edges):
    """Return the YAML of {frame: (parent, (4, 4) in it)}, which `--start` reads, too."""
    sensors = {child: {'parent': parent, **_place(T)} for child, (parent, T) in edges.items()}
    return '# Each sensor in the frame of its parent: m, quaternion x y z w.\n' + _yaml(
        {'sensors': sensors}
    )


def _yaml(content):
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=96)


def record_of(each):
    """Return a `Fused` as plain values."""
    p = each.verdict.p_aligned
    spread = each.spread and {'m': each.spread[0], 'deg': each.spread[1]}
    return {
        **_place(each.pose),
        'verdict': each.verdict.verdict.value,
        'p_aligned': known(p),
        'reason': each.verdict.reason,
        'by': each.by,
        'instants': len(each.agreeing),
        'spread': spread,
        'covariance': each.covariance.tolist(),
    }


def _place(T):
    xyz, quaternion = translation_and_quaternion(T)
    return {
        'xyz': [_rounded(value) for value in xyz],
        'quaternion': [_rounded(value) for value in quaternion],
    }


def sensors_table(names, found):
    """Return the Markdown table of the sensors: where they are, how sure, and by what."""
    heads = ('sensor', 'x [m]', 'y', 'z', 'roll [deg]', 'pitch', 'yaw', 'sigma [mm]', '[deg]')
    heads += ('spread [mm]', '[deg]', 'from start', 'verdict', 'p')
    rows = [
        _row(name, each, start)
        for name, each, start in zip(names, found.sensors, found.starts, strict=True)
    ]
    return table(heads, rows, left=1)


def moved(names, found, tree):
    """Yield a line about each sensor that is not where an earlier calibration had it.

    That is, by more than three standard deviations of both, in the frame of the same reference.
    """
    for name, each, start in zip(names[1:], found.sensors[1:], found.starts[1:], strict=True):
        before = tree.covariances.get(bare(name))
        if before is None or not each.agreeing or tree.parent_of(name) != bare(names[0]):
            continue
        drift = drift_of(name, each, start, before)
        if drift.has_moved:
            yield f'{name} has moved by {drift} of both calibrations, since {tree.source}'


def beside_truth(names, found, truth):
    """Yield a line about how far each sensor is from {name: (4, 4)} where it truly is."""
    for name, each in zip(names, found.sensors, strict=True):
        if name in truth and each.agreeing:
            off = drift_of(name, each, truth[name], np.zeros((6, 6)))
            yield f'{name} is {off} from where the recording says that it truly is'


def _row(name, each, start):
    place = [f'{number:.4f}' for number in each.pose[:3, 3]]
    turn = [f'{np.degrees(number):.3f}' for number in roll_pitch_yaw(each.pose)]
    sigma = np.sqrt(each.covariance.diagonal())
    sure = f'{1e3 * sigma[:3].max():.3g}', f'{np.degrees(sigma[3:].max()):.2g}'
    spread = ('-', '-')
    if each.spread is not None:
        spread = f'{1e3 * each.spread[0]:.3g}', f'{each.spread[1]:.2g}'
    moved = np.linalg.norm(each.pose[:3, 3] - start[:3, 3])
    degrees = np.degrees(se3.rotation_angle(se3.inverse(start) @ each.pose))
    from_start = f'{moved:.3f} m, {degrees:.2f} deg'
    said = each.verdict
    judged = said.verdict.value, f'{said.p_aligned:.2f}'
    return (name, *place, *turn, *sure, *spread, from_start, *judged)


def _rounded(value):
    return round(float(value), DIGITS) + 0.0
