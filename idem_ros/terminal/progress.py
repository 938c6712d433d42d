"""How far a long work is: a bar on a terminal, elsewhere nothing."""

from typing import Any


def progress(steps: Any = None, total=None, desc=None, **options) -> Any:
    """Return what iterates over steps and shows how far it is, see `tqdm`; no bar stays behind."""
    from tqdm import tqdm  # late: most commands show none

    return tqdm(steps, total=total, desc=desc, leave=False, disable=None, **options)
