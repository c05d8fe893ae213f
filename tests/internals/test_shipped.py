"""Scenes that the wheel takes along, and those that only a checkout has."""

from commands import call

from simbrake.files import _shipped
from simbrake.files._shipped import IN_CHECKOUT, shipped_files


def test_twelve_scenes_are_in_the_wheel(scenarios):
    """What `.ci/check_installed.py` sees in an installed one."""
    names = {name for name, one in shipped_files().items() if not one.template}
    assert {one.file.parent for one in shipped_files().values() if not one.template} == {scenarios}
    assert len(names - set(IN_CHECKOUT)) == 12
    assert names > set(IN_CHECKOUT)


def test_scene_of_the_checkout_alone(capsys, monkeypatch):
    installed = {name: one for name, one in shipped_files().items() if name not in IN_CHECKOUT}
    monkeypatch.setattr(_shipped, "shipped_files", lambda: installed)
    for arguments in (("run", "unequal_bands"), ("new", "unequal_bands")):
        code, _, err = call(capsys, *arguments)
        assert (code, "scenarios/unequal_bands.py in a checkout" in err) == (2, True)
