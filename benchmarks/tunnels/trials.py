"""One registration in such a scene: drawn from a seed, solved, held against the truth."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import subspace_angles
from scipy.spatial.transform import Rotation

from benchmarks.tunnels.scenes import BARE, HELD, ORDINARY, Place
from benchmarks.tunnels.sensors import PATTERNS, scanned
from idem_ros.core import RegistrationConfig, register
from idem_ros.core.geometry import se3

VOXELS = (0.25, 0.5)  # [m]
JITTER = (0.0, 0.3, 1.0, 2.0)  # [deg]
MOTION, OFF = (0.2, 5.0), (0.3, 5.0)  # [m]
ON_ROUTES_OFF = 0.5  # [m]: ordinary scenes have no one way to be off along
MAP_SCANS, MAP_STEP = 5, 4.0
WRONG = 0.1  # [m]
NAMED_DEG = 10.0
LEAST_SEEN = 15  # returns from a niche or a post, in both clouds: it is in sight
GUESSES = ('truth', 'off', 'no motion')
SCENES = {build.__name__: build for build in (*BARE, *HELD, *ORDINARY)}


class Setup(NamedTuple):
    """What is registered, drawn from a seed."""

    name: str
    place: Place
    pattern: str
    onto: str  # 'scan' or 'map'
    guessed: str  # one of GUESSES
    voxel_size: float
    target: np.ndarray
    source: np.ndarray
    here: np.ndarray  # (4, 4) T_world_target
    truth: np.ndarray  # (4, 4) T_target_source
    guess: np.ndarray
    in_sight: int  # niches or posts

    def solved(self):
        """Return the `RegistrationResult` from the guess."""
        config = RegistrationConfig(voxel_size=self.voxel_size)
        return register(self.target, self.source, self.guess, config)


class Trial(NamedTuple):
    """One registration and what came of it."""

    scene: str
    seed: int
    pattern: str
    onto: str
    guessed: str
    motion: float  # [m]
    off: float  # of the guess [m]
    in_sight: int
    wanted: bool  # whether there is enough in sight to be right and aligned
    error: float  # of the sensor's place [m]
    across: float  # of it, but for what is free [m]
    rotation: float  # [deg], but for what is free
    verdict: str
    free: str  # in words
    named: bool  # whether just the free motions are said to be free
    drift: float  # from the guess along what is free [m]
    p: float
    sigma: float  # along x [m]

    @property
    def right(self):
        """Whether the sensor's place is off by WRONG at most."""
        return self.error <= WRONG

    @property
    def aligned(self):
        """Whether it is called so."""
        return self.verdict == 'aligned'


def trial(name, seed):
    """Return the `Trial` of a scene's name and a seed."""
    drawn = setup(name, seed)
    return held_against_truth(drawn, seed, drawn.solved())


def setup(name, seed):
    """Return the `Setup` of a scene's name and a seed; seeds in turn take the patterns in turn."""
    rng = np.random.default_rng([seed, *name.encode()])
    place, pattern = SCENES[name](rng), PATTERNS[seed % len(PATTERNS)]
    onto = 'map' if rng.random() < 0.4 and not len(place.scene.route) else 'scan'
    motion, jitter = rng.uniform(*MOTION), rng.choice(JITTER)
    here, there, *others = _poses(place, motion, jitter, rng)
    target = scanned(place.scene, here, pattern, rng)
    if onto == 'map':
        more = [(se3.inverse(here) @ T, scanned(place.scene, T, pattern, rng)) for T in others]
        target = np.concatenate([target, *(se3.transform_points(*each) for each in more)])
    source, truth = scanned(place.scene, there, pattern, rng), se3.inverse(here) @ there
    guessed = GUESSES[rng.integers(3 if onto == 'scan' else 2)]
    guess = _guess(truth, guessed, here, len(place.scene.route), rng)
    seen = _in_sight(place, here, target) & _in_sight(place, there, source)
    size = float(rng.choice(VOXELS))
    return Setup(
        name, place, pattern, onto, guessed, size, target, source, here, truth, guess, seen.sum()
    )


def _poses(place, motion, jitter, rng):
    """Return T_world_sensor of the target, of the source, and of a map's other scans."""
    if len(place.scene.route):
        route = place.scene.route
        gone = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(route, axis=0), axis=1))]
        at = rng.uniform(0.0, gone[-1] - motion)
        ways = [[np.interp(s, gone, c) for c in route.T] for s in (at, at + motion)]
        x, y, _ = np.subtract(ways[1], ways[0])
        ahead = np.arctan2(y, x)
        return [_pose(way, place.height, ahead, jitter, rng) for way in ways]
    at, side = rng.uniform(-5, 5), rng.uniform(-0.5, 0.5)
    others = at + MAP_STEP * (rng.uniform(-0.5, 0.5, MAP_SCANS) + np.arange(MAP_SCANS) - 2)
    ways = [(x, side, 0.0) for x in (at, at + motion, *others)]
    return [_pose(way, place.height, 0.0, jitter, rng) for way in ways]


def _pose(ground, height, ahead, jitter, rng):
    pose = np.eye(4)
    wobble = np.radians(jitter) * rng.uniform(-1, 1, 3)
    pose[:3, :3] = Rotation.from_euler('zyx', [ahead + wobble[0], *wobble[1:]]).as_matrix()
    pose[:3, 3] = np.add(ground, (0.0, 0.0, height))
    return pose


def _guess(truth, kind, here, on_route, rng):
    """Return the guess: off along the way, on a route anywhere, or no motion at all."""
    if kind == 'truth':
        return truth
    if kind == 'no motion':
        return np.eye(4)
    guess = truth.copy()
    if on_route:
        direction = rng.normal(size=3)
        guess[:3, 3] += rng.uniform(0, ON_ROUTES_OFF) * direction / np.linalg.norm(direction)
    else:
        guess[:3, 3] += rng.choice([-1, 1]) * rng.uniform(*OFF) * here[0, :3]
    return guess


def _in_sight(place, T_world_sensor, points):
    """Return which niches or posts (n,) give enough returns."""
    points = se3.transform_points(T_world_sensor, points)
    inside = [((points > row[:3]) & (points < row[3:])).all(axis=1).sum() for row in place.holders]
    return np.array(inside, int) >= LEAST_SEEN


def held_against_truth(drawn, seed, result):
    """Return the `Trial` of a `Setup` and its result."""
    T, axes = result.T_target_source, drawn.here[:3, :3].T  # columns: the place's axes
    free = drawn.place.free
    moves = axes[:, ['xy'.index(name) for name in free if name in 'xy']]
    off, step = T[:3, 3] - drawn.truth[:3, 3], T[:3, 3] - drawn.guess[:3, 3]
    turn = Rotation.from_matrix(T[:3, :3] @ drawn.truth[:3, :3].T).as_rotvec(degrees=True)
    if 'rz' in free:
        turn = turn - axes[:, 2] * (axes[:, 2] @ turn)
    said = result.assessment
    return Trial(
        drawn.name,
        seed,
        drawn.pattern,
        drawn.onto,
        drawn.guessed,
        float(np.linalg.norm(drawn.truth[:3, 3])),
        float(np.linalg.norm((drawn.guess - drawn.truth)[:3, 3])),
        int(drawn.in_sight),
        bool(drawn.place.wanted and drawn.in_sight >= drawn.place.wanted),
        float(np.linalg.norm(off)),
        float(np.linalg.norm(off - moves @ (moves.T @ off))),
        float(np.linalg.norm(turn)),
        said.verdict.value,
        said.free,
        _named(free, axes, result.free_motions),
        float(np.linalg.norm(moves.T @ step)),
        float(said.p_aligned),
        float(np.sqrt(max(axes[:, 0] @ said.covariance[:3, :3] @ axes[:, 0], 0.0))),
    )


def _named(free, axes, found):
    """Whether the motions (k, 6) that were found free are those that are."""
    if len(free) != len(found) or not free:
        return len(free) == len(found)
    truly = np.zeros((len(free), 6))
    for row, name in zip(truly, free, strict=True):
        row[3 * (name == 'rz') :][:3] = axes[:, 'xyz'.index(name[-1])]
    arm = np.repeat([1.0, 10.0], 3)
    return bool(np.degrees(subspace_angles((truly * arm).T, (found * arm).T).max()) < NAMED_DEG)
