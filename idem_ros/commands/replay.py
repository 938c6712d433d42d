"""`idem replay`: refine every pair of a recording, without ROS."""

import logging
import sys
from dataclasses import replace
from functools import partial
from itertools import islice

from idem_ros.commands.inputs import (
    RECORDING,
    add_recordings_under,
    add_topic_options,
    topics_from,
)
from idem_ros.commands.replay_outputs import outputs_for, write_outputs
from idem_ros.commands.replay_settings import add_settings_options, settings_from
from idem_ros.core.exceptions import IdemError
from idem_ros.replay.settings import IDEM
from idem_ros.terminal.command_line import FAILED, INTERRUPTED, OK, UsageError, progress
from idem_ros.terminal.printable import printable

DESCRIPTION = """\
Refine every pair of BAG, as the live node would, and report the errors.

With several methods each has a block in the table, and files of its own: --json
result.json becomes result.idem.json and result.gicp.json. q_tot, overlap and radius
of every method are those of IDEM's metric at its result.

Ctrl-C ends with the report and the files of what was done, and exit code 130.
Exit code: 0 a pair was registered (its verdict is aligned; without one, it converged), 1 none was
(of several methods: by one of them) or BAG cannot be read, 2 the command line is wrong.

What is found waits on disk, in the folder of temporary files (TMPDIR; some 8 kB a
frame), so that the memory does not grow with the recording.
"""
EPILOG = """\
examples:
  idem replay run.mcap --voxel-size 0.5 --json result.json --out result.mcap
  idem replay run.mcap --method idem,gicp --start 60 --duration 30 --every 5
  idem replay run.mcap --params refine.yaml
  idem replay drive.bag --sequence submap --voxel-size 0.5 --tum drive.tum
  idem replay --again result.mcap
"""
OF_AGAIN = ('bag', 'again', 'recordings_under', 'json', 'out', 'clouds', 'tum', 'run')

_progress = partial(progress, unit='msg')


class NothingRefined(IdemError):
    """A recording of which no source could be refined."""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'replay',
        help='refine the pairs of a recording',
        description=DESCRIPTION,
        epilog=EPILOG,
    )
    parser.add_argument(
        'bag', metavar='BAG', nargs='?', help=f'{RECORDING}; with --again it may be left out'
    )
    parser.add_argument(
        '--again',
        metavar='RESULT',
        help='repeat the replay that RESULT (of --json or --out) is of, from the parameters in '
        'it, and compare transforms, q_tot and status bit for bit: exit code 0 or 1',
    )
    add_recordings_under(parser, 'with --again: ')
    add_topic_options(parser)
    parser.add_argument('--json', metavar='FILE', help='write every frame as JSON; - for stdout')
    parser.add_argument(
        '--out',
        metavar='FILE.mcap',
        help='write transforms and diagnostics into a new recording, with all of --json in it',
    )
    parser.add_argument(
        '--clouds',
        action='store_true',
        help='the clouds, too, into --out: it shows in Foxglove by itself',
    )
    parser.add_argument('--tum', metavar='FILE', help='write the transforms as TUM lines')
    add_settings_options(parser)
    parser.set_defaults(run=run)


def run(args):
    """Replay, write what was asked for, print the table."""
    if args.again:
        return _again(args)
    if args.bag is None:
        raise UsageError('no recording is named; give BAG, or --again RESULT')
    if args.recordings_under:
        raise UsageError('--recordings-under is for what a RESULT names; it needs --again')
    then, guesses = _of_capsule(args.bag)
    settings, notes = settings_from(args, then)
    if then is not None:
        notes = [*notes, 'a capsule of a node: from its guess, with its parameters, unless given']
    topics = topics_from(args)
    if guesses and not topics['guess_topic'] and settings[0].sequence is None:
        topics['guesses'] = guesses
    return _written(args, args.bag, settings, topics, notes)[0]


def _of_capsule(bag):
    from idem_ros.capsules import read_capsule

    return read_capsule(bag) or (None, {})


def _written(args, bag, settings, topics, notes=()):
    """Replay, write and print; return the exit code and the [`Replay`] of each method."""
    from idem_ros.recording.folder import fingerprint
    from idem_ros.replay.provenance import map_fingerprint
    from idem_ros.replay.run import replay_each
    from idem_ros.results.summary import table, why_nothing

    logging.getLogger('idem_ros.maps').setLevel(logging.INFO)  # reading a map takes its time
    inputs = [bag, *filter(None, [args.again, getattr(args, 'params', None)])]
    outputs = outputs_for(args, inputs, [each.method for each in settings])
    made_of = None, None
    if args.json or args.out:
        made_of = fingerprint(bag), map_fingerprint(settings[0].map.target_file)
    replays = replay_each(bag, settings, progress=_progress, **topics)
    if not any(each.frames for each in replays):
        if replays[0].interrupted:
            raise KeyboardInterrupt
        raise NothingRefined(why_nothing(replays[0]))
    replays = [replace(each, notes=(*notes, *each.notes)) for each in replays]
    for each in zip(outputs, replays, settings, strict=True):
        write_outputs(*each, made_of, args.clouds)
    text = '\n\n'.join(map(table, replays, map(_is_audit, settings)))
    print(text, file=sys.stderr if args.json == '-' else sys.stdout)
    return _code(replays), replays


def _is_audit(settings):
    return settings.method == IDEM and settings.config.mode == 'audit'  # only IDEM has modes


def _code(replays):
    if replays[0].interrupted:
        return INTERRUPTED
    found = (any(f.refinement.result.is_usable for f in each.frames) for each in replays)
    return OK if all(found) else FAILED


def _again(args):
    """Repeat a result, compare, say how many frames agree."""
    from idem_ros.recording.folder import fingerprint
    from idem_ros.replay import again
    from idem_ros.replay.provenance import versions
    from idem_ros.results.result_file import read_result
    from idem_ros.results.summary import json_record

    _refuse_settings_of_their_own(args)
    result = read_result(args.again)
    settings, topics = again.settings_of(result)
    bag = args.bag or again.recording_of(result, args.recordings_under)
    settings = again.with_map(settings, result, args.recordings_under)
    again.require_same(result, 'input', fingerprint(bag))
    code, (replayed,) = _written(args, bag, [settings], topics)
    repeated = json_record(replayed)['frames']
    if result.record['summary'].get('interrupted'):
        repeated = islice(repeated, len(result.frames))
    found = again.agreement(result.frames, repeated)
    stream = sys.stderr if args.json == '-' else sys.stdout
    for name, version in versions(settings.method).items():
        if version != (then := result.made_by['versions'].get(name)):
            print(printable(f'note: {name} was {then} and is {version}'), file=stream)
    print(f'{found.agreeing} of {found.frames} frames agree bit for bit', file=stream)
    if found.first:
        print(printable(f'the first that differs: {found.first}'), file=stream)
    if code == INTERRUPTED:
        return code
    return FAILED if found.first else OK  # whether pairs were registered is no matter here


def _refuse_settings_of_their_own(args):
    given = [name for name, value in vars(args).items() if value is not None]
    if others := [name for name in given if name not in OF_AGAIN]:
        options = ', '.join('--' + name.replace('_', '-') for name in others)
        raise UsageError(f'--again takes all settings from {args.again}; leave out {options}')
