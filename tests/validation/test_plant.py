"""Planting of errors: every kind is found where it should be, and each error is the one that was meant."""

import ast
import textwrap

import plant
import planting
import pytest

MODULE = '''
"""Text with 1 + 2."""
from typing import Any

class Motion:
    start: float = 1.5

    def ended(self, x, y: "a + b" = 2.0):
        """Text."""
        if x < 0 and y:
            raise ValueError("a" + str(1 + 1))
        rest = [-y for y in x[1:]]
        return f(x, 3 * y) if rest[0] else f"{rest[-1] + 1:.3f}"
'''


def of_module(tmp_path):
    file = tmp_path / "simbrake" / "motion.py"
    file.parent.mkdir()
    file.write_text(textwrap.dedent(MODULE), "utf-8")
    return file.read_text("utf-8"), planting.sites(file, tmp_path)


def test_errors_of_every_kind_and_none_in_text_annotations_or_messages(tmp_path):
    _, found = of_module(tmp_path)
    assert {(s.function, s.kind, s.before, s.after) for s in found} == {
        ("Motion", "constant", "1.5", "1.65"),
        ("Motion.ended", "constant", "2.0", "2.2"),
        ("Motion.ended", "operator", "x < 0 and y", "x < 0 or y"),
        ("Motion.ended", "dropped term", "x < 0 and y", "y"),
        ("Motion.ended", "dropped term", "x < 0 and y", "x < 0"),
        ("Motion.ended", "operator", "x < 0", "x > 0"),
        ("Motion.ended", "constant", "0", "1"),
        ("Motion.ended", "sign", "-y", "y"),
        ("Motion.ended", "index", "x[1:]", "x[2:]"),
        ("Motion.ended", "condition", 'f(x, 3 * y) if rest[0] else f"{rest[-1] + 1:.3f}"'.replace('"', "'"), NOT),
        ("Motion.ended", "swapped arguments", "f(x, 3 * y)", "f(3 * y, x)"),
        ("Motion.ended", "operator", "3 * y", "3 / y"),
        ("Motion.ended", "dropped term", "3 * y", "3"),
        ("Motion.ended", "dropped term", "3 * y", "y"),
        ("Motion.ended", "constant", "3", "4"),
        ("Motion.ended", "index", "rest[0]", "rest[1]"),
        ("Motion.ended", "index", "rest[-1]", "rest[0]"),
        ("Motion.ended", "operator", "rest[-1] + 1", "rest[-1] - 1"),
        ("Motion.ended", "dropped term", "rest[-1] + 1", "rest[-1]"),
        ("Motion.ended", "dropped term", "rest[-1] + 1", "1"),
        ("Motion.ended", "constant", "1", "2"),
    }


NOT = "f(x, 3 * y) if not rest[0] else f'{rest[-1] + 1:.3f}'"


def test_each_error_changes_its_place_alone(tmp_path):
    text, found = of_module(tmp_path)
    for site in found:
        planted = planting.with_error(text, site)
        assert planted is not None, site
        assert planted.encode()[: site.start] == text.encode()[: site.start]
        there = planted.encode()[site.start : len(planted.encode()) - len(text.encode()) + site.end].decode()
        assert ast.unparse(ast.parse(there, mode="eval")) == ast.unparse(ast.parse(site.after, mode="eval"))
        assert planted.encode().endswith(text.encode()[site.end :])
        assert planting.with_error(planted, site) is None  # it is no longer there


def test_places_are_drawn_by_seed_from_every_part_and_kind():
    first, again, other = (list(plant.drawn(60, seed)) for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert {plant.part_of(site.module) for site in first} == set(plant.PARTS)
    assert {site.kind for site in first} == set(planting.KINDS)
    assert len(set(first)) == 60


def test_reasons_of_equivalent_errors_are_of_places_there_are():
    known = plant.equivalents()
    assert all(reason for reason in known.values())
    there = {
        site.key for module in {key[0] for key in known} for site in planting.sites(plant.ROOT / module, plant.ROOT)
    }
    assert set(known) <= there


def test_tests_that_are_lost_are_left_out(tmp_path, capsys):
    """A list with one unknown test would run none, and the error count as caught."""
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_a.py").write_text("def test_one(): pass\n", "utf-8")
    kept, moved, gone = (f"tests/test_{name}" for name in ("a.py::test_one", "a.py::test_moved", "b.py::test_one"))
    known = object.__new__(plant.Map)
    known.seconds = dict.fromkeys((kept, moved, gone), 1.0)
    known.of_function = {"simbrake/x.py::f": {kept, moved}, "simbrake/x.py": {gone}}
    known.forget_lost(tmp_path)
    assert known.seconds == {kept: 1.0}
    assert known.of_function == {"simbrake/x.py::f": {kept}, "simbrake/x.py": set()}
    assert capsys.readouterr().out == "2 tests of the map are lost; python tests/plant.py --map test_a.py test_b.py\n"


@pytest.mark.parametrize(
    ("status", "output", "found"),
    [
        (0, "12 passed in 3 s", ("survived", "7 tests pass")),
        (1, "FAILED tests/test_a.py::test_b[1] - assert 1 == 2", ("caught", "tests/test_a.py::test_b[1]")),
        (2, "ERROR tests/test_a.py - NameError: x", ("caught", "tests/test_a.py")),
        (2, "!! Interrupted: the time is up !!\nFAILED tests/a.py::b", ("caught", "tests/a.py::b")),
        (2, "!! Interrupted: the time is up !!", ("survived", "the time was up")),
        (4, "ImportError while loading conftest '/x/tests/conftest.py'.", ("caught", "cannot be imported")),
        (4, "ERROR: not found: tests/a.py::b", ("survived", "pytest ended by itself, with 4")),
        (-11, "....", ("survived", "pytest ended by itself, with -11")),
        (None, "....", ("caught", "takes far longer than it should")),
    ],
)
def test_an_error_is_caught_only_where_a_test_fails(status, output, found):
    assert plant.judged(status, output, 7) == found
