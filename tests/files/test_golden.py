"""What a run says, whole: its summary, its explanation and the text of some reports, a
file for each kind of duty.

`pytest tests/files/test_golden.py -m "" --renew` writes the files anew; the difference
is then for review.
"""

import dataclasses
import functools
import re

import lxml.etree
import lxml.html
import pytest
import staged_scenes as staged
from disc_scenes import fading_scene
from goldens import assert_kept
from heat_scenes import lump
from matplotlib.figure import Figure
from result_scenes import heated_stop
from scenes import replaced, stop_scene
from shoe_scenes import shoe_scene

import simbrake as sb

T0 = 8e3
LOAD = 1.2e4


def rigid(load=LOAD, *, lever=T0, **parts):
    lever = sb.Constant(lever) if isinstance(lever, float) else lever
    return stop_scene(n=6, beta=45.0, C=None, lever=lever, load=load, **parts)


def stop():
    """An elastic band, a hook on a rope in layers, wear with a permissible depth,
    allowable stresses."""
    hook = sb.HookLoad(2e4, 0.4, 8, rope=sb.loads.RopeLayers(0.04, 4.0, 8.5))
    scene = stop_scene(n=8, beta=30.0, lever=sb.ramp(2e3, 24e3, 0.0, 0.35), load=hook)
    changes = {
        "brake.band.strength": sb.brakes.Strength(band_area=2e-3, band_stress=150e6),
        "brake.linings.area": 0.02,
        "brake.linings.permissible_pressure": 1e6,
        "wear": sb.Wear(1e-14, permissible=8e-3),
    }
    return replaced(scene, changes)


def stops():
    """Two stops, the load on the open brake between them; a permissible temperature
    exceeded."""
    lever = sb.PiecewiseLinear(
        [0.0, 2.0, 2.0, 2.5, 2.5, 9.0], [T0, T0, 0.0, 0.0, T0, T0]
    )
    heat = sb.lumped_heat(
        rim=2e4, linings=1e4, partition=0.6, rim_cooling=5.0, permissible=310.0
    )
    return dataclasses.replace(rigid(lever=lever, end=4.0), heat=heat)


def heated():
    """Resistances on the shaft, shares of the power that leave as electricity, heat in
    layers."""
    shaft = (
        sb.loads.HydrodynamicBrake(60.0, place="rim"),
        sb.loads.BearingFriction("30 N*m"),
    )
    shares = sb.PowerShares(electrical=0.02, mechanical=0.05)
    scene = rigid(3e3, w0=20.0, end=3.0)
    return dataclasses.replace(
        scene, heat=lump(2e5, linings=4e4, share=0.8), shaft=shaft, power_shares=shares
    )


def tripping():
    """Two cycles of phases in which a string is lowered by stands."""
    phases = (
        sb.loads.Phase(sb.Constant(0.0), "travel 3 m", "lower"),
        sb.loads.Phase(sb.Constant(3e4), "rest", "brake"),
    )
    load = sb.loads.StringLoad(8e3, 30e3, 0.4, 8, stand=900.0)
    return rigid(w0=0.0, lever=sb.loads.Phases(phases, count=2), load=load, end=60.0)


SCENES = {
    "stop": stop,
    "stops": stops,
    "heated": heated,
    "layers": heated_stop,
    "held": lambda: rigid(w0=0.0),
    "lowering": lambda: rigid(lever=sb.SpeedHold(T0), end=3.0),
    "steady": lambda: dataclasses.replace(
        rigid(lever=0.0, w0=20.0), shaft=(sb.loads.ViscousDrag(600.0),)
    ),
    "tripping": tripping,
    "runaway": lambda: rigid(6e4, end=0.5),
    "turning": lambda: rigid(end=0.2),
    "open": lambda: rigid(lever=0.0, end=0.5),
    "disc": lambda: fading_scene(force=sb.PiecewiseLinear([0.0, 9.0], [2e4, 2e4])),
    "shoe": lambda: shoe_scene(load=100.0),
    "staged": lambda: staged.stop(heat=None),
}
#: templates of machines that are no drawworks, and words that are not theirs
OTHERS = ("lift", "windlass", "winch", "winder", "rotor")
SCENES |= {name: functools.partial(sb.read_scene, name) for name in OTHERS}
FOREIGN = re.compile("drawworks|hook|drill|tackle", re.IGNORECASE)


HIDDEN = ("script", "style", "svg", "figure", "noscript")
ROWS = {"tr", "p", "h1", "h2", "h3", "li", "dt", "pre", "summary", "div"}


def text_of(page):
    """The words of a page, a line for each row, heading and paragraph."""
    tree = lxml.html.document_fromstring(page)
    lxml.etree.strip_elements(tree, *HIDDEN, with_tail=False)
    for element in tree.iter(lxml.etree.Element):
        gap = "\n" if element.tag in ROWS else " "
        element.text = gap + (element.text or "")
    lines = (" ".join(line.split()) for line in tree.text_content().split("\n"))
    return "\n".join(line for line in lines if line)


#: what differs from machine to machine: residuals of rounding, and how many steps a run
#: took
ROUNDING = (
    (r"((?:residual|by) )[\d.·⁻⁰-⁹¹²³e+-]+", r"\1…"),
    (r"\d+ (steps|accepted|rejected|truncated)", r"… \1"),
)


#: runs whose page is kept too, up to the table of parameters: each has a part that the
#: others lack
PAGES = ("stop", "tripping", "heated", "staged")


def said(name):
    """Summary and explanation of a run, and the page of some."""
    result = sb.simulate(SCENES[name](), throw=False)
    first = name == "stop"
    limits = {"max_tension": "120 kN", "stopping_time": "0.56 s"} if first else {}
    parts = [
        str(result),
        sb.results.explain(result, limits=limits, influence=name in ("stop", "held")),
    ]
    if first:
        with sb.results.display_units("rig"):
            parts.append(str(result))
    if name in PAGES:
        slopes = ["stopping_time"] if first else ()
        page = sb.report(result, check=False, limits=limits, sensitivity=slopes)
        parts.append(text_of(page).partition("\nEquipment\nEvery")[0])
    text = "\n\n".join(map(str, parts)) + "\n"
    for pattern, masked in ROUNDING:
        text = re.sub(pattern, masked, text)
    return text


@pytest.mark.parametrize("name", SCENES)
def test_words_of_a_run(name, request, monkeypatch):
    # (figures take longer than all the rest, and have no words here)
    monkeypatch.setattr(
        Figure, "savefig", lambda figure, file, **options: file.write(b"")
    )
    text = said(name)
    assert_kept(request, name, text)
    assert name not in OTHERS or not FOREIGN.findall(text)
