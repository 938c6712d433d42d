"""Every parameter file of the package answers the demo recording."""

import pytest
from node_bench import values_of

# isort: split
from conftest import ROOT
from parameter_files import parameters_in

from idem_ros.messages.pointcloud2 import read_points
from idem_ros.messages.transform_message import stamp_ns
from idem_ros.recording.messages import cloud_message, to_cdr
from idem_ros.recording.reader import open_recording

SOURCES = 1
CONFIGS = [
    path for path in sorted(ROOT.glob('config/*.yaml')) if not path.stem.startswith('audit')
]


@pytest.mark.parametrize('file', CONFIGS, ids=lambda file: file.stem)
def test_node_with_a_parameter_file_of_the_package_aligns_the_demo(bench, file):
    b = bench(**{**parameters_in(file), 'reliability': 'reliable'}).start()
    publishers = {'/target': b.target, '/source': b.source, '/initial_guess': b.guess}
    with open_recording(ROOT / 'bags' / 'demo.mcap') as recording:
        stamps = []
        for topic, _, message in recording.messages(list(publishers)):
            if topic == '/source':
                if len(stamps) == SOURCES:
                    break
                stamps.append(stamp_ns(message))
            publishers[topic].publish(to_cdr(thinned(message)))
            if topic == '/initial_guess':
                b.transform_of(stamps[-1])
    b.until(lambda: len(b.statuses('converged')) == SOURCES)
    verdicts = [values_of(each)['verdict'] for each in b.statuses('converged')]
    assert verdicts == ['aligned'] * SOURCES


def thinned(message):
    """Return a cloud of every third point; another message as it is."""
    if not hasattr(message, 'data'):
        return message
    points = read_points(message).points[::3]
    return cloud_message(points, stamp_ns(message), message.header.frame_id)
