"""Steps 1 to 7 of the synthesis: depth, Fourier numbers, volumes, partition, bulk temperatures, properties, repeat."""

from typing import Any

import numpy as np

from ..thermal._material import Material
from ._estimate_report import EstimateRow
from ._estimate_rows import partition_rows
from ._property_iteration import PARTS, REPLACED_ABOVE, Pass, properties_at, property_factor
from ._synthesis_chain import Chain
from ._synthesis_report import SynthesisRow

_HEATED = ("rim", "lining")


def heating_rows(c: Chain) -> list[SynthesisRow]:
    """Figures of steps 1 to 7."""
    rows = [*_depth(c, 1, c.first), _within(c), *_fourier(c, 2, c.first), *_volumes(c, 3, c.first)]
    rows += _partition(c) + _bulk(c, 5, c.first) + _properties(c)
    return rows + _repeat(c)


def _named(name: str, step: int) -> str:
    return f"{name}, refined" if step == 7 else name


def _depth(c: Chain, step: int, found: Pass, parts: tuple[str, ...] = PARTS) -> list[SynthesisRow]:
    return [
        SynthesisRow.of(
            step,
            EstimateRow(_named(f"depth of heat, {part}", step), "b = 1.73 √(a τ)", found.depth[part], "m", "S, step 1"),
            ("a", float(found.materials[part].diffusivity), "m^2/s"),
            ("τ", c.before.time, "s"),
        )
        for part in parts
    ]


def _within(c: Chain) -> SynthesisRow:
    """Of the rim's heat at the end of the braking, the share that lies within that depth."""
    simulated, course = None, None if c.seen is None else c.seen.rim
    if course is not None:
        rise = course.layers[-1] - course.layers[0]
        whole = float(rise @ course.steps)
        simulated = float(rise @ course.inside(c.first.depth["rim"])) / whole if whole > 0 else None
    why = "heat tails off without an edge; a thin rim, or one heated before, moves it as well"
    return SynthesisRow.of(
        1,
        EstimateRow("rim's heat within the depth", "1: all of it", 1.0, "1", "S, steps 1, 3", simulated, why),
        ("b", c.first.depth["rim"], "m"),
    )


def _fourier(c: Chain, step: int, found: Pass, parts: tuple[str, ...] = PARTS) -> list[SynthesisRow]:
    rows = []
    for part in parts:
        thickness = getattr(c.before, f"{part}_thickness")
        formula = "a τ/δ², for b > δ" if found.depth[part] > thickness else "1/3, for b ≤ δ"
        rows.append(
            SynthesisRow.of(
                step,
                EstimateRow(_named(f"Fourier number, {part}", step), formula, found.Fo[part], "1", "S-15, step 2"),
                ("a", float(found.materials[part].diffusivity), "m^2/s"),
                ("τ", c.before.time, "s"),
                ("δ", thickness, "m"),
                ("b", found.depth[part], "m"),
            )
        )
    return rows


def _volumes(c: Chain, step: int, found: Pass, parts: tuple[str, ...] = PARTS) -> list[SynthesisRow]:
    b, rows = c.before, []
    for part in parts:
        name, area = f"effective volume, {part}", b.track_area if part == "rim" else b.lining_area
        row = EstimateRow(_named(name, step), "A min(b, δ)", found.volume[part], "m^3", "S, step 3")
        numbers = [("A", area, "m^2"), ("b", found.depth[part], "m"), ("δ", getattr(b, f"{part}_thickness"), "m")]
        rows.append(SynthesisRow.of(step, row, *numbers))
    return rows


def _partition(c: Chain) -> list[SynthesisRow]:
    b = c.before
    by_name = {row.name: row for row in partition_rows(b)}
    charron, printed = (by_name[f"share into the rim, {law}"] for law in ("effusivities", "transmission"))
    formula = "α_TP: law of the scene" if b.inputs["share"].source == "scene" else "α_TP, as given"
    if b.inputs["share"].source.startswith("effusivities"):
        formula = "α_TP = e_1/(e_1 + e_2)"
    used = EstimateRow("share into the rim", formula, c.first.share, "1", "S, step 4", charron.simulated, charron.why)
    e = [("e_1", float(b.rim.effusivity), "W*s^0.5/(m^2*K)"), ("e_2", float(b.lining.effusivity), "W*s^0.5/(m^2*K)")]
    at = ("T", b.start_now, "K")
    lining = None if charron.simulated is None else 1 - charron.simulated
    rest = EstimateRow("share into the linings", "1 − α_TP", 1 - c.first.share, "1", "S-42", lining, charron.why)
    return [
        SynthesisRow.of(4, used, ("T_rim", c.start["rim"], "K"), ("T_lining", c.start["lining"], "K")),
        SynthesisRow.of(4, rest, ("α_TP", c.first.share, "1")),
        SynthesisRow.of(4, charron, *e),
        SynthesisRow.of(4, printed, at),
    ]


def _bulk(c: Chain, step: int, found: Pass) -> list[SynthesisRow]:
    rows = []
    whys = {
        "rim": "2/3 is for power that falls linearly from the first moment, and G is all of the heated depth",
        "lining": "as for the rim; linings and rim also exchange heat through the contact",
    }
    for part in _HEATED:
        share = found.share if part == "rim" else 1 - found.share
        course = None if c.seen is None else getattr(c.seen, part)
        simulated = None if course is None else float(np.mean(course.mean(found.depth[part])))
        name = _named(f"mean bulk temperature, {part}", step)
        row = EstimateRow(name, "T + (2/3) α W/(c G)", found.bulk[part], "K", "S-25, step 5", simulated, whys[part])
        numbers = [
            ("T", c.start[part], "K"),
            ("α", share, "1"),
            ("W", c.before.heat, "J"),
            ("c", float(found.materials[part].specific_heat), "J/(kg*K)"),
            ("G", found.mass[part], "kg"),
        ]
        rows.append(SynthesisRow.of(step, row, *numbers))
    return rows


_PROPERTIES = (
    ("conductivity", "λ", "W/(m*K)"),
    ("specific_heat", "c", "J/(kg*K)"),
)


def _properties(c: Chain) -> list[SynthesisRow]:
    """Which temperature the properties of the next round are taken at, and what they are there."""
    rows = []
    for part in _HEATED:
        replaced = part in c.found.replaced
        T = c.first.bulk[part] if replaced else c.first.at[part]
        formula = "T_v of step 5" if replaced else "room: T_v of step 5 is not above 150 °C"
        numbers = [("T_v", c.first.bulk[part], "K"), ("limit", REPLACED_ABOVE, "K")]
        row = EstimateRow(f"temperature of the properties, {part}", formula, T, "K", "S, step 6")
        rows.append(SynthesisRow.of(6, row, *numbers))
        material: Material = getattr(c.before, part)
        there = properties_at(material, T, part)
        for field, symbol, unit in _PROPERTIES:
            slope = getattr(material, f"{field}_slope")
            words = f"{symbol} (no temperature dependence known)" if slope is None else f"{symbol} [1 + b (T − T_r)]"
            row = EstimateRow(
                f"{field.replace('_', ' ')}, {part}",
                words,
                float(getattr(there, field)),
                unit,
                "S, step 6",
                _simulated_property(c, part, field),
                "the run takes it everywhere at its own temperature",
            )
            given: list[Any] = [(symbol, float(getattr(material, field)), unit)]
            if slope is not None:
                given += [("b", float(slope), "1/K"), ("T", T, "K"), ("T_r", float(material.reference), "K")]
            rows.append(SynthesisRow.of(6, row, *given))
    return rows


def _simulated_property(c: Chain, part: str, field: str) -> float | None:
    """A property by the scene's own law at the simulated mean temperature of the heated depth."""
    course = None if c.seen is None else getattr(c.seen, part)
    if course is None:
        return None
    material, T = course.wall.material, float(np.mean(course.mean(c.first.depth[part])))
    return float(getattr(material, field)) * property_factor(material, field, T)


def _repeat(c: Chain) -> list[SynthesisRow]:
    found = c.found
    formula = "until T_v changes no more" if found.replaced else "none: properties stay those of room temperature"
    rounds = EstimateRow("rounds of steps 1 to 5", formula, float(found.rounds), "1", "S, step 7")
    rows = [SynthesisRow.of(7, rounds, ("last change", found.change, "K"))]
    rows += (
        _depth(c, 7, found.last, _HEATED) + _fourier(c, 7, found.last, _HEATED) + _volumes(c, 7, found.last, _HEATED)
    )
    first = _partition(c)[0]
    share = SynthesisRow.of(
        7,
        EstimateRow(
            "share into the rim, refined", first.formula, found.last.share, "1", "S, step 7", first.simulated, first.why
        ),
        ("T_rim", found.last.bulk["rim"], "K"),
        ("T_lining", found.last.bulk["lining"], "K"),
    )
    return [*rows, share, *_bulk(c, 7, found.last)]
