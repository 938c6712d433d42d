"""Run a benchmark: `python -m benchmarks NAME`, in the checkout."""

import sys

from idem_ros.commands.entry import ended_in_order


def _run():
    from benchmarks.commands.main import main

    return main()


if __name__ == '__main__':
    sys.exit(ended_in_order(_run))
