"""`idem replay`: refine every pair of a recording, without ROS."""

import sys
from pathlib import Path

from idem_ros.commands.exit_codes import OK, UsageError
from idem_ros.commands.options import REPLAYED, add_config_options, config_from
from idem_ros.core.exceptions import IdemError
from idem_ros.preprocessing import PreprocessingConfig


class NothingRefined(IdemError):
    """A recording of which no source could be refined."""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'replay',
        help='refine the pairs of a recording',
        description='Refine every pair of BAG, as the live node would, and report the errors.',
    )
    parser.add_argument(
        'bag', metavar='BAG', help='recording: .mcap, rosbag2 folder, .db3 or ROS 1 .bag'
    )
    for role, what in (
        ('target', 'PointCloud2'),
        ('source', 'PointCloud2'),
        ('guess', 'TransformStamped'),
        ('truth', 'TransformStamped'),
    ):
        parser.add_argument(
            f'--{role}-topic', metavar='NAME', help=f'{what} topic (default: found by type)'
        )
    parser.add_argument('--json', metavar='FILE', help='write every frame as JSON; - for stdout')
    parser.add_argument(
        '--out', metavar='FILE.mcap', help='write transforms and diagnostics into a new recording'
    )
    parser.add_argument('--tum', metavar='FILE', help='write the transforms as TUM lines')
    for config_type in REPLAYED:
        add_config_options(parser, config_type=config_type)
    parser.set_defaults(run=run)


def run(args):
    """Replay, write what was asked for, print the table."""
    from idem_ros.evaluation.replay import replay
    from idem_ros.evaluation.summary import table

    config = config_from(args)
    _check_outputs(args)
    replayed = replay(
        args.bag,
        config,
        preprocessing=config_from(args, PreprocessingConfig),
        target_topic=args.target_topic,
        source_topic=args.source_topic,
        guess_topic=args.guess_topic,
        truth_topic=args.truth_topic,
        progress=_progress,
    )
    if not replayed.frames:
        raise NothingRefined(_why_nothing(replayed))
    _write(args, replayed)
    print(table(replayed), file=sys.stderr if args.json == '-' else sys.stdout)
    return OK


def _check_outputs(args):
    """Refuse before the work what could not be written after it."""
    from idem_ros.atomic_file import require_writable

    outputs = [file for file in (args.json, args.out, args.tum) if file and file != '-']
    if args.out and not args.out.endswith('.mcap'):
        raise UsageError(f'--out is {args.out}; its name must end in .mcap')
    bag, *resolved = (Path(file).resolve() for file in [args.bag, *outputs])
    if len({bag, *resolved}) <= len(outputs) or any(bag in file.parents for file in resolved):
        raise UsageError(
            f'among {", ".join([args.bag, *outputs])} a file is named twice; '
            'each output needs a file of its own outside the recording'
        )
    for file in outputs:
        require_writable(file)


def _progress(messages, total):
    from tqdm import tqdm

    return tqdm(messages, total=total, unit='msg', leave=False, disable=None)


def _write(args, replayed):
    if args.out:
        from idem_ros.recording.results import result_messages
        from idem_ros.recording.writer import write_mcap

        write_mcap(args.out, result_messages(replayed.frames))
    if args.tum:
        from idem_ros.pose_files import write_tum

        refinements = [frame.refinement for frame in replayed.frames]
        write_tum(
            args.tum,
            [refinement.stamp for refinement in refinements],
            [refinement.result.T_target_source for refinement in refinements],
        )
    if args.json:
        _write_json(args.json, replayed)


def _write_json(file, replayed):
    import json

    from idem_ros.atomic_file import replacing
    from idem_ros.evaluation.summary import json_record

    text = json.dumps(json_record(replayed), indent=1, allow_nan=False)
    if file == '-':
        print(text)
        return
    with replacing(file) as temporary:
        temporary.write_text(text + '\n')


def _why_nothing(replayed):
    reasons = [refusal.reason for refusal in replayed.refused[:1]]
    if replayed.unpaired:
        reasons.append(f'{replayed.unpaired} sources wait for {replayed.unpaired_for}')
    reasons.extend(replayed.notes)
    return f'no source of {replayed.path} could be refined: {"; ".join(reasons) or "it has none"}'
