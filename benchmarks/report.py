"""Tables and times at equal error of the work–precision benchmark."""

import itertools
import math
from typing import Any

LEVELS = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)


def time_at(points: list[dict[str, Any]], level: float) -> float | None:
    """Time in which a method comes to an error: least time of its curve, log time over
    log error between points.

    A method that is more accurate than asked at its loosest tolerance takes the time of
    that point.
    """
    good = [p for p in points if math.isfinite(p["error"])]
    found = [p["seconds"] for p in good if p["error"] <= level]
    for a, b in itertools.pairwise(good):
        low = min(a["error"], b["error"])
        high = max(a["error"], b["error"])
        if 0 < low < level < high:
            share = math.log(level / a["error"]) / math.log(b["error"] / a["error"])
            found.append(
                math.exp(
                    (1 - share) * math.log(a["seconds"])
                    + share * math.log(b["seconds"])
                )
            )
    return min(found, default=None)


def by_method(scene: dict[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Points of each method in order of falling tolerance."""
    curves: dict[str, list[dict[str, Any]]] = {}
    for row in scene["rows"]:
        curves.setdefault(row["method"], []).append(row)
    return curves


def equal_error(scene: dict[str, Any]) -> dict[str, dict[str, float | None]]:
    """Time of each method over that of simbrake's fastest one, at equal error."""
    curves = by_method(scene)
    found: dict[str, dict[str, float | None]] = {}
    for level in LEVELS:
        times = {name: time_at(points, level) for name, points in curves.items()}
        ours = min(
            (t for name, t in times.items() if t and name.startswith("simbrake")),
            default=None,
        )
        for name, time in times.items():
            found.setdefault(name, {})[f"{level:.0e}"] = (
                time / ours if time and ours else None
            )
    return found


def text(scene: dict[str, Any]) -> str:
    """The table of a scene."""
    reference = scene["reference"]
    lines = [
        f"\n({scene['name']}) {scene['title']}",
        f"reference: {reference['method']}, uncertain by {reference['uncertainty']:.0e}",
        f"{'':32}{'tolerance':>10}{'of times':>10}{'of state':>10}{'time µs':>10}{'steps':>8}{'rhs':>8}{'first s':>9}",
    ]
    for r in scene["rows"]:
        steps, calls = (
            "–" if r[key] < 0 else str(r[key]) for key in ("steps", "evaluations")
        )
        errors = f"{r['error_times']:10.1e}{r['error_state']:10.1e}"
        first = f"{r['first_seconds']:9.2f}"
        lines.append(
            f"{r['method']:32}{r['tolerance']:10.0e}{errors}{1e6 * r['seconds']:10.0f}{steps:>8}{calls:>8}{first}"
        )
    lines += [f"{name:32}not run: {why}" for name, why in scene["left_out"].items()]
    lines.append(
        f"\n{'time over that of simbrake at an error of':42}"
        + "".join(f"{level:>9.0e}" for level in LEVELS)
    )
    for name, ratios in scene["equal_error"].items():
        cells = "".join(
            f"{'–' if r is None else f'{r:.2f}':>9}" for r in ratios.values()
        )
        lines.append(f"{name:42}{cells}")
    return "\n".join(lines)


#: errors at which the documentation gives times
_SHOWN = (1e-5, 1e-7, 1e-9)


def markdown(scene: dict[str, Any]) -> str:
    """A scene for the documentation: times at equal error, over simbrake's, the best
    error, and what is left out."""
    heads = [
        f"{what} {level:.0e}" for what in ("µs at", "ratio at") for level in _SHOWN
    ]
    lines = [
        f"**({scene['name']})** {scene['title']}",
        "",
        "| | " + " | ".join([*heads, "smallest error"]) + " |",
    ]
    lines.append("|" + "---|" * (len(heads) + 2))
    for name, points in by_method(scene).items():
        times = [time_at(points, level) for level in _SHOWN]
        ratios = [scene["equal_error"][name][f"{level:.0e}"] for level in _SHOWN]
        cells = ["" if t is None else significant(1e6 * t) for t in times]
        cells += ["" if r is None else significant(r) for r in ratios]
        lines.append(
            f"| {name} | "
            + " | ".join([*cells, f"{min(p['error'] for p in points):.0e}"])
            + " |"
        )
    reasons: dict[str, list[str]] = {}
    for name, why in scene["left_out"].items():
        reasons.setdefault(why, []).append(name)
    return "\n".join(
        [
            *lines,
            "",
            *(
                f"Not run: {', '.join(names)} ({why})."
                for why, names in reasons.items()
            ),
        ]
    ).rstrip()


def significant(x: float) -> str:
    """Two digits, without an exponent."""
    digits = max(0, 1 - math.floor(math.log10(x)))
    return f"{round(x, 1 - math.floor(math.log10(x))):,.{digits}f}"
