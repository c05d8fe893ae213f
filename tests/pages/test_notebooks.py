"""The notebooks as files: valid, with small outputs, alike in structure. CI executes
them (`pytest --nbmake`)."""

import json
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parents[2]
FILES = sorted((ROOT / "notebooks").glob("*.ipynb"))


def load(file):
    return json.loads(file.read_text("utf-8"))


def source(cell):
    return "".join(cell["source"])


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_outputs_are_stored_whole_and_small(file):
    cells = load(file)["cells"]
    code = [cell for cell in cells if cell["cell_type"] == "code"]
    # executed from top to bottom in one go, without errors or warnings
    assert [cell["execution_count"] for cell in code] == list(
        range(1, len(code) + 1)
    ), "run docs/make_notebooks.py"
    outputs = [output for cell in code for output in cell["outputs"]]
    assert {output["output_type"] for output in outputs} <= {
        "stream",
        "execute_result",
        "display_data",
    }
    assert all(output.get("name", "stdout") == "stdout" for output in outputs)
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert file.stat().st_size <= 400 * 1024
    assert all(cell["metadata"] == {} for cell in cells)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_opens_anywhere(file):
    book = load(file)
    assert (book["nbformat"], book["nbformat_minor"]) == (4, 5)
    assert book["metadata"]["kernelspec"]["name"] == "python3"
    ids = [cell["id"] for cell in book["cells"]]
    assert len(set(ids)) == len(ids)
    assert all(re.fullmatch(r"[A-Za-z0-9_-]{1,64}", one) for one in ids)
    code = [source(cell) for cell in book["cells"] if cell["cell_type"] == "code"]
    # a bare Figure is displayed only by the inline backend; simbrake itself turns
    # 64-bit mode on
    assert code[0].startswith("%matplotlib inline\n")
    assert "import simbrake as sb\n" in code[0] + "\n"
    assert "jax_enable_x64" not in "".join(code)
    assert "import scenarios" not in "".join(code)
    assert not re.search(
        r"""["'](/|[A-Z]:|\.\.?/)""", "".join(code)
    )  # no path outside of the installed package
