import pytest
from browser import COLOURS, open_browser
from replayed import changed, write_replayed

from idem_ros.report import plots as report_plots
from idem_ros.report.folder import write_report

DESKTOP, PHONE = (1280, 900), (390, 844)
SHOWN = "[...document.querySelectorAll('.frame')].filter(p => !p.hidden).map(p => p.id)"
OVERLAPS = """
(() => {
  document.querySelectorAll('details').forEach(part => { part.open = true; });
  const parts = [...document.querySelectorAll('figure, .scroll, h2, h3, p, nav, ul, dl')]
    .filter(part => part.getClientRects().length && !part.parentElement.closest('dl'));
  const boxes = parts.map(part => part.getBoundingClientRect());
  const found = [];
  for (let i = 0; i < parts.length; i++)
    for (let j = i + 1; j < parts.length; j++) {
      const [a, b] = [boxes[i], boxes[j]];
      if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1
          && b.top < a.bottom - 1 && !parts[i].contains(parts[j]))
        found.push(parts[i].outerHTML.slice(0, 80) + ' / ' + parts[j].outerHTML.slice(0, 80));
    }
  return found;
})()
"""


@pytest.fixture(scope='module')
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp('report')
    result = write_replayed(folder)
    other = changed(result, lambda record: record.update(bag='x' * 200), 'long_' * 30)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_plots, 'MEASURES', report_plots.MEASURES[:1])
        return write_report([result, other], folder / 'report').as_uri()


@pytest.mark.parametrize('size', [DESKTOP, PHONE])
def test_nothing_is_wider_than_the_window(browser, address, size):
    browser.open(address, *size)
    widths = browser.evaluate('[document.documentElement.scrollWidth, document.body.scrollWidth]')
    assert max(widths) <= size[0]


@pytest.mark.parametrize('size', [DESKTOP, PHONE])
def test_nothing_overlaps(browser, address, size):
    browser.open(address, *size)
    assert browser.evaluate(OVERLAPS) == []


def test_tables_scroll_in_their_own_boxes_on_a_phone(browser, address):
    browser.open(address, *PHONE)
    boxes = browser.evaluate(
        "[...document.querySelectorAll('.scroll')].filter(b => b.clientWidth)"
        '.map(b => [b.clientWidth, b.scrollWidth, getComputedStyle(b).overflowX])'
    )
    assert all(client <= PHONE[0] and style == 'auto' for client, _, style in boxes)
    assert any(scroll > client for client, scroll, _ in boxes)


def test_the_page_asks_the_network_for_nothing_and_logs_no_error(browser, address):
    browser.open(address, *DESKTOP)
    assert browser.requests() == [address]
    assert browser.complaints() == []


def test_every_picture_is_shown(browser, address):
    browser.open(address, *DESKTOP)
    widths = browser.evaluate('[...document.images].map(image => image.naturalWidth)')
    assert len(widths) >= 8
    assert min(widths) > 300


def test_a_click_on_a_worst_frame_shows_its_pictures_and_hides_the_others(browser, address):
    browser.open(address, *PHONE)
    first = browser.evaluate(SHOWN)
    assert len(first) == 1  # of all results: there is one viewer
    row = "document.querySelectorAll('.worst')[0].querySelectorAll('tbody tr')[2]"
    wanted = browser.evaluate(f'{row}.dataset.pictures')
    assert wanted not in first
    browser.evaluate(f'{row}.scrollIntoView()')
    box = browser.evaluate(f'JSON.parse(JSON.stringify({row}.cells[2].getBoundingClientRect()))')
    place = {'x': box['x'] + 10, 'y': box['y'] + box['height'] / 2}
    for kind in ('mousePressed', 'mouseReleased'):
        browser.call('Input.dispatchMouseEvent', type=kind, button='left', clickCount=1, **place)
    assert browser.evaluate(SHOWN) == [wanted]
    shown = f"document.getElementById('{wanted}').querySelectorAll('img')"
    heights = browser.evaluate(f'[...{shown}].map(image => image.getBoundingClientRect().height)')
    assert len(heights) == 1
    assert min(heights) > 100
    viewer = f"document.getElementById('{wanted}').querySelector('#viewer')"
    assert browser.evaluate(f'{viewer}.getBoundingClientRect().height') > 300


def test_the_clouds_of_the_chosen_frame_are_drawn(browser, address):
    browser.open(address, *DESKTOP)
    if browser.evaluate("document.getElementById('viewer').classList.contains('flat')"):
        pytest.skip('this browser has no WebGL, not even in software')
    assert browser.evaluate(COLOURS) >= 3  # the ground, the target and the source
    assert 'points' in browser.evaluate("document.querySelector('#viewer .key').textContent")


def test_a_worst_frame_has_every_step_of_its_solve_and_q_of_each_point(browser, address):
    browser.open(address, *DESKTOP)
    if browser.evaluate("document.getElementById('viewer').classList.contains('flat')"):
        pytest.skip('this browser has no WebGL, not even in software')
    assert int(browser.evaluate("document.getElementById('step').max")) > 2
    assert not browser.evaluate("document.getElementById('by').hidden")
    browser.evaluate("document.querySelector('input[name=by][value=q]').click()")
    assert browser.evaluate(COLOURS) > 3  # from blue to red


def test_without_webgl_the_chosen_frame_is_shown_from_above(address, tmp_path):
    with open_browser(tmp_path, '--disable-3d-apis') as page:
        page.open(address, *PHONE)
        page.evaluate("document.querySelectorAll('.worst button')[1].click()")
        widths = page.evaluate(
            "[...document.querySelectorAll('#viewer img')].map(image => image.naturalWidth)"
        )
        assert len(widths) == 2
        assert min(widths) > 300
        assert page.evaluate('document.documentElement.scrollWidth') <= PHONE[0]


def test_a_frame_can_be_chosen_by_keyboard(browser, address):
    browser.open(address, *DESKTOP)
    button = "document.querySelectorAll('.worst button')[3]"
    browser.evaluate(f'{button}.focus()')
    for kind in ('keyDown', 'keyUp'):
        browser.call(
            'Input.dispatchKeyEvent', type=kind, key='Enter', text='\r', windowsVirtualKeyCode=13
        )
    wanted = browser.evaluate(f"{button}.getAttribute('aria-controls')")
    assert wanted in browser.evaluate(SHOWN)
    assert browser.evaluate(f"{button}.getAttribute('aria-expanded')") == 'true'
