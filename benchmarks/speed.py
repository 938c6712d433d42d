"""Time every method from the same raw points and guesses, taking turns."""

import math
from dataclasses import dataclass

from benchmarks.case import LEVELS, starts
from benchmarks.methods import IDEM, PEERS
from benchmarks.raw_to_result import (
    gicp_parts,
    idem_from_raw,
    idem_parts,
    idem_to_prepared,
    peer_from_raw,
    peer_settings,
    reaches,
)
from benchmarks.timing import interleaved_ms, median_and_p95

GUESSES = 8  # different starts that the rounds take in turn
TRIES = 3
PREPARED = 'to a prepared target'


@dataclass(frozen=True)
class SpeedRow:
    """Milliseconds of every method on one pair, each {'median', 'p95', 'rounds'}.

    Attributes:
        name: of the row.
        points: of target and source, raw.
        voxel_size: [m].
        settings: method -> the setting of a peer that was fastest and succeeded.
        whole: (method, threads) -> raw points to result.
        success: method -> share of the starts that ended at the truth.
        parts: (method, part) -> ms of IDEM's and GICP's parts, one thread.
        to_prepared: IDEM, one thread, against a target that an earlier call prepared.
    """

    name: str
    points: tuple
    voxel_size: float
    settings: dict
    whole: dict
    success: dict
    parts: dict
    to_prepared: dict

    def ratio(self, method=IDEM, reference='GICP', threads=1):
        """Return the ratio of two methods' medians."""
        return self.whole[method, threads]['median'] / self.whole[reference, threads]['median']


def measure_row(name, case, config, rounds, seconds, threads=(1, 2)):
    """Return the `SpeedRow` of a case: `rounds` at least of each method, and so many seconds."""
    guesses = starts(case, LEVELS[0], GUESSES)
    settings = {method: _fastest(case, method, guesses[0]) for method in PEERS}
    wholes = {(method, n): run for n in threads for method, run in _all(case, config, settings, n)}
    parts = {(IDEM, part): run for part, run in idem_parts(case, config).items()}
    parts |= {('GICP', part): run for part, run in gicp_parts(case, settings['GICP']).items()}
    to_prepared = {PREPARED: idem_to_prepared(case, config)}
    times = {}
    for n in threads:  # one number of threads after the other: idle threads spin for a while
        runs = {key: run for key, run in wholes.items() if key[1] == n}
        if n == 1:
            runs |= parts | to_prepared
        times |= interleaved_ms(_in_turn(runs, guesses), rounds, seconds)
    times = {key: median_and_p95(ms) for key, ms in times.items()}
    return SpeedRow(
        name=name,
        points=(len(case.target), len(case.source)),
        voxel_size=case.voxel_size,
        settings=settings,
        whole={key: times[key] for key in wholes},
        success={method: _success(case, wholes[method, 1], guesses) for method in (IDEM, *PEERS)},
        parts={key: times[key] for key in parts},
        to_prepared=times[PREPARED],
    )


def _all(case, config, settings, threads):
    yield IDEM, idem_from_raw(case, config, threads)
    for method, setting in settings.items():
        yield method, peer_from_raw(case, setting, threads)


def _success(case, run, guesses):
    return sum(reaches(case, run, T_guess) for T_guess in guesses) / len(guesses)


def as_given_ms(case, config, rounds):
    """Return {'median', ...} of registering the points as they are, no voxels, one thread."""
    guesses = starts(case, LEVELS[0], GUESSES)
    run = idem_from_raw(case, config)
    return median_and_p95(interleaved_ms(_in_turn({IDEM: run}, guesses), rounds)[IDEM])


def growth(points_and_ms):
    """Return the exponent p of time ~ points^p between the smallest and the largest cloud."""
    (few, fast), (many, slow) = min(points_and_ms), max(points_and_ms)
    return math.log(slow / fast) / math.log(many / few)


def _fastest(case, method, T_guess):
    """Return the setting that a user in a hurry would want; the first where none succeeds."""
    tried = [setting for setting in peer_settings() if setting.method == method]
    runs = {setting: peer_from_raw(case, setting) for setting in tried}
    good = {setting: run for setting, run in runs.items() if reaches(case, run, T_guess)}
    if not good:
        return tried[0]
    times = interleaved_ms(_in_turn(good, [T_guess]), TRIES)
    return min(times, key=lambda setting: times[setting].min())


def _in_turn(runs, guesses):
    """Make functions of the guess functions of the round."""
    return {name: lambda k, run=run: run(guesses[k % len(guesses)]) for name, run in runs.items()}
