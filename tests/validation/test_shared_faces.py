"""Temperatures of a network whose faces several links share, in perfect contact with
each other and with a lump, against the same network as one matrix."""

import itertools

import numpy as np
import pytest
from helpers import all_near
from scipy.linalg import expm

import simbrake as sb
from simbrake.thermal import Conductance, Convection, Lump, ThermalContact, Wall

#: copies of linings
N = 3
#: layers, thickness (m), area (m²), copies, material, temperature at the start
STEEL = sb.Material(48.0, 7800.0, 500.0)
STUFF = sb.Material(0.7, 2000.0, 1000.0)
WALLS = {
    "rim": (5, 0.025, 1.5, 1, STEEL, 480.0),
    "lining": (4, 0.03, 0.3, N, STUFF, 420.0),
    "plate": (3, 0.01, 1.2, 1, STEEL, 390.0),
    "shield": (2, 0.004, 0.9, 1, STEEL, 350.0),
    "block": (2, 0.01, 0.2, N, STUFF, 330.0),
}
LUMPS = {"pads": (60.0, N, 400.0), "band": (400.0, 1, 320.0)}
#: conductances (W/K), or perfect contacts
LINKS = [
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
    ("shield.back", "air", 11.0),
    ("band", "air", 4.0),
]
SOURCES = {"rim.front": 900.0, "plate.front": 400.0}
AIR = 300.0


def network():
    """The links as parts, each of another kind with the same conductance."""
    kinds = itertools.cycle(
        [
            Conductance,
            lambda a, b, g: ThermalContact(a, b, 2.0, 2.0 / g),
            lambda a, b, g: Convection(a, 0.5, 2.0 * g, b),
        ]
    )
    links = [
        ThermalContact(a, b, 1.0) if g is None else kind(a, b, g)
        for (a, b, g), kind in zip(LINKS, kinds, strict=False)
    ]
    walls = [
        Wall(name, material, thickness, area, layers, temperature=T, copies=copies)
        for name, (layers, thickness, area, copies, material, T) in WALLS.items()
    ]
    lumps = [Lump(name, C, T, count=n) for name, (C, n, T) in LUMPS.items()]
    sources = tuple(sb.thermal.Source(place, power) for place, power in SOURCES.items())
    bodies = (*walls, *lumps, sb.thermal.Reservoir("air", AIR))
    return sb.Heat(bodies, tuple(links), sources=sources)


def by_matrix(t):
    """Temperatures of the nodes at a time: nodes of perfect contacts are one, those
    without capacity are eliminated."""
    new = itertools.count()
    places = {"air": [next(new)]}
    capacity = {0: np.inf}
    start = {0: AIR}
    links = []
    for name, (layers, thickness, area, copies, material, T) in WALLS.items():
        step = thickness / layers
        g = float(material.conductivity) * area / step
        C = float(material.density * material.specific_heat) * area * step
        for _ in range(copies):
            row = [next(new) for _ in range(layers)]
            capacity |= dict.fromkeys(row, C)
            start |= dict.fromkeys(row, T)
            links += [(a, b, g) for a, b in itertools.pairwise(row)]
            for face, node in (("front", row[0]), ("back", row[-1])):
                places.setdefault(f"{name}.{face}", []).append(next(new))
                links.append((places[f"{name}.{face}"][-1], node, 2 * g))
    for name, (C, count, T) in LUMPS.items():
        places[name] = [next(new) for _ in range(count)]
        capacity |= dict.fromkeys(places[name], C)
        start |= dict.fromkeys(places[name], T)
    one = np.arange(next(new))
    for a, b, g in LINKS:
        for x, y in np.broadcast(places[a], places[b]):
            if g is None:
                one[one == one[x]] = one[y]
            else:
                links.append((x, y, g))
    L = np.zeros((one.size, one.size))
    for a, b, g in links:
        x, y = one[a], one[b]
        L[[x, y], [x, y]] += g
        L[[x, y], [y, x]] -= g
    power = np.zeros(one.size)
    for place, P in SOURCES.items():
        power[one[places[place]]] += P
    kept = one[[*capacity]]
    gone = np.setdiff1d(one, kept)
    through = L[np.ix_(kept, gone)] @ np.linalg.inv(L[np.ix_(gone, gone)])
    C = np.asarray([*capacity.values()])[:, None]
    rates = np.zeros((kept.size + 1, kept.size + 1))
    rates[:-1, :-1] = (through @ L[np.ix_(gone, kept)] - L[np.ix_(kept, kept)]) / C
    rates[:-1, -1] = (power[kept] - through @ power[gone]) / C[:, 0]
    return (expm(t * rates) @ [*start.values(), 1.0])[1:-1]


@pytest.mark.parametrize("solver", [None, sb.hybrid.Rodas5P()])
def test_network_is_its_matrix(solver):
    run = sb.simulate_heat(network(), [0.0, 2.0, 60.0], rtol=1e-11, solver=solver)
    for t, found in zip((2.0, 60.0), np.asarray(run.temperature)[1:], strict=True):
        all_near(found, by_matrix(t), 1e-9)
