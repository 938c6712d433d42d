"""The page of a report: one HTML file that holds all it shows and asks no network for anything."""

from base64 import b64encode
from hashlib import sha256
from html import escape as escaped
from importlib.resources import files
from itertools import groupby

from idem_ros.evaluation import report_tables
from idem_ros.evaluation.report_plots import COLOURS
from idem_ros.printable import printable

MISSING = '–'
LONG = 48  # letters of a cell from which on it is cut, and told in full on hovering
CAPTIONS = {
    'before': 'at the initial guess, from above',
    'after': 'refined, from above',
    'q_tot': 'slice of q_tot around the result: a valley at the circle is what is sought',
}
READING = {
    'before, after': 'at the initial guess and at the refined pose.',
    'translation and rotation error': 'distance and angle to the ground truth; left out where the '
    'recording has none.',
    'q_tot': 'the local entropy of both clouds together minus that of each [nat]: the less, the '
    'better they agree. It depends on the number of points, so compare a frame with itself.',
    'q_mean': 'q_tot per point that has a neighbour in the other cloud; may be compared between '
    'frames.',
    'overlap': 'share of the points that have a neighbour in the other cloud.',
    'verdict, reason': 'whether the pose can be trusted, and what speaks against it.',
    'sigma': 'the largest standard deviation of the position and of the rotation, of the '
    'covariance of the pose; left out where nothing is known of it.',
    'basin': 'where the guess was: 0 at the minimum, 1 at the rim of the basin that leads to it.',
    'position and rotation, 2nd difference': 'how far each pose is from where its neighbours in '
    'time would have it, twice; with evenly spaced stamps the second difference of the '
    'trajectory. It is 0 for a steady motion; a single high value is a jump, of the vehicle or '
    'of the registration, and no error by itself. It says something where the target stays, as '
    'a map does.',
    'time': 'of reading the messages and registering.',
    'cumulative': 'the share of the frames whose number is at most that on the axis.',
    'before against after': 'a point a frame; below the line the refinement has lowered it.',
}


def page(runs, plots, worst, downloads):
    """Return the page.

    Args:
        runs: [`Run`].
        plots: [`Plot`], those of one measure in a row.
        worst: for each run (`Table` of its worst frames, sentence on their order, [`Pictures`]).
        downloads: {file name: bytes of CSV}.
    """
    script, style = (_beside(name) for name in ('report.js', 'report.css'))
    hashed = b64encode(sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; "
        f"script-src 'sha256-{hashed}'"
    )
    names = ', '.join(run.name for run in runs)
    return '\n'.join(
        [
            '<!DOCTYPE html>',
            '<html lang="en"><head><meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<link rel="icon" href="data:,">',
            f'<title>{escape(names)} - idem report</title>',
            f'<style>{style}</style></head><body>',
            _header(runs),
            _summary(runs),
            _plots(plots),
            *(_worst(number, run, *of_run) for number, (run, of_run) in _numbered(runs, worst)),
            _downloads(downloads),
            _reading(),
            f'<script>{script}</script></body></html>\n',
        ]
    )


def escape(text):
    """Return a text as HTML that shows it, and hides nothing of it."""
    return escaped(printable(text))


def _beside(name):
    return files(__package__).joinpath(name).read_text(encoding='utf-8')


def _numbered(runs, worst):
    return enumerate(zip(runs, worst, strict=True))


def _header(runs):
    entries = ''.join(
        f'<li><svg viewBox="0 0 22 8" aria-hidden="true"><rect width="22" height="8" '
        f'fill="{COLOURS[i % len(COLOURS)]}"/></svg>{escape(run.name)}</li>'
        for i, run in enumerate(runs)
    )
    parts = ('summary', 'plots', 'worst frames', 'downloads', 'how to read it')
    links = ''.join(f'<a href="#{_id(part)}">{part}</a>' for part in parts)
    return (
        f'<header><h1>idem report</h1><ul class="runs">{entries}</ul><nav>{links}</nav></header>'
    )


def _summary(runs):
    settings = report_tables.parameters(runs)
    differing = {row for row in settings.rows if len(set(row[1:])) > 1}
    judged = report_tables.verdicts(runs)
    verdicts = ('<h3>How they were judged</h3>', _table(judged)) if judged.rows else ()
    made = _table(settings, marked=differing) if settings.rows else _said_nothing(runs)
    return _section(
        'summary',
        '<h3>What became of the sources</h3>',
        _table(report_tables.outcomes(runs)),
        _notes(runs),
        *verdicts,
        '<h3>Before and after</h3>',
        _table(report_tables.before_and_after(runs)),
        '<details><summary>Every number of the frames</summary>',
        _table(report_tables.every_number(runs), 'tall'),
        '</details><details><summary>How the results were made: parameters, versions, '
        'recording</summary>',
        made,
        '</details>',
    )


def _notes(runs):
    """Return what the results say that a reader should know of their recordings."""
    entries = [
        f'<li>{escape(run.name)}: {escape(str(note))}</li>'
        for run in runs
        for note in run.result.record.get('notes') or ()
    ]
    return f'<ul class="note">{"".join(entries)}</ul>' if entries else ''


def _said_nothing(runs):
    says = 'The result does not say' if len(runs) == 1 else 'None of the results says'
    return f'<p class="note">{says} how it was made.</p>'


def _plots(plots):
    if not plots:
        return _section('plots', '<p class="note">No frame was refined; there is no plot.</p>')
    parts = []
    for measure, group in groupby(plots, key=lambda plot: plot.measure):
        figures = ''.join(_figure(plot.svg, 'svg+xml', plot.title) for plot in group)
        parts.append(f'<h3>{escape(measure)}</h3><div class="grid">{figures}</div>')
    return _section('plots', *parts)


def _worst(number, run, table, order, pictures):
    title = f'<h3>{escape(run.name)}</h3>'
    anchor = 'worst frames' if number == 0 else ''
    if not table.rows:
        return _section(anchor, title, '<p class="note">No frame was refined.</p>')
    ids = [f'pictures-{number}-{row[0]}' for row in table.rows]
    shown = ''.join(
        f'<div class="pictures" id="{id_}"><h3>Frame {row[0]}</h3>{_of_frame(each)}</div>'
        for id_, row, each in zip(ids, table.rows, pictures, strict=True)
    )
    return _section(
        anchor,
        title,
        f'<p class="soft">Ordered {escape(order)}. A click on a row shows its pictures.</p>',
        f'<div class="worst">{_table(table, pictures=ids)}{shown}</div>',
    )


def _of_frame(pictures):
    figures = ''.join(
        _figure(image, 'png', CAPTIONS[key]) for key, image in pictures.images.items()
    )
    note = f'<p class="note">{escape(pictures.note)}</p>' if pictures.note else ''
    return f'{note}<div class="grid">{figures}</div>'


def _downloads(downloads):
    links = ''.join(
        f'<li><a download="{escape(name)}" href="{_as_link(content, "text/csv")}">'
        f'{escape(name)}</a></li>'
        for name, content in downloads.items()
    )
    beside = '<p class="soft">They lie beside this page, too, as do the pictures as PNG.</p>'
    return _section('downloads', f'<ul>{links}</ul>', beside)


def _reading():
    entries = ''.join(f'<dt>{term}</dt><dd>{meaning}</dd>' for term, meaning in READING.items())
    return _section('how to read it', f'<dl>{entries}</dl>')


def _section(title, *parts):
    heading = f'<h2 id="{_id(title)}">{title[0].upper()}{title[1:]}</h2>' if title else ''
    return f'<section>{heading}{"".join(parts)}</section>'


def _id(title):
    return title.replace(' ', '-')


def _figure(image, kind, caption):
    link = _as_link(image, f'image/{kind}')
    text = escape(caption)
    return f'<figure><img src="{link}" alt="{text}"><figcaption>{text}</figcaption></figure>'


def _as_link(content, kind):
    return f'data:{kind};base64,{b64encode(content).decode()}'


def _table(table, kind='', marked=(), pictures=()):
    """Return a table in a box of its own that scrolls; `pictures` are what its rows show."""
    numeric = [
        any(isinstance(row[k], int | float) for row in table.rows)
        for k in range(len(table.header))
    ]
    heads = ''.join(
        f'<th class="{"number" if is_numeric else ""}" scope="col">{escape(str(title))}</th>'
        for title, is_numeric in zip(table.header, numeric, strict=True)
    )
    lines = []
    for i, row in enumerate(table.rows):
        cells = [_cell(value, numeric[k]) for k, value in enumerate(row)]
        attributes = ' class="differs"' if row in marked else ''
        if pictures:
            attributes = f' data-pictures="{pictures[i]}"'
            button = f'<button type="button" aria-controls="{pictures[i]}">{row[0]}</button>'
            cells[0] = f'<td class="number">{button}</td>'
        lines.append(f'<tr{attributes}>{"".join(cells)}</tr>')
    return (
        f'<div class="scroll {kind}" tabindex="0"><table><thead><tr>{heads}</tr></thead>'
        f'<tbody>{"".join(lines)}</tbody></table></div>'
    )


def _cell(value, is_numeric):
    if value is None:
        text = MISSING
    elif isinstance(value, float):
        text = f'{value:.4g}'
    else:
        text = str(value)
    if len(text) > LONG:
        return f'<td class="long" title="{escape(text)}">{escape(text)}</td>'
    return f'<td class="{"number" if is_numeric else ""}">{escape(text)}</td>'
