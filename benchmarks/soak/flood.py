"""A flood: what honest clouds are answered like among garbage, and what the node takes."""

import subprocess
import sys
from contextlib import ExitStack

import numpy as np

from benchmarks import CHECKOUT
from benchmarks.goal import Goal
from benchmarks.soak.children import SoakFailed, started
from benchmarks.soak.parts import (
    AVERAGED,
    FIRST_MINUTE,
    GROWTH_PERCENT,
    PARAMETERS,
    RATE,
    Part,
    Size,
    latencies,
    run_a_node,
)
from idem_ros.node.process import node_command

FLOODER = [sys.executable, '-m', 'benchmarks.soak.flooder']
START = 30.0  # [s] that nodes and players take to begin, and to settle
TIMES = 2.0  # the latency without


def flood(size: Size) -> Part:
    """Clouds at 10 Hz, alone and among a flood with a second node of the same name."""
    part = Part(f'{size.points} points at {RATE:g} Hz in a flood of {size.flood_s:g} s')
    parameters = {'use_sim_time': True}
    seconds = min(size.flood_s, FIRST_MINUTE)
    alone, _ = run_a_node(part, size.points, RATE, seconds)
    with ExitStack() as others:
        command = [*FLOODER, '--seconds', str(size.flood_s + START)]
        flooder = started(command, cwd=CHECKOUT, stdout=subprocess.PIPE, text=True)
        child = others.enter_context(flooder)
        second = others.enter_context(started(node_command({**PARAMETERS, **parameters})))
        played, samples = run_a_node(part, size.points, RATE, size.flood_s, parameters)
        if second.poll() is not None:
            raise SoakFailed(f'the second node ended with exit code {second.returncode}')
        said, _ = child.communicate(timeout=10.0 * START)
    missing = len(played.published) - len(played.answered.keys() & played.published.keys())
    part.notes += [said.strip(), f'{missing} of {len(played.published)} honest clouds unanswered']
    before, after = (float(np.percentile(latencies(each), 99)) for each in (alone, played))
    part.notes.append(f'p99 {before:.1f} ms without, {after:.1f} ms in the flood')
    part.hold_by_the_clock(size, Goal('p99 over that without', after / before, TIMES))
    rss = np.array([each.rss for each in samples if each.time > FIRST_MINUTE], dtype=float)
    if len(rss) > 2 * AVERAGED:
        growth = 100 * (rss[-AVERAGED:].mean() / rss[:AVERAGED].mean() - 1)
        part.goals.append(Goal('growth of the memory', float(growth), GROWTH_PERCENT, '%'))
    return part
