"""The summary of a run as text, from the dictionary that also becomes its JSON."""

from typing import Any


def _number(value: float | None, unit: str, digits: int = 6) -> str:
    return "—" if value is None else f"{value:.{digits}g} {unit}"


def _kilo(value: float | None, unit: str, *, digits: int = 6, sign: int = 1) -> str:
    """A number in thousands; a dash for what left the range of numbers in a failed run."""
    return f"— {unit}" if value is None else f"{sign * value / 1e3 + 0.0:.{digits}g} {unit}"


def _share(value: float | None) -> str:
    return "—" if value is None else f"{value:.1e}"


def _grouped(events: list[dict[str, Any]]) -> str:
    """Events in order, runs of one name at several linings drawn together."""
    parts: list[str] = []
    i = 0
    while i < len(events):
        event = events[i]
        j = i
        while "lining" in event and j + 1 < len(events) and events[j + 1]["name"] == event["name"]:
            j += 1
        words = event["name"].replace("_", " ")
        if j > i:
            first, last = event["lining"], events[j]["lining"]
            parts.append(f"{words}s {first}…{last} {event['time']:.6g}…{events[j]['time']:.6g} s")
        else:
            lining = f" {event['lining']}" if "lining" in event else ""
            parts.append(f"{words}{lining} {event['time']:.6g} s")
        i = j + 1
    shown = parts if len(parts) <= 12 else [*parts[:6], f"… {len(parts) - 10} more …", *parts[-4:]]
    return ", ".join(shown) if shown else "none"


#: events that change no mode, in words
_MARKS = {
    "permissible_temperature": "permissible temperature exceeded",
    "grip_lost": "grip lost",
    "self_locking": "self-locking",
}


def _heat_lines(summary: dict[str, Any]) -> list[str]:
    m, e, at = summary["metrics"], summary["energy"], summary["at"]
    if "heat_stored" not in e:
        return []
    body, linings = summary.get("body", "rim"), f"{summary.get('lining', 'lining')}s"
    names = {"peak_rim_temperature": body, "peak_lining_temperature": linings, "peak_band_temperature": "band"}
    names["peak_lining_outer_temperature"] = "linings outside"
    hot = [f"{w} {m[k] - 273.15:.5g} °C at {at[f'{k}_time']:.6g} s" for k, w in names.items() if m.get(k) is not None]
    marks = []
    for name, words in _MARKS.items():
        times = [event["time"] for event in summary["events"] if event["name"] == name]
        if times:
            often = "once, " if len(times) == 1 else f"{len(times)} times, first "
            marks.append(f"{words} {often}at {min(times):.6g} s")
    return [
        *([f"marks    {', '.join(marks)}"] if marks else []),
        f"hottest  {', '.join(hot)}" if hot else "hottest  the scene names no rim, linings or band",
        f"heat     to metal {_kilo(e['heat_to_metal'], 'kJ')} + to linings {_kilo(e['heat_to_linings'], 'kJ')}"
        + (f" + to band {_kilo(e['heat_to_band'], 'kJ')}" if e["heat_to_band"] else "")
        + (f" + supplied {_kilo(e['heat_supplied'], 'kJ')}" if e["heat_supplied"] else "")
        + f" = stored {_kilo(e['heat_stored'], 'kJ')} + lost {_kilo(e['heat_lost'], 'kJ')}"
        f" (closure {_share(e['heat_closure'])})",
    ]


def _staged_lines(summary: dict[str, Any]) -> list[str]:
    m, e = summary["metrics"], summary["energy"]
    if "stages" not in summary:
        return []
    lines = [
        f"staged   internal slip {_number(m['internal_slip_time'], 's')}, "
        f"external lock {_number(m['external_lock_time'], 's')}; "
        f"heat external {_kilo(e['heat_external'], 'kJ')} + internal {_kilo(e['heat_internal'], 'kJ')}"
    ]
    for stage in summary["stages"]:
        lines.append(
            f"         {stage['start']:.6g}…{stage['end']:.6g} s {stage['name']}: external "
            f"{_kilo(stage['heat_external'], 'kJ', digits=4)}, internal {_kilo(stage['heat_internal'], 'kJ', digits=4)}"
        )
    return lines + [f"         no {stage['name']}: {stage['reason']}" for stage in summary["absent_stages"]]


def _tension_lines(summary: dict[str, Any]) -> list[str]:
    m, at = summary["metrics"], summary["at"]
    if "max_tension" not in m:
        return []
    return [
        f"tension  at most {_kilo(m['max_tension'], 'kN')} behind lining {at['max_tension_lining']} "
        f"at {_number(at['max_tension_time'], 's')}"
    ]


def _wear_lines(summary: dict[str, Any]) -> list[str]:
    worn, m = summary.get("worn_thickness"), summary["metrics"]
    if worn is None or m["greatest_wear"] is None:
        return []
    where = worn.index(max(worn)) + 1
    if m["wear_over_mean"] is None:
        return [f"wear     none: no {summary.get('lining', 'lining')} slid"]
    least = "" if m["wear_over_least"] is None else f", {m['wear_over_least']:.4g} times the least"
    return [
        f"wear     at most {1e6 * m['greatest_wear']:.5g} µm on {summary.get('lining', 'lining')} {where}, "
        f"{m['wear_over_mean']:.4g} times the mean{least}"
    ]


def text(summary: dict[str, Any]) -> str:
    """About ten lines that can be read without the source."""
    m, e, s = summary["metrics"], summary["energy"], summary["solver"]
    at, normal = summary["at"], m["max_normal_load"]
    gains = e["kinetic_change"] is not None and e["kinetic_change"] > 0  # the load has sped the pulley up
    lines = [
        f"{summary['status']}: {summary['message']}",
        f"events   {_grouped(summary['events'])}",
        f"onset    slip onset t0 {_number(m['slip_onset_time'], 's')}, full slip {_number(m['full_slip_time'], 's')}",
        f"stop     after {_number(m['stopping_time'], 's')}, {_number(m['stopping_angle'], 'rad')}"
        + ("" if m["hook_travel"] is None else f", hook travel {_number(m['hook_travel'], 'm')}"),
        *_staged_lines(summary),
        *_tension_lines(summary),
        f"load     at most {_kilo(normal, 'kN')} on {summary.get('lining', 'lining')} {at['max_normal_load_lining']} "
        f"at {_number(at['max_normal_load_time'], 's')}",
        f"energy   load {_kilo(e['load_work'], 'kJ')} + lever {_kilo(e['lever_work'], 'kJ')} "
        + ("" if gains else f"+ kinetic {_kilo(e['kinetic_change'], 'kJ', sign=-1)} ")
        + f"= friction heat {_kilo(e['friction_heat'], 'kJ')}"
        + (f" + dampers {_kilo(e['damper_heat'], 'kJ')}" if "damper_heat" in e else "")
        + (f" + electrical {_kilo(e['electrical_work'], 'kJ')}" if "electrical_work" in e else "")
        + (f" + mechanical {_kilo(e['mechanical_work'], 'kJ')}" if "mechanical_work" in e else "")
        + (f" + elastic {_kilo(e['elastic_change'], 'kJ')}" if "elastic_change" in e else "")
        + (f" + kinetic energy gained {_kilo(e['kinetic_change'], 'kJ')}" if gains else ""),
        *_heat_lines(summary),
        *_wear_lines(summary),
        f"closure  {_share(e['closure'])} of the largest energy exchanged",
        f"solver   {s['method']}, rtol {s['rtol']:g}: {s['steps']} steps, {s['rejected']} rejected, "
        f"{s['retaken']} retaken at events, {s['segments']} segments",
    ]
    if not summary["distribution"].startswith("mobilisation"):
        lines.append(f"split    {summary['distribution']}")
    if "heat_stored" in e:
        lines.append(f"method   {s['method']}: {s['reason']}")
    lines += [f"warning  {warning}" for warning in summary["warnings"]]
    return "\n".join(lines)
