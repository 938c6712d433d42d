"""A headless Chromium for tests: those that need one are skipped where there is none."""

from contextlib import ExitStack, contextmanager

import pytest

from benchmarks import browser
from benchmarks.browser import SOFTWARE

__all__ = ['COLOURS', 'SOFTWARE', 'open_browser']
# how many different ones the viewer has drawn
COLOURS = """
(() => {
  const gl = document.querySelector('canvas').getContext('webgl2');
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(4 * width * height);
  viewer.framesPerSecond(1);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return new Set(new Uint32Array(pixels.buffer)).size;
})()
"""


@contextmanager
def open_browser(folder, *flags):
    """Start a browser with its profile in a folder; yield its page."""
    with ExitStack() as opened:
        try:
            page = opened.enter_context(browser.open_browser(folder, *flags))
        except browser.NoBrowser as error:
            pytest.skip(str(error))
        yield page
