"""Executes the notebooks and stores their outputs:
`python docs/make_notebooks.py [NUMBER …]`, by default all seven.

Needs `pip install -e '.[notebooks]'`. Cells get no metadata and no timing, so that
outputs change with results only.
"""

import base64
import io
import pathlib
import sys

import nbformat
from nbclient import NotebookClient
from PIL import Image

FOLDER = pathlib.Path(__file__).parents[1] / "notebooks"


def smaller(picture: str) -> str:
    """A PNG in base64 with a palette of 256 colours: half of the size; fewer give thin
    lines the colour of others."""
    image = Image.open(io.BytesIO(base64.b64decode(picture))).convert("RGB")
    file = io.BytesIO()
    image.quantize(256, dither=Image.Dither.NONE).save(file, "PNG", optimize=True)
    return base64.b64encode(file.getvalue()).decode()


def joined(outputs: list[nbformat.NotebookNode]) -> list[nbformat.NotebookNode]:
    """Printed lines that follow each other as one output."""
    found: list[nbformat.NotebookNode] = []
    for output in outputs:
        if found and output.output_type == found[-1].output_type == "stream":
            found[-1].text += output.text
        else:
            found.append(output)
    return found


def execute(file: pathlib.Path) -> None:
    """Run one notebook and write it with its outputs; an exception in a cell leaves the
    file as it was."""
    book = nbformat.read(file, as_version=4)
    NotebookClient(
        book,
        timeout=1200,
        record_timing=False,
        resources={"metadata": {"path": str(FOLDER)}},
    ).execute()
    for cell in book.cells:
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.outputs = joined(
                [output for output in cell.outputs if output.get("name") != "stderr"]
            )
            for output in cell.outputs:
                output.get("metadata", {}).clear()
                if "image/png" in output.get("data", {}):
                    output.data["image/png"] = smaller(output.data["image/png"])
    book.metadata = {
        "kernelspec": {
            "display_name": "Python 3",
            "language": "python",
            "name": "python3",
        },
        "language_info": {"name": "python"},
    }
    nbformat.validate(book)
    nbformat.write(book, file)
    print(f"{file.name}: {file.stat().st_size / 1024:.0f} kB")


if __name__ == "__main__":
    for file in sorted(FOLDER.glob("*.ipynb")):
        if not sys.argv[1:] or file.name[0] in sys.argv[1:]:
            execute(file)
