"""Mutated input: scene files, `--set`, recordings, result files, manifests; each is
read, or an input error in words.

`python tests/fuzz.py --count 20000 --seed 1` runs many of them,
`tests/files/test_bad_input.py` a few hundred. A mutant that ends in any other error, or
takes longer than 2 s, is printed: a line for that test.
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
import warnings

import simbrake as sb

TEMPLATES = pathlib.Path(sb.__file__).parent / "templates" / "scenes"
#: s that reading and checking one mutant may take
LONGEST = 2.0

#: what takes the place of a number, a word or a text, one a line
NASTY = [
    *r"""0
-1
1e308
-1e308
5e-324
nan
inf
1e400
0x10
1_000
1e-40
1e40
2.5
true
none
[]
{}
[[]]
[1, 2]
[nan]
1979-05-27
07:32:00
""
"0"
'x'
"1 N"
"1 kg"
"1 m^9^9^9"
"1 (m"
"90 degC"
"-300 degC"
"[1, 2] m"
"[1, 2"
"1 1 m"
"1 %"
"1e5 km/h"
"=1+1"
"\u0000"
"../../etc/passwd"
"/dev/zero"
"<script>alert(1)</script>"
"{{7*7}}"
"%s%n"
"__import__('os').system('touch hit')"
"ConstantFriction"
"Lining"
"HookLoad"
"steel"
"travel 3 m"
"repeat 99999999 times"
"hold 5 s"
""".splitlines(),
    "9" * 400,
    f'"{"a" * 5000}"',
    f'"{chr(128738) * 50}"',
]
#: what is put between two characters
BITS = [*"\x00\n\"'[]{}=.,;#\\\t\u202eé-", "\ud83d\udee2", "e9"]
_TOKEN = re.compile(r"[\w.+-]+|\"[^\"\n]*\"|'[^'\n]*'")


def mutated(text, draw):
    """The text with one to four changes."""
    for _ in range(draw.choice((1, 1, 1, 2, 4))):
        lines = text.split("\n")
        tokens = list(_TOKEN.finditer(text))
        i, j = (draw.randrange(len(lines)) for _ in range(2))
        at = draw.randrange(len(text) + 1)
        way = draw.randrange(9)
        if way < 4 and tokens:
            token = draw.choice(tokens)
            text = text[: token.start()] + draw.choice(NASTY) + text[token.end() :]
        elif way < 7:
            lines[i : i + way // 6] = [lines[j]] * draw.choice((0, 1, 200))
            text = "\n".join(lines)
        elif way == 7:
            text = text[:at]
        else:
            text = text[:at] + draw.choice(BITS) * draw.choice((1, 1, 3000)) + text[at:]
    return text


def spoiled(data, draw):
    """Bytes with a few of them changed, missing or moved."""
    found = bytearray(data)
    for _ in range(draw.choice((1, 1, 3, 30))):
        at = draw.randrange(len(found) + 1)
        new = draw.choice((draw.randbytes(1), b"", found[:400], b"\xff" * 4, bytes(4)))
        found[at : at + draw.choice((0, 1, 4, 400))] = new
    return bytes(found)


@functools.cache
def standard():
    return (TEMPLATES / "standard.toml").read_text("utf-8")


def lever_from(name):
    """The standard scene with a lever from a CSV file."""
    lines = standard().split("\n")
    text = "\n".join(line for line in lines if not line.startswith("slack_tension"))
    lever = f'slack_tension = {{ file = "{name}", column = "tension" }}'
    return text.replace("[duty]", f"[duty]\n{lever}")


def ensemble(folder):
    """Three runs kept in a folder, or those that it has."""
    scene = sb.files.scene_from_text(standard())
    values = {"initial.omega": [18.0, 20.0, 22.0]}
    where = {"directory": folder, "progress": False}
    return sb.ensemble(scene, values, ["stopping_time"], **where)


_COMMAS = "".join(f"0,{i:02d};{24 - i};{i // 2},{i % 2}\n" for i in range(9))


@functools.cache
def seeds():
    """Of each kind of input, texts or bytes to begin with."""
    scenes = [file.read_text("utf-8") for file in sorted(TEMPLATES.glob("*.toml"))]
    written = [sb.files.scene_text(sb.files.scene_from_text(text)) for text in scenes]
    rows = "".join(f"{10 * i},{200 - i},1.5\n" for i in range(30))
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        run = sb.simulate(sb.files.scene_from_text(standard()))
        data = sb.dataset(run, times=[0.0, 1.0])
        result = sb.save(data, folder / "result.nc").read_bytes()
        ensemble(folder / "runs")
        manifest = (folder / "runs" / "manifest.json").read_text("utf-8")
    return {
        "scene": [*scenes, *written, lever_from("lever.csv")],
        "set": [
            "brake.linings.count=18",
            "brake.linings.angle=[0.2, 0.3]",
            "brake.band.stiffness=none",
            "brake.linings.angle[3]=0.2",
            "duty.slack_tension.values=[1, 2] kN",
            "end_time=5 s",
        ],
        "recording": [
            f"t [ms],omega [rpm],omega_sigma [rpm]\n{rows}",
            f"# a logger\nt;omega;tight_tension [kN]\n{_COMMAS}",
            "event,time [ms],sigma\nstopping_time,1250,5\nslip_onset_time,12,1\n",
            't\tlining_temperature[3] [degC]\n0\t20\n"1"\t"21"\n',
        ],
        "result": [result],
        "manifest": [manifest],
    }


def read(kind, content, folder):
    """What reads such input, in an empty folder."""
    if kind == "set":
        path, _, value = str(content).partition("=")
        values = {path.strip(): value.strip()}
        return sb.files.scene_from_text(standard(), values=values)
    (folder / "lever.csv").write_text("t,tension [kN]\n0,2\n0.35,24\n", "utf-8")
    suffix = {"scene": "toml", "recording": "csv", "result": "nc", "manifest": "json"}
    file = folder / f"{kind}.{suffix[kind]}"
    if isinstance(content, str):
        content = content.encode("utf-8", "surrogatepass")
    file.write_bytes(content)
    if kind == "recording":
        return sb.read_measured(file)
    if kind == "result":
        return sb.read_result(file)
    if kind == "manifest":
        (folder / "lever.csv").unlink()
        return ensemble(folder)
    scene = sb.read_scene(file)
    sb.check_scene(scene)
    return sb.files.scene_text(scene)


def tried(kind, content):
    """What is not as promised with a mutant: an error, its time, or a file it left."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        start = time.perf_counter()
        try:
            with contextlib.chdir(folder):
                read(kind, content, folder)
        except sb.InputError as error:
            if not str(error).strip() or "Traceback" in str(error):
                return "an error without words"
        except Exception as error:
            return f"{type(error).__name__}: {error}"[:200]
        if (spent := time.perf_counter() - start) > LONGEST:
            return f"took {spent:.1f} s"
        names = {file.name.partition(".")[0] for file in folder.iterdir()}
        left = {text for text in names if not text.startswith("chunk-")}
        return f"left {left}" if left - {"lever", kind} else None


def mutants(count, seed):
    draw = random.Random(seed)
    kinds = seeds()
    for _ in range(count):
        (kind,) = draw.choices([*kinds], [10, 4, 3, 2, 1])
        whole = draw.choice(kinds[kind])
        if isinstance(whole, bytes):
            yield kind, spoiled(whole, draw)
        elif kind in ("scene", "recording") and draw.random() < 0.1:
            yield kind, spoiled(whole.encode(), draw)
        else:
            yield kind, mutated(whole, draw)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    warnings.simplefilter("error")
    count = 0
    for kind, content in mutants(asked.count, asked.seed):
        if what := tried(kind, content):
            count += 1
            print(f'("{kind}", {content[-300:]!r}),  # {what}')
    print(f"{asked.count} mutants, {count} not as promised")
    sys.exit(count > 0)


if __name__ == "__main__":
    main()
