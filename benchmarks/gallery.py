"""The pictures of docs/gallery.md: small, and each made of what the code computes."""

import io
import math
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from benchmarks.browser import SOFTWARE, NoBrowser, open_browser
from idem_ros.core import RegistrationConfig, register, undistort
from idem_ros.core.geometry.se3 import inverse, log, transform_points
from idem_ros.maps.open_map import open_map
from idem_ros.refinement.debug_clouds import slice_around
from idem_ros.simulation.city import write_city
from idem_ros.simulation.drive import drive, moving_drive, perturbed
from idem_ros.simulation.lidar import moving_scan, scan
from idem_ros.simulation.recording import SCANNER, map_of
from idem_ros.simulation.street import street
from idem_ros.simulation.town import BLOCK
from idem_ros.simulation.tunnel import tunnel
from idem_ros.viewer.page import STYLE, page
from idem_ros.viewer.scene import scene_of

SIZE, DPI, COLOURS = (6.2, 2.9), 100, 48
MOST_BYTES = 60_000
CONFIG = RegistrationConfig(voxel_size=0.5)
GREY, BLUE, RED = '#8a939c', '#1f6fb4', '#d1495b'
SWEEP_S, SPEED, TURN = 0.1, 15.0, math.radians(45.0)
WINDOW = (760, 900)
VIEW = "document.getElementById('view')"


def draw(folder):
    """Write every picture into a folder; yield (name, bytes), or (name, why there is none)."""
    pictures = {
        'solve': _solve,
        'trust': _trust,
        'valleys': _valleys,
        'sweep': _sweep,
        'map': _map,
    }
    for name, make in pictures.items():
        with rc_context(STYLE):
            file = io.BytesIO()
            make().savefig(file, dpi=DPI, metadata={'Software': None})
        yield name, _written(folder / f'{name}.png', file.getvalue())
    try:
        yield 'viewer', _written(folder / 'viewer.png', _viewer())
    except NoBrowser as error:
        yield 'viewer', str(error)


def _written(path, png):
    """Write a picture with few colours; return its size."""
    from PIL import Image

    image = Image.open(io.BytesIO(png)).convert('RGB')
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
    return path.stat().st_size


def _pair(scene, seed):
    """Return target, source, truth and a guess that is 1.5 degrees and 0.3 m off."""
    rng = np.random.default_rng(seed)
    seen = scene(rng)
    target = map_of(seen, 11, 40_000, rng)
    pose = next(islice(drive(seen, 11, rng), 5, None))
    return target, scan(seen, pose, SCANNER, rng), pose, perturbed(pose, 1.5, 0.3, rng)


def _figure(columns=1):
    figure = Figure(SIZE, layout='constrained')
    return figure, np.atleast_1d(figure.subplots(1, columns))


def _solve():
    target, source, truth, guess = _pair(street, 0)
    result = register(target, source, guess, CONFIG)
    off = np.array([log(inverse(truth) @ pose) for pose in (guess, *result.path)])
    figure, (axes,) = _figure()
    axes.semilogy(
        1e3 * np.linalg.norm(off[:, 3:], axis=1), '.-', color=BLUE, label='position [mm]'
    )
    degrees = np.degrees(np.linalg.norm(off[:, :3], axis=1))
    axes.semilogy(degrees, '.-', color=RED, label='rotation [deg]')
    axes.set(xlabel='step of the solve', ylabel='off the truth')
    axes.grid(alpha=0.25)
    axes.legend()
    return figure


def _trust():
    target, source, truth, _ = _pair(street, 0)
    audit = RegistrationConfig(voxel_size=0.5, mode='audit')
    offsets = np.linspace(-0.3, 0.3, 25)
    figure, (axes,) = _figure()
    for axis, colour in (('x', BLUE), ('y', RED), ('z', '#2e8b57')):
        likely = []
        for offset in offsets:
            pose = truth.copy()
            pose['xyz'.index(axis), 3] += offset
            likely.append(register(target, source, pose, audit).assessment.p_aligned)
        axes.plot(100 * offsets, likely, '.-', color=colour, label=f'moved along {axis}')
    axes.axvspan(-5, 5, color=GREY, alpha=0.25, lw=0, label='audit_tolerance')
    axes.set(xlabel='off the truth [cm]', ylabel='p_aligned')
    axes.grid(alpha=0.25)
    axes.legend(loc='upper right')
    return figure


def _valleys():
    figure, both = _figure(2)
    for axes, scene, name in zip(both, (street, tunnel), ('a street', 'a tunnel'), strict=True):
        target, source, truth, guess = _pair(scene, 0)
        result = register(target, source, guess, CONFIG)
        shown = slice_around(target, source, truth, truth, result.radius, CONFIG, 31)
        axes.pcolormesh(shown.shifts, shown.shifts, shown.q_tot, shading='gouraud')
        for motion in result.motions[~result.observable]:
            along = np.outer((-1, 1), motion[:2] / np.linalg.norm(motion[:2])) * shown.shifts[-1]
            axes.plot(*along.T, '--', color='white', lw=1.2, scalex=False, scaley=False)
        free = np.count_nonzero(~result.observable)
        axes.set(title=f'{name}: {free} of 6 motions free', xlabel='x [m]', ylabel='y [m]')
        axes.set_aspect('equal')
    return figure


def _sweep():
    rng = np.random.default_rng(2)
    seen = street(rng)
    target = map_of(seen, 11, 80_000, rng)
    poses, twists = moving_drive(seen, 3, rng, SPEED, TURN, SWEEP_S)
    pose, twist = poses[1], twists[1]
    points, times = moving_scan(seen, pose, twist, SWEEP_S, SCANNER, rng)
    figure, both = _figure(2)
    still = undistort(points, times, twist)
    for axes, shown, title in (
        (both[0], points, 'as measured'),
        (both[1], still, 'motion undone'),
    ):
        for cloud, colour in ((target, GREY), (transform_points(pose, shown), RED)):
            walls = cloud[(cloud[:, 2] > 0.5) & (cloud[:, 2] < 3.0)]
            axes.plot(*walls[:, :2].T, '.', ms=1.5, mew=0, color=colour)
        (x, y), reach = pose[:2, 3], 14.0
        axes.set(
            title=f'{title}: {SPEED:g} m/s',
            xlim=(x - reach, x + reach),
            ylim=(y - reach, y + reach),
        )
        axes.set_aspect('equal')
    return figure


def _map():
    figure, (axes,) = _figure()
    with TemporaryDirectory() as folder:
        write_city(Path(folder), 3 * BLOCK, 2, 0)
        tiles = open_map(Path(folder) / 'map', say=lambda line: None)
        points = tiles.points_within(*tiles.bounds)[::12]
    low, high = tiles.bounds[:, :2]
    axes.scatter(*points[:, :2].T, c=np.clip(points[:, 2], 0, 12), s=0.4, lw=0, cmap='viridis')
    for axis, lines in enumerate((axes.axvline, axes.axhline)):
        for edge in np.arange(low[axis], high[axis] + 1, 100.0):
            lines(edge, color=GREY, lw=0.8)
    reach = np.linspace(0, 2 * np.pi, 100)
    axes.plot(BLOCK + 50 * np.cos(reach), BLOCK + 50 * np.sin(reach), color=RED, lw=1.5)
    border = (-10, 3 * BLOCK + 10)
    axes.set(xlabel='x [m]', ylabel='y [m]', xlim=border, ylim=border)
    axes.set_aspect('equal')
    return figure


def _viewer():
    """Return a picture of what `idem show` shows."""
    from base64 import b64decode

    target, source, _, guess = _pair(street, 0)
    with TemporaryDirectory() as folder, open_browser(f'{folder}/profile', *SOFTWARE) as browser:
        file = Path(folder) / 'page.html'
        file.write_text(page(scene_of('', target, source, guess, CONFIG)), encoding='utf-8')
        browser.open(file.as_uri(), *WINDOW)
        browser.evaluate("document.querySelector('input[value=q]').click()")
        browser.evaluate('viewer.framesPerSecond(1)')
        box = browser.evaluate(f'JSON.parse(JSON.stringify({VIEW}.getBoundingClientRect()))')
        clip = {name: box[name] for name in ('x', 'y', 'width', 'height')} | {'scale': 0.75}
        return b64decode(browser.call('Page.captureScreenshot', format='png', clip=clip)['data'])
