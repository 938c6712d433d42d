"""`idem register`: refine the pose of one cloud file in the frame of another."""

from idem_ros.commands.inputs import CLOUD_KINDS, add_columns_option, points_of_file
from idem_ros.commands.options import add_config_options, config_from
from idem_ros.commands.output_names import require_outputs
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.terminal.command_line import FAILED, OK, UsageError


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'register',
        help='register one cloud file to another',
        description='Refine the pose of SOURCE in the frame of TARGET, from --guess, or without '
        'one from the identity: it does not find a pose from far off. The exit code is 0 where '
        'the verdict is aligned (with --assessment none: it converged), else 1.',
    )
    parser.add_argument('target', metavar='TARGET', help=f'cloud file ({CLOUD_KINDS})')
    parser.add_argument('source', metavar='SOURCE', help='cloud file')
    parser.add_argument(
        '--guess',
        metavar='FILE',
        help='pose of SOURCE to start from: a 4x4 or 3x4 matrix, or one TUM line '
        '(default: identity)',
    )
    parser.add_argument('--out', metavar='FILE', help='write the refined pose, a 4x4 matrix')
    parser.add_argument('--json', action='store_true', help='print the result as JSON')
    add_columns_option(parser)
    add_config_options(parser)
    add_config_options(parser, config_type=PreprocessingConfig)
    add_config_options(parser, config_type=PointTimeConfig)
    parser.set_defaults(run=run)


def run(args):
    """Register, print and write."""
    from idem_ros.core import Cloud, register
    from idem_ros.files.pose_file import read_pose, write_pose
    from idem_ros.refinement.diagnostics import motion_record

    config, preprocessing = config_from(args), config_from(args, PreprocessingConfig)
    if config.motion in ('guess', 'last'):
        raise UsageError(
            f'--motion is {config.motion}, which two files do not tell; solve finds it'
        )
    require_outputs(args, [('--out', args.out)], [args.target, args.source, args.guess])
    guess = read_pose(args.guess) if args.guess else None
    reading = args.columns, preprocessing, _point_times(args, config)
    target, _ = points_of_file(args.target, *reading, is_target=True)
    source, times = points_of_file(args.source, *reading)
    result = register(target, Cloud(source, times), guess, config)
    if args.out:
        write_pose(args.out, result.T_target_source)
    motion = motion_record(result, _reference(times, config))
    print(_json(args, result, motion) if args.json else _text(args, result, motion, source))
    return OK if result.is_usable else FAILED


def _point_times(args, config):
    """Return how times of points are read; None where no motion is undone."""
    return None if config.motion == 'none' else config_from(args, PointTimeConfig)


def _json(args, result, motion):
    import json

    from idem_ros.refinement.diagnostics import assessment_record

    return json.dumps(
        {
            'target': args.target,
            'source': args.source,
            'T_target_source': result.T_target_source.tolist(),
            'status': result.status.value,
            'converged': bool(result.converged),
            'iterations': result.iterations,
            'q_tot': result.q_tot,
            'q_mean': result.q_mean,
            'overlap': result.overlap,
            'overlap_source': result.overlap_source,
            'overlap_target': result.overlap_target,
            'radius': result.radius,
            'voxel_size': result.voxel_size,
            'information': result.information.tolist(),
            **assessment_record(result.assessment),
            **motion,
        },
        indent=2,
        allow_nan=False,
    )


def _text(args, result, motion, source):
    size, digits = result.voxel_size, _digits(result.T_target_source, source)
    rows = (
        ' '.join(f'{number:{digits + 7}.{digits}f}' for number in row)
        for row in result.T_target_source
    )
    return '\n'.join(
        [
            'T_target_source:',
            *rows,
            f'{result.status.value} after {result.iterations} iterations: '
            f'q_tot {result.q_tot:.6g} nat, q_mean {result.q_mean:.6g} nat, '
            f'overlap {result.overlap:.1%}, radius {result.radius:.6g}, '
            + ('points as given' if size is None else f'voxels of {size:.6g}'),
            *_motion_said(motion),
            *_said(result.assessment, result.T_target_source, source),
            *([] if args.guess else ['note: no --guess: the initial guess is the identity']),
        ]
    )


def _motion_said(motion):
    if 'motion_flaw' in motion:
        yield f'motion of the sweep not undone: {motion["motion_flaw"]}'
    if 'twist' in motion:
        twist = ' '.join(f'{number:.4g}' for number in motion['twist'])
        yield (
            f'motion of the sweep undone: half of the points moved by {motion["moved"]:.3g} m or '
            f'more; twist (m/s, rad/s): {twist}'
        )


def _reference(times, config):
    from idem_ros.core.geometry.undistortion import reference_time

    return 0.0 if times is None else reference_time(times, config.motion_reference)


def _digits(T_target_source, source):
    """Return how many decimals keep every point where it is to a micrometre in a kilometre.

    Nine, and one more for each power of ten that the farthest is beyond.
    """
    import numpy as np

    farthest = max(np.abs(source).max(), np.abs(T_target_source[:3, 3]).max())
    return 9 + int(np.clip(np.ceil(np.log10(max(farthest, 1e-300) / 1e3)), 0, 7))


def _said(assessment, T_target_source, source):
    import numpy as np

    from idem_ros.core.trust.verdict import Verdict
    from idem_ros.refinement.diagnostics import covariance_at

    if assessment is None:
        return
    p = 'unknown' if np.isnan(assessment.p_aligned) else f'{assessment.p_aligned:.3f}'
    yield f'{assessment.verdict.value} (p_aligned {p}): {assessment.reason}'
    if np.isfinite(assessment.swap_gap):
        yield f'target registered to source ends {assessment.swap_gap:.3g} m from it'
    if assessment.verdict not in (Verdict.ALIGNED, Verdict.DEGENERATE):
        return
    middle = np.median(source, axis=0)
    covariance = covariance_at(middle, assessment.covariance, T_target_source)
    lengths, radians = np.split(np.sqrt(covariance.diagonal().clip(0.0)), 2)
    yield (
        'standard deviations at the middle of the source: '
        f'{_deviations(("x", "y", "z"), lengths, 1.0)} in the unit of the '
        f'files, {_deviations(("rx", "ry", "rz"), radians, np.degrees(1.0))} deg'
    )


def _deviations(axes, sigmas, unit):
    return ' '.join(f'{axis} {unit * s:.3g}' for axis, s in zip(axes, sigmas, strict=True))
