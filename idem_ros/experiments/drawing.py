"""How the figures are drawn: one width, one type size, one colour scale, one pair of marks."""

import numpy as np

WIDTH = 7.0  # [in], of a page's text
TYPE = 8  # [pt], the least
COLOURS = 'magma'
MARK = '#39ff14'  # the paper's green, bright enough on all of the colour scale
NAMES = {'rx': 'about X', 'ry': 'about Y', 'rz': 'about Z'}
TARGET, SOURCE = '#1b9e3e', '#c2259b'  # the paper's green and magenta
REGION = 'region of interest (dashed: open)'
VIEW = {'elev': 24, 'azim': -52}


def canvas(rows, columns, height, width=WIDTH, **arguments):
    """Return a figure and its array of axes (rows, columns); arguments as for plt.subplots."""
    import matplotlib as mpl

    mpl.use('Agg')
    from matplotlib import pyplot as plt

    # Not rc_context: ticks are made, and look at the size, when the figure is saved.
    mpl.rcParams.update({'font.size': TYPE, 'axes.titlesize': TYPE + 1, 'legend.fontsize': TYPE})
    size = {'figsize': (width, height), 'layout': 'constrained'}
    return plt.subplots(rows, columns, squeeze=False, **size, **arguments)


def title_of(figure):
    """Return 'Figure N', N the label in the paper's source: from 15 on, one more than printed."""
    if figure.printed == figure.number:
        return f'Figure {figure.number}'
    return f"Figure {figure.number} (its label in the paper's source; {figure.printed} in print)"


def axis_label(name, unit):
    """Return a label such as 'shift along X [mm]' or 'turn about Z [deg]'."""
    return (
        f'turn {NAMES[name]} [{unit}]' if name in NAMES else f'shift along {name.upper()} [{unit}]'
    )


def draw_map(axes, shown, letter):
    """Draw a `Map`: a cross at perfect alignment, a circle at the minimum, the ROI dashed."""
    u, v = shown.coordinates
    image = axes.pcolormesh(u, v, shown.values.T, cmap=COLOURS, shading='nearest', rasterized=True)
    if shown.region is not None:
        draw_outline(axes, u, v, shown.region)
    axes.plot(0, 0, '+', color=MARK, ms=9, mew=1.4)
    axes.plot(*shown.minimum, 'o', mfc='none', mec=MARK, ms=9, mew=1.2)
    axes.set(
        title=f'({letter}) {shown.title}',
        xlabel=axis_label(shown.axes[0], shown.unit),
        ylabel=axis_label(shown.axes[1], shown.unit),
        aspect='equal',
    )
    bar = axes.figure.colorbar(image, ax=axes, label=shown.label, location='bottom', aspect=25)
    bar.ax.locator_params(nbins=4)


def draw_outline(axes, u, v, region):
    """Draw the border of a `GridRegion`, along its cells; dashed where it reaches the edge."""
    from matplotlib.collections import LineCollection

    edges = [np.append(c, c[-1] + c[1] - c[0]) - (c[1] - c[0]) / 2 for c in (u, v)]
    padded = np.pad(region.inside, 1)
    lines = []
    for i, j in np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1]):
        lines.append([(edges[0][i], edges[1][j]), (edges[0][i], edges[1][j + 1])])
    for i, j in np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1]):
        lines.append([(edges[0][i], edges[1][j]), (edges[0][i + 1], edges[1][j])])
    style = 'solid' if region.closed else (0, (1.5, 1.5))
    axes.add_collection(LineCollection(lines, colors='white', linewidths=1.0, linestyles=style))


def legend_of_marks(figure):
    """Say below the figure what cross, circle and line are."""
    from matplotlib.lines import Line2D

    marks = [
        Line2D([], [], ls='', marker='+', color='#1fa80a', ms=9, label='perfect alignment'),
        Line2D([], [], ls='', marker='o', mfc='none', mec='#1fa80a', ms=8, label='minimum'),
        Line2D([], [], color='white', lw=1.2, label=REGION, path_effects=_rim()),
    ]
    figure.legend(handles=marks, loc='outside lower center', ncols=len(marks), frameon=False)


def _rim():
    from matplotlib import patheffects

    return [patheffects.Stroke(linewidth=2.4, foreground='#444444'), patheffects.Normal()]


def colour_scale(values):
    """Return a ScalarMappable over the range of some values."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(float(np.min(values)), float(np.max(values))), COLOURS)


def draw_faces(axes, corners, values, scale, volume, title, reach):
    """Draw coloured squares in space, (F, 4, 3) corners with a value (F,) each.

    Names and unit of the axes are those of a volume, they range from -reach to reach.
    """
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    faces = Poly3DCollection(corners, facecolors=scale.to_rgba(values), edgecolors='none')
    faces.set(antialiased=False, rasterized=True)
    axes.add_collection3d(faces)
    limits = (-reach, reach)
    axes.set(xlim=limits, ylim=limits, zlim=limits)
    axes.set_title(title, y=0.98)
    axes.set_box_aspect((1, 1, 1), zoom=0.82)
    axes.view_init(**VIEW)
    labels = [f'{NAMES.get(name, name.upper())} [{volume.unit}]' for name in volume.axes]
    axes.set(xlabel=labels[0], ylabel=labels[1], zlabel=labels[2])
    axes.tick_params(pad=-1)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_major_locator(MaxNLocator(4, steps=(1, 2, 5, 10)))


def planes_in_space(offsets, slices):
    """Return corners (F, 4, 3) and values (F,) of three crossing planes of squares.

    Args:
        offsets: (n,) of the squares' middles along each axis.
        slices: {normal axis 0..2: (n, n) values over the other two}, each plane through 0.
    """
    edges = _edges(offsets)
    corners, values = [], []
    for normal, of_plane in slices.items():
        a, b = (k for k in range(3) if k != normal)
        i, j = (m.ravel() for m in np.indices(of_plane.shape))
        square = np.zeros((i.size, 4, 3))
        for corner, (di, dj) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            square[:, corner, a], square[:, corner, b] = edges[i + di], edges[j + dj]
        corners.append(square)
        values.append(of_plane.ravel())
    return np.concatenate(corners), np.concatenate(values)


def skin_of(inside, offsets, volume):
    """Return corners (F, 4, 3) and values (F,) of the squares between a region and the rest.

    Args:
        inside: (n, n, n) bool.
        offsets: (n,) of the cells' middles along each axis.
        volume: (n, n, n) values; a square has that of its cell within the region.
    """
    edges, padded = _edges(offsets), np.pad(inside, 1)
    corners, values = [], []
    for axis in range(3):
        a, b = (k for k in range(3) if k != axis)
        for side in (0, 1):
            beyond = np.roll(padded, 1 - 2 * side, axis)[1:-1, 1:-1, 1:-1]
            cells = np.argwhere(inside & ~beyond)
            square = np.zeros((len(cells), 4, 3))
            square[:, :, axis] = edges[cells[:, axis] + side][:, None]
            for corner, (da, db) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
                square[:, corner, a] = edges[cells[:, a] + da]
                square[:, corner, b] = edges[cells[:, b] + db]
            corners.append(square)
            values.append(volume[tuple(cells.T)])
    return np.concatenate(corners), np.concatenate(values)


def _edges(middles):
    step = middles[1] - middles[0]
    return np.append(middles - step / 2, middles[-1] + step / 2)
