"""The accuracy of all methods as Markdown and as what JSON holds."""

from dataclasses import asdict

from benchmarks.case import LEVELS
from benchmarks.judged_figures import verdicts
from benchmarks.real_pairs import TRUSTED
from idem_ros.terminal.markdown import number, table

HEADER = (
    *('row', 'method', 'setting', 'success'),
    *('rotation [deg] median', 'p90', 'translation [mm] median', 'p90'),
    *('successful: [deg] median', 'p90', '[mm] median', 'p90'),
)
NOTE = """Each row pools several scenes or samplings. Starts are off by the given multiple of r4th
(of the clouds as registered, Eq. 9 at a = 1) and angle, in random directions; the source turns
about its centroid, and translation errors are those of its centroid. Success: below 1 deg and
0.5 r4th. Each peer bears the setting that served it best at this row and level (by success, then
median error): of all these very runs, an oracle that no user has, or on a real pair of its first
four. Distances and voxels are multiples of r4th. IDEM has one setting everywhere. All methods stop
at the same criteria, and the peers work in units of r4th. A peer's smaller error counts where it
tells: not where both are within what the truth is uncertain by, which is {uncertainties}.
Scenes and samplings are drawn: of 2000 drawings with replacement from those of a row, 95 % have a
ratio of IDEM's error to the best peer's within what is given as chance; it is beyond chance where
all of these are smaller than 1.
"""


def markdown(results):
    """Return the verdicts, then a table for each level."""
    parts = ['## Accuracy\n', NOTE.format(uncertainties=_uncertainties()), _verdict_list(results)]
    for level, (multiple, degrees) in enumerate(LEVELS):
        parts.append(f'### From {multiple} r4th and {degrees:g} deg\n')
        rows = [row for result in results for row in _rows(result, level)]
        parts.append(table(HEADER, rows))
    return '\n'.join(parts)


def _uncertainties():
    known = [(name, deg, m) for _, name, _, deg, m, _ in TRUSTED if deg or m]
    return ', '.join(f'{name} {deg:g} deg and {1e3 * m:g} mm' for name, deg, m in known)


def summary(results):
    """Return the verdicts as text."""
    return '\n'.join(str(verdict) for verdict in verdicts(results))


def json_record(results):
    """Return all figures and the verdicts as what JSON holds."""
    return {
        'levels': [{'r4th': multiple, 'rotation_deg': degrees} for multiple, degrees in LEVELS],
        'rows': [asdict(result) for result in results],
        'verdicts': [asdict(verdict) for verdict in verdicts(results)],
    }


def _verdict_list(results):
    lines = summary(results).splitlines()
    return (
        '\n'.join(f'  - {line.strip()}' if line[0] == ' ' else f'- {line}' for line in lines)
        + '\n'
    )


def _rows(result, level):
    name = f'{result.name} (r4th {1e3 * result.spacing:.3g} mm)'
    for figures in result.levels[level]:
        rotation, translation = figures.rotation_deg, figures.translation_m
        cells = [name, figures.method, figures.setting, f'{figures.success:.0%}']
        for suffix in ('', '_successful'):
            for values, scale in ((rotation, 1.0), (translation, 1e3)):
                cells += [number(values[f'{k}{suffix}'], scale) for k in ('median', 'p90')]
        yield cells
        name = ''
