"""Spoilt clouds, recordings, results, parameters, maps and more, thousands of each: `make fuzz`.

Each case is one command of `idem` in a forked process. It must end by itself with exit code 0, 1
or 2 and at most one line of error, within 10 s of work and 2 GB; else this ends with 1.
"""

import argparse
import os
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / 'test' / 'support'))

import children  # noqa: E402
import numpy as np  # noqa: E402
from recordings import scans  # noqa: E402
from spoilt_capsules import Capsules  # noqa: E402
from spoilt_clouds import Clouds  # noqa: E402
from spoilt_maps import Maps  # noqa: E402
from spoilt_parameters import Parameters  # noqa: E402
from spoilt_poses import Poses  # noqa: E402
from spoilt_recordings import Recordings  # noqa: E402
from spoilt_results import Results  # noqa: E402
from spoilt_sweeps import Sweeps  # noqa: E402

from idem_ros.commands.main import main as idem  # noqa: E402
from idem_ros.recording.writer import write_mcap  # noqa: E402

KINDS = {
    'clouds': Clouds,
    'recordings': Recordings,
    'results': Results,
    'parameters': Parameters,
    'maps': Maps,
    'poses': Poses,
    'sweeps': Sweeps,
    'capsules': Capsules,
}
FULL = 10_000
SHOWN = 20


def main():
    """Run what is asked for; print the counts; return the exit code."""
    args = _arguments()
    with tempfile.TemporaryDirectory(prefix='idem_fuzz_') as folder:
        _write_inputs(Path(folder))
        kinds = {name: kind(folder) for name, kind in KINDS.items()}
        if args.only:
            name, _, index = args.only.partition(':')
            found = children.run_one(kinds[name], name, int(index), args.seed, keep=True)
            print(found['code'], f'{found["seconds"]:.2f} s', found['fault'])
            return bool(found['fault'])
        counts = {name: getattr(args, name) for name in KINDS}
        return _judged(children.run_all(kinds, counts, args.seed, args.jobs))


def _arguments():
    parser = argparse.ArgumentParser(prog='fuzz', description=__doc__)
    for name in KINDS:
        parser.add_argument(f'--{name}', type=int, default=FULL, metavar='N')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--jobs', type=int, default=os.cpu_count())
    parser.add_argument('--only', metavar='KIND:INDEX', help='one case, whose files are kept')
    return parser.parse_args()


def _write_inputs(folder):
    write_mcap(folder / 'scans.mcap', scans(np.random.default_rng(0), 7, points=200))
    (folder / 'refine.yaml').write_text((ROOT / 'config' / 'refine.yaml').read_text())
    files = [str(folder / name) for name in ('result.json', 'result.mcap', 'again.json')]
    bag = str(folder / 'scans.mcap')
    # also compiles all kernels, which the children inherit
    assert idem(['replay', bag, '--json', files[0], '--out', files[1]]) == 0
    assert idem(['report', files[0], '--out', str(folder / 'report')]) == 0
    assert idem(['compare', files[0], files[1]]) == 0


def _judged(found):
    begin, codes, slowest, faults = time.monotonic(), Counter(), {}, 0
    try:
        for each in found:
            kind = each['kind']
            codes[kind, each['code']] += 1
            slowest[kind] = max(slowest.get(kind, 0.0), each['seconds'])
            if each['fault']:
                faults += 1
                if faults <= SHOWN:
                    print(
                        f'FAULT --only {kind}:{each["index"]}: {each["fault"][-3000:]}', flush=True
                    )
    finally:  # whoever interrupts it sees how far it came
        for kind in slowest:
            counted = {code: n for (of, code), n in codes.items() if of == kind}
            ended = ', '.join(f'{n} with {code}' for code, n in sorted(counted.items(), key=str))
            print(f'{kind}: {sum(counted.values())} ({ended}), slowest {slowest[kind]:.2f} s')
        work = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
        print(f'{faults} faults in {time.monotonic() - begin:.0f} s, {work:.0f} s of work')
    return int(faults > 0)


if __name__ == '__main__':
    sys.exit(main())
