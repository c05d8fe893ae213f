"""Scenes that the wheel takes along, and those that only a checkout has."""

import json

import pytest
from commands import call

import simbrake as sb


@pytest.mark.parametrize(
    "name",
    [
        "drag_lowering",
        "drag_lowering.py",
        "scenarios/drag_lowering.py",
        "standard.toml",
    ],
)
def test_one_name_opens_a_shipped_scene_everywhere(name, capsys, monkeypatch, tmp_path):
    """With or without its ending, wherever one works, and beside a folder of that
    name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "drag_lowering").mkdir()
    file = sb.files.shipped(name)
    speed = sb.read_scene(file).initial.omega
    assert sb.read_scene(name).initial.omega == speed
    assert sb.read_scene(name, {"initial.omega": 3.0}).initial.omega == 3.0
    code, out, _ = call(capsys, "scene", "show", name, "--json")
    shown = {row["path"]: row["value"] for row in json.loads(out)}
    assert (code, shown["initial.omega"]) == (0, speed)


def test_python_scene_is_named_by_its_ending():
    assert sb.files.shipped("u2_5_5_stop").suffix == ".toml"
    assert sb.files.shipped("u2_5_5_stop.py").suffix == ".py"


def test_title_is_the_whole_first_paragraph(capsys):
    code, out, _ = call(capsys, "new", "--json")
    titles = {row["name"]: row["title"] for row in json.loads(out)}
    assert code == 0
    assert titles["drag_lowering"] == (
        "Lowering a heavy string at constant speed on the brake alone: the lever follows "
        "the friction of the heating linings"
    )
    assert titles["lift"].endswith("a disc brake that springs close")
