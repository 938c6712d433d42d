"""Figures 6 and 16: q_tot over planes and volumes of displacements, and the region of interest."""

from typing import NamedTuple

import numpy as np

from idem_ros.core.metric.landscape import q_on_grid
from idem_ros.core.metric.region_of_interest import (
    AxialRegion,
    GridRegion,
    region_along_axes,
    region_on_grid,
)
from idem_ros.experiments.conditions import make_case
from idem_ros.experiments.drawing import (
    canvas,
    colour_scale,
    draw_faces,
    draw_map,
    legend_of_marks,
    planes_in_space,
    skin_of,
    title_of,
)
from idem_ros.experiments.experiment import figure_page, write_outputs
from idem_ros.experiments.maps import landscape_of, q_map, symmetric_range
from idem_ros.terminal.markdown import table

SHIFTS, TURNS = ('x', 'y', 'z'), ('rx', 'ry', 'rz')
HEADER = ('panel', *SHIFTS, *TURNS, 'q_tot', 'inside_roi')
# Reach, step and step of --quick: [mm] and [deg].
OF_SHIFTS, OF_TURNS = (5.0, 0.25, 0.5), (25.0, 1.25, 2.5)
ALL_SHIFTS, ALL_TURNS = (80.0, 1.0, 5.0), (180.0, 2.0, 10.0)


class Volumes(NamedTuple):
    """A figure of the paper: which pair, and what it shows."""

    number: int
    printed: int
    case: str
    shows: str


class Volume(NamedTuple):
    """q_tot over three displacements, and the region of interest among them."""

    axes: tuple
    offsets: np.ndarray  # (n,) of each axis [mm] or [deg]
    q: np.ndarray  # (n, n, n)
    region: GridRegion
    unit: str


FIGURES = (
    Volumes(
        6,
        6,
        'B0-B0',
        'Translations in the XY plane until the clouds are apart (a), within the region of '
        'interest on three planes (b), a section of its volume (c) and all of it (d); rotations '
        'around X and Y (e) and likewise (f, g, h). q_tot is 0 in the centre, and 0 again where '
        'the clouds are apart; for rotations, 0 in the centre only. The maxima lie at 3 to 7 mm '
        'and at 10 to 15 degrees.',
    ),
    Volumes(
        16,
        15,
        'B0p1-Brp',
        'The partial, remeshed pair: q_tot for translations within the region of interest on the '
        "XY, XZ and YZ planes (a), and for rotations around the centroid's X, Y and Z axes (b).",
    ),
)


def run(figure, context):
    """Write one of `FIGURES`; see `Experiment`."""
    case = make_case(figure.case, context.model, context.seed)
    landscape = landscape_of(case, context.threads)
    along_axes = region_along_axes(landscape)
    ranges = ((SHIFTS, OF_SHIFTS), (TURNS, OF_TURNS))
    steps = context.progress(ranges, desc=f'figure{figure.number}')
    volumes = [_volume(landscape, axes, _offsets(of, context)) for axes, of in steps]
    maps = _maps(case, landscape, context) if figure.number == 6 else []
    stem = context.out / f'figure{figure.number}'
    drawn = _whole(figure, maps, volumes) if maps else _planes_only(figure, volumes)
    page = _page(figure, context, case, along_axes, volumes)
    return write_outputs(stem, HEADER, _rows(maps, volumes), drawn, page)


def _offsets(of, context):
    reach, step, quick_step = of
    return symmetric_range(reach, quick_step if context.quick else step)


def _maps(case, landscape, context):
    ranges = ((SHIFTS[:2], ALL_SHIFTS), (TURNS[:2], ALL_TURNS))
    return [q_map(case, landscape, axes, _offsets(of, context)) for axes, of in ranges]


def _volume(landscape, axes, offsets: np.ndarray):
    is_turn = axes == TURNS
    in_own_unit = np.deg2rad(offsets) if is_turn else offsets
    q = q_on_grid(landscape, **dict.fromkeys(axes, in_own_unit))
    region = region_on_grid(q, offsets[1] - offsets[0])
    return Volume(axes, offsets, q, region, 'deg' if is_turn else 'mm')


def _rows(maps, volumes):
    rows = []
    for panel, shown in zip('ae', maps, strict=False):
        rows += _rows_of(panel, shown.axes, shown.coordinates, shown.values, shown.region.inside)
    for panel, shown in zip('df' if maps else 'ab', volumes, strict=True):
        rows += _rows_of(panel, shown.axes, [shown.offsets] * 3, shown.q, shown.region.inside)
    return rows


def _rows_of(panel, axes, coordinates, values, inside):
    columns = {name: np.zeros(values.size) for name in (*SHIFTS, *TURNS)}
    for name, mesh in zip(axes, np.meshgrid(*coordinates, indexing='ij'), strict=True):
        columns[name] = mesh.ravel()
    offsets = np.array(list(columns.values())).T.tolist()
    return [
        (panel, *(f'{c:.6g}' for c in offset), f'{q:.8g}', int(within))
        for offset, q, within in zip(offsets, values.ravel(), inside.ravel(), strict=True)
    ]


def _whole(figure, maps, volumes):
    """Four rows of two: translations to the left, rotations to the right."""
    drawn, axes = canvas(4, 2, 13.5)
    for column, (shown, volume) in enumerate(zip(maps, volumes, strict=True)):
        letters = 'abcd' if column == 0 else 'efgh'
        draw_map(axes[0, column], shown, letters[0])
        axes[0, column].set_title(f'({letters[0]}) {"turns" if column else "shifts"}')
        places = [_in_space(drawn, axes[row, column]) for row in (1, 2, 3)]
        scale = colour_scale(volume.q)
        titles = ('three planes', 'section of the ROI', 'the ROI')
        reaches = (volume.offsets[-1], *[_reach_of(volume)] * 2)
        for place, *lettered, reach, faces in zip(
            places, letters[1:], titles, reaches, _faces(volume), strict=True
        ):
            draw_faces(place, *faces, scale, volume, '({}) {}'.format(*lettered), reach)
        drawn.colorbar(scale, ax=places, label='q_tot [nat]', location='bottom', aspect=30)
    drawn.suptitle(f'Figure {figure.number}: q_tot of B0 with itself')
    legend_of_marks(drawn)
    return drawn


def _planes_only(figure, volumes):
    drawn, axes = canvas(1, 2, 4.2)
    for place, letter, volume in zip(axes[0], 'ab', volumes, strict=True):
        space, scale = _in_space(drawn, place), colour_scale(volume.q)
        title = f'({letter}) {"turns" if volume.axes == TURNS else "shifts"} on three planes'
        draw_faces(space, *next(_faces(volume)), scale, volume, title, volume.offsets[-1])
        drawn.colorbar(scale, ax=space, label='q_tot [nat]', location='bottom', aspect=30)
    drawn.suptitle(f'Figure {figure.number}: q_tot of {figure.case.replace("-", " and ")}')
    return drawn


def _in_space(drawn, place):
    """Put axes of three dimensions in place of flat ones."""
    place.remove()
    return drawn.add_subplot(place.get_subplotspec(), projection='3d')


def _reach_of(volume):
    """Return how far the region reaches from the pose along the widest axis."""
    inside = np.argwhere(volume.region.inside)
    return float(np.abs(volume.offsets[inside]).max() + volume.offsets[1] - volume.offsets[0])


def _faces(volume):
    """Yield what to draw: the three planes, the region cut open, the whole region."""
    middle = len(volume.offsets) // 2
    planes = {normal: np.take(volume.q, middle, normal) for normal in range(3)}
    yield planes_in_space(volume.offsets, planes)
    section = volume.region.inside.copy()
    section[:, :middle] = False  # the half towards the eye
    yield skin_of(section, volume.offsets, volume.q)
    yield skin_of(volume.region.inside, volume.offsets, volume.q)


def _page(figure, context, case, along_axes: AxialRegion, volumes):
    header = ('axis', 'maximum below', 'above', 'q_tot there', '')
    return figure_page(
        figure,
        f'{title_of(figure)}: {case.name}',
        context.model.note,
        f'{case.description}: {len(case.target)} and {len(case.source)} points, a = 1, '
        'lengths in mm. The region of interest is what lies on the side of the pose of the '
        'watershed between the pose and the edge of the grid; along an axis it ends at the '
        'nearest maximum (`idem_ros.core.metric.region_of_interest`). Rotations are around the '
        "centroid of the source. The paper's picture is not part of its source.",
        '\n'.join(map(_of_volume, volumes)),
        table(header, _axis_rows(along_axes), left=1),
        f'q_tot at perfect alignment: {along_axes.q_pose:.4g} nat.',
    )


def _of_volume(volume):
    region = volume.region
    kind = 'Rotations' if volume.axes == TURNS else 'Translations'
    bound = '' if region.closed else ', a lower bound: the region reaches the edge of the grid'
    at = ', '.join(f'{volume.offsets[i]:g}' for i in region.minimum)
    return (
        f'- {kind}: the region of interest has {region.measure:.4g} {volume.unit}³{bound}; the '
        f'crown is {region.lowest_pass:.4g} nat at its lowest; q_IDEM (Eq. 14) is '
        f'{region.q_idem:.4g} nat, at ({at}) {volume.unit}.'
    )


def _axis_rows(along_axes):
    for k, name in enumerate((*SHIFTS, *TURNS)):
        turns = name in TURNS
        low, high = np.rad2deg(along_axes.extent[k]) if turns else along_axes.extent[k]
        unit = 'deg' if turns else 'mm'
        below, above = along_axes.crown[k]
        what = f'about {name[1].upper()}' if turns else f'along {name.upper()}'
        yield what, f'{low:.2f} {unit}', f'{high:.2f} {unit}', f'{below:.5g}', f'{above:.5g}'
