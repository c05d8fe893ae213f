"""The pages: fresh, readable without a build, every public name with a place, every event and code with a row."""

import ast
import functools
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


#: a link with the name of code as its text, to a file of the package
SOURCE = re.compile(r"\[`([\w.]+)`\]\(((?:\.\./)+simbrake/[\w/]+\.py)\)")


@pytest.fixture(scope="module")
def make_reference():
    """The script that writes what the pages take from the code."""
    sys.path.insert(0, str(DOCS))
    import make_reference

    yield make_reference
    sys.path.remove(str(DOCS))


def pages() -> dict[pathlib.Path, str]:
    return {file: file.read_text("utf-8") for file in sorted(DOCS.rglob("*.md"))}


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


def test_every_public_name_is_on_one_page_of_the_reference(make_reference):
    names = make_reference.public_names()
    assert len(names) > 120
    homeless = [f"{name} (module {module})" for name, module in names.items() if make_reference.page_of(name) is None]
    assert not homeless, "give their modules a page in PAGES of docs/make_reference.py"
    placed = [name for page in make_reference.PAGES for name in make_reference.names_on(page)]
    assert sorted(placed) == sorted(names)
    assert {file.stem for file in (DOCS / "api").glob("*.md")} - {"index"} == set(make_reference.PAGES)
    index = (DOCS / "api" / "index.md").read_text("utf-8")
    for page in make_reference.PAGES:
        assert f"]({page}.md)" in index
        text = (DOCS / "api" / f"{page}.md").read_text("utf-8")
        assert f"<!-- reference {page}: begin -->\n" in text
        assert all(f"\n## `{full}`\n" in text for full in make_reference.entries(page))


def test_what_the_pages_take_from_the_code_is_fresh(make_reference):
    stale = [file.relative_to(DOCS).as_posix() for file in make_reference.stale()]
    assert not stale, "run: python docs/make_reference.py"
    marked = {name for text in pages().values() for name in re.findall(r"<!-- table (\w+): begin -->", text)}
    assert marked == make_reference.TABLES.keys()


def test_pages_are_readable_without_a_build(make_reference):
    """Plain Markdown as hosting sites show it: no directives and roles, links with a text and a target."""
    wrong = []
    texts = pages()
    anchors = {
        file: {make_reference.anchor(head) for head in re.findall(r"^#+ (.+)$", text, re.M)}
        for file, text in texts.items()
    }
    for file, text in texts.items():
        name = file.relative_to(DOCS).as_posix()
        wrong += [
            f"{name}: {found}"
            for found in re.findall(r"^(?:`{3,}|:{3,})\{[^}]*\}|(?<!\^)\{[\w:-]+\}`[^`]*`", text, re.M)
        ]
        wrong += [f"{name}: {found}" for found in re.findall(r"^: .*|\[\]\(.*?\)", text, re.M)]
        for target in re.findall(r"\]\(([^()\s]+)\)", re.sub(r"^```.*?^```$", "", text, flags=re.S | re.M)):
            path, _, anchor = target.partition("#")
            if re.match(r"\w+://", target):
                continue
            to = (file.parent / path).resolve() if path else file
            if not to.exists() or (anchor and anchor not in anchors.get(to, set())):
                wrong.append(f"{name}: {target} leads nowhere")
    assert not wrong


def test_what_the_pages_link_to_in_the_source_exists():
    found = [(file, *link) for file, text in pages().items() for link in SOURCE.findall(text)]
    assert len(found) > 400
    missing = [f"{file.name}: {name} in {path}" for file, name, path in found if not exists(name, file.parent / path)]
    assert not missing


@functools.cache
def parsed(file: pathlib.Path) -> ast.Module:
    return ast.parse(file.read_text("utf-8"))


def exists(name: str, file: pathlib.Path) -> bool:
    """Whether a file of the package has a dotted name below simbrake, as `brakes._band.tension_ratio`."""
    file = file.resolve()
    if not file.is_file():
        return False
    module = [part for part in file.relative_to(PACKAGE.resolve()).with_suffix("").parts if part != "__init__"]
    parts = name.split(".")
    body: list = parsed(file).body
    for part in parts[len(module) :]:
        node = next((x for x in body if getattr(x, "name", None) == part), None)
        if node is None:
            return False
        body = getattr(node, "body", [])
    return parts[: len(module)] == module


def test_all_pages_are_in_a_table_of_contents():
    index = (DOCS / "index.md").read_text("utf-8")
    for page in DOCS.rglob("*.md"):
        name = page.relative_to(DOCS).as_posix()
        if name != "index.md" and not (name.startswith("api/") and name != "api/index.md"):
            assert f"]({name})" in index, f"{name} is in none of the lists of docs/index.md"
