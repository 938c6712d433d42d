"""Sources that went wrong, kept on disk by a thread of its own: no refinement waits for it."""

import time
from collections.abc import Iterable
from typing import Any

from idem_ros.core import IdemError, RegistrationConfig, Status
from idem_ros.node.config import ALL, LATE, NOT_ALIGNED, REFUSED, CapsuleConfig
from idem_ros.node.worker import LatestOnlyWorker
from idem_ros.pairing.guesses import GuessConfig
from idem_ros.pairing.pair import Pair
from idem_ros.pairing.targets import PairingConfig
from idem_ros.refinement.diagnostics import is_registered
from idem_ros.refinement.point_time_config import PointTimeConfig
from idem_ros.refinement.preprocessing import PreprocessingConfig
from idem_ros.refinement.refiner import Refinement

QUIET = 60.0  # [s] between two lines on what cannot be written
MB = 10**6


class Capsules:
    """Writes capsules, see `idem_ros.capsules`; one that comes while another is written waits.

    A third takes the place of the one that waits.

    Args:
        logger: says what cannot be written, once a minute.
    """

    def __init__(self, logger: Any):
        self._logger = logger
        self._configs: dict[type, Any] = {CapsuleConfig: CapsuleConfig()}
        self._worker: LatestOnlyWorker | None = None
        self._said_at = -QUIET

    def configure(self, configs: dict[type, Any]) -> None:
        """Take other parameters, {type: configuration}, from the next source on."""
        self._configs = configs
        if configs[CapsuleConfig].folder:
            _writing()  # now, not beside a refinement

    def offer(
        self, pair: Pair, refinement: Refinement | None, reason: str, diagnostics: Iterable[tuple]
    ) -> None:
        """Have a source kept if it is one of those that are asked for.

        Args:
            pair: with the source.
            refinement: what came of it; None: it was refused.
            reason: why it was refused.
            diagnostics: the last statuses, see `Report.lately`.
        """
        configs = self._configs
        config = configs[CapsuleConfig]
        if not config.folder or not is_wanted(config.when, refinement):
            return
        if self._worker is None:
            self._worker = LatestOnlyWorker(self._write)
        self._worker.submit((configs, pair, refinement, reason, tuple(diagnostics)))

    def stop(self) -> None:
        """Let what is being written be finished, and write nothing more. May be repeated."""
        if self._worker is not None:
            self._worker.stop()
            self._worker = None

    def _write(self, job: tuple) -> None:
        seen_as, keep, settings_of = _writing()
        configs, pair, refinement, reason, diagnostics = job
        settings = settings_of(
            configs[RegistrationConfig],
            configs[PreprocessingConfig],
            configs[PairingConfig],
            configs[GuessConfig],
            configs[PointTimeConfig],
        )
        config = configs[CapsuleConfig]
        seen = seen_as(pair, settings, refinement, reason, diagnostics)
        try:
            path = keep(config.folder, seen, config.most, config.most_mb * MB)
            self._logger.debug(f'kept as {path}')
        except (IdemError, OSError) as error:
            self._say(f'no capsule: {error}')

    def _say(self, text: str) -> None:
        now = time.monotonic()
        if now - self._said_at >= QUIET:
            self._said_at = now
            self._logger.warning(text)


def _writing() -> tuple[Any, Any, Any]:
    """Return what writes capsules: who keeps none does not pay for rosbags and the schema."""
    from idem_ros.capsules import Seen, keep
    from idem_ros.recording.messages import typestore
    from idem_ros.replay.settings import Settings

    typestore()
    return Seen, keep, Settings


def is_wanted(when: str, refinement: Refinement | None) -> bool:
    """Return whether a source is one of those that `capsules.when` asks for; None: refused."""
    if when == ALL or refinement is None:
        return when in (ALL, REFUSED, NOT_ALIGNED)
    if when == LATE:
        return refinement.result.status is Status.LATE
    return when == NOT_ALIGNED and not is_registered(refinement.result)
