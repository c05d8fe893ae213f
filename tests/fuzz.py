"""Mutated input: scene files, `--set`, recordings, result files, manifests; each is
read, or an input error in words.

`python tests/fuzz.py --count 20000 --seed 1` runs many of them,
`tests/files/test_hostile_input.py` a few hundred. A mutant that ends in any other
error, or takes longer than 2 s, is printed as a line for the corpus of that test.
"""

import argparse
import contextlib
import functools
import pathlib
import random
import re
import sys
import tempfile
import time
import warnings as python_warnings
from collections.abc import Callable, Iterator
from typing import NamedTuple

import simbrake as sb

ROOT = pathlib.Path(sb.__file__).parent
#: s that reading and checking one mutant may take
LONGEST = 2.0

#: what takes the place of a number, a word or a text
NASTY = (
    *(
        "0",
        "-1",
        "1e308",
        "-1e308",
        "5e-324",
        "nan",
        "inf",
        "-inf",
        "1e400",
        "0x10",
        "1_000",
        "9" * 400,
        "1e-40",
    ),
    *(
        "1e40",
        "2.5",
        "100",
        "true",
        "none",
        "[]",
        "{}",
        "[[]]",
        "[1, 2]",
        "[nan]",
        "1979-05-27",
        "07:32:00",
    ),
    *(
        '""',
        '"0"',
        "'x'",
        '"1 N"',
        '"1 kg"',
        '"1 m^9^9^9"',
        '"1 (m"',
        '"90 degC"',
        '"-300 degC"',
        '"[1, 2] m"',
    ),
    *(
        '"[1, 2"',
        '"1 1 m"',
        '"1 %"',
        '"1e5 km/h"',
        '"=1+1"',
        '"@SUM(A1)"',
        '"\\u0000"',
        '"../../etc/passwd"',
    ),
    *(
        '"/dev/zero"',
        '"<script>alert(1)</script>"',
        '"{{7*7}}"',
        '"%s%n"',
        f'"{"a" * 5000}"',
        f'"{"🛢" * 50}"',
    ),
    *(
        "\"__import__('os').system('touch hit')\"",
        '"ConstantFriction"',
        '"Lining"',
        '"HookLoad"',
        '"steel"',
    ),
    *('"travel 3 m"', '"repeat 99999999 times"', '"hold 5 s"'),
)
#: what is put between two characters
BITS = (*"\x00\n\"'[]{}=.,;#\\\t\u202eé-", "\ud83d\udee2", "e9")
_TOKEN = re.compile(r"""[\w.+-]+|"[^"\n]*"|'[^'\n]*'""")


def mutated(text: str, draw: random.Random) -> str:
    """The text with one to four changes."""
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        lines = text.split("\n")
        tokens = list(_TOKEN.finditer(text))
        i = draw.randrange(len(lines))
        j = draw.randrange(len(lines))
        way = draw.randrange(9)
        if way < 4 and tokens:
            token = draw.choice(tokens)
            text = text[: token.start()] + draw.choice(NASTY) + text[token.end() :]
        elif way == 4:
            lines[i], lines[j] = lines[j], lines[i]
            text = "\n".join(lines)
        elif way == 5:
            del lines[i]
            text = "\n".join(lines)
        elif way == 6:
            lines[i:i] = [lines[j]] * draw.choice((1, 1, 200))
            text = "\n".join(lines)
        elif way == 7:
            text = text[: draw.randrange(len(text) + 1)]
        else:
            at = draw.randrange(len(text) + 1)
            text = (
                text[:at] + draw.choice(BITS) * draw.choice((1, 1, 1, 3000)) + text[at:]
            )
    return text


def spoiled(data: bytes, draw: random.Random) -> bytes:
    """Bytes with a few of them changed, missing or moved."""
    found = bytearray(data)
    for _ in range(draw.choice((1, 1, 3, 30))):
        at = draw.randrange(len(found)) if found else 0
        way = draw.randrange(4)
        if way == 0:
            found[at : at + 1] = bytes([draw.randrange(256)])
        elif way == 1:
            del found[at : at + draw.choice((1, 4, 400))]
        elif way == 2:
            found[at:at] = found[: draw.choice((1, 8, 400))]
        else:
            found[at : at + 4] = draw.choice(
                (b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\x00\x00\x00\x00")
            )
    return bytes(found)


# --- kinds of input -----------------------------------------------------------------


class Kind(NamedTuple):
    """Texts to begin with, and what reads a mutant in an empty folder."""

    seeds: tuple[str | bytes, ...]
    read: Callable[[str | bytes, pathlib.Path], object]


@functools.cache
def scenes() -> tuple[str, ...]:
    """The templates, and the same scenes as simbrake writes them."""
    texts = tuple(
        file.read_text("utf-8")
        for file in sorted((ROOT / "templates" / "scenes").glob("*.toml"))
    )
    written = (sb.files.scene_text(sb.files.scene_from_text(text)) for text in texts)
    return (*texts, *written, lever_from("lever.csv"))


def lever_from(name: str) -> str:
    """The standard scene with a lever from a CSV file."""
    lines = [
        line for line in standard().split("\n") if not line.startswith("slack_tension")
    ]
    return "\n".join(lines).replace(
        "[duty]", f'[duty]\nslack_tension = {{ file = "{name}", column = "tension" }}'
    )


def read_scene(text: str | bytes, folder: pathlib.Path) -> object:
    (folder / "lever.csv").write_text("t,tension [kN]\n0,2\n0.35,24\n", "utf-8")
    file = folder / "scene.toml"
    file.write_bytes(
        text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    )
    scene = sb.read_scene(file)
    sb.check_scene(scene)
    return sb.files.scene_text(scene)


@functools.cache
def standard() -> str:
    return (ROOT / "templates" / "scenes" / "standard.toml").read_text("utf-8")


def read_set(text: str | bytes, _: pathlib.Path) -> object:
    assert isinstance(text, str)
    path, _, value = text.partition("=")
    return sb.files.scene_from_text(standard(), values={path.strip(): value.strip()})


SETTINGS = (
    *(
        "duty.load.mass=80 t",
        "brake.linings.count=18",
        "initial.omega=24",
        "brake.linings.angle=[0.2, 0.3]",
    ),
    *(
        "brake.band.stiffness=none",
        "brake.linings.angle[3]=0.2",
        "duty.slack_tension.values=[1, 2] kN",
        "end_time=5 s",
    ),
)
_COMMAS = "".join(f"0,{i:02d};{24 - i};{i // 2},{i % 2}\n" for i in range(9))
RECORDINGS = (
    "t [ms],omega [rpm],omega_sigma [rpm]\n"
    + "".join(f"{10 * i},{200 - i},1.5\n" for i in range(30)),
    f"# a logger\nt;omega;tight_tension [kN]\n{_COMMAS}",
    "event,time [ms],sigma\nstopping_time,1250,5\nslip_onset_time,12,1\n",
    't\tlining_temperature[3] [degC]\n0\t20\n"1"\t"21"\n',
)


def read_recording(text: str | bytes, folder: pathlib.Path) -> object:
    file = folder / "recording.csv"
    file.write_bytes(
        text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    )
    return sb.read_measured(file)


@functools.cache
def results() -> tuple[bytes, ...]:
    """A result without its series, which are numbers like those of the rest."""
    with tempfile.TemporaryDirectory() as folder:
        data = sb.dataset(
            sb.simulate(sb.files.scene_from_text(standard())), times=[0.0, 1.0]
        )
        return (sb.save(data, pathlib.Path(folder, "result.nc")).read_bytes(),)


def read_result(content: str | bytes, folder: pathlib.Path) -> object:
    assert isinstance(content, bytes)
    file = folder / "result.nc"
    file.write_bytes(content)
    return sb.read_result(file)


def ensemble(folder: pathlib.Path) -> object:
    """Three runs kept in a folder, or those that it has."""
    scene = sb.files.scene_from_text(standard())
    values = {"initial.omega": [18.0, 20.0, 22.0]}
    return sb.ensemble(
        scene, values, ["stopping_time"], directory=folder, progress=False
    )


@functools.cache
def manifest() -> str:
    with tempfile.TemporaryDirectory() as folder:
        ensemble(pathlib.Path(folder))
        return pathlib.Path(folder, "manifest.json").read_text("utf-8")


def read_manifest(text: str | bytes, folder: pathlib.Path) -> object:
    assert isinstance(text, str)
    (folder / "manifest.json").write_bytes(text.encode("utf-8", "surrogatepass"))
    return ensemble(folder)


def kinds() -> dict[str, Kind]:
    return {
        "scene": Kind(scenes(), read_scene),
        "set": Kind(SETTINGS, read_set),
        "recording": Kind(RECORDINGS, read_recording),
        "result": Kind(results(), read_result),
        "manifest": Kind((manifest(),), read_manifest),
    }


# --- trying them --------------------------------------------------------------------


class Found(NamedTuple):
    """A mutant that is not as promised: its kind and content, and what happened."""

    kind: str
    content: str | bytes
    what: str


def tried(kind: str, content: str | bytes) -> Found | None:
    """Reads one mutant. Nothing but what it reads may lie in its folder afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        try:
            with contextlib.chdir(folder):
                kinds_read()[kind](content, pathlib.Path(folder))
        except sb.InputError as error:
            if not str(error).strip() or "Traceback" in str(error):
                return Found(kind, content, "an error without words")
        except Exception as error:
            return Found(kind, content, f"{type(error).__name__}: {error}"[:200])
        if (spent := time.perf_counter() - start) > LONGEST:
            return Found(kind, content, f"took {spent:.1f} s")
        known = {
            "lever.csv",
            "scene.toml",
            "recording.csv",
            "result.nc",
            "manifest.json",
        }
        more = {
            file.name
            for file in pathlib.Path(folder).iterdir()
            if not file.name.startswith("chunk-")
        } - known
        return Found(kind, content, f"left {sorted(more)}") if more else None


@functools.cache
def kinds_read() -> dict[str, Callable[[str | bytes, pathlib.Path], object]]:
    return {name: kind.read for name, kind in kinds().items()}


#: how often each kind is drawn
WEIGHTS = {"scene": 10, "set": 4, "recording": 3, "result": 2, "manifest": 1}


def mutants(count: int, seed: int) -> Iterator[tuple[str, str | bytes]]:
    draw = random.Random(seed)
    all_kinds = kinds()
    for _ in range(count):
        (kind,) = draw.choices([*WEIGHTS], [*WEIGHTS.values()])
        whole = draw.choice(all_kinds[kind].seeds)
        if isinstance(whole, str) and draw.random() < 0.9:
            yield kind, mutated(whole, draw)
        elif isinstance(whole, str) and kind not in ("scene", "recording"):
            yield kind, mutated(mutated(whole, draw), draw)
        else:
            yield (
                kind,
                spoiled(whole if isinstance(whole, bytes) else whole.encode(), draw),
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    python_warnings.simplefilter("error")
    found = []
    longest = 0.0
    for kind, content in mutants(asked.count, asked.seed):
        start = time.perf_counter()
        one = tried(kind, content)
        longest = max(longest, time.perf_counter() - start)
        found += [] if one is None else [one]
    for one in found:
        print(f'    ("{one.kind}", {one.content[-300:]!r}),  # {one.what}')
    print(
        f"{asked.count} mutants, {len(found)} not as promised, the longest took {longest:.2f} s"
    )
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
