"""`idem align`: the poses of several cloud files at once, in one frame."""

from pathlib import Path

from idem_ros.commands.inputs import CLOUD_KINDS, add_columns_option, points_of_file
from idem_ros.commands.options import OF_PAIRS, add_config_options, config_from
from idem_ros.commands.output_names import (
    require_ending,
    require_matplotlib,
    require_outputs,
)
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.terminal.command_line import FAILED, OK

WITHOUT = ('motion', 'motion_reference')


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'align',
        help='register several cloud files to one another at once',
        description='Refine the poses of two clouds or more in one frame, all at once, from '
        '--poses, or without them from where the clouds are. The exit code is 0 where every '
        'cloud is aligned and they hang together (with --assessment none: it converged), else 1.',
    )
    parser.add_argument(
        'clouds', metavar='CLOUD', nargs='+', help=f'cloud files ({CLOUD_KINDS}), two at least'
    )
    parser.add_argument(
        '--poses',
        metavar='FILE',
        help='poses to start from, one a cloud in their order: TUM lines, 4x4 matrices, or the '
        'vertices of a .g2o (default: identities)',
    )
    parser.add_argument(
        '--held',
        metavar='N',
        type=int,
        nargs='+',
        help='clouds whose poses stay, by their place in the order from 0 (default: 0)',
    )
    parser.add_argument(
        '--out',
        metavar='FILE',
        help='write the poses: a .g2o with an edge for each pair that agrees, a .mat of 4x4 '
        'matrices, a .tum or .txt of TUM lines with the number of the cloud as stamp',
    )
    parser.add_argument('--picture', metavar='FILE', help='write a .png of before and after')
    parser.add_argument('--json', action='store_true', help='print the result as JSON')
    add_columns_option(parser)
    add_config_options(parser, without=WITHOUT)
    add_config_options(parser, OF_PAIRS, PreprocessingConfig)
    parser.set_defaults(run=run)


def run(args):
    """Register, print and write."""
    from dataclasses import replace

    from idem_ros.core import register_all
    from idem_ros.files.cloud_list import clouds_of_files
    from idem_ros.files.pose_file import read_poses, write_poses

    config, preprocessing = config_from(args), config_from(args, PreprocessingConfig)
    _check_outputs(args)
    starts = read_poses(args.poses, len(args.clouds)) if args.poses else None

    def read(file):
        """Return the points of a file that take part."""
        return points_of_file(file, args.columns, preprocessing)[0]

    clouds, size = clouds_of_files(args.clouds, read, config)
    config = config if size is None else replace(config, voxel_size=None)
    result = register_all(clouds, starts, config, held=args.held)
    if args.out:
        edges = [(e.i, e.j, e.covariance) for e in result.edges if e.covariance is not None]
        write_poses(args.out, result.poses, edges)
    if args.picture:
        _draw(args.picture, clouds, starts, result.poses)
    size = result.voxel_size if size is None else size
    said = _json if args.json else _text
    print(said(args, result, clouds, size))
    return OK if result.is_usable else FAILED


def _draw(path, clouds, starts, poses):
    import numpy as np

    from idem_ros.report.clouds_picture import draw_clouds

    points = [cloud.points + cloud.origin for cloud in clouds]
    before = np.tile(np.eye(4), (len(clouds), 1, 1)) if starts is None else starts
    draw_clouds(path, points, before, poses)


def _check_outputs(args):
    from idem_ros.files.pose_file import SUFFIXES

    if args.out:
        require_ending('--out', args.out, SUFFIXES)
    if args.picture:
        require_ending('--picture', args.picture, ['.png'])
        require_matplotlib('the pictures')
    outputs = ('--out', args.out), ('--picture', args.picture)
    require_outputs(args, outputs, [*args.clouds, args.poses])


def closures(result, clouds):
    """Return, of each edge, how far the two alone would have its second cloud from its pose.

    [deg] and [m], of the cloud's middle; None of an edge that was not audited. The poses
    themselves close around every loop.
    """
    import numpy as np

    found = []
    for edge in result.edges:
        if edge.gap is None:
            found.append(None)
            continue
        move, turn = np.split(edge.gap, 2)
        R = result.poses[edge.i, :3, :3].T @ result.poses[edge.j, :3, :3]
        off = move + np.cross(turn, R @ clouds[edge.j].origin)
        found.append((float(np.degrees(np.linalg.norm(turn))), float(np.linalg.norm(off))))
    return found


def _text(args, result, clouds, size):
    from idem_ros.terminal.markdown import table

    voxels = 'points as given' if size is None else f'voxels of {size:.6g}'
    lines = [
        f'{result.status.value} after {result.iterations} iterations: q_tot {result.q_tot:.6g} '
        f'nat, radius {result.radius:.6g}, {voxels}',
        '',
        table(
            ('cloud', 'file', 'x', 'y', 'z', 'verdict', 'p', 'why'),
            list(_cloud_rows(args, result)),
            left=2,
        ),
        table(
            ('edge', 'overlap', 'q_mean', 'verdict', 'closure [deg]', 'closure [m]'),
            list(_edge_rows(result, closures(result, clouds))),
        ),
    ]
    if not result.is_connected:
        parts = ' and '.join(' '.join(map(str, part)) for part in result.parts)
        lines.append(f'the clouds fall into parts that do not meet: {parts}')
    if not args.poses:
        lines.append('note: no --poses: the clouds start from where they are')
    return '\n'.join(lines)


def _cloud_rows(args, result):
    for k, (file, pose) in enumerate(zip(args.clouds, result.poses, strict=True)):
        place = [f'{number:.6g}' for number in pose[:3, 3]]
        said = result.verdicts[k] if result.verdicts else None
        judged = (said.verdict.value, f'{said.p_aligned:.3f}', said.reason) if said else '---'
        yield (k, Path(file).name, *place, *judged)


def _edge_rows(result, gaps):
    for edge, gap in zip(result.edges, gaps, strict=True):
        verdict = edge.verdict.value if edge.verdict else '-'
        closure = ('-', '-') if gap is None else (f'{gap[0]:.3g}', f'{gap[1]:.3g}')
        yield (
            f'{edge.i}-{edge.j}',
            f'{edge.overlap:.1%}',
            f'{edge.q_mean:.3g}',
            verdict,
            *closure,
        )


def _json(args, result, clouds, size):
    import json

    from idem_ros.refinement.diagnostics import known

    gaps = closures(result, clouds)
    record = {
        'clouds': args.clouds,
        'poses': result.poses.tolist(),
        'covariance': result.covariance.tolist(),
        'held': list(result.held),
        'status': result.status.value,
        'is_usable': result.is_usable,
        'iterations': result.iterations,
        'q_tot': result.q_tot,
        'q_means': list(result.q_means),
        'radius': result.radius,
        'voxel_size': size,
        'parts': [list(part) for part in result.parts],
        'verdicts': [
            {'verdict': said.verdict.value, 'p_aligned': known(said.p_aligned)}
            | {'reason': said.reason}
            for said in result.verdicts
        ],
        'edges': [_edge_record(*each) for each in zip(result.edges, gaps, strict=True)],
    }
    return json.dumps(record, indent=2, allow_nan=False)


def _edge_record(edge, gap):
    from idem_ros.refinement.diagnostics import known

    degrees, length = gap or (None, None)
    return {
        'i': edge.i,
        'j': edge.j,
        'overlap': edge.overlap,
        'q_mean': edge.q_mean,
        'verdict': edge.verdict.value if edge.verdict else None,
        'p_aligned': known(edge.p_aligned),
        'reason': edge.reason,
        'covariance': None if edge.covariance is None else edge.covariance.tolist(),
        'closure_deg': degrees,
        'closure_m': length,
    }
