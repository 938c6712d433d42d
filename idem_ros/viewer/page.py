"""Pages that are one file, in which nothing else can run; that of one registration among them."""

import io
from base64 import b64encode
from hashlib import sha256
from importlib.resources import files
from typing import Any

import numpy as np
from jinja2 import Environment, FunctionLoader, StrictUndefined
from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure

from idem_ros.terminal.printable import printable

STYLE: dict[Any, Any] = {
    'font.size': 9,
    'axes.titlesize': 9,
    'legend.fontsize': 8,
    'svg.hashsalt': 'idem',
}
METADATA = {'svg': {'Date': None}, 'png': {'Software': None}}
SCRIPTS = 'viewer/three.min.js', 'viewer/viewer.js'


def save(figure):
    """Return a figure as (SVG, PNG); the same bytes for the same figure."""
    svg = saved_as('svg', figure, 140)
    figure.set_layout_engine('none')  # it is laid out now, which takes as long as to draw it
    return svg, saved_as('png', figure, 140)


def saved_as(kind, figure, dpi):
    """Return a figure as 'svg' or 'png'; the same bytes for the same figure."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, metadata=METADATA[kind], dpi=dpi)
    return file.getvalue()


def environment():
    """Return the `Environment` of a page: every value is escaped and `printable`.

    Templates are named by their path within the package, as 'viewer/viewer.html.jinja'.
    """
    made = Environment(
        autoescape=True,
        finalize=_without_controls,
        loader=FunctionLoader(text_of),
        undefined=StrictUndefined,
        trim_blocks=True,
    )
    made.filters['link'] = data_link
    return made


def text_of(name):
    """Return the text of a file beside the code, by its path within the package."""
    return files('idem_ros').joinpath(name).read_text(encoding='utf-8')


def policy(scripts):
    """Return the Content-Security-Policy of a page on which these scripts, and no others, run."""
    digests = (b64encode(sha256(script.encode()).digest()).decode() for script in scripts)
    allowed = ' '.join(f"'sha256-{digest}'" for digest in digests)
    return (
        f"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {allowed}"
    )


def data_link(content, kind):
    """Return bytes of a kind as an address that a page holds itself."""
    return f'data:{kind};base64,{b64encode(content).decode()}'


def _without_controls(value):
    return value if isinstance(value, Markup) else printable(value)


def page(scene):
    """Return the page of a `Scene`."""
    scripts = [text_of(name) for name in (*SCRIPTS, 'viewer/page.js')]
    with rc_context(STYLE):
        curves = saved_as('svg', _drawn(scene.curves), 140)
    return (
        environment()
        .get_template('viewer/viewer.html.jinja')
        .render(
            policy=policy(scripts),
            scene=scene,
            style=text_of('viewer/page.css') + text_of('viewer/viewer.css'),
            curves=curves,
            scripts=scripts,
        )
    )


def _drawn(curves):
    figure = Figure((9.0, 4.4), layout='constrained')
    for axes, curve in zip(figure.subplots(2, 3).flat, curves, strict=False):
        unit = 'm' if len(curve.axis) == 1 else 'deg'
        axes.plot(curve.offsets, curve.q_tot, lw=1.2)
        axes.axvline(0.0, color='#1c2530', lw=0.8)
        axes.axvline(curve.guess, color='#d1495b', lw=1.0, ls='--')
        crests = np.interp(curve.crests, curve.offsets, curve.q_tot) if curve.crests else ()
        axes.plot(curve.crests, crests, 'o', ms=4, color='#2e8b57')
        axes.set(xlabel=f'{curve.axis} [{unit}]', ylabel='q_tot [nat]')
        axes.grid(alpha=0.25, lw=0.6)
    return figure
