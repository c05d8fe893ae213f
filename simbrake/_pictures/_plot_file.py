"""A figure as bytes of a file, the same for the same figure."""

import io

import matplotlib
from matplotlib.figure import Figure


def svg(figure: Figure) -> bytes:
    """The figure as an SVG whose text is drawn, so that it looks alike without the font, and without a date."""
    file = io.BytesIO()
    # ids inside the file come from a hash; without a salt of our own they differ from one time to the next
    with matplotlib.rc_context({"svg.hashsalt": "simbrake", "svg.fonttype": "path"}):
        figure.savefig(file, format="svg", metadata={"Date": None})
    return file.getvalue()


def png(figure: Figure, dpi: float) -> bytes:
    """The figure as a PNG."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=dpi, metadata={"Software": None})
    return file.getvalue()
