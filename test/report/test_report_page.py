import re
from html.parser import HTMLParser

import numpy as np
import pytest
from replayed import changed, write_replayed

from idem_ros.report import tables as report_tables
from idem_ros.report import worst_frames
from idem_ros.report.folder import page
from idem_ros.report.plots import Plot
from idem_ros.report.runs import read_runs
from idem_ros.viewer.scene import view_of

PLOT = Plot('stem', 'title', 'measure', b'<svg/>', b'')
VOID = {'meta', 'link', 'img', 'br', 'input'}
EVIL = '</script><script>alert("x")</script><img src=http://evil.example/x.png>'


class Tags(HTMLParser):
    """Checks that what is opened is closed, and keeps what was there."""

    def __init__(self, text):
        super().__init__()
        self.open, self.found, self.text = [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_startendtag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def handle_data(self, text):
        self.text.append(text)

    def all(self, tag):
        return [attributes for name, attributes in self.found if name == tag]


def page_of(paths, plots=(PLOT,), view=None):
    runs = read_runs(paths)
    ordered = [worst_frames.worst(run) for run in runs]
    pictures = worst_frames.Pictures({'q_tot': b'png'}, 'a note', view)
    worst = [
        (report_tables.worst(run, order), sentence, [pictures] * len(order))
        for run, (order, sentence) in zip(runs, ordered, strict=True)
    ]
    return page(runs, list(plots), worst, {'frames.csv': b'a,b\n'})


@pytest.fixture
def result(tmp_path):
    return write_replayed(tmp_path)


def test_the_page_is_well_formed_and_asks_nobody_for_anything(result):
    text = page_of([result])
    tags = Tags(text)
    sources = [each.get('src') or each.get('href') for _, each in tags.found]
    assert all(link.startswith(('data:', '#')) for link in sources if link)
    assert 'http:' not in text
    assert 'https:' not in text


def test_its_policy_forbids_every_script_but_its_own(result):
    policy = Tags(page_of([result])).all('meta')[1]['content']
    assert "default-src 'none'" in policy
    assert re.search(r"script-src 'sha256-[A-Za-z0-9+/=]{44}'", policy)
    assert 'unsafe-inline' not in policy.partition('script-src')[2]


def test_each_of_the_worst_frames_has_a_button_and_its_pictures(result):
    tags = Tags(page_of([result, changed(result, lambda record: None)]))
    buttons = [each['aria-controls'] for each in tags.all('button')]
    ids = [each['id'] for each in tags.all('div') if each.get('class') == 'frame']
    assert buttons == ids
    assert len(ids) == len(set(ids)) == 8


def test_clouds_are_on_the_page_once_each_and_the_viewer_once(result, rng):
    points = rng.uniform(0, 1, (20, 3))
    text = page_of([result], view=view_of(points, points, (np.eye(4), np.eye(4)), 10))
    tags = Tags(text)
    scenes = [each for each in tags.all('script') if each.get('class') == 'scene']
    assert len(scenes) == 4
    assert [each['id'] for each in tags.all('div') if each.get('id') == 'viewer'] == ['viewer']
    policy = tags.all('meta')[1]['content']
    assert policy.count('sha256-') == text.count('<script>') == 3
    assert len(page_of([result])) < 100_000  # without clouds there is no viewer


def test_links_within_the_page_lead_somewhere(result):
    tags = Tags(page_of([result, changed(result, lambda record: None)]))
    ids = [each['id'] for _, each in tags.found if 'id' in each]
    assert len(ids) == len(set(ids))
    targets = [a['href'][1:] for a in tags.all('a') if a['href'].startswith('#')]
    assert targets
    assert set(targets) <= set(ids)


def test_whatever_a_file_holds_is_shown_as_text(result):
    def change(record):
        record['bag'] = EVIL
        record['made_by'] = {'method': EVIL, 'parameters': {EVIL: EVIL}}
        for frame in record['frames']:
            frame['status'] = EVIL
            frame[EVIL] = 1.0
        record['notes'] = [EVIL]

    tags = Tags(page_of([changed(result, change, 'a" onload="x')]))
    assert len(tags.all('script')) == 1
    assert not [each for _, each in tags.found if 'onload' in each]
    assert not [image for image in tags.all('img') if 'evil' in image['src']]
    assert EVIL in tags.text


def test_settings_that_differ_are_marked(result):
    one, two = (
        changed(
            result,
            lambda r, size=size: r.update(made_by={'parameters': {'a': 1, 'voxel_size': size}}),
            f'result{size}',
        )
        for size in (1, 2)
    )
    rows = [each for each in Tags(page_of([one, two])).all('tr') if each.get('class')]
    assert rows == [{'class': 'differs'}]


def test_a_result_that_does_not_say_how_it_was_made_is_told(result):
    assert 'does not say how it was made' in page_of([result])


def test_without_frames_the_page_says_so(result):
    text = page_of([changed(result, lambda record: record.update(frames=[]))], plots=())
    Tags(text)
    assert text.count('No frame was refined') == 2


def test_what_a_result_notes_is_told(result):
    text = page_of([changed(result, lambda record: record.update(notes=['the end is missing']))])
    assert 'changed: the end is missing' in text
