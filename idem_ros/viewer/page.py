"""The page of one registration: a file that opens without a network."""

import json
from base64 import b64encode
from hashlib import sha256
from importlib.resources import files

import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure

from idem_ros.core.geometry.se3 import transform_points
from idem_ros.report.page import data_link
from idem_ros.report.plots import STYLE, save
from idem_ros.report.views import draw_from_above, png, seen_from_above
from idem_ros.terminal.printable import printable

GUESS, REFINED = 'at the guess', 'refined'


def page(scene, headline):
    """Return the page of a `Scene`, its verdict said in the headline."""
    scripts = {
        'three': _beside('three.min.js'),
        'data': f'const SCENE = {json.dumps(_data(scene))};',
        'script': _beside('viewer.js'),
    }
    allowed = ' '.join(f"'sha256-{_digest(script)}'" for script in scripts.values())
    environment = Environment(
        autoescape=True, finalize=_without_controls, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters['link'] = data_link
    with rc_context(STYLE):
        pictures = dict(_from_above(scene))
        curves, _ = save(_drawn(scene.curves))
    return environment.from_string(_beside('viewer.html.jinja')).render(
        policy=f"default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; "
        f'script-src {allowed}',
        scene=scene,
        headline=headline,
        names=_names(scene),
        style=_beside('viewer.css'),
        pictures=pictures,
        curves=curves,
        **scripts,
    )


def _data(scene):
    """What the script draws, as JSON: points in base64, poses by columns."""
    spread = np.percentile(np.abs(transform_points(scene.poses[-1], scene.source)), 95)
    arrays = {name: getattr(scene, name) for name in ('target', 'source', 'means', 'q')}
    return {
        **{name: _encoded(values) for name, values in arrays.items()},
        'poses': [pose.T.ravel().tolist() for pose in scene.poses],
        'names': _names(scene),
        'free': scene.free.tolist(),
        'extent': 2.0 * float(spread) or 1.0,
    }


def _names(scene):
    return [GUESS, *(f'step {k}' for k in range(1, len(scene.poses) - 1)), REFINED]


def _encoded(values):
    return b64encode(np.ascontiguousarray(values, dtype='<f4').tobytes()).decode()


def _digest(script):
    return b64encode(sha256(script.encode()).digest()).decode()


def _beside(name):
    return files(__package__).joinpath(name).read_text(encoding='utf-8')


def _without_controls(value):
    return value if isinstance(value, Markup) else printable(value)


def _from_above(scene):
    refined = transform_points(scene.poses[-1], scene.source)
    view = seen_from_above(refined, 0.0)
    for name, pose in ((GUESS, scene.poses[0]), (REFINED, scene.poses[-1])):
        moved = transform_points(pose, scene.source)
        yield name, png(draw_from_above(scene.target, moved, *view, name))


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
