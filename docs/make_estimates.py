"""Writes `measured/estimates.json` for `estimates.md`:
`python docs/make_estimates.py [order] [parts] [staged]`.

Without names all of them; `parts` simulates thirty stands, some two minutes, the others
take half a minute each.
"""

import dataclasses
import json
import math
import pathlib
import runpy
import sys
from typing import Any, TypedDict

import numpy as np

HERE = pathlib.Path(__file__).parent
NUMBERS = HERE / "measured" / "estimates.json"
ZERO = 273.15
LAYERS = (10, 20, 40, 80)


def scenario(name: str) -> dict[str, Any]:
    """Names of a shipped scenario."""
    return runpy.run_path(str(HERE.parent / "scenarios" / f"{name}.py"))


class Table(TypedDict):
    """Headings and cells, as text."""

    head: list[str]
    rows: list[list[str]]


# --- Schmidt's scheme ---------------------------------------------------------------


def schmidt_errors(layers: int) -> tuple[float, float, float]:
    """Maximum errors over the depth at `Fo = 0.5`, over the rise of the face: scheme
    and network against the slab

    (adiabatic back), and their distance with a back that is cooled.
    """
    import simbrake as sb

    steel = sb.material("steel_20L")
    thickness = 0.025
    q = 3e5
    end = 0.5 * thickness**2 / float(steel.diffusivity)
    face = float(sb.formulas.slab_rise(q, end, thickness, steel))
    wall = sb.thermal.Wall("rim", steel, thickness, 1.0, layers, temperature=300.0)
    air = sb.thermal.Reservoir("air", 300.0)
    source = sb.thermal.Source("rim.front", q)

    def network(coefficient: float) -> np.ndarray:
        heat = sb.Heat(
            (wall, air),
            (sb.thermal.Convection("rim.back", 1.0, coefficient),),
            None,
            (source,),
        )
        return (
            np.asarray(sb.simulate_heat(heat, np.array([0.0, end])).temperature[-1])
            - 300.0
        )

    course = sb.formulas.schmidt(steel, thickness, layers, end, q)
    truth = sb.formulas.slab_rise(q, end, thickness, steel, course.depth[1:-1])
    cooled = sb.formulas.schmidt(
        steel, thickness, layers, end, q, back_coefficient=40.0
    ).temperature[-1, 1:-1]
    found = (
        course.temperature[-1, 1:-1] - truth,
        network(0.0) - truth,
        cooled - network(40.0),
    )
    return tuple(float(np.max(np.abs(x))) / face for x in found)  # pyright: ignore


def order() -> list[Table]:
    """Errors over the number of layers, and the order between two rows."""
    rows = []
    last = None
    for layers in LAYERS:
        errors = schmidt_errors(layers)
        cells = [f"{layers}"]
        for i, error in enumerate(errors):
            cells += [
                f"{error:.2e}",
                "" if last is None else f"{math.log2(last[i] / error):.2f}",
            ]
        rows.append(cells)
        last = errors
    head = [
        "layers",
        "scheme − slab",
        "order",
        "network − slab",
        "order",
        "scheme − network",
        "order",
    ]
    return [{"head": head, "rows": rows}]


# --- estimates beside simulations ---------------------------------------------------

KELVIN = "K"
#: words, row of the estimates, unit shown, factor (or KELVIN: shown in °C), and why
#: they differ
PARTS: list[tuple[str, str, str, Any, str]] = [
    ("stopping time", "stopping time", "s", 1.0, "see the steps below"),
    ("friction work", "friction work", "kJ", 1e-3, "see the steps below"),
    (
        "bulk, mean",
        "bulk temperature, mean",
        "°C",
        KELVIN,
        "the power does not fall linearly; the depth grows meanwhile",
    ),
    (
        "bulk, end",
        "bulk temperature, end",
        "°C",
        KELVIN,
        "energy alone: they must agree",
    ),
    (
        "surface at the end, constant flux",
        "surface temperature, constant flux",
        "°C",
        KELVIN,
        "the power has fallen by then",
    ),
    (
        "surface, falling flux",
        "surface temperature, falling flux",
        "°C",
        KELVIN,
        "the power falls later than linearly",
    ),
    (
        "surface, Schmidt",
        "surface temperature, Schmidt",
        "°C",
        KELVIN,
        "the run's own power; no exchange with linings and air",
    ),
    (
        "maximum, S-26",
        "maximum temperature, S-26",
        "°C",
        KELVIN,
        "a third of the flash of assumed spots; the run has none",
    ),
    (
        "maximum, S-27",
        "maximum temperature, S-27",
        "°C",
        KELVIN,
        "the same; counts the bulk twice, the surface by a third",
    ),
    ("maximum, plain sum", "maximum temperature, sum", "°C", KELVIN, "the whole flash"),
    (
        "heat partition coefficient, rim, effusivities",
        "heat partition coefficient, rim, effusivities",
        "",
        1.0,
        "the scene's own law",
    ),
    (
        "heat partition coefficient, rim, transmission",
        "heat partition coefficient, rim, transmission",
        "",
        1.0,
        "a steady state of hours; a brake application lasts a second",
    ),
    (
        "drop over the rim",
        "drop over the rim, stationary flux",
        "K",
        1.0,
        "a steady flux, which a brake application never reaches",
    ),
    (
        "thermal stress",
        "thermal stress, surface",
        "MPa",
        1e-6,
        "largest about half-way, when the power is high",
    ),
]
STAGED: list[tuple[str, str, str, Any, str]] = [
    (
        "slack tension of internal slip",
        "slack tension of internal slip",
        "kN",
        1e-3,
        "the same law: they must agree",
    ),
    (
        "stage 1",
        "stage 1",
        "s",
        1.0,
        "the lever takes that long to this tension; the formula has it at once",
    ),
    ("stage 2", "stage 2", "s", 1.0, "the lever force still rises meanwhile"),
    ("stage 3", "stage 3", "s", 1.0, "at its maximum tension for most of it"),
    (
        "work of the external pair",
        "friction work, external pair",
        "kJ",
        1e-3,
        "stage 1 is missing in the formula",
    ),
    (
        "work of the internal pair",
        "friction work, internal pair",
        "kJ",
        1e-3,
        "what stages 1 and 2 leave, and the load",
    ),
    (
        "share of the external pair",
        "share of the external pair",
        "",
        1.0,
        "as the works",
    ),
    (
        "band, bulk at the end",
        "bulk temperature, end, external pair",
        "°C",
        KELVIN,
        "the hot linings warm it too",
    ),
    (
        "rim, bulk at the end",
        "bulk temperature, end, internal pair",
        "°C",
        KELVIN,
        "energy alone: they must agree",
    ),
    (
        "rim, surface, falling flux",
        "surface temperature, falling flux, internal pair",
        "°C",
        KELVIN,
        "the power rises first",
    ),
    (
        "rim, surface, Schmidt",
        "surface temperature, Schmidt, internal pair",
        "°C",
        KELVIN,
        "layers of the run grow from 1.5 mm; with forty equal ones they agree to 0.1 K",
    ),
    (
        "thermal stress of the rim",
        "thermal stress, surface, internal pair",
        "MPa",
        1e-6,
        "largest early, when the power is high",
    ),
]


def shown(value: float | None, factor: Any) -> str:
    if value is None:
        return "–"
    return f"{value - ZERO:.1f}" if factor == KELVIN else f"{value * factor:.4g}"


def compared(
    rows: list[tuple[str, str, str, Any, str]], tables: list[Any]
) -> list[list[str]]:
    """Estimate and simulated value of every table, row by row, with the reason."""
    found = []
    for words, name, unit, factor, why in rows:
        cells = [f"{words}, {unit}" if unit else words]
        for one in tables:
            row = next((row for row in one if row.name == name), None)
            cells += (
                ["–", "–"]
                if row is None
                else [shown(row.value, factor), shown(row.simulated, factor)]
            )
        found.append([*cells, why])
    return found


def stop_of_the_page() -> Any:
    """The stop of U2-5-5 with the rim of the thirty stands."""
    stop = scenario("u2_5_5_stop")["scene"]()
    return dataclasses.replace(stop, heat=scenario("tripping_30_stands")["heat"]())


def steps(scene: Any, table_of_stop: Any) -> Table:
    """From the classical stop to the run, whose friction is constant: what each
    assumption costs."""
    import simbrake as sb

    rigid = dataclasses.replace(
        scene.brake, band=dataclasses.replace(scene.brake.band, stiffness=None)
    )
    bare = dataclasses.replace(scene, heat=None)
    rows = []
    time, work = (table_of_stop[name] for name in ("stopping time", "friction work"))
    rows.append(
        [
            "classical: the lever's maximum tension at once",
            f"{time.value:.4f}",
            f"{work.value / 1e3:.1f}",
        ]
    )
    for words, one in (
        ("the lever takes its time", dataclasses.replace(bare, brake=rigid)),
        ("and the band stretches: the run", bare),
    ):
        run = sb.simulate(one)
        rows.append(
            [
                words,
                f"{run.metrics['stopping_time']:.4f}",
                f"{float(run.energy['friction_heat']) / 1e3:.1f}",
            ]
        )
    return {
        "head": ["step by step", "stopping time, s", "friction work, kJ"],
        "rows": rows,
    }


def parts() -> list[Table | str]:
    """The stop and the thirty stands: estimate, simulation, reason; and the steps
    between them."""
    import simbrake as sb

    scene = stop_of_the_page()
    stop = sb.estimates(sb.simulate(scene))
    stands = sb.estimates(sb.simulate(scenario("tripping_30_stands")["scene"]()))
    head = [
        "estimate",
        "stop: formula",
        "simulated",
        "30 stands: formula",
        "simulated",
        "why they differ",
    ]
    words = []
    for name, one in (
        ("the stop", stop),
        ("the last brake application of thirty stands", stands),
    ):
        falling, own = (
            one[f"surface temperature, {x}"] for x in ("falling flux", "Schmidt")
        )
        apart = own.value - falling.value
        left = own.simulated - own.value
        words.append(
            f"Surface of {name}: simulated less falling flux "
            f"{own.simulated - falling.value:.1f} K. {apart:.1f} K of "
            "it are the course of the power, as Schmidt's scheme with the run's own heat shows; "
            f"{left:.1f} K are left for exchange with linings and air, layers, and "
            "properties that change with "
            "temperature."
        )
    return [
        {"head": head, "rows": compared(PARTS, [stop, stands])},
        steps(scene, stop),
        *words,
    ]


def staged() -> list[Table]:
    """The staged brake of `staged_vs_standard.py`."""
    import simbrake as sb

    found = sb.estimates(sb.simulate(scenario("staged_vs_standard")["scene"]()))
    return [
        {
            "head": ["estimate", "formula", "simulated", "why they differ"],
            "rows": compared(STAGED, [found]),
        }
    ]


BLOCKS = {"order": order, "parts": parts, "staged": staged}


def main(names: list[str]) -> None:
    found = json.loads(NUMBERS.read_text("utf-8"))
    for name in names or BLOCKS:
        found[name] = BLOCKS[name]()
    NUMBERS.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
