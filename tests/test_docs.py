"""The pages: every public name has a place in the reference, every event and code a row in its table."""

import ast
import itertools
import pathlib
import re
import sys

import pytest

import simbrake as sb
from simbrake._physics import _chain, _mechanism, _sprung
from simbrake._run import _log, _report
from simbrake.hybrid import Code
from simbrake.results import BandMode

PACKAGE = pathlib.Path(sb.__file__).parent
DOCS = PACKAGE.parent / "docs"
LABELS = [_mechanism.Label(int(band), inner) for band in BandMode for inner in (-1, 0, 1)]


@pytest.fixture(scope="module")
def extension():
    """The folder of the pages' own Sphinx extensions on the path."""
    sys.path.insert(0, str(DOCS / "_extension"))
    yield
    sys.path.remove(str(DOCS / "_extension"))


def text_constants(tree: ast.AST) -> set[str]:
    return {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}


def test_every_change_of_mode_has_names_with_a_row():
    emitted = {
        name
        for before, after in itertools.product(LABELS, LABELS)
        for first in (True, False)
        for name in _mechanism.events_of_change(before, after, first)
    }
    assert {"slip_onset", "full_slip", "stop", "restart", "external_lock", "internal_restick"} <= emitted
    assert emitted <= _log.EVENTS.keys()


def test_every_name_that_makes_an_event_has_a_row():
    """`Event(time, "name", …)` anywhere in the package, and names handed over as `("name", lining)` marks."""
    found = set()
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Event":
                found |= {x.value for x in node.args if isinstance(x, ast.Constant) and isinstance(x.value, str)}
            if isinstance(node, ast.FunctionDef) and node.name == "mark_names":
                found |= {text for text in text_constants(node) if re.fullmatch(r"[a-z_]+", text)}
    assert {"lining_limit", "self_locking", "grip_lost", "permissible_temperature"} <= found
    assert found <= _log.EVENTS.keys()


def test_contacts_of_single_linings_have_rows():
    chain = _chain.ChainMode(*[None] * len(_chain.ChainMode._fields))
    bandage = _sprung.SprungMode(*[None] * len(_sprung.SprungMode._fields))
    names = {
        f"{contact}_{what}" for mode in (chain, bandage) for contact in mode.contacts for what in ("slip", "stick")
    }
    assert len(names) == 6
    assert names <= _log.EVENTS.keys()
    assert {"slip", "stick"} <= text_constants(ast.parse(pathlib.Path(_report.__file__).read_text("utf-8")))


def test_no_row_for_an_event_that_nothing_can_emit():
    said = set()
    for file in PACKAGE.rglob("*.py"):
        if file.name != "_event_names.py":
            said |= text_constants(ast.parse(file.read_text("utf-8")))
    contacts = {f"{contact}_{what}" for contact in said for what in ("slip", "stick")}
    assert _log.EVENTS.keys() <= said | contacts


def test_every_mode_stage_status_and_code_has_words():
    assert set(_mechanism.BAND_MODES) == set(BandMode)
    assert {_log.stage_of(label) for label in LABELS} == set(_log.STAGES)
    assert set(_log.STATUS_MESSAGES) == set(_log.Status)
    assert set(_log.FAILURES) == (set(Code) | set(_mechanism.BrakeCode)) - {Code.COMPLETED}
    assert all(len(words) == 2 and all(words) for words in _mechanism.BAND_MODES.values())
    assert all(about.meaning and about.brakes for about in _log.EVENTS.values())
    assert _mechanism.BandMode.HELD in _mechanism.BAND_MODES


def test_every_public_name_is_on_one_page_of_the_reference(extension):
    import groups

    names = groups.public_names()
    assert len(names) > 120
    homeless = [f"{name} (module {module})" for name, module in names.items() if groups.page_of(name) is None]
    assert not homeless, "give their modules a page in docs/_extension/groups.py"
    placed = [name for page in groups.PAGES for name in groups.names_on(page)]
    assert sorted(placed) == sorted(names)
    pages = {*groups.PAGES, "pictures"}
    assert {file.stem for file in (DOCS / "api").glob("*.md")} - {"index"} == pages
    index = (DOCS / "api" / "index.md").read_text("utf-8").splitlines()
    assert pages <= set(index)
    for page in pages:
        assert f"```{{public-names}} {page}\n" in (DOCS / "api" / f"{page}.md").read_text("utf-8")


def test_what_the_theory_links_to_exists():
    """Links to the source, which need no build of the pages to be looked at."""
    pages = sorted((DOCS / "theory").glob("*.md"))
    found = [name for page in pages for name in re.findall(r"\{source\}`([^`]+)`", page.read_text("utf-8"))]
    assert len(found) > 60
    missing = [name for name in found if not exists(name)]
    assert not missing


def exists(name: str) -> bool:
    parts, folder = name.split("."), PACKAGE
    while parts and (folder / parts[0]).is_dir():
        folder /= parts.pop(0)
    file = folder / (f"{parts[0]}.py" if parts else "__init__.py")
    if not file.is_file():
        return False
    body = ast.parse(file.read_text("utf-8")).body
    for part in parts[1:]:
        node = next((x for x in body if getattr(x, "name", None) == part), None)
        if node is None:
            return False
        body = getattr(node, "body", [])
    return True


def test_all_pages_are_in_a_table_of_contents():
    index = (DOCS / "index.md").read_text("utf-8").split()
    for page in DOCS.rglob("*.md"):
        name = page.relative_to(DOCS).with_suffix("").as_posix()
        if name != "index" and not (name.startswith("api/") and name != "api/index"):
            assert name in index, f"{name} is in no table of contents of docs/index.md"
