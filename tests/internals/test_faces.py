"""Heat flows through faces that several links share, against dense solutions."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import root

import simbrake as sb
from simbrake.physics._thermal import Conditions, assemble_thermal
from simbrake.thermal import (
    Conductance,
    Convection,
    Lump,
    Radiation,
    Reservoir,
    Source,
    ThermalContact,
)

N = 3
SIGMA = 5.670374419e-8


STEEL = sb.Material(48.0, 7800.0, 500.0)
LINING = sb.Material(0.7, 2000.0, 1000.0)


#: layers, thickness (m), area (m²), conductivity, copies
WALLS = {
    "rim": (5, 0.025, 1.5, 48.0, 1),
    "lining": (4, 0.03, 0.3, 0.7, N),
    "plate": (3, 0.01, 1.2, 48.0, 1),
    "shield": (2, 0.004, 0.9, 48.0, 1),
    "block": (2, 0.01, 0.2, 0.7, N),
}


#: links by kind: ends, conductance (W/K), `ε A` (m²), or none of a perfect contact
LINEAR = [
    ("rim.front", "air", 45.0),
    ("rim.front", "lining.front", 150.0),
    ("lining.front", "pads", 8.0),
    ("block.front", "lining.front", 9.0),
    ("plate.back", "block.front", 5.0),
    ("block.front", "rim.front", 6.0),
    ("lining.front", "plate.back", 7.0),
    ("block.back", "air", 2.0),
    ("lining.back", "band", None),
    ("lining.back", "air", 3.0),
    ("rim.back", "plate.front", None),
    ("plate.front", "shield.front", None),
    ("rim.back", "shield.front", 70.0),
    ("rim.back", "air", 20.0),
    ("plate.front", "band", 90.0),
    ("plate.back", "lining.back", 40.0),
    ("plate.back", "air", 15.0),
    ("shield.back", "air", 11.0),
    ("band", "air", 4.0),
]


RADIANT = [
    ("rim.front", "air", 1.2),
    ("plate.back", "shield.back", 0.7),
    ("lining.back", "air", 0.25),
]


SOURCES = [("rim.front", 900.0), ("plate.front", 400.0)]


def network(radiant=()):
    """The links as parts, each of the kind that has such a conductance."""

    def wall(name, material):
        layers, thickness, area, _, copies = WALLS[name]
        return sb.thermal.Wall(name, material, thickness, area, layers, copies=copies)

    links = []
    for i, (a, b, g) in enumerate(LINEAR):
        kinds = (
            lambda a, b, g: Conductance(a, b, g),
            lambda a, b, g: ThermalContact(a, b, 2.0, 2.0 / g),
            lambda a, b, g: Convection(a, 0.5, 2.0 * g, b),
        )
        links.append(ThermalContact(a, b, 1.0) if g is None else kinds[i % 3](a, b, g))
    links += [Radiation(a, area / 0.8, 0.8, b) for a, b, area in radiant]
    bodies = (
        wall("rim", STEEL),
        Lump("pads", [50.0, 60.0, 70.0], count=N),
        wall("lining", LINING),
        Lump("band", 400.0),
        wall("plate", STEEL),
        wall("shield", STEEL),
        wall("block", LINING),
        Reservoir("air", 300.0),
    )
    return sb.Heat(
        bodies,
        tuple(links),
        sources=tuple(Source(place, power) for place, power in SOURCES),
    )


def dense(T, radiant=()):
    """Flows (W) into the bodies' outer nodes: all face temperatures and flows of
    perfect contacts at once."""
    places = {"air": [300.0], "band": T["band"], "pads": T["pads"]}
    faces = {}
    half = {}
    for name, (layers, thickness, area, conductivity, copies) in WALLS.items():
        rows = np.reshape(T[name], (copies, layers))
        for face, i in (("front", 0), ("back", -1)):
            faces[f"{name}.{face}"] = rows[:, i]
            half[f"{name}.{face}"] = 0.5 * thickness / layers / (conductivity * area)
    perfect = [(a, b) for a, b, g in LINEAR if g is None]
    number = [max(len(faces.get(p, places.get(p))) for p in pair) for pair in perfect]

    def unpack(x):
        found = {}
        at = 0
        for name, inside in faces.items():
            found[name] = x[at : at + len(inside)]
            at += len(inside)
        flows = []
        for n in number:
            flows.append(1e3 * x[at : at + n])
            at += n
        return found, flows

    def flows(x):
        S, through = unpack(x)
        at = {**places, **S}
        each = [
            (a, b, g * (np.asarray(at[b]) - at[a]))
            for a, b, g in LINEAR
            if g is not None
        ]
        each += [
            (a, b, area * SIGMA * (np.asarray(at[b]) ** 4 - at[a] ** 4))
            for a, b, area in radiant
        ]
        each += [(a, b, q) for (a, b), q in zip(perfect, through, strict=True)]
        into = {
            name: np.zeros(len(inside)) for name, inside in {**places, **faces}.items()
        }
        for a, b, q in each:
            for place, sign in ((a, 1), (b, -1)):
                into[place] = into[place] + sign * (
                    q if len(into[place]) > 1 else np.sum(q)
                )
        for place, power in SOURCES:
            into[place] = into[place] + power
        return S, into

    def unbalance(x):
        S, into = flows(x)
        rest = [
            (into[name] - (S[name] - inside) / half[name]) / 1e3
            for name, inside in faces.items()
        ]
        at = {**places, **S}
        return np.concatenate(
            [
                *rest,
                *(
                    np.zeros(n) + at[b] - at[a]
                    for (a, b), n in zip(perfect, number, strict=True)
                ),
            ]
        )

    x = np.concatenate([*faces.values(), np.zeros(sum(number))])
    for _ in range(3):  # a fresh Jacobian at the solution takes it to rounding
        x = root(unbalance, x, method="hybr", options={"xtol": 1e-15}).x
    assert np.max(np.abs(unbalance(x))) < 1e-9
    S, into = flows(x)
    for (
        name,
        inside,
    ) in faces.items():  # what reaches the first node: by the balance of its face
        assert np.allclose(
            into[name], (S[name] - inside) / half[name], rtol=1e-7, atol=1e-5
        )
    return into


def ours(heat, T):
    """The same by simbrake: flows into faces, lumps and the air, and their sum at all
    nodes."""
    thermal, _ = assemble_thermal(heat)
    nodes = np.concatenate(
        [
            np.ravel(T[body.name])
            for body in heat.bodies
            if not isinstance(body, Reservoir)
        ]
    )
    flows = thermal.flows(jnp.asarray(nodes), jnp.zeros(0), 0.0, Conditions(), ())
    spans = thermal.spans.stores
    inside = jnp.concatenate(
        [jnp.zeros(1), thermal.between * (nodes[:-1] - nodes[1:]), jnp.zeros(1)]
    )
    outer = flows.into - (inside[:-1] - inside[1:])  # without conduction inside walls
    found = dict(flows.faces) | {
        "air": flows.lost[None],
        "band": outer[spans["band"]],
        "pads": outer[spans["pads"]],
    }
    return found, float(jnp.sum(flows.into) + flows.lost - flows.supplied)


def temperatures(rng):
    T = {
        name: rng.uniform(320, 520, layers * copies)
        for name, (layers, *_, copies) in WALLS.items()
    }
    return T | {"pads": rng.uniform(320, 420, N), "band": rng.uniform(320, 420, 1)}


@pytest.mark.parametrize("seed", [1, 2])
def test_linked_faces_match_dense_solution(seed):
    """Rows of linings, single faces, faces in perfect contact with each other and with
    a lump, sources."""
    T = temperatures(np.random.default_rng(seed))
    exact = dense(T)
    (found, left) = ours(network(), T)
    assert abs(left) < 1e-8  # W, of 10 kW: what leaves one end enters the other
    for place, flow in exact.items():
        np.testing.assert_allclose(
            found[place], flow, rtol=1e-9, atol=1e-9 * 1e3, err_msg=place
        )


def test_radiation_matches_a_dense_solution():
    """Two Newton steps from the temperatures of the outermost layers."""
    T = temperatures(np.random.default_rng(3))
    exact = dense(T, RADIANT)
    (found, left) = ours(network(RADIANT), T)
    assert abs(left) < 1e-8
    for place, flow in exact.items():
        np.testing.assert_allclose(
            found[place], flow, rtol=1e-9, atol=1e-6, err_msg=place
        )


@pytest.mark.parametrize(
    ("conductivity", "half", "error"), [(48.0, 1e-4, 1e-9), (0.7, 1.4e-3, 1e-6)]
)
@pytest.mark.parametrize("hot", [400.0, 700.0])
def test_radiation_error_on_rims_and_linings(conductivity, half, error, hot):
    """`(S − T)/R = ε σ (T_a⁴ − S⁴) + h (T_a − S)` of one face: a rim's, and one of a
    lining of uniform layers."""
    wall = sb.thermal.Wall(
        "w", sb.Material(conductivity, 2000.0, 1000.0), 4 * half, 1.0, 2
    )
    links = (Radiation("w.front", 1.0, 0.8), Convection("w.front", 1.0, 25.0))
    thermal, _ = assemble_thermal(sb.Heat((wall, Reservoir("air", 300.0)), links))
    found = thermal.flows(jnp.full(2, hot), jnp.zeros(0), 0.0, Conditions(), ()).faces[
        "w.front"
    ][0]
    S = hot
    for _ in range(20):
        out = 0.8 * SIGMA * (S**4 - 300.0**4) + 25.0 * (S - 300.0)
        S -= ((S - hot) * conductivity / half + out) / (
            conductivity / half + 3.2 * SIGMA * S**3 + 25.0
        )
    assert float(found) == pytest.approx(-out, rel=error)


def test_derivative_through_eliminated_faces():
    T = temperatures(np.random.default_rng(4))
    heat = network()

    def lost(g):
        links = (dataclasses.replace(heat.links[0], value=g), *heat.links[1:])
        thermal, _ = assemble_thermal(dataclasses.replace(heat, links=links))
        nodes = np.concatenate(
            [
                np.ravel(T[body.name])
                for body in heat.bodies
                if not isinstance(body, Reservoir)
            ]
        )
        return thermal.flows(
            jnp.asarray(nodes), jnp.zeros(0), 0.0, Conditions(), ()
        ).lost

    h = 1e-2
    up, down, up2, down2 = (float(lost(45.0 + s * h)) for s in (1, -1, 2, -2))
    assert float(jax.grad(lost)(45.0)) == pytest.approx(
        (8 * (up - down) - (up2 - down2)) / (12 * h), rel=1e-9
    )
