"""How fast the viewer draws two large clouds in a browser that has no graphics processor."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.browser import SOFTWARE, open_browser
from benchmarks.goal import Goal
from idem_ros.core.exceptions import IdemError
from idem_ros.viewer.page import page
from idem_ros.viewer.scene import Scene, view_of

POINTS = 100_000  # of each cloud
WINDOW = (1280, 900)
SECONDS, FRAMES = 3.0, 20
RATE, MEGABYTES = 20.0, 15.0
TRIALS = 3
ABOUT = """\
`python -m benchmarks viewer`: the page of `idem show` in headless Chromium that draws in
software, on the processor alone (SwiftShader). While the view turns the viewer draws as many of
the points, evenly chosen, as a frame has time for, and all of them 0.15 s after it came to
rest; a graphics processor has time for all. The second row draws every point in every frame:
software works on them one by one (half of them take half the time), so that it depends on how
many cores are idle.

"""


class NoWebGL(IdemError):
    """The browser cannot draw, not even in software."""


def measure(points=POINTS, seconds=SECONDS, frames=FRAMES):
    """Return the `Goal`s of a page with two clouds.

    Args:
        points: of each cloud.
        seconds: that the view turns, in each trial.
        frames: that are drawn of all points, in each trial.

    Raises:
        NoBrowser: none is installed.
        NoWebGL: it has no WebGL.
    """
    with TemporaryDirectory() as folder, open_browser(f'{folder}/profile', *SOFTWARE) as browser:
        file = Path(folder) / 'page.html'
        file.write_text(page(_street(points)), encoding='utf-8')
        browser.open(file.as_uri(), *WINDOW)
        if browser.evaluate("document.getElementById('viewer').classList.contains('flat')"):
            raise NoWebGL('this browser has no WebGL, not even in software')
        turned = [browser.evaluate(f'viewer.turning({seconds})') for _ in range(TRIALS)]
        whole = [browser.evaluate(f'viewer.framesPerSecond({frames})') for _ in range(TRIALS)]
        megabytes = file.stat().st_size / 1e6
    rate = float(np.median([each['framesPerSecond'] for each in turned]))
    share = float(np.median([each['share'] for each in turned]))
    what = f'2 x {points} points'
    return [
        Goal(
            f'{what}: a frame while it turns, {share:.0%} of them drawn',
            1e3 / rate,
            1e3 / RATE,
            'ms',
        ),
        Goal(f'{what}: a frame of all of them', 1e3 / float(np.median(whole)), 1e3 / RATE, 'ms'),
        Goal(f'{what}: page', megabytes, MEGABYTES, 'MB'),
    ]


def _street(points):
    """Return a `Scene` of two clouds of a street: the ground and two fronts of houses."""
    rng = np.random.default_rng(0)

    def cloud():
        xyz = rng.uniform((-60, -10, 0), (60, 10, 8), (points, 3))
        side = rng.integers(0, 3, points)
        xyz[side == 0, 2] = 0.0
        xyz[side == 1, 1], xyz[side == 2, 1] = -10.0, 10.0
        return xyz + rng.normal(0, 0.02, (points, 3))

    target, source = cloud(), cloud()
    guess = np.eye(4)
    guess[:2, 3] = 0.5, 0.3
    view = view_of(
        target,
        source,
        (guess, np.eye(4)),
        points,
        (np.vstack([target, source]), np.zeros(2 * points)),
    )
    return Scene('measured', view, (), {'status': 'measured'})
