"""Beyond the paper: the pairs of table 2 in six degrees of freedom, by IDEM and by others."""

import numpy as np

from benchmarks.methods import DISTANCES
from benchmarks.six_dof.figure import figure_of
from benchmarks.six_dof.runs import CONFIGS, IDEM, NEAR, measured, methods_of
from idem_ros.core.metric.landscape import AXES
from idem_ros.experiments.conditions import case_names
from idem_ros.experiments.experiment import write_outputs
from idem_ros.replay.peers import PeersMissing, small_gicp
from idem_ros.terminal.markdown import number, table

STARTS, QUICK_STARTS = 50, 5
QUICK_CASES = (
    *('B0-B0', 'B0-B0.9', 'B0-B0.5', 'B0-B0.1', 'B0-Bn0.05', 'B0-Bn0.25', 'B0-Bh5', 'B0-Bh25'),
    *('B0p1-B0p2', 'B0-B0r'),
)
MM = {'mm': 1.0, 'm': 1000.0}
SHARED = 'the pairs of table 2'
INDEPENDENT = 'table 2 of two independent samplings'
MEASURES = (
    ('Rate of success [%]', lambda of, mm: f'{100 * of.success:.0f}'),
    ('Rotation error, median [deg]', lambda of, mm: number(of.rotation_deg['median'])),
    ('Rotation error, p90 [deg]', lambda of, mm: number(of.rotation_deg['p90'])),
    ('Translation error, median [mm]', lambda of, mm: number(of.translation_m['median'], mm)),
    ('Translation error, p90 [mm]', lambda of, mm: number(of.translation_m['p90'], mm)),
)
HEADER = (
    *('case', 'points_target', 'points_source', 'points_in_common', 'r_4th_mm', 'starts'),
    *('method', 'correspondence_distance_r_4th', 'success_rate'),
    *('rotation_median_deg', 'rotation_p90_deg', 'translation_median_mm', 'translation_p90_mm'),
    *(f'start_{axis}_{end}' for axis in AXES for end in ('from', 'to')),
)


def run(context):
    """Write the experiment six_dof; see `Experiment`."""
    return _run(context, 'six_dof', ('shared',))


def run_independent(context):
    """Write six_dof_independent, beside six_dof, which is measured where it was not before."""
    return _run(context, 'six_dof_independent', ('shared', 'independent'))


def _run(context, name, kinds):
    names = [case for case in case_names() if not context.quick or case in QUICK_CASES]
    starts = QUICK_STARTS if context.quick else STARTS
    peers = _are_there()
    outcomes = {kind: measured(context, kind, names, starts, peers) for kind in kinds}
    own = outcomes[kinds[-1]]
    title = SHARED if kinds == ('shared',) else INDEPENDENT
    stem = context.out / name
    drawn, page = (
        figure_of(own, methods_of(peers), title),
        _page(context, name, outcomes, starts, peers),
    )
    rows = [row for outcome in own for row in _rows(outcome)]
    return write_outputs(stem, HEADER, rows, drawn, page)


def _are_there():
    try:
        small_gicp()
    except PeersMissing:
        return False
    return True


def _rows(outcome):
    mm = MM[outcome.unit]
    reach = np.array(outcome.reach) * np.repeat((mm, np.degrees(1.0)), 3)[:, None]
    for of in outcome.figures:
        errors = (
            *(of.rotation_deg[key] for key in ('median', 'p90')),
            *(mm * of.translation_m[key] for key in ('median', 'p90')),
        )
        common = outcome.name, *outcome.points, outcome.in_common, mm * outcome.r_4th, of.runs
        method = of.method, of.setting.distance, of.success
        yield (*common, *method, *errors, *reach.ravel())


def _page(context, name, outcomes, starts, peers):
    shared, own = outcomes['shared'], list(outcomes.values())[-1]
    independent = 'independent' in outcomes
    lines = [
        f'# Beyond the paper: {INDEPENDENT if independent else SHARED}, six degrees of freedom',
        context.model.note,
        _about_points(shared, independent),
        _about_starts(own, starts),
        _about_methods(peers),
        *(_verdict(kind, outcomes[kind], methods_of(peers)) for kind in outcomes),
        f'![rates of success and errors by case]({name}.png)',
    ]
    for title, cell in MEASURES:
        lines += [f'## {title}', _table(outcomes, methods_of(peers), cell)]
    lines += ['## The starts, and the correspondence distances', _starts_table(own, peers)]
    if context.quick:
        lines.insert(1, f'A quick run: {len(own)} of the {len(case_names())} cases.')
    return '\n\n'.join(lines)


def _about_points(shared, independent):
    some = next(outcome for outcome in shared if outcome.name == 'B0-B0.9')
    text = (
        "The paper's clouds share points: each point of B_0.x, B_hx and most of B_nx is a point "
        f'of B_0 ({some.in_common} of {some.points[1]} of B_0.9), which makes the task easier '
        'than that of a second scan. Point to point distances vanish at the truth and nowhere '
        'else, and q_tot has its least value there.'
    )
    if not independent:
        return f'{text} `six_dof_independent` holds the same pairs of independent samplings.'
    return (
        f'{text} Here "independent" is each pair once more of two samplings of the surface (its '
        'triangles, evenly likely per area, two seeded draws; the stairs: two scans from stations '
        'half a metre apart), so that no point of one cloud is a point of the other; "shared" is '
        "the paper's pair, as in `six_dof`. Each kind has its own region of interest, and starts."
    )


def _about_starts(outcomes, starts):
    ends = sum(outcome.open_axes for outcome in outcomes)
    return (
        f'{starts} random starts for each case, the same for every method. Along and around X, Y '
        'and Z of the target frame (around the centroid of the source) the region of interest '
        'ends at the nearest maximum of q_tot (a = 1, lengths as given) on either side of the '
        'truth; each of the six offsets is drawn evenly between these ends, all six at once. '
        f'({ends} of {12 * len(outcomes)} ends have no maximum within eight radii: such an axis '
        'reaches as far as on its other side.) A start counts as a success if it ends less than '
        "0.5 r_4th and 1 deg off; the translation error is that of the source's centroid."
    )


def _about_methods(peers):
    text = (
        f'{IDEM} is `register` with its defaults, whose first stage has eight times the radius: '
        f'it is meant for guesses that far off. {NEAR} is the same from the stage of four radii '
        f'on ({", ".join(f"{factor:g}" for factor in CONFIGS[NEAR].radius_schedule)}), for '
        'guesses as near as these.'
    )
    if not peers:
        return (
            f'{text} **small_gicp is not installed, so that its ICP, point-to-plane and GICP are '
            "missing here**: `pip install '.[bench]'`."
        )
    distances = ', '.join(f'{distance:g}' for distance in DISTANCES)
    return (
        f"{text} ICP, PLANE_ICP (point to plane) and GICP are small_gicp's, each at the best for "
        f'that case of the correspondence distances {distances} r_4th: that with the fewest '
        'failures among its first four starts, then the least median error.'
    )


def _verdict(kind, outcomes, methods):
    rows = []
    for k, method in enumerate(methods):
        rates = {outcome.name: outcome.figures[k].success for outcome in outcomes}
        missed = ', '.join(
            f'{case} {100 * rate:.0f} %' for case, rate in rates.items() if rate < 1
        )
        mean = f'{100 * np.mean(list(rates.values())):.1f}'
        rows.append((method, missed or '-', sum(rate == 1 for rate in rates.values()), mean))
    header = (kind, 'cases with failures', f'all succeed, of {len(outcomes)}', 'mean success [%]')
    return table(header, rows, left=2)


def _table(outcomes, methods, cell):
    kinds = list(outcomes)
    header = [
        method if len(kinds) == 1 else f'{method} {kind}' for method in methods for kind in kinds
    ]
    rows = []
    for pair in zip(*outcomes.values(), strict=True):
        cells = [
            cell(outcome.figures[k], MM[outcome.unit])
            for k in range(len(methods))
            for outcome in pair
        ]
        rows.append((pair[0].name, *cells))
    return table(('case', *header), rows)


def _starts_table(outcomes, peers):
    methods = methods_of(peers)[len(CONFIGS) :]
    header = (
        *('case', 'points', 'in common', 'r_4th [mm]'),
        *('X [mm]', 'Y [mm]', 'Z [mm]', 'about X [deg]', 'about Y [deg]', 'about Z [deg]'),
        *(f'{method} [r_4th]' for method in methods),
    )
    rows = []
    for outcome in outcomes:
        units = np.repeat((MM[outcome.unit], np.degrees(1.0)), 3)[:, None]
        ends = [f'{low:.1f} to {high:.1f}' for low, high in np.array(outcome.reach) * units]
        points = ' / '.join(map(str, outcome.points))
        distances = [f'{of.setting.distance:g}' for of in outcome.figures[len(CONFIGS) :]]
        r_4th = f'{MM[outcome.unit] * outcome.r_4th:.2f}'
        rows.append((outcome.name, points, outcome.in_common, r_4th, *ends, *distances))
    return table(header, rows)
