import re

import numpy as np
import pytest
from browser import COLOURS, open_browser
from replayed import write_replayed

from idem_ros.report.worst_frames import shown_frame
from idem_ros.viewer.page import page as page_of
from idem_ros.viewer.scene import Scene, view_of

DESKTOP, PHONE = (1280, 900), (390, 844)
RESTED = """
new Promise(resolve => {
  const note = document.getElementById('thinned');
  const look = () => note.textContent ? resolve(true) : setTimeout(look, 20);
  look();
})
"""
FLAT = "document.getElementById('viewer').classList.contains('flat')"


@pytest.fixture(scope='module')
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp('show')
    page = folder / 'page.html'
    page.write_text(page_of(shown_frame(write_replayed(folder), 0)), encoding='utf-8')
    return page.as_uri()


@pytest.mark.parametrize('size', [DESKTOP, PHONE])
def test_the_clouds_are_drawn_without_the_network_and_without_a_complaint(browser, address, size):
    browser.open(address, *size)
    if browser.evaluate(FLAT):
        pytest.skip('this browser has no WebGL, not even in software')
    assert (
        browser.evaluate("getComputedStyle(document.querySelector('.pictures')).display") == 'none'
    )
    assert browser.requests() == [address]
    assert [each for each in browser.complaints() if 'exceptionDetails' in each] == []
    assert browser.evaluate(COLOURS) >= 3  # the ground, the target and the source
    assert browser.evaluate('document.documentElement.scrollWidth') <= size[0]


def test_the_slider_goes_from_the_guess_to_the_result(browser, address):
    browser.open(address, *DESKTOP)
    step = "document.getElementById('step')"
    assert browser.evaluate(f'{step}.value') == browser.evaluate(f'{step}.max')
    if not browser.evaluate(FLAT):
        browser.evaluate(f"{step}.value = 0; {step}.dispatchEvent(new Event('input'))")
        assert browser.evaluate("document.getElementById('said').textContent") == 'at the guess'


def test_while_the_view_turns_points_may_be_left_out_and_then_all_are_drawn(browser, address):
    browser.open(address, *DESKTOP)
    if browser.evaluate(FLAT):
        pytest.skip('this browser has no WebGL, not even in software')
    turned = browser.evaluate('viewer.turning(0.5)')
    assert turned['framesPerSecond'] > 0
    assert 0 < turned['share'] <= 1
    assert browser.evaluate(COLOURS) >= 3


def test_who_sees_points_left_out_is_told_how_many_and_why(browser, tmp_path):
    rng = np.random.default_rng(0)
    clouds = [rng.uniform(-20, 20, (100_000, 3)) for _ in range(2)]
    page = tmp_path / 'large.html'
    view = view_of(*clouds, (np.eye(4), np.eye(4)), 100_000)
    page.write_text(page_of(Scene('large', view, (), {'status': 'converged'})), encoding='utf-8')
    browser.open(page.as_uri(), *DESKTOP)
    if browser.evaluate(FLAT):
        pytest.skip('this browser has no WebGL, not even in software')
    turned = browser.evaluate('viewer.turning(1.0)')
    browser.evaluate(RESTED)
    said = browser.evaluate("document.getElementById('thinned').textContent")
    assert browser.evaluate("document.getElementById('thinned').hidden") == (turned['share'] >= 1)
    assert re.fullmatch(
        r'While the view turns \d+ % of the points are drawn: a frame of all takes \d+ ms here'
        r'(, without a graphics processor)?\.',
        said,
    )


def test_a_browser_without_webgl_shows_pictures(address, tmp_path):
    with open_browser(tmp_path, '--disable-3d-apis') as page:
        page.open(address, *DESKTOP)
        assert page.evaluate(FLAT)
        assert page.evaluate("getComputedStyle(document.getElementById('view')).display") == 'none'
        pictures = "document.querySelectorAll('.pictures img')"
        assert page.evaluate(f'[...{pictures}].every(image => image.naturalWidth > 100)')
        assert page.evaluate(f'{pictures}.length') == 2


def test_only_scripts_of_the_page_itself_may_run(tmp_path):
    page = page_of(shown_frame(write_replayed(tmp_path), 0))
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy.count('sha256-') == page.count('<script>') == 3
    assert 'default-src &#39;none&#39;' in policy
