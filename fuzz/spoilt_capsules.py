"""Capsules spoilt: what they say of themselves, their record, and their bytes."""

import io
import json
from pathlib import Path

from values import HOSTILE, chance, spoilt_bytes, spoilt_record

from idem_ros.capsules import NAME, TOPICS, Seen, write_capsule
from idem_ros.messages.transform_message import matrix_of
from idem_ros.pairing.guesses import Guess
from idem_ros.pairing.pair import Pair
from idem_ros.recording.embedded import METADATA, RECORD, read_embedded
from idem_ros.recording.reader import open_recording
from idem_ros.recording.writer import write_mcap
from idem_ros.refinement.refiner import Refiner
from idem_ros.replay.settings import Settings

COMMANDS = [
    ['replay', 'spoilt.mcap'],
    ['replay', 'spoilt.mcap', '--json', 'again.json'],
    ['replay', '--again', 'spoilt.mcap'],
    ['show', 'spoilt.mcap', '--out', 'page.html'],
    ['compare', 'spoilt.mcap', 'spoilt.mcap'],
]
SHARES = [8, 4, 4, 1, 1]


def _pair_of(bag):
    """Return the first `Pair` of a recording: target, source and the guess of it."""
    with open_recording(bag) as recording:
        topics = TOPICS.target, TOPICS.source, TOPICS.guess
        first = {topic: message for topic, _, message in [*recording.messages(topics)][::-1]}
    target, source, guess = (first[topic] for topic in topics)
    return Pair(target, source, Guess(matrix_of(guess), 'map', 'lidar'))


class Capsules:
    """Cases of spoilt capsules.

    Args:
        inputs: a folder with scans.mcap, into which a capsule is written whole.
    """

    def __init__(self, inputs):
        inputs = Path(inputs)
        path, settings = inputs / 'capsule.mcap', Settings()
        pair = _pair_of(inputs / 'scans.mcap')
        write_capsule(path, Seen(pair, settings, Refiner(settings.config).refine(pair)))
        embedded = read_embedded(path)
        self._bytes, self._metadata = path.read_bytes(), embedded.metadata
        self._record = json.loads(embedded.attachments[RECORD])
        with open_recording(path) as recording:
            self._messages = list(recording.messages([TOPICS.target, TOPICS.source, TOPICS.guess]))

    def write(self, rng):
        """Write a case into the working folder; return the arguments of `idem`."""
        if rng.random() < 0.3:
            Path('spoilt.mcap').write_bytes(spoilt_bytes(rng, self._bytes))
        else:
            text = json.dumps(spoilt_record(rng, self._record)).encode()
            text = spoilt_bytes(rng, text) if rng.random() < 0.1 else text
            metadata = {name: dict(each) for name, each in self._metadata.items()}
            if rng.random() < 0.1:
                inner = metadata[chance(rng, NAME, METADATA)]
                inner[chance(rng, *inner)] = str(chance(rng, *HOSTILE)).replace('\ud800', '')
            attached = {RECORD: ('application/json', io.BytesIO(text))}
            write_mcap('spoilt.mcap', self._messages, metadata, attached)
        (words,) = rng.choices(COMMANDS, SHARES)
        return words
