"""A headless Chromium, spoken to by its own protocol over two pipes."""

import json
import os
import select
import shutil
import subprocess
from contextlib import contextmanager

from idem_ros.core import IdemError

NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable', 'chrome')
FLAGS = ('--headless=new', '--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage')
PATIENCE = 60  # [s] for an answer
SOFTWARE = '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'
READ, WRITE = 3, 4  # the descriptors that --remote-debugging-pipe speaks on


class NoBrowser(IdemError):
    """No browser is installed."""


class Page:
    """One page of the browser, and what it asked the network for."""

    def __init__(self, commands, answers):
        self._commands, self._answers = commands, answers
        self._buffer, self._count, self._session = b'', 0, None
        self.events = []
        target = self.call('Target.createTarget', url='about:blank')['targetId']
        attached = self.call('Target.attachToTarget', targetId=target, flatten=True)
        self._session = attached['sessionId']
        for domain in ('Page', 'Network', 'Runtime', 'Log'):
            self.call(f'{domain}.enable')

    def call(self, method, **params):
        """Send a command and return its result; events that come before are kept."""
        self._count += 1
        message = {'id': self._count, 'method': method, 'params': params}
        if self._session:
            message['sessionId'] = self._session
        os.write(self._commands, json.dumps(message).encode() + b'\0')
        while True:
            answer = self._next()
            if answer.get('id') == self._count:
                assert 'error' not in answer, answer
                return answer['result']
            self.events.append(answer)

    def open(self, url, width, height):
        """Load a page in a window of that size, as a phone has it below 600 pixels."""
        self.call(
            'Emulation.setDeviceMetricsOverride',
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        self.events.clear()
        self.call('Page.navigate', url=url)
        while not any(event.get('method') == 'Page.loadEventFired' for event in self.events):
            self.events.append(self._next())

    def evaluate(self, expression):
        """Return the value of a JavaScript expression in the page; of a promise when it comes."""
        found = self.call(
            'Runtime.evaluate', expression=expression, returnByValue=True, awaitPromise=True
        )
        assert 'exceptionDetails' not in found, found
        return found['result'].get('value')

    def requests(self):
        """Return the addresses that the page asked for, without those it holds itself."""
        urls = [
            event['params']['request']['url']
            for event in self.events
            if event.get('method') == 'Network.requestWillBeSent'
        ]
        return [url for url in urls if not url.startswith('data:')]

    def complaints(self):
        """Return what the browser logged as errors and warnings, and uncaught exceptions."""
        return [
            event['params']
            for event in self.events
            if event.get('method') in ('Log.entryAdded', 'Runtime.exceptionThrown')
        ]

    def _next(self):
        while b'\0' not in self._buffer:
            ready, _, _ = select.select([self._answers], [], [], PATIENCE)
            assert ready, f'the browser did not answer within {PATIENCE} s'
            received = os.read(self._answers, 2**20)
            assert received, 'the browser has ended'
            self._buffer += received
        message, _, self._buffer = self._buffer.partition(b'\0')
        return json.loads(message)


@contextmanager
def open_browser(folder, *flags):
    """Start a browser with its profile in a folder; yield a `Page`.

    Raises:
        NoBrowser: none is installed.
    """
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        raise NoBrowser(f'no browser is installed: none of {", ".join(NAMES)}')
    to_browser, commands = os.pipe()
    answers, from_browser = os.pipe()
    command = [program, *FLAGS, *flags, f'--user-data-dir={folder}', '--remote-debugging-pipe']
    # a shell puts the pipes where the browser expects them; exec leaves one process to end
    placed = f'exec "$@" {READ}<&{to_browser} {WRITE}>&{from_browser}'
    with subprocess.Popen(
        ['bash', '-c', placed, 'bash', *command],
        pass_fds=(to_browser, from_browser),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        os.close(to_browser)
        os.close(from_browser)
        try:
            page = Page(commands, answers)
            yield page
        finally:
            process.terminate()
            process.wait(PATIENCE)
            os.close(commands)
            os.close(answers)
