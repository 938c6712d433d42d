"""The site as a phone and a desk show it; skipped where `make site` has not built it."""

from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import pytest
from conftest import ROOT

SITE = ROOT / 'build' / 'site'
DESKTOP, PHONE = (1280, 900), (390, 844)
LOADED = '[...document.images].filter(i => i.complete && !i.naturalWidth).map(i => i.src)'
WIDER = """
[...document.querySelectorAll('article *')]
  .filter(each => each.getBoundingClientRect().right > innerWidth + 1
    && !each.closest('.md-typeset__scrollwrap, .md-typeset__table, pre, table, .highlight, svg'))
  .map(each => each.outerHTML.slice(0, 100))
"""


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *said):
        pass


@pytest.fixture(scope='module')
def address():
    if not (SITE / 'index.html').is_file():
        pytest.skip('make site has not built it')
    with ThreadingHTTPServer(('127.0.0.1', 0), partial(_Quiet, directory=str(SITE))) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield f'http://127.0.0.1:{server.server_port}'
        server.shutdown()


@pytest.mark.parametrize('size', [DESKTOP, PHONE])
def test_no_page_is_wider_than_the_window_and_every_picture_is_there(browser, address, size):
    pages = sorted(page.relative_to(SITE).as_posix() for page in SITE.rglob('*.html'))
    assert len(pages) > 30
    found = {}
    for page in pages:
        browser.open(f'{address}/{page}', *size)
        wrong = browser.evaluate(WIDER) + browser.evaluate(LOADED)
        if browser.evaluate('document.documentElement.scrollWidth') > size[0]:
            wrong.append('the page scrolls sideways')
        if wrong:
            found[page] = wrong[:3]
    assert found == {}
