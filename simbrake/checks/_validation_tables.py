"""Validation against printed tables: stops of the dynamic tables run anew, and cells that statics and heat give."""

import functools
import math
from typing import Any

import numpy as np

from .._parts._scene import band_brake
from .._run._simulate import simulate
from ..layouts._equal_layout import equal_increment_angles
from ..published import Cell, cells
from ._validation import Case
from ._validation_brakes import scene_of

_TITLES = {
    "Z": "Zhuravlov et al., Dynamics of friction couples of a band-shoe brake",
    "V": "Volchenko et al., Thermal transmission through metal friction elements",
}


def _rounding(printed: str) -> float:
    """Relative tolerance of a printed number: 1.5 units of its last place, or 0.5 % if that is more, as `reproduce`."""
    places = len(printed.partition(".")[2])
    return max(0.005, 1.5 * 10.0**-places / abs(float(printed)))


def stop_cases() -> list[Case]:
    """Rows of Z's tables 5 and 6 as stops: ten linings over 270°, λ = C R/T_0 = 5, at rest as k of them slide."""
    found = []
    for table, f, k, scheme, T_max, N_max in (
        (5, 0.5, 8, "variable", "9.96", "2.36"),
        (5, 0.5, 4, "uniform", "2.63", "1.23"),
        (6, 0.3, 8, "variable", "3.56", "1.1"),
    ):
        n, wrap, lam = 10, math.radians(270.0), 5.0
        angle = equal_increment_angles(f, n, k, wrap).angle if scheme == "variable" else np.full(n, wrap / n)
        fz = f * np.tan(np.asarray(angle) / 2)
        w_0 = lam / (float(np.prod(((1 + fz) / (1 - fz))[:k])) - 1)

        @functools.cache
        def run(f: float = f, angle: Any = angle, w_0: float = w_0) -> Any:
            scene = scene_of(1.0, n=n, f=f, R=1.0, J=lam / w_0**2, C=lam, w0=1.0, end=30.0)
            own = band_brake(scene)
            lining = own.linings
            angles = type(lining)(lining.friction, np.asarray(angle))
            brake = type(own)(own.pulley, own.band, angles)
            return simulate(type(scene)(brake, scene.duty, scene.initial, scene.end_time), rtol=1e-12)

        name, source = f"Z table {table}, k = {k}, {scheme}", f"{_TITLES['Z']}, table {table}"
        found += [
            Case(f"{name}/T_max", source, float(T_max), _rounding(T_max), lambda run=run: run().metrics["max_tension"]),
            Case(
                f"{name}/N_max",
                source,
                float(N_max),
                _rounding(N_max),
                lambda run=run: run().metrics["max_normal_load"],
            ),
            Case(
                f"{name}/stop",
                "closed form: 1/λ + π/(2w_0) [Z-15, 16]",
                1 / lam + math.pi / (2 * w_0),
                1e-11,
                lambda run=run: run().stopping_time,
            ),
        ]
    return found


def cell_cases() -> list[Case]:
    """Single cells of the tables that `simbrake reproduce` recomputes whole."""
    computed = functools.cache(lambda: {(c.table, c.row, c.column): c for c in cells()})
    wanted = (
        ("Z1", 0, "beta1_deg", "25.1"),
        ("Z2", 0, "T7", "1.31"),
        ("Z4", 0, "N3", "0.43"),
        ("V1", 0, "resistance", "0.051"),
        ("V2", 0, "K1", "3.329"),
        ("V2", 0, "share_metal", "0.531"),
    )
    found = []
    for table, row, column, printed in wanted:

        def value(key: Any = (table, row, column)) -> float:
            cell: Cell = computed()[key]
            return cell.computed

        source = f"{_TITLES[table[0]]}, table {table[1]}"
        found.append(Case(f"{table} row {row}/{column}", source, float(printed), _rounding(printed), value))
    return found


def cases() -> list[Case]:
    """All cases of this file, none of them run yet."""
    return stop_cases() + cell_cases()
