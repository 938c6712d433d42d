"""The layouts that are shipped, held to messages: of the node, of a replay, of a capsule."""

from node_bench import FIRST, send

# isort: split
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from recordings import scans
from sensor_msgs.msg import PointCloud2

from idem_ros.commands.main import main
from idem_ros.node.interface import INPUTS, OUTPUTS
from idem_ros.recording.writer import write_mcap

CONFIG = Path(__file__).resolve().parents[2] / 'config'
LAYOUT = json.loads((CONFIG / 'foxglove_layout.json').read_text())
FOXGLOVE = LAYOUT['configById']
PATH = re.compile(r'(/\w+)\.status\[:\]\{name=="(.+?)"\}\.values\[:\]\{key=="(\w+)"\}\.value')
PATHS = [
    path['value']
    for panel in FOXGLOVE.values()
    for path in panel.get('paths', ())
    if isinstance(panel.get('paths'), list)
]


def decoded(path):
    """Return {topic: [message]} of an MCAP, as Foxglove's own reader has them."""
    with path.open('rb') as stream:
        reader, found = make_reader(stream, decoder_factories=[DecoderFactory()]), {}
        for _, channel, _, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append(message)
        return found


@pytest.fixture
def live(bench, clouds, tmp_path):
    """{topic: [message]} of the node while it refines, and the capsule that it wrote."""
    folder = tmp_path / 'capsules'
    b, q_points = bench(**{'capsules.folder': str(folder), 'capsules.when': 'all'}), []
    b.other.create_subscription(PointCloud2, '/idem_node/debug/q_points', q_points.append, 10)
    b.start()
    send(b, clouds, FIRST)
    b.until(lambda: q_points and b.statuses('converged') and b.loads())
    b.until(lambda: list(folder.glob('idem_capsule_*')))
    (capsule,) = folder.glob('idem_capsule_*')
    found = {'/diagnostics': b.received['diagnostics'], '/idem_node/debug/q_points': q_points}
    return found, decoded(capsule)


@pytest.fixture(scope='module')
def result(tmp_path_factory):
    """{topic: [message]} of what `idem replay --out --clouds` writes."""
    folder = tmp_path_factory.mktemp('replayed')
    write_mcap(folder / 'scans.mcap', scans(np.random.default_rng(0)))
    out = folder / 'result.mcap'
    assert main(['replay', str(folder / 'scans.mcap'), '--out', str(out), '--clouds']) == 0
    return decoded(out)


def numbers_of(messages):
    """Return {(status, hardware, key)} of all values that are numbers, in /diagnostics."""
    found = set()
    for status in (each for message in messages['/diagnostics'] for each in message.status):
        for value in status.values:
            try:
                float(value.value)
            except ValueError:
                continue
            found.add((status.name, status.hardware_id, value.key))
    return found


def plotted(numbers, of_load):
    """Every number that a layout plots is there; without a node there is none of its load."""
    known = {(name, key) for name, _, key in numbers}
    paths = [PATH.fullmatch(path).groups() for path in PATHS]
    assert {topic for topic, _, _ in paths} == {'/diagnostics'}
    wanted = {(name, key) for _, name, key in paths if of_load or not name.endswith(': load')}
    assert len(wanted) > 4
    assert wanted <= known
    root = ElementTree.parse(CONFIG / 'plotjuggler_layout.xml').getroot()
    curves = {curve.get('name') for curve in root.iter('curve')}
    curves = {name for name in curves if of_load or ': load/' not in name}
    # topic/hardware_id/name/key, as PlotJuggler's parser of DiagnosticArray puts them together
    assert len(curves) > 4
    assert curves <= {f'/diagnostics/{of}/{name}/{key}' for name, of, key in numbers}


def panels_of(layout):
    if isinstance(layout, str):
        return {layout}
    return panels_of(layout['first']) | panels_of(layout['second'])


def test_every_panel_has_its_place_and_every_topic_is_one_of_the_node():
    assert panels_of(LAYOUT['layout']) == set(FOXGLOVE)
    inputs = {topic.name.replace('~', '') for topic in INPUTS.values()}  # as launched
    outputs = {topic.name.replace('~', '/idem_node') for topic in OUTPUTS.values()}
    assert set(FOXGLOVE['3D!idem']['topics']) <= inputs | outputs
    assert FOXGLOVE['DiagnosticSummary!idem']['topicToRender'] == OUTPUTS['diagnostics'].name
    splitter = ElementTree.parse(CONFIG / 'plotjuggler_layout.xml').find('.//DockSplitter')
    assert len(splitter.get('sizes').split(';')) == int(splitter.get('count')) == len(splitter)


def test_what_the_layouts_plot_is_in_the_messages_of_the_node(live):
    plotted(numbers_of(live[0]), of_load=True)


def test_what_the_layouts_plot_is_in_the_recording_of_a_replay(result):
    plotted(numbers_of(result), of_load=False)


def test_what_the_layouts_plot_is_in_a_capsule(live):
    plotted(numbers_of(live[1]), of_load=False)


def test_q_i_is_a_field_of_the_cloud_that_is_coloured_by_it(live):
    shown = FOXGLOVE['3D!idem']['topics']['/idem_node/debug/q_points']
    (cloud, *_) = live[0]['/idem_node/debug/q_points']
    assert shown['colorField'] in [field.name for field in cloud.fields]


def test_the_clouds_that_are_shown_are_in_a_replay_and_in_a_capsule(live, result):
    clouds = {'/target', '/source'}
    assert clouds <= set(FOXGLOVE['3D!idem']['topics'])
    for messages in (result, live[1]):
        assert clouds <= set(messages)
        assert all(message.data for topic in clouds for message in messages[topic])


def test_the_status_summary_and_the_aggregator_take_the_statuses_of_the_node(live):
    statuses = [each for message in live[0]['/diagnostics'] for each in message.status]
    panel = FOXGLOVE['DiagnosticSummary!idem']
    assert all(panel['hardwareIdFilter'] in each.hardware_id for each in statuses)
    sections = yaml.safe_load((CONFIG / 'diagnostic_aggregator.yaml').read_text())
    contains = sections['/**']['ros__parameters']['registration']['contains']
    assert all(any(part in each.name for part in contains) for each in statuses)
    assert all(any(part in each.name for each in statuses) for part in contains)
