"""The figures of sweeps as a page, and as what JSON holds."""

from typing import NamedTuple

from benchmarks.goal import goals_table
from benchmarks.sweeps import cost, newer, odometry, pairs
from idem_ros.terminal.markdown import number, table

PAIRS = """\
{trials} simulated sweeps of 0.1 s, in street, forest, tunnel (5, 10, 20 m/s) and room (1, 2,
3 m/s), turning by 20, 45, 90°/s; 16, 32, 64, 128 rings of 900 points, 2 cm of range noise. The
target is a scan from a pose before, the guess 1.5° and 0.3 m off (0.1 m in rooms), the pose that
at the middle of the sweep; voxels as "auto" finds them. Nothing was chosen on these scenes.
Right: below 1° and half a spacing. NEES: mean and median over the right ones, over 6. The figures
above are of the {kept} sweeps of which the sensor that stood still is right: what fails for it is
no matter of motion. The last row's solve is told how far off its twist may be (`twist_sigma`)."""

RATIOS = """\
The same sweeps: errors over those of sensors standing still, with 95 % bounds by 1000 draws of
sweeps. Errors spread over two decades, from 128 rings to 16: fewer than some hundred sweeps tell
a ratio of medians to no better than a third.

Six more unknowns are what solving costs: the last two rows are the least that the information of
the same balls allows at the truth, each standing error times what its own sweep loses. Held least
is the climb together with the pitch rate and, at the middle, the roll: left and right of the
sensor are seen half a sweep apart, so that a roll and a climb differ only by what lies ahead and
behind; most so in rooms. With `guess` or `last`, and an IMU for the rates, none of that has to be
solved; a twist known to 5 % of its speed tells the climb no better than the clouds. A twist taken
as it is, 5 % off, leaves what it is off.
Along a tunnel little holds the speed: what lies across it votes for the place and the speed at
once. With 16 rings the NEES of a sensor that stood still is too high as well."""

NEWER = """\
Median distance of the points to where an IMU-aided SLAM has them, solved from no motion against
those [cm]. The least that one constant twist leaves is that of a fit to the truth itself; surfaces
that are the same in both clouds let the solver come closer."""

ODOMETRY = """\
{scans} sweeps of a drive, each against the {kept} before, undone by what was found of them; start
and twist from the one before; both are told the first step. KISS-ICP at voxels of that size, with
its own deskewing, its poses taken for those at the instant that suits it best. Median error of the
translation from scan to scan [mm]."""


class Found(NamedTuple):
    """All that was measured."""

    outcomes: list
    newer: tuple
    odometry: dict
    undoing_ms: float
    rigid_ms: float
    solving_ms: float


def goals(found):
    """Return all `Goal`s."""
    return [
        *pairs.goals(found.outcomes),
        *newer.goals(found.newer),
        *odometry.goals(found.odometry),
        *cost.goals(found.undoing_ms, found.rigid_ms, found.solving_ms),
    ]


def markdown(found, reached, trials):
    """Return the page; reached: the `Goal`s."""
    kept = len(pairs.of_way(pairs.with_standing_right(found.outcomes), pairs.STILL))
    parts = ['# Sweeps', goals_table(reached), '## Pairs', PAIRS.format(trials=trials, kept=kept)]
    parts += [_pairs_table(found.outcomes), RATIOS, _ratios_table(found.outcomes)]
    if found.newer:
        rows = [
            (k, *map(number, row), number(least))
            for k, (row, least) in enumerate(zip(found.newer, newer.LEAST_CM, strict=True))
        ]
        heads = 'sweep', 'before', 'at voxels of 0.25 m', 'at those found', 'least'
        parts += ['## newer_06', NEWER, table(heads, rows)]
    rows = [
        (kind, number(ours, 1e3), '-' if theirs is None else number(theirs, 1e3))
        for kind, (ours, theirs) in found.odometry.items()
    ]
    text = ODOMETRY.format(scans=odometry.SCANS, kept=odometry.KEPT)
    parts += ['## Odometry', text, table(('drive', 'IDEM', 'KISS-ICP'), rows)]
    parts.append(
        f'## Time\n\nUndoing {cost.POINTS} points {number(found.undoing_ms)} ms; a refinement '
        f'{number(found.rigid_ms)} ms rigid, {number(found.solving_ms)} ms with the motion solved.'
    )
    return '\n\n'.join(parts) + '\n'


def json_record(found, reached):
    """Return what JSON holds."""
    record = found._asdict()
    record['outcomes'] = [each._asdict() for each in found.outcomes]
    return {**record, 'goals': [goal.record() for goal in reached]}


def _pairs_table(outcomes):
    groups = {'all': outcomes}
    for kind in dict.fromkeys(each.kind for each in outcomes):
        groups[kind] = [each for each in outcomes if each.kind == kind]
    fewest = min(each.rings for each in outcomes)
    groups[f'{fewest} rings'] = [each for each in outcomes if each.rings == fewest]
    if more := [each for each in outcomes if each.rings > fewest]:
        groups['more rings'] = more
    ways = list(dict.fromkeys(each.way for each in outcomes))
    rows = []
    for name, of_group in groups.items():
        for way in ways:
            some = pairs.of_way(of_group, way)
            rotation, wide, translation, far, right, nees, usual = pairs.figures(some)
            rows.append(
                (
                    name,
                    way,
                    len(some),
                    f'{number(rotation)} / {number(wide)}',
                    f'{number(translation, 1e3)} / {number(far, 1e3)}',
                    f'{100 * right:.0f} %',
                    f'{number(nees)} / {number(usual)}',
                )
            )
    heads = 'sweeps', 'undone by', 'n', 'median / p90 [deg]', '[mm]', 'right', 'NEES'
    return table(heads, rows)


def _ratios_table(outcomes):
    outcomes = pairs.with_standing_right(outcomes)
    found = {way: pairs.ratios(outcomes, way) for way in pairs.MOST}
    for way in (pairs.SOLVED_ON, pairs.SOLVED):
        found[f'{way}, by information'] = pairs.least(outcomes, way)
    rows = [
        (way, *(f'{at:.2f} [{low:.2f}, {high:.2f}]' for at, low, high in each))
        for way, each in found.items()
    ]
    heads = 'rotation, median', 'p90', 'translation, median', 'p90'
    return table(('undone by', *heads), rows)
