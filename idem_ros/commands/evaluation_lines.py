"""One line on stderr for each recording that is evaluated: a bar on a terminal, else its end."""

import sys

from idem_ros.terminal.printable import printable


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
