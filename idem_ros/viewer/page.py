"""The page of one registration: a file that opens without a network."""

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from idem_ros.viewer.figures import STYLE, saved_as
from idem_ros.viewer.one_file import environment, policy, text_of

SCRIPTS = 'viewer/three.min.js', 'viewer/viewer.js'


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
