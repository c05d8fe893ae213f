"""The summary of a run as text, from the dictionary that also becomes its JSON."""

from typing import Any


def _number(value: float | None, unit: str, digits: int = 6) -> str:
    return "—" if value is None else f"{value:.{digits}g} {unit}"


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


def _heat_lines(summary: dict[str, Any]) -> list[str]:
    m, e, at = summary["metrics"], summary["energy"], summary["at"]
    if "heat_stored" not in e:
        return []
    names = {"peak_rim_temperature": "rim", "peak_lining_temperature": "linings", "peak_band_temperature": "band"}
    names["peak_lining_outer_temperature"] = "linings outside"
    hot = [f"{w} {m[k] - 273.15:.5g} °C at {at[f'{k}_time']:.6g} s" for k, w in names.items() if m.get(k) is not None]
    passed = []
    for name in ("permissible_temperature", "grip_lost", "self_locking"):
        times = [event["time"] for event in summary["events"] if event["name"] == name]
        if times:
            often = "once, " if len(times) == 1 else f"{len(times)} times, first "
            passed.append(f"{name.replace('_', ' ')} {often}at {min(times):.6g} s")
    return [
        *([f"passed   {', '.join(passed)}"] if passed else []),
        f"hottest  {', '.join(hot)}" if hot else "hottest  the scene names no rim, linings or band",
        f"heat     to metal {e['heat_to_metal'] / 1e3:.6g} kJ + to linings {e['heat_to_linings'] / 1e3:.6g} kJ"
        + (f" + to band {e['heat_to_band'] / 1e3:.6g} kJ" if "heat_external" in e else "")
        + (f" + supplied {e['heat_supplied'] / 1e3:.6g} kJ" if e["heat_supplied"] else "")
        + f" = stored {e['heat_stored'] / 1e3:.6g} kJ + lost {e['heat_lost'] / 1e3:.6g} kJ"
        f" (closure {e['heat_closure']:.1e})",
    ]


def _staged_lines(summary: dict[str, Any]) -> list[str]:
    m, e = summary["metrics"], summary["energy"]
    if "heat_internal" not in e:
        return []
    lines = [
        f"staged   internal slip {_number(m['internal_slip_time'], 's')}, "
        f"external lock {_number(m['external_lock_time'], 's')}; "
        f"heat external {e['heat_external'] / 1e3:.6g} kJ + internal {e['heat_internal'] / 1e3:.6g} kJ"
    ]
    for stage in summary["stages"]:
        lines.append(
            f"         {stage['start']:.6g}…{stage['end']:.6g} s {stage['name']}: external "
            f"{stage['heat_external'] / 1e3:.4g} kJ, internal {stage['heat_internal'] / 1e3:.4g} kJ"
        )
    return lines + [f"         no {stage['name']}: {stage['reason']}" for stage in summary["absent_stages"]]


def text(summary: dict[str, Any]) -> str:
    """About ten lines that can be read without the source."""
    m, e, s = summary["metrics"], summary["energy"], summary["solver"]
    at, normal = summary["at"], m["max_normal_load"]
    lines = [
        f"{summary['status']}: {summary['message']}",
        f"events   {_grouped(summary['events'])}",
        f"onset    slip onset t0 {_number(m['slip_onset_time'], 's')}, full slip {_number(m['full_slip_time'], 's')}",
        f"stop     after {_number(m['stopping_time'], 's')}, {_number(m['stopping_angle'], 'rad')}"
        + ("" if m["hook_travel"] is None else f", hook travel {_number(m['hook_travel'], 'm')}"),
        *_staged_lines(summary),
        f"tension  at most {m['max_tension'] / 1e3:.6g} kN behind lining {at['max_tension_lining']} "
        f"at {at['max_tension_time']:.6g} s",
        f"load     at most {normal / 1e3:.6g} kN on lining {at['max_normal_load_lining']} "
        f"at {at['max_normal_load_time']:.6g} s",
        f"energy   load {e['load_work'] / 1e3:.6g} kJ + lever {e['lever_work'] / 1e3:.6g} kJ "
        f"+ kinetic {-e['kinetic_change'] / 1e3:.6g} kJ = friction heat {e['friction_heat'] / 1e3:.6g} kJ "
        + (f"+ dampers {e['damper_heat'] / 1e3:.6g} kJ " if "damper_heat" in e else "")
        + f"+ elastic {e['elastic_change'] / 1e3:.6g} kJ",
        *_heat_lines(summary),
        f"closure  {e['closure']:.1e} of the largest energy exchanged",
        f"solver   {s['method']}, rtol {s['rtol']:g}: {s['steps']} steps, {s['rejected']} rejected, "
        f"{s['retaken']} retaken at events, {s['segments']} segments",
    ]
    if not summary["distribution"].startswith("mobilisation"):
        lines.append(f"split    {summary['distribution']}")
    if "heat_stored" in e:
        lines.append(f"method   {s['method']}: {s['reason']}")
    lines += [f"warning  {warning}" for warning in summary["warnings"]]
    return "\n".join(lines)
