"""`idem play`: publish a recording on live ROS 2 topics."""

import sys
from argparse import ArgumentTypeError
from contextlib import suppress

from idem_ros.commands.inputs import add_recording, opened
from idem_ros.core.exceptions import IdemError
from idem_ros.node.environment import require_rclpy
from idem_ros.terminal.command_line import FAILED, INTERRUPTED, OK, progress
from idem_ros.terminal.printable import counted, printable

PATIENCE = 10.0  # [s] until it plays to nobody, and until it gives up on an acknowledgement


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'play',
        help='publish a recording on live ROS 2 topics (needs rclpy)',
        description='Publish every message of BAG on its topic, at the pace of the log times. '
        f'Waits up to {PATIENCE:.0f} s for a subscriber before it starts. All topics are '
        'reliable; those that hold one message, or whose name ends in "target", are latched. '
        'Exit code: 1 where nobody listened to any.',
    )
    add_recording(parser)
    parser.add_argument(
        '--rate', type=_rate, default=1.0, metavar='R', help='times the recorded pace (default: 1)'
    )
    parser.add_argument('--loop', action='store_true', help='start over at the end, until Ctrl-C')
    parser.add_argument(
        '--clock', action='store_true', help='publish each log time on /clock, for use_sim_time'
    )
    parser.set_defaults(run=run)


def run(args):
    """Play the recording, say what was skipped."""
    require_rclpy('idem play')
    from idem_ros.node.player import Player, playing_node

    with opened(args.bag, args) as recording, playing_node('idem_play') as node:
        player = Player(node, recording, with_clock=args.clock)
        for topic, reason in player.skipped.items():
            _say(f'skips {topic}: {reason}')
        _say(f'waits up to {PATIENCE:.0f} s for a subscriber of {", ".join(player.topics)}')
        if not player.wait_for_subscribers(PATIENCE):
            _say('nobody listens; plays all the same')
        try:
            count = _play_pass(player, recording, args.rate)
            while args.loop and count:
                count += _play_pass(player, recording, args.rate)
        except SystemExit as signalled:
            if not args.loop or signalled.code != INTERRUPTED:
                raise
            return _heard(player, recording)  # Ctrl-C is how a loop ends
        if not player.finish(PATIENCE):
            _say(f'a subscriber has not acknowledged everything after {PATIENCE:.0f} s')
        topics = counted(len(player.topics), 'topic')
        print(f'{recording.path}: {counted(count, "message")} of {topics} played')
        code = _heard(player, recording)
    for warning in dict.fromkeys(recording.warnings):
        _say(warning)
    return code


def _heard(player, recording):
    """Say what nobody listened to though a node would; return the exit code."""
    unheard, names = player.unheard(), _inputs(recording)
    is_heard = len(unheard) < len(player.topics)
    missed = [name for name in names if name in unheard]
    if missed := missed or ([] if is_heard else unheard):
        remaps = [f"-r '~/{names[name]}:={name}'" for name in missed if name in names]
        shown = ' '.join(remaps or ["-r '~/source:=TOPIC'"])
        _say(f'nobody listened to {", ".join(missed)}: start the node with --ros-args {shown}')
    return OK if is_heard else FAILED


def _inputs(recording):
    """Return {topic: input of the node} of a recording; none where it is open which they are."""
    from idem_ros.recording.topics import find_topics

    with suppress(IdemError):
        found = find_topics(recording)
        return {found.target: 'target', found.source: 'source', found.guess: 'initial_guess'}
    return {}


def _play_pass(player, recording, rate):
    """Publish the recording once; return how many messages that were."""
    from idem_ros.node.player import Pace

    pace, count, skipped = Pace(rate), 0, set(player.skipped)
    total = sum(recording.topics[name].count for name in player.topics)
    messages = recording.messages(player.topics)
    for topic, log_time, message in progress(messages, total, unit='msg'):
        pace.wait(log_time)
        count += player.publish(topic, log_time, message)
    for topic in player.skipped.keys() - skipped:
        _say(f'skips {topic}: {player.skipped[topic]}')
    return count


def _rate(text):
    try:
        rate = float(text)
    except ValueError:
        rate = 0.0
    if not 0.0 < rate < float('inf'):
        raise ArgumentTypeError(f'{text!r} is no number above 0')
    return rate


def _say(text):
    print(f'idem play: {printable(text)}', file=sys.stderr)
