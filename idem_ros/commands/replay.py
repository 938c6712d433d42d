"""`idem replay`: refine every pair of a recording, without ROS."""

import sys

from idem_ros.commands.exit_codes import OK
from idem_ros.commands.options import REPLAYED, add_config_options, config_from
from idem_ros.commands.replay_outputs import check_outputs, write_outputs
from idem_ros.core.exceptions import IdemError


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
        ('guess', 'TransformStamped (or as --initial-guess-type says)'),
        ('truth', 'TransformStamped'),
    ):
        parser.add_argument(
            f'--{role}-topic', metavar='NAME', help=f'{what} topic (default: found by type)'
        )
    parser.add_argument('--json', metavar='FILE', help='write every frame as JSON; - for stdout')
    parser.add_argument(
        '--out',
        metavar='FILE.mcap',
        help='write transforms and diagnostics into a new recording, with all of --json in it',
    )
    parser.add_argument('--tum', metavar='FILE', help='write the transforms as TUM lines')
    for config_type in REPLAYED:
        add_config_options(parser, config_type=config_type)
    parser.set_defaults(run=run)


def run(args):
    """Replay, write what was asked for, print the table."""
    from idem_ros.evaluation.replay import replay
    from idem_ros.evaluation.settings import Settings
    from idem_ros.evaluation.summary import table
    from idem_ros.recording.fingerprint import fingerprint

    settings = Settings(*(config_from(args, each) for each in REPLAYED))
    check_outputs(args)
    input_ = fingerprint(args.bag) if args.json or args.out else None
    replayed = replay(
        args.bag,
        settings.config,
        preprocessing=settings.preprocessing,
        pairing=settings.pairing,
        guess=settings.guess,
        target_topic=args.target_topic,
        source_topic=args.source_topic,
        guess_topic=args.guess_topic,
        truth_topic=args.truth_topic,
        progress=_progress,
    )
    if not replayed.frames:
        raise NothingRefined(_why_nothing(replayed))
    write_outputs(args, replayed, settings, input_)
    print(table(replayed), file=sys.stderr if args.json == '-' else sys.stdout)
    return OK


def _progress(messages, total):
    from tqdm import tqdm

    return tqdm(messages, total=total, unit='msg', leave=False, disable=None)


def _why_nothing(replayed):
    reasons = [refusal.reason for refusal in replayed.refused[:1]]
    if replayed.unpaired:
        reasons.append(
            f'{replayed.unpaired} sources wait for {replayed.unpaired_for} '
            f'({replayed.unpaired_why})'
        )
    reasons.extend(replayed.notes)
    return f'no source of {replayed.path} could be refined: {"; ".join(reasons) or "it has none"}'
