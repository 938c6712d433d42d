"""The figures of trials in tunnels and other scenes, held against those to reach."""

from dataclasses import asdict, dataclass

import numpy as np

from benchmarks.goal import Goal, goals_table
from benchmarks.tunnels.scenes import BARE, HELD, ORDINARY
from benchmarks.tunnels.sensors import PATTERNS
from benchmarks.tunnels.trials import LEAST_SEEN, WRONG
from idem_ros.terminal.markdown import table

ALARMS, UNNAMED = 0.5, 5.0  # [%], of bare scenes
ALARMS_HELD, UNFOUND = 1.0, 15.0  # [%], where something holds the way
UNTRUSTED = 5.0  # [%], of right results in ordinary scenes
HEAD = (
    'scene',
    'trials',
    'wrong and aligned',
    'free motions right [%]',
    'right [%]',
    'right and aligned [%]',
    'where enough is in sight [%]',
    'p90 across [mm]',
    'p90 along what is free, from the guess [mm]',
)


@dataclass(frozen=True)
class Counts:
    """How many trials of each group of scenes."""

    bare: int
    held: int
    ordinary: int

    @classmethod
    def of(cls, trials):
        """Return as many in bare scenes, and half of that in each of the others."""
        return cls(trials, trials // 2, trials // 2)

    def tasks(self, first_seed):
        """Return (name of the scene, seed) of every trial."""
        groups = ((BARE, self.bare), (HELD, self.held), (ORDINARY, self.ordinary))
        return [
            (scenes[k % len(scenes)].__name__, first_seed + k // len(scenes))
            for scenes, count in groups
            for k in range(count)
        ]


def goals(trials):
    """Yield the `Goal`s of `Trial`s."""
    bare, held, ordinary = (_of(trials, scenes) for scenes in (BARE, HELD, ORDINARY))
    said = f'wrong by more than {WRONG} m and aligned'
    yield Goal(f'bare scenes: {said}, of {len(bare)}', _alarms(bare), ALARMS, '%')
    unnamed = _percent(not each.named for each in bare)
    yield Goal(f'bare scenes: free motions not named right, of {len(bare)}', unnamed, UNNAMED, '%')
    yield Goal(f'niches, posts: {said}, of {len(held)}', _alarms(held), ALARMS_HELD, '%')
    for scene in HELD:
        wanted = [each for each in _of(held, [scene]) if each.wanted]
        what = f'{scene.__name__}: not right and aligned where enough is in sight'
        unfound = _percent(not (each.right and each.aligned) for each in wanted)
        yield Goal(f'{what}, of {len(wanted)}', unfound, UNFOUND, '%')
    yield Goal(f'ordinary scenes: {said}, of {len(ordinary)}', _alarms(ordinary), ALARMS, '%')
    right = [each for each in ordinary if each.right]
    untrusted = _percent(not each.aligned for each in right)
    yield Goal(f'ordinary scenes: right, not aligned, of {len(right)}', untrusted, UNTRUSTED, '%')


def markdown(trials):
    """Return the page."""
    scenes = [build.__name__ for build in (*BARE, *HELD, *ORDINARY)]
    rows = [_row(name, [each for each in trials if each.scene == name]) for name in scenes]
    bare = _of(trials, BARE)
    patterns = [_row(name, [each for each in bare if each.pattern == name]) for name in PATTERNS]
    return (
        '## Tunnels\n\n'
        'Scan to scan, and in two fifths scan to map, of scenes along x: a bare tunnel, two '
        'facades, a wall and a plane, an open plane; a tunnel with niches at random and two '
        'facades with twelve posts of radius 0.08 to 0.3 m; ordinary scenes. Motions are 0.2 to '
        '5 m, the attitude differs by 0 to 2 deg, voxels are 0.25 or 0.5 m; guesses are the '
        'truth, 0.3 to 5 m off along x, or no motion. Enough is in sight where three niches or '
        f'eight posts give {LEAST_SEEN} returns in both clouds.\n\n'
        f'{goals_table(goals(trials))}\n\n{table(HEAD, rows)}\n\n'
        f'Bare scenes by the sensor:\n\n{table(HEAD, patterns)}\n'
    )


def json_record(trials):
    """Return all figures and trials as what JSON holds."""
    found = [each._asdict() for each in trials]
    clean = [{k: None if v != v else v for k, v in each.items()} for each in found]
    return {'goals': [asdict(goal) for goal in goals(trials)], 'trials': clean}


def _of(trials, scenes):
    names = [build.__name__ for build in scenes]
    return [each for each in trials if each.scene in names]


def _alarms(trials):
    return _percent(each.aligned and not each.right for each in trials)


def _percent(each):
    found = list(each)
    return 100.0 * float(np.mean(found)) if found else None


def _row(name, trials):
    wanted = [each for each in trials if each.wanted]
    good = _percent(each.right and each.aligned for each in trials)
    shares = (
        _percent(each.named for each in trials),
        _percent(each.right for each in trials),
        good,
        _percent(each.right and each.aligned for each in wanted),
    )
    lengths = [[each.across for each in trials], [each.drift for each in trials]]
    return (
        name.replace('_', ' '),
        len(trials),
        sum(each.aligned and not each.right for each in trials),
        *('-' if share is None else f'{share:.0f}' for share in shares),
        *(f'{1e3 * np.percentile(some, 90):.1f}' if some else '-' for some in lengths),
    )
