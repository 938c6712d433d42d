"""`idem demo`: start the node, play a recording to it over live topics, show what it refines."""

import os
import statistics
import time

from idem_ros.core.exceptions import IdemError
from idem_ros.node.environment import require_rclpy
from idem_ros.terminal.command_line import OK, UsageError

BAG = 'bags/demo.mcap'
PATIENCE = 10.0  # [s]: on a machine that is busy, too
LONGEST = 50.0  # [s] of playing, however many scans are left


class DemoFailed(IdemError):
    """A demo in which scans went missing or the refinement did not help."""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'demo',
        help='see the node refine a recording live (needs rclpy)',
        description='Start the node as a process of its own, play BAG to it over ROS 2 topics on '
        'this machine only, and show each transform with its error before and after as it '
        'arrives. Plays at the recorded pace, but holds each scan back until the one before is '
        f'answered or {PATIENCE:.0f} s have passed. Fails if a scan has no answer or the median '
        'error has not shrunk.',
    )
    parser.add_argument(
        'bag',
        metavar='BAG',
        nargs='?',
        help=f'recording with a guess and the truth of every source (default: {BAG})',
    )
    parser.set_defaults(run=run)


def run(args):
    """Refine the recording live, show every scan, judge the whole."""
    require_rclpy('idem demo')
    from idem_ros.node.environment import loopback_environment
    from idem_ros.node.live_run import refine_live
    from idem_ros.recording.reader import open_recording
    from idem_ros.recording.topics import find_topics

    os.environ.update(loopback_environment())
    with open_recording(args.bag or _own_bag()) as recording:
        topics = find_topics(recording)
        if not (topics.guess and topics.truth):
            raise UsageError(
                f'{recording.path} lacks the guess or the truth; the demo needs both '
                '(TransformStamped topics named initial_guess and ground_truth)'
            )
        total = recording.topics[topics.source].count
        print(
            f'{recording.path}: {total} scans, live on ROS_DOMAIN_ID={os.environ["ROS_DOMAIN_ID"]}'
        )
        print('Starting the node; it compiles its kernels first if they are not cached.')
        scans = []
        start = None
        for scan in refine_live(recording, topics, patience=PATIENCE):
            if start is None:
                start = time.monotonic()
                print(f'{"scan":>7}  {"error of the guess":24} ->  {"of the refined pose":24}')
            scans.append(scan)
            print(f'{len(scans):3}/{total}  {_line(scan)}', flush=True)
            if time.monotonic() - start > LONGEST:
                break
    _judge(scans, total)
    return OK


def _own_bag():
    from idem_ros.files.installed_file import installed_file

    bag = installed_file(BAG)
    if bag is None:
        raise UsageError(f'{BAG} lies in the checkout only, and this is none; name a recording')
    return bag


def _line(scan):
    """Return what became of a scan as one line."""
    if scan.T_target_source is None:
        return scan.diagnostics.get('reason', f'no answer within {PATIENCE:.0f} s')
    values = scan.diagnostics
    return (
        f'{_shown(_errors(scan, scan.T_guess))}  ->  {_shown(_errors(scan, scan.T_target_source))}'
        f'   {values.get("status", "?"):10} {float(values.get("milliseconds", "nan")):5.0f} ms'
    )


def _errors(scan, transform):
    """Return (translation [m], rotation [deg]) off the truth; not a number where unknown."""
    from idem_ros.replay.frames import rotation_error_deg, translation_error_m

    if transform is None or scan.T_truth is None:
        return float('nan'), float('nan')
    return (
        translation_error_m(transform, scan.T_truth),
        rotation_error_deg(transform, scan.T_truth),
    )


def _shown(errors):
    translation, rotation = errors
    return f'{100 * translation:6.2f} cm {rotation:6.3f} deg'


def _judge(scans, total):
    """Print the summary; raise `DemoFailed` if it is none to be content with."""
    answered = [scan for scan in scans if scan.T_target_source is not None]
    if not answered:
        raise DemoFailed(f'none of {total} scans was answered')
    before = _medians(answered, lambda scan: scan.T_guess)
    after = _medians(answered, lambda scan: scan.T_target_source)
    print(f'{len(answered)} of {total} scans refined, median error:')
    print(f'         {_shown(before)}  ->  {_shown(after)}')
    if len(answered) < total:
        raise DemoFailed(f'{total - len(answered)} of {total} scans are missing')
    for what, was, is_now in zip(('translation', 'rotation'), before, after, strict=True):
        if not is_now < was:  # also where it is not a number
            raise DemoFailed(
                f'the refinement did not help: the median {what} error was {was:.4g} '
                f'and is {is_now:.4g}'
            )


def _medians(scans, transform_of):
    errors = [_errors(scan, transform_of(scan)) for scan in scans]
    return tuple(statistics.median(column) for column in zip(*errors, strict=True))
