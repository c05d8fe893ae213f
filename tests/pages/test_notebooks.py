"""The notebooks as files: outputs stored whole and small, nothing that opens only here.
CI executes them (`pytest --nbmake`)."""

import json
import pathlib
import re

import pytest

FILES = sorted((pathlib.Path(__file__).parents[2] / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_outputs_are_whole_and_small(file):
    book = json.loads(file.read_text("utf-8"))
    code = [cell for cell in book["cells"] if cell["cell_type"] == "code"]
    counts = [cell["execution_count"] for cell in code]
    assert counts == list(range(1, len(code) + 1)), "run docs/make_notebooks.py"
    kinds = {output["output_type"] for cell in code for output in cell["outputs"]}
    assert kinds <= {"stream", "execute_result", "display_data"}
    assert file.stat().st_size <= 400 * 1024
    assert book["metadata"]["kernelspec"]["name"] == "python3"
    text = "".join("".join(cell["source"]) for cell in code)
    assert not re.search(r"[\"'](/|[A-Z]:|\.\.?/)|import scenarios", text)
