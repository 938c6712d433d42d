"""Table 2: the error of q_tot, RMSE, Chamfer and Hausdorff in each of the 20 cases."""

import json
from typing import NamedTuple

from idem_ros.experiments import figures_maps
from idem_ros.experiments.conditions import case_names, make_case
from idem_ros.experiments.distances import CloudDistances, Distances
from idem_ros.experiments.drawing import canvas
from idem_ros.experiments.experiment import settings_of, write_outputs
from idem_ros.experiments.figures_maps import IN_ROI, WIDE, XY, Row
from idem_ros.experiments.maps import (
    count_in_common,
    landscape_of,
    least_distances,
    nearest_minima,
    q_map,
)
from idem_ros.experiments.table2_page import METRICS, PAPER, page
from idem_ros.files.atomic_file import replacing

PARTS = 'table2_cases'  # folder of what an interrupted run need not do again
# The stairs' grids are those of figure 18; the table's errors of 10 to 24 mm lie beyond +-5 mm.
GRIDS = {
    'mm': Row(XY, IN_ROI, WIDE, ()),
    'm': next(each.rows[0] for each in figures_maps.FIGURES if each.case == 'S1-S2'),
}
HEADER = (
    *('case', 'description', 'unit', 'n1', 'n2', 'points_in_common', 'r_4th', 'paper_r_4th'),
    *(f'{end}{metric}_error' for metric in METRICS for end in ('', 'paper_')),
    *(f'{metric}_error_downhill' for metric in Distances._fields),
)


class Outcome(NamedTuple):
    """A row of the table, as it is here."""

    name: str
    description: str
    unit: str  # of all lengths: 'mm' or 'm'
    points: list  # of the target, of the source
    in_common: int  # points of the source that are points of the target
    r_4th: float  # of the pair
    errors: list  # of METRICS: from perfect alignment to the least value on the grid
    downhill: list  # of `Distances`: to where a descent over the grid from there ends
    steps: list  # of the grid of q_tot, of that of the distances


def run(context):
    """Write table 2; see `Experiment`."""
    rows = [_kept(name, context) for name in context.progress(case_names(), desc='table2')]
    stem = context.out / 'table2'
    cells, text = [_cells(row) for row in rows], page(context, rows, GRIDS)
    return write_outputs(stem, HEADER, cells, _figure(rows), text)


def outcome_of(case, grids, quick=False, threads=1):
    """Return the `Outcome` of a `Case`.

    Args:
        case: of `make_case`.
        grids: `Row` whose axes are two translations; its `of_rmse` holds for every distance.
        quick: take the grids' coarse steps.
        threads: that share the grid; the results are the same for any number.
    """
    landscape = landscape_of(case, threads)
    offsets = grids.of_q.offsets(quick), grids.of_rmse.offsets(quick)
    distances = CloudDistances(case.target, case.source, threads)
    least = least_distances(case, distances, grids.axes, offsets[1])
    return Outcome(
        name=case.name,
        description=case.description,
        unit=case.unit,
        points=[len(case.target), len(case.source)],
        in_common=count_in_common(case),
        r_4th=landscape.radius,
        errors=[
            q_map(case, landscape, grids.axes, offsets[0]).error,
            *(found.error for found in least),
        ],
        downhill=list(nearest_minima(distances, grids.axes, offsets[1])),
        steps=[float(each[1] - each[0]) for each in offsets],
    )


def _kept(name, context):
    """Return the `Outcome` of a case, that which an interrupted run left if it has the same."""
    path, settings = context.out / PARTS / f'{name}.json', settings_of(context)
    record = read_part(path, settings)
    if record is not None:
        return Outcome(**record)
    case = make_case(name, context.model, context.seed)
    outcome = outcome_of(case, GRIDS[case.unit], context.quick, context.threads)
    write_part(path, settings, outcome._asdict())
    return outcome


def _cells(row):
    paper = PAPER[row.name]
    pairs = [
        f'{error:.4g}' for pair in zip(row.errors, paper.errors, strict=True) for error in pair
    ]
    return (
        *(row.name, row.description, row.unit, *row.points, row.in_common),
        *(f'{row.r_4th:.4g}', paper.r_4th, *pairs),
        *(f'{error:.4g}' for error in row.downhill),
    )


def _figure(rows):
    """Draw the errors of each metric, the paper's beside ours, case by case."""
    figure, axes = canvas(1, len(METRICS), 4.2, sharey=True)
    down = range(len(rows))
    for k, (panel, title) in enumerate(zip(axes[0], METRICS.values(), strict=True)):
        theirs, ours = [PAPER[row.name].errors[k] for row in rows], [row.errors[k] for row in rows]
        panel.plot(theirs, down, 's', mfc='none', label='paper')
        panel.plot(ours, down, '.', color='#d62728', label='here')
        panel.set(title=title, xlim=(-0.15, 40), xlabel='error [mm]')
        panel.set_xscale('symlog', linthresh=0.5)
        panel.set_xticks((0, 0.5, 5), ('0', '0.5', '5'))
        panel.grid(alpha=0.3)
    names = [row.name if row.unit == 'mm' else f'{row.name} [{row.unit}]' for row in rows]
    axes[0, 0].set_yticks(down, names)
    axes[0, 0].invert_yaxis()
    figure.suptitle('Table 2: from perfect alignment to the least value of each metric')
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc='outside lower center', ncols=2)
    return figure


def write_part(path, made_with, record):
    """Write a record (JSON), with the settings that it was made with."""
    path.parent.mkdir(exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(json.dumps({'made_with': made_with, 'record': record}) + '\n')


def read_part(path, made_with):
    """Return the record that a run of the same settings left; None if there is none."""
    try:
        part = json.loads(path.read_text())
        return part['record'] if part['made_with'] == made_with else None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
