"""The notebooks as files: valid, without outputs, alike in how they begin. CI executes them (`pytest --nbmake`)."""

import json
import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parent.parent
FILES = sorted((ROOT / "notebooks").glob("*.ipynb"))


def load(file):
    return json.loads(file.read_text("utf-8"))


def source(cell):
    return "".join(cell["source"])


def test_there_are_six_and_all_are_listed():
    assert [file.stem[0] for file in FILES] == list("123456")
    page = (ROOT / "docs" / "notebooks.md").read_text("utf-8")
    assert re.findall(r"^\| `(\w+)` \|", page, re.M) == [file.stem for file in FILES]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_nothing_that_ran_is_committed(file):
    for cell in load(file)["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None
        assert cell["metadata"] == {}


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_opens_anywhere(file):
    book = load(file)
    assert (book["nbformat"], book["nbformat_minor"]) == (4, 5)
    assert book["metadata"]["kernelspec"]["name"] == "python3"
    ids = [cell["id"] for cell in book["cells"]]
    assert len(set(ids)) == len(ids)
    assert all(re.fullmatch(r"[A-Za-z0-9_-]{1,64}", one) for one in ids)
    code = [source(cell) for cell in book["cells"] if cell["cell_type"] == "code"]
    # a bare Figure is displayed only by the inline backend
    assert code[0].startswith("%matplotlib inline\n")
    assert "jax_enable_x64" not in "".join(code)  # simbrake turns 64 bits on
    assert "import scenarios" not in "".join(code)
    assert not re.search(r"""["'](/|[A-Z]:|\.\.?/)""", "".join(code))  # no path outside of the installed package


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_teaches_and_checks(file):
    cells = load(file)["cells"]
    text = "".join(source(cell) for cell in cells if cell["cell_type"] == "markdown")
    assert text.startswith(f"# {file.stem[0]} · ")
    assert "## What to try next" in text
    assert sum(source(cell).count("\n    assert ") + source(cell).count("\nassert ") for cell in cells) >= 3
