"""The layouts that are shipped name topics, statuses and values that the node publishes."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from clouds import surface

from idem_ros.core import register
from idem_ros.node.interface import INPUTS, OUTPUTS
from idem_ros.node.traffic import Traffic
from idem_ros.refinement.diagnostics import refinement_values
from idem_ros.refinement.outcome import Refinement

CONFIG = Path(__file__).resolve().parents[2] / 'config'
NODE = '/idem_node'
PATH = re.compile(
    r'(?P<topic>/\w+)\.status\[:\]\{name=="(?P<name>[^"]+)"\}'
    r'\.values\[:\]\{key=="(?P<key>\w+)"\}\.value'
)


@pytest.fixture(scope='module')
def published():
    """Return {status: {key: text}} of what the node would say."""
    rng = np.random.default_rng(0)
    cloud = surface(rng, 400)
    result = register(cloud, cloud + (0.002, 0, 0))
    refinement = Refinement(
        stamp=0,
        target_frame='map',
        source_frame='lidar',
        T_guess=np.eye(4),
        result=result,
        q_tot_before=None,
        time_ms=1.0,
        points_target=400,
        points_source=400,
        dropped_nonfinite=0,
        dropped_zero=0,
    )
    load = Traffic(['target', 'source'], 0.0).load(1.0, 0, {}, ['target', 'source'])
    return {
        f'{NODE}: registration': refinement_values(refinement, dropped=0),
        f'{NODE}: load': load.values,
    }


def is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


def panels_of(layout):
    if isinstance(layout, str):
        return {layout}
    return panels_of(layout['first']) | panels_of(layout['second'])


def test_foxglove_plots_numbers_that_the_node_publishes(published):
    layout = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    panels = layout['configById']
    assert panels_of(layout['layout']) == set(panels)
    paths = [
        path['value']
        for name, panel in panels.items()
        if name.startswith('Plot!')
        for path in panel['paths']
    ]
    assert len(paths) > 5
    for path in paths:
        found = PATH.fullmatch(path)
        assert found, path
        assert found['topic'] == OUTPUTS['diagnostics'].name
        assert is_number(published[found['name']][found['key']]), path


def test_foxglove_shows_topics_of_the_node_and_q_i_by_its_field():
    panels = json.loads((CONFIG / 'foxglove_layout.json').read_text())['configById']
    topics = panels['3D!idem']['topics']
    inputs = {topic.name.replace('~', '') for topic in INPUTS.values()}  # as launched
    outputs = {topic.name.replace('~', NODE) for topic in OUTPUTS.values()}
    assert set(topics) <= inputs | outputs
    assert topics['/idem_node/debug/q_points']['colorField'] == 'q_i'
    assert panels['DiagnosticSummary!idem']['topicToRender'] == OUTPUTS['diagnostics'].name


def test_plotjuggler_draws_numbers_that_the_node_publishes(published):
    root = ElementTree.parse(CONFIG / 'plotjuggler_layout.xml').getroot()
    splitter = root.find('.//DockSplitter')
    assert len(splitter.get('sizes').split(';')) == int(splitter.get('count')) == len(splitter)
    curves = [curve.get('name') for curve in root.iter('curve')]
    # topic/hardware_id/name/key, as its parser of DiagnosticArray puts them together
    known = {
        f'{OUTPUTS["diagnostics"].name}/{NODE}/{status}/{key}'
        for status, values in published.items()
        for key, value in values.items()
        if is_number(value)
    }
    assert len(curves) > 5
    assert set(curves) <= known


def test_the_aggregator_finds_both_statuses(published):
    sections = yaml.safe_load((CONFIG / 'diagnostic_aggregator.yaml').read_text())
    contains = sections['/**']['ros__parameters']['registration']['contains']
    assert all(any(part in status for part in contains) for status in published)
