"""Errors that nobody foresaw: said once in a while with where they came from, and lived with."""

import traceback
from typing import Any

from idem_ros.core.exceptions import IdemError

AGAIN = 5.0  # [s] from one traceback to the next


def reason_of(error: BaseException, logger: Any = None) -> str:
    """Return what an error says; of one that nobody foresaw its kind, too.

    Args:
        error: any.
        logger: is told where one that nobody foresaw came from, of many one in a while.
    """
    if isinstance(error, IdemError):
        return str(error)
    if logger is not None:
        said = ''.join(traceback.format_exception(error))
        logger.error(said, throttle_duration_sec=AGAIN)
    return f'unexpected {type(error).__name__}: {error}'
