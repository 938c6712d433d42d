"""`idem evaluate`: replay many recordings, side by side, and sum them up."""

import sys
from contextlib import closing
from pathlib import Path

from idem_ros.commands.inputs import RECORDING, add_topic_options, topics_from
from idem_ros.commands.options import add_worker_options, workers_from
from idem_ros.commands.replay_settings import add_settings_options, settings_from
from idem_ros.terminal.command_line import FAILED, INTERRUPTED, OK, UsageError
from idem_ros.terminal.printable import printable

DESCRIPTION = """\
Replay every recording in worker processes, as `idem replay` does one of them, and
print the figures of each and of all together. A FOLDER is searched; a rosbag2
folder in it counts once. With --out, DIR receives

  NAME.CHECKSUM.json   of each recording, what `idem replay --json` writes
  summary.json         counts, errors, times: of each recording, and pooled
  evaluation.json      the settings that all of it was made with

Called again, what is there of the same input (name, size, checksum) and the same
settings is not done again, so that an interrupted evaluation goes on where it was.
A DIR of other settings is refused; nothing in it is overwritten but the summary.

A recording that cannot be evaluated is named with the reason, the others go on; so
is one whose worker was killed three times (on a cluster: as often as its scheduler
allows). With several jobs the milliseconds are
those of a busy machine: take --jobs 1 to judge them.
Exit code: 0 all evaluated, 1 some could not be, 2 the command line is wrong.
"""


def add_parser(subparsers):
    """Add the subcommand."""
    parser = subparsers.add_parser(
        'evaluate',
        help='replay many recordings and sum them up',
        description=DESCRIPTION,
        epilog='example: idem evaluate drives/ --voxel-size 0.5 --out results',
    )
    parser.add_argument(
        'bags',
        metavar='BAG|FOLDER',
        nargs='+',
        help=f'{RECORDING}; or a folder of such',
    )
    add_worker_options(parser, 'the recordings by the same paths')
    parser.add_argument(
        '--out', metavar='DIR', help='folder for the results, new or to go on with'
    )
    add_topic_options(parser)
    add_settings_options(parser)
    parser.set_defaults(run=run)


def run(args):
    """Evaluate what is not evaluated yet, write each result as it comes, print the summary."""
    from idem_ros.evaluation.one_recording import Task
    from idem_ros.evaluation.overall import Overall
    from idem_ros.evaluation.result_folder import OtherResults, open_folder

    workers = workers_from(args)
    settings = _settings(args)
    bags = _recordings(args.bags)
    if args.cluster is not None:
        bags = [bag.absolute() for bag in bags]  # a worker's working directory is another
    try:
        there = open_folder(args.out, _made_with(settings, args)) if args.out else {}
    except OtherResults as error:
        raise UsageError(str(error)) from error
    topics = topics_from(args)
    tasks = [Task(str(bag), settings, topics, frozenset(there)) for bag in bags]
    overall = Overall()
    interrupted = _evaluate(tasks, workers, args.out, there, overall)
    return _summed_up(overall, args.out, interrupted)


def _settings(args):
    every, notes = settings_from(args)
    if len(every) > 1:
        raise UsageError(
            f'--method names {len(every)} methods; an evaluation is of one: '
            'call it for each, with a folder of its own'
        )
    for note in notes:
        print(printable(f'note: {note}'), file=sys.stderr)
    return every[0]


def _recordings(paths):
    """Return what the paths mean, each recording once."""
    from idem_ros.recording.folder import recordings_in

    found = {}
    for path in paths:
        for bag in recordings_in(path):
            found.setdefault(bag.resolve(), bag)
    return list(found.values())


def _made_with(settings, args):
    from importlib.metadata import version

    from idem_ros.replay.settings import as_record

    return {
        'settings': as_record(settings),
        'topics': topics_from(args),
        'idem_ros': version('idem_ros'),
    }


def _evaluate(tasks, workers, out, there, overall):
    """Take in each outcome as it comes; return whether the user ended it before its time."""
    left = {task.path for task in tasks}
    try:
        with Lines(tasks) as lines, closing(workers(tasks, watch=lines.watch)) as ended:
            for index, outcome in ended:
                _take_in(outcome, out, there, overall)
                left.discard(outcome.path)
                lines.end(index, outcome)
    except KeyboardInterrupt:
        for path in left:
            overall.add_failure(path, 'interrupted before it was done')
        return True
    return False


def _take_in(outcome, out, there, overall):
    import json

    from idem_ros.evaluation.result_folder import result_file, write_text
    from idem_ros.results.result_file import read_result

    if outcome.reason:
        overall.add_failure(outcome.path, outcome.reason)
        return
    if outcome.text is None:
        file = there[outcome.identity]
        overall.add(outcome.path, read_result(file).record, file)
        return
    file = result_file(out, outcome.identity) if out else None
    if file and not file.exists():  # it does where the same recording lies in two places
        write_text(file, outcome.text)
    overall.add(outcome.path, json.loads(outcome.text), file)


def _summed_up(overall, out, interrupted):
    from idem_ros.evaluation.overall import overall_table
    from idem_ros.evaluation.result_folder import SUMMARY, write_json

    record = overall.record()
    if out:
        write_json(Path(out) / SUMMARY, record)
    print(overall_table(record))
    if interrupted:
        return INTERRUPTED
    return FAILED if record['failed'] else OK


class Lines:
    """The lines of an evaluation, while entered.

    Args:
        tasks: what is evaluated.
    """

    def __init__(self, tasks):
        self._tasks = tasks
        self._ended = 0
        self._bars = {}
        self._terminal = sys.stderr.isatty()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for bar in self._bars.values():
            bar.close()

    def watch(self, index, done, total):
        """Show how many of its messages a task has read."""
        from tqdm import tqdm

        if not self._terminal or not total:
            return
        if index not in self._bars:
            self._bars[index] = tqdm(
                total=total, desc=printable(self._tasks[index].path), unit='msg', leave=False
            )
        bar = self._bars[index]
        bar.n = done  # a task that is done again begins anew
        bar.refresh()

    def end(self, index, outcome):
        """Say what became of a task, above the bars of those that run."""
        from tqdm import tqdm

        from idem_ros.evaluation.overall import named

        if index in self._bars:
            self._bars.pop(index).close()
        self._ended += 1
        if outcome.reason:
            text = f'not evaluated: {named(outcome.path, outcome.reason)}'
        else:
            how = 'there already' if outcome.text is None else 'evaluated'
            text = f'{outcome.path}: {how}'
        line = printable(f'[{self._ended}/{len(self._tasks)}] {text}')
        tqdm.write(line, file=sys.stderr)
