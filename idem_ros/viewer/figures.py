"""How figures of pages look, and their bytes."""

import io
from typing import Any

STYLE: dict[Any, Any] = {
    'font.size': 9,
    'axes.titlesize': 9,
    'legend.fontsize': 8,
    'svg.hashsalt': 'idem',
}
METADATA = {'svg': {'Date': None}, 'png': {'Software': None}}


def save(figure):
    """Return a figure as (SVG, PNG); the same bytes for the same figure."""
    svg = saved_as('svg', figure, 140)
    figure.set_layout_engine('none')  # it is laid out now, which takes as long as to draw it
    return svg, saved_as('png', figure, 140)


def saved_as(kind, figure, dpi):
    """Return a figure as 'svg' or 'png'; the same bytes for the same figure."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, metadata=METADATA[kind], dpi=dpi)
    return file.getvalue()
