"""Times and memory as figures to reach, as Markdown and as what JSON holds."""

from dataclasses import asdict

import numpy as np

from benchmarks.goal import Goal, goals_table
from benchmarks.methods import IDEM, PEERS
from benchmarks.speed import growth
from idem_ros.terminal.markdown import number, table

NOTE = """Milliseconds from raw points to result, median / 95th percentile, the methods taking
turns from the same starts (1 r4th and 2 deg off). Each peer at its fastest setting that reaches
the truth, with small_gicp's own termination.
"""
PARTS = ('downsampling', 'preparation', 'solve')


def goals(result):
    """Return the `Goal`s that a `SpeedResult` decides."""
    found = [
        Goal(
            f'IDEM / GICP, median of the pairs, {n} thread{"s"[: n - 1]}', _ratio(result, n), most
        )
        for n, most in ((1, 0.5), (2, 0.6))
    ]
    least = min(result.rows, key=lambda row: row.points[0])
    found.append(
        Goal(f'IDEM / GICP, scans of {least.points[0]} points', least.ratio(threads=1), 1.0)
    )
    found += [
        Goal(f"{race.scene}: time to the best peer's accuracy / its time", race.ratio, 0.5)
        for race in result.races
    ]
    found += [
        Goal(f'{race.scene}: to that of the fastest peer within a third of it', near.ratio, 0.5)
        for race in result.races
        for near in [race.near]
    ]
    found += [
        Goal('to a prepared target / to an unprepared one', _prepared_ratio(result), 1.0),
        Goal('q_tot, radius known', result.q_tot['points and radius']['median'], 8.0, 'ms'),
        Goal('q_tot, one of many poses', result.q_tot['one of many poses']['median'], 8.0, 'ms'),
    ]
    found += [Goal(f'exponent of the cost, {how}', p, 1.1) for how, p in _growths(result).items()]
    found += [
        Goal(f'peak memory of {what} a point', used['resident'], 400.0, 'bytes')
        for what, used in result.memory.items()
    ]
    for cache, most in (('warm', 1.0), ('cold', 15.0)):
        found.append(Goal(f'first result, {cache} cache', result.first_result[cache], most, 's'))
    return found


def markdown(result):
    """Return the goals and all tables."""
    parts = ['## Speed\n', goals_table(goals(result)), NOTE]
    for threads in (1, 2):
        parts += [f'### {threads} thread{"s"[: threads - 1]}\n', _whole_table(result, threads)]
    parts += ['### Parts, 1 thread [ms]\n', _parts_table(result)]
    for race in result.races:
        parts += [f'### Error against time: {race.scene}\n', _race_table(race)]
    return '\n'.join([*parts, '### Alone\n', _alone_table(result)])


def json_record(result):
    """Return a `SpeedResult` as what JSON holds."""
    record = asdict(result)
    for row, original in zip(record['rows'], result.rows, strict=True):
        for key in ('whole', 'parts'):
            values = getattr(original, key)
            row[key] = {f'{method} {what}': times for (method, what), times in values.items()}
        row['settings'] = {method: str(s) for method, s in original.settings.items()}
        row['ratio'] = {str(n): original.ratio(threads=n) for n in (1, 2)}
    return {**record, 'goals': [g.record() for g in goals(result)]}


def _ratio(result, threads):
    return float(np.median([row.ratio(threads=threads) for row in result.rows]))


def _prepared_ratio(result):
    pairs = [(row.to_prepared, row.whole[IDEM, 1]) for row in result.rows]
    return float(np.median([ms['median'] / whole['median'] for ms, whole in pairs]))


def _growths(result):
    """Return the exponents between the smallest and the largest cloud of the street."""
    streets = [row for row in result.rows if row.name.startswith('street')]
    coarsest = max(row.voxel_size for row in streets)
    reduced = [
        (row.points[0], row.whole[IDEM, 1]['median'])
        for row in streets
        if row.voxel_size == coarsest
    ]
    as_given = [(points, times['median']) for points, times in result.as_given.items()]
    return {
        f'voxels of {coarsest:g} m': growth(reduced),
        'points as given': growth(as_given),
    }


def _whole_table(result, threads):
    header = ['pair', 'points', 'IDEM / GICP', IDEM]
    header += [f'{method}' for method in PEERS]
    rows = []
    for row in result.rows:
        cells = [row.name, ' + '.join(map(str, row.points)), f'{row.ratio(threads=threads):.2f}']
        rows.append(cells + [_cell(row, method, threads) for method in (IDEM, *PEERS)])
    rows.append(['median', '', f'{_ratio(result, threads):.2f}', *[''] * (1 + len(PEERS))])
    return table(header, rows)


def _cell(row, method, threads):
    times, success = row.whole[method, threads], row.success[method]
    text = f'{number(times["median"])} / {number(times["p95"])}'
    return text if success == 1.0 else f'{text} ({success:.0%} succeed)'


def _parts_table(result):
    header = ['pair', *[f'{method} {part}' for method in (IDEM, 'GICP') for part in PARTS]]
    rows = []
    for row in result.rows:
        ms = {key: times['median'] for key, times in row.parts.items()}
        known = ms[IDEM, 'downsampling'] + ms[IDEM, 'solve']
        ms[IDEM, 'preparation'] = max(row.whole[IDEM, 1]['median'] - known, 0.0)
        cells = [number(ms[method, part]) for method in (IDEM, 'GICP') for part in PARTS]
        rows.append([row.name, *cells, number(row.to_prepared['median'])])
    return table([*header, 'IDEM, prepared target'], rows)


def _race_table(race):
    header = ('method', 'voxel [m]', 'setting', '[ms]', '[deg]', '[mm]', 'moved [mm]', 'success')
    rows = [
        (
            *(t.method, f'{t.voxel_size:g}', t.setting, number(t.milliseconds)),
            *(number(t.rotation_deg), number(t.translation_m, 1e3), number(t.moved_m, 1e3)),
            f'{t.success:.0%}',
        )
        for t in sorted(race.tradeoffs, key=lambda t: (t.method != IDEM, t.method, t.moved_m))
    ]
    near = f'Fastest peer within a third of that error: {_compared(race.near)}'
    return table(header, rows) + f'\nBest peer: {_compared(race)}\n{near}\n'


def _compared(race):
    peer, idem = race.best_peer, race.idem
    said = f'{peer.method} at {peer.voxel_size:g} m, {number(peer.milliseconds)} ms. '
    if idem is None:
        return said + 'IDEM does not reach its error.'
    as_good = f'IDEM is as good at {idem.voxel_size:g} m, {number(idem.milliseconds)} ms: '
    return said + as_good + f'{race.ratio:.2f} of that.'


def _alone_table(result):
    sizes = ' x '.join(map(str, result.q_tot['points']))
    rows = [
        (f'q_tot, {sizes} points: {what}', f'{number(times["median"])} ms')
        for what, times in result.q_tot.items()
        if isinstance(times, dict)
    ]
    rows += [
        (f'registration of 2 x {points} points as given', f'{number(times["median"])} ms')
        for points, times in result.as_given.items()
    ]
    for what, used in result.memory.items():
        text = f'{number(used["resident"])} (Python and numpy: {number(used["python"])}) bytes'
        rows.append((f'peak memory of {what} a point, {result.memory_points} points', text))
    rows += [
        (f'first result after process start, {state} cache', f'{result.first_result[state]:.2f} s')
        for state in ('warm', 'cold')
    ]
    return table(('what', 'IDEM'), rows)
