"""Where the files beside the Python code lie: in a checkout or where they were installed."""

from pathlib import Path


def installed_file(relative: str) -> Path | None:
    """Find a file that the package ships, or None where it was not installed.

    Args:
        relative: its path from the root of the checkout, such as 'config/refine.yaml'; installed,
            it lies under `share/idem_ros` of the prefix that holds this package.
    """
    for folder in Path(__file__).resolve().parents:
        for candidate in (folder / relative, folder / 'share' / 'idem_ros' / relative):
            if candidate.is_file():
                return candidate
    return None
