"""Train what judges results: the verdict's model, and the confidence of coarse stages."""

from functools import partial

from benchmarks.trust.fit import fitted, fitted_confidence, left_out
from benchmarks.trust.poses import NUMBERS, judged_poses
from benchmarks.trust.scenes import real, simulated
from benchmarks.trust.ways import ways
from idem_ros.core.trust.basin import FIRST, LAST
from idem_ros.core.trust.verdict import WEIGHTS
from idem_ros.evaluation.worker_processes import worker_pool
from idem_ros.experiments.experiment import write_csv, write_page
from idem_ros.terminal.markdown import table

CASES, QUICK_CASES = 24, 1  # of each kind
ALONE = (8.0, 1.0)  # with these stages the first is the last coarse one, too
COLUMNS = ('kind', 'how', 'right', *NUMBERS, 'free', 'p_left_out')


def run(context):
    """Write verdict.csv, every pose that was judged, and verdict.md, the models."""
    cases = simulated(QUICK_CASES if context.quick else CASES)
    builders = [(kind, build) for kind, some in cases.items() for build in some]
    measured = [] if context.quick else [(k, b) for k, some in real().items() for b in some]
    tasks = [partial(judged_poses, kind, build) for kind, build in builders + measured]
    tasks += [partial(ways, kind, build) for kind, build in builders]
    tasks += [partial(ways, kind, build, ALONE) for kind, build in builders]
    with worker_pool(context.threads) as pool:
        steps = context.progress(pool.map(_call, tasks), total=len(tasks), desc='verdict')
        outcomes = list(steps)
    n, m = len(builders + measured), len(builders)
    poses = [each for found in outcomes[:n] for each in found if each.right is not None]
    last, first = (
        fitted_confidence([each for found in some for each in found])
        for some in (outcomes[n : n + m], outcomes[n + m :])
    )
    weights = fitted(poses)
    return [_csv(context, poses), _page(context, poses, weights, first, last)]


def _call(task):
    return task()


def _csv(context, poses):
    by_kind = {kind: iter(p) for kind, p in left_out(poses).items()}
    rows = [
        (
            each.kind,
            each.how,
            each.right,
            *(getattr(each, name) for name in NUMBERS),
            each.free,
            next(by_kind[each.kind]),
        )
        for each in poses
    ]
    return write_csv(context.out / 'verdict.csv', COLUMNS, rows)


def _page(context, poses, weights, first, last):
    models = {
        **{
            f'verdict, slope of {name}': pair
            for name, *pair in zip(NUMBERS, WEIGHTS[:-1], weights[:-1], strict=True)
        },
        'verdict, constant': (WEIGHTS[-1], weights[-1]),
        'first stage, slope': (FIRST[0], first[0]),
        'first stage, even at a mean contrast of': (FIRST[1], first[1]),
        'last coarse stage, slope': (LAST[0], last[0]),
        'last coarse stage, even at a mean contrast of': (LAST[1], last[1]),
    }
    rows = [(name, f'{kept:.4g}', f'{now:.4g}') for name, (kept, now) in models.items()]
    right = sum(each.right for each in poses)
    text = (
        '# The models that judge results\n\n'
        f'Trained on {len(poses)} poses, {right} right and {len(poses) - right} wrong by known '
        'amounts, each kind of scene, class and way of making them counting alike; verdict.csv '
        'has them all. The models in use are in `idem_ros/core/trust/verdict.py` and '
        '`idem_ros/core/trust/basin.py`. '
        '`python -m benchmarks trust` tells how well such models judge kinds of scene they never '
        'saw.\n\n'
    )
    return write_page(
        context.out / 'verdict.md', text + table(('model', 'in use', 'trained now'), rows)
    )
