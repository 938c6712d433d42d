import signal
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parent.parent
LIVE = {'live', 'node_bench', 'rclpy'}  # who imports of these talks over a ROS graph

# A job in the background of a script is born deaf to Ctrl-C, and so are all that it starts.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

try:
    from hypothesis import settings
except ImportError:  # a ROS machine has it not; the modules that need it say so
    pass
else:
    settings.register_profile('repeatable', deadline=None, derandomize=True)
    settings.load_profile('repeatable')


def pytest_collection_modifyitems(config, items):
    """Mark the live tests; of two workers, each ends with modules that are soon done.

    Those of few tests, each of which takes long, come before those of many.
    """
    for item in filter(_is_live, items):
        item.add_marker('live')
    if hasattr(config, 'workerinput'):
        sizes = Counter(item.path for item in items)
        items.sort(key=lambda item: sizes[item.path])


def _is_live(item):
    names = (
        getattr(each, '__module__', None) or getattr(each, '__name__', '')
        for each in vars(item.module).values()
    )
    return any(str(name).partition('.')[0] in LIVE for name in names)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture(scope='module')
def context():
    """An rclpy context in a domain of its own, or a skip where rclpy is not installed."""
    from live import own_graph

    with own_graph() as context:
        yield context


@pytest.fixture(scope='module')
def clouds():
    """Two clouds that the node registers: target and source, T_TRUTH apart."""
    from node_bench import corner

    return corner()


@pytest.fixture(scope='module')
def browser(tmp_path_factory):
    """A browser that draws in software, or a skip where there is none."""
    from browser import SOFTWARE, open_browser

    with open_browser(tmp_path_factory.mktemp('profile'), *SOFTWARE) as page:
        yield page


@pytest.fixture
def bench(context):
    """What makes a node between publishers and subscriptions, see `Bench`, which end with it."""
    from node_bench import Bench

    benches = []

    def make(**options):
        benches.append(Bench(context, **options))
        return benches[-1]

    yield make
    for each in benches:
        each.close()


@pytest.fixture
def bags(tmp_path):
    """The paths of four small recordings, see `recordings.four_bags`."""
    from recordings import four_bags

    return four_bags(tmp_path)


@pytest.fixture
def marks(tmp_path):
    """A folder in which `Deadly` counts how often it killed a worker."""
    (tmp_path / 'marks').mkdir()
    return str(tmp_path / 'marks')


@pytest.fixture(scope='session')
def shared_data():
    """The folder of real clouds beside the project, or a skip that says so."""
    folder = ROOT.parent / 'shared' / 'data'
    if not folder.is_dir():
        pytest.skip(f'the real clouds are not here: {folder} does not exist')
    return folder
