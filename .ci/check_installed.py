"""Check an installed simbrake from an empty folder:
`python check_installed.py CHECKOUT`.

The package lies outside of the checkout, has every file of its source and twelve
shipped scenes, and runs, with its templates and tables.
"""

import json
import pathlib
import shutil
import subprocess
import sys

import simbrake as sb
from simbrake.files.shipped_scenes import IN_CHECKOUT


def files(package: pathlib.Path) -> set[pathlib.Path]:
    """All files of a package but compiled ones, relative to it."""
    found = {file.relative_to(package) for file in package.rglob("*") if file.is_file()}
    return {file for file in found if "__pycache__" not in file.parts}


def command() -> str:
    return str(pathlib.Path(sys.executable).parent / "simbrake")


def run(*arguments: str) -> str:
    """What the installed command prints; an exit code other than 0 is an error."""
    return subprocess.run(
        [command(), *arguments], capture_output=True, text=True, check=True
    ).stdout


def main() -> None:
    checkout = pathlib.Path(sys.argv[1]).resolve()
    installed = pathlib.Path(sb.__file__).resolve().parent
    assert not installed.is_relative_to(checkout), installed
    scenes = {
        file for file in files(checkout / "scenarios") if file.stem not in IN_CHECKOUT
    }
    source = files(checkout / "simbrake") | {
        pathlib.Path("scenarios") / file for file in scenes
    }
    assert files(installed) == source, sorted(map(str, files(installed) ^ source))
    assert pathlib.Path("py.typed") in source
    for name in sb.__all__:
        assert getattr(sb, name) is not None
    assert sb.formulas.rim_material("cast_iron")
    shutil.copy(checkout / "scenarios" / "u2_5_5_stop.py", "u2_5_5_stop.py")
    for name in ("standard", "u2_5_5_stop", "drawworks_tests"):
        run("new", name)
    run("test", "drawworks_tests.toml")
    for scene in ("u2_5_5_stop.py", "u2_5_5_stop.toml", "standard.toml", "standard"):
        assert json.loads(run("run", scene, "--json"))["status"] == "stopped"
    run("scene", "check", "drag_lowering")  # uses another one
    run("report", "u2_5_5_stop.toml")
    assert "<html" in pathlib.Path("u2_5_5_stop.html").read_text("utf-8")
    missing = subprocess.run(
        [command(), "run", "unequal_bands"], capture_output=True, text=True
    )
    assert missing.returncode == 2
    assert "scenarios/unequal_bands.py in a checkout" in missing.stderr
    away = subprocess.run([command(), "reproduce"], capture_output=True, text=True)
    assert (away.returncode, away.stdout) == (2, "")
    assert "papers/reproduce.py" in away.stderr


if __name__ == "__main__":
    main()
