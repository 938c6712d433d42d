"""What every `python -m benchmarks` takes and writes."""

import os

from idem_ros.terminal.command_line import UsageError

QUICK = '\nQuick: {}; no figure is decided by that.\n'


def add_jobs(parser):
    """Add the number of processes."""
    parser.add_argument(
        '--jobs',
        type=int,
        default=os.cpu_count(),
        metavar='N',
        help='processes that share the work (default: one a core)',
    )


def add_output_options(parser):
    """Add what a benchmark writes, and how short it may be."""
    parser.add_argument('--quick', action='store_true', help='few rows and few runs of each')
    parser.add_argument('--json', metavar='FILE', help='write every figure as JSON')
    parser.add_argument('--markdown', metavar='FILE', help='write the tables as Markdown')


def add_trials(parser, default, what):
    """Add `--trials`; what: each is one of these."""
    parser.add_argument(
        '--trials', type=int, default=default, metavar='N', help=f'{what} (default: %(default)s)'
    )


def check_trials(args):
    """Refuse a number of trials that is none."""
    if args.trials is not None and args.trials < 1:
        raise UsageError(f'--trials is {args.trials}; it must be from 1')


def check_jobs(args):
    """Refuse a number of processes that is none."""
    if args.jobs < 1:
        raise UsageError(f'--jobs is {args.jobs}; it must be from 1')


def check_outputs(args):
    """Refuse before the work what could not be written after it."""
    from idem_ros.files.atomic_file import require_writable

    for file in (args.json, args.markdown):
        if file:
            require_writable(file)


def write(args, record, text):
    """Write the record as JSON and the text as Markdown, where these are asked for."""
    import json

    from idem_ros.files.atomic_file import replacing

    as_json = json.dumps(record, indent=1, allow_nan=False)
    for file, content in ((args.json, as_json), (args.markdown, text)):
        if file:
            with replacing(file) as temporary:
                temporary.write_text(content.rstrip() + '\n')
