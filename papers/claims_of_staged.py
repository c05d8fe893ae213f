"""Claims of K, and of V on the same brake: linings that ride on the pulley."""

import dataclasses
import math
from typing import Any

import numpy as np
from claim import (
    LININGS,
    WRAP,
    ZERO,
    Found,
    Runs,
    claim,
    floating,
    judged,
    of_each,
    scenario,
    stop,
)

import simbrake as sb


@claim(
    "K",
    "operation of the brake",
    "the external pair works first, then the linings stop on the band and the internal pair works",
)
def stages(runs: Runs) -> Found:
    names = [stage.name for stage in runs.cold_staged.stages][:3]
    text = (
        f"stages of a stop in this order: {', '.join(names).replace('_', ' ')}; both "
        f"pairs slide for {runs.cold_staged.stages[1].duration:.2f} s in between"
    )
    return Found(
        len(names),
        text,
        judged(names == ["stage_1", "stage_2", "stage_3"], "stage_3" in names),
    )


@claim(
    "K",
    "main condition",
    "the stages need external friction above internal friction",
    "equal lever and load",
)
def condition(_: Runs) -> Found:
    def brake(ratio: float) -> sb.Scene:
        return stop(0.3 * ratio, stiffness=None, bandage=floating(0.3))

    # of f_e/f_i: the internal pair never slides, and slides from a finite tension on
    low = 0.5
    least = 2.0
    while least - low > 1e-3:
        middle = 0.5 * (low + least)
        slides = np.isfinite(
            float(sb.results.internal_slip_tension(brake(middle).brake, 1350.0, 29.4e3))
        )
        low, least = (low, middle) if slides else (middle, least)
    seen = [
        any(stage.name == "stage_3" for stage in sb.simulate(brake(ratio)).stages)
        for ratio in (0.8, 1.4)
    ]
    text = (
        f"the internal pair can slide from $f_e/f_i$ = {least:.2f} on, as the band has "
        f"the longer arm; a run with 0.8 {'has' if seen[0] else 'lacks'} stage 3, one "
        f"with 1.4 {'has' if seen[1] else 'lacks'} it"
    )
    separate = seen == [False, True]
    return Found(least, text, judged(separate and abs(least - 1) < 0.02, separate))


@claim(
    "K",
    "after Fig. 5",
    "the internal pair's work in stage 3 is that of a serial brake without stages 1 and 2",
    "equal stopping time",
)
def stage_three(runs: Runs) -> Found:
    result, factor = runs.staged
    third = sum(
        stage.heat_internal for stage in result.stages if stage.name == "stage_3"
    )
    heat = third / float(runs.standard.energy["friction_heat"])
    text = (
        "work of the internal pair in stage 3 over that of the serial brake "
        f"{heat:.3f} (same friction on the rim, lever × {factor:.2f}): the same pair "
        "and law, less what the earlier stages took"
    )
    return Found(heat, text, judged(abs(heat - 1) < 0.05, heat > 0.8))


@claim(
    "V",
    "conclusions",
    "the external pairs unload the internal ones: the rim of a staged brake stays cooler",
    "equal stopping time",
)
def cooler(runs: Runs) -> Found:
    result, factor = runs.staged
    rise = [
        r.metrics["peak_rim_temperature"] - sb.thermal.ROOM
        for r in (result, runs.standard)
    ]
    lining = [
        r.metrics["peak_lining_temperature"] - ZERO for r in (result, runs.standard)
    ]
    text = (
        f"rim at most {rise[0] + sb.thermal.ROOM - ZERO:.1f} °C against "
        f"{rise[1] + sb.thermal.ROOM - ZERO:.1f} °C (linings {lining[0]:.1f} against "
        f"{lining[1]:.1f} °C), same friction on the rim, lever × {factor:.2f}"
    )
    return Found(rise[0] / rise[1], text, judged(rise[0] < rise[1]))


@claim(
    "K",
    "advantages, 2",
    "the time for which each pair works lets their loads be levelled",
    "equal lever at its maximum",
)
def levelling(_: Runs) -> Found:
    share = []
    for preload, ramp in ((0.0, 0.35), (8e3, 0.35), (8e3, 2.0), (30e3, 2.0)):
        of = sb.with_values(
            stop(0.42, stiffness=None, bandage=floating(preload=preload)),
            {"duty.slack_tension.times": [0.0, ramp]},
        )
        energy = sb.simulate(of).energy
        share.append(float(energy["heat_external"]) / float(energy["friction_heat"]))
    text = (
        f"share of the external pair {of_each(share)} of the friction work by preload "
        "(0, 8, 8, 30 kN) and time of the lever (0.35, 0.35, 2, 2 s)"
    )
    return Found(
        max(share),
        text,
        judged(min(share) < 0.5 < max(share), max(share) > min(share) + 0.1),
    )


@claim(
    "K",
    "advantages, 3",
    "linings that change their position on the band wear evenly",
    "the same stop, linings fixed or moved",
)
def travel(runs: Runs) -> Found:
    result = runs.cold_staged
    t = np.linspace(0.0, result.metrics["stopping_time"], 2001)
    s = result.series(t)
    psi = np.concatenate(
        [
            [0.0],
            np.cumsum(
                0.5
                * np.diff(t)
                * (np.asarray(s.bandage_speed)[1:] + np.asarray(s.bandage_speed)[:-1])
            ),
        ]
    )
    rate = np.asarray(s.pairs["external"].normal_load) * np.abs(
        np.asarray(s.pairs["external"].slip_speed)
    )
    fixed = np.trapezoid(rate, t, axis=0)
    # a full ring of linings of one pitch: each takes from a station the share by which
    # their arcs overlap
    pitch = WRAP / LININGS
    ring = round(2 * math.pi / (WRAP / LININGS))
    stops = 40
    worn = np.zeros(ring)
    turned = 0.0
    first = math.nan
    for number in range(stops):
        place = (
            np.arange(ring)[:, None]
            - np.arange(LININGS)
            - ((psi + turned) / pitch)[:, None, None]
        ) % ring
        part = np.maximum(1 - np.minimum(place, ring - place), 0.0)
        worn += np.trapezoid(np.einsum("mjk,mk->mj", part, rate), t, axis=0)
        turned += psi[-1]
        first = float(np.max(worn) / np.min(worn)) if number == 0 else first
    ratio = float(np.max(worn) / np.min(worn))
    once = float(np.max(fixed) / np.min(fixed))
    text = (
        f"outer faces, maximum over minimum wear {once:.2f} fixed, for a full ring "
        f"{first:.2f} after one "
        f"stop, in which it turns by {psi[-1]:.2f} rad, {ratio:.2f} after {stops}"
    )
    return Found(ratio, text, judged(ratio < 1.1, ratio < once))


@claim(
    "K",
    "advantages, 4",
    "linings that turn with the pulley intensify the cooling of its track and of their own faces",
    "open brake, all at 200 °C, 10 min at 10 m/s; linings of 45 mm",
)
def turning(_: Runs) -> Found:
    track = 2 * math.pi * 0.590 * 0.220
    steel = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    forced = sb.thermal.SpeedCoefficient(10.0, 2.0)  # W/(m²·K), m/s: assumptions
    time = np.array([0.0, 600.0])
    hot = 473.15

    def rejected(staged: bool, face: Any) -> tuple[float, float]:
        """Share of their heat that rim and linings have given to the air; `face`: of
        the open face of the linings."""
        rim = sb.thermal.Lump(
            "rim", steel.density * steel.specific_heat * 0.025 * track, hot
        )
        linings = sb.thermal.Wall(
            "lining", lining, 0.045, 0.75 * track, 16, temperature=hot, both=True
        )
        inner = sb.thermal.FrictionHeat("rim", "lining.front", 0.9)
        outer = None
        links = [
            sb.thermal.Convection("rim", track, forced, covered=0.75),
            sb.thermal.Convection("rim", track, 25.0),
        ]
        # on the pulley: their inner faces on the track, outer ones in the air while the
        # band is open
        if staged:
            links.append(
                sb.thermal.ThermalContact("rim", "lining.front", 0.75 * track, 2e-3)
            )
            outer = sb.thermal.FrictionHeat("band", "lining.back", 0.5)
        else:  # on the band, at rest
            links.append(sb.thermal.Convection("lining.front", 0.75 * track, face))
        links.append(
            sb.thermal.Convection("lining.back", 0.75 * track, face if staged else 5.0)
        )
        band = sb.thermal.Lump("band", 460.0 * 7800.0 * 0.006 * 0.75 * track)
        links.append(sb.thermal.Conductance("band", "air", 5.0))
        bodies = (rim, linings, band, sb.thermal.Reservoir("air"))
        result = sb.simulate_heat(
            sb.Heat(bodies, tuple(links), inner, external=outer), time, speed=10.0
        )
        left = (np.asarray(result.temperature)[-1] - sb.thermal.ROOM) / (
            hot - sb.thermal.ROOM
        )
        return 1 - left[0], 1 - float(
            np.sum(left[1:17] * np.asarray(linings.steps))
        ) / 0.045

    turned = rejected(True, forced)
    still = rejected(True, 10.0)
    serial = rejected(False, 10.0)
    text = (
        f"linings have rejected {100 * turned[1]:.0f} % of their heat, "
        f"{100 * still[1]:.0f} % if their faces were in still air, those of a serial "
        f"brake {100 * serial[1]:.0f} %; the rim, whose track stays covered by three "
        f"quarters, {100 * turned[0]:.1f} and {100 * still[0]:.1f} %, of a serial "
        f"brake {100 * serial[0]:.1f} %"
    )
    better = turned[1] > still[1] and turned[0] > still[0]
    return Found(
        turned[1] / still[1], text, judged(better and turned[0] > serial[0], better)
    )


@claim(
    "K",
    "after K-8",
    "more flexible parallel bands spread the loads more evenly over external and internal pairs",
    "equal lever",
)
def flexible(_: Runs) -> Found:
    found = []
    for C in (1e5, 2.5e4):
        result = sb.simulate(stop(0.42, stiffness=C, bandage=floating()))
        outer, inner = (
            np.asarray(sb.results.lining_peak(result, "normal_load", pair=p))
            for p in ("external", "internal")
        )
        found.append((np.max(outer) / np.min(outer), np.max(inner) / np.max(outer)))
    (uneven, pairs), (uneven_soft, pairs_soft) = found
    text = (
        "a quarter of the stiffness: peak loads of the linings, maximum over minimum, "
        f"{uneven:.2f} -> {uneven_soft:.2f}; internal over external {pairs:.2f} -> "
        f"{pairs_soft:.2f} (the preload); full slip does not depend on stiffness"
    )
    return Found(
        float(uneven_soft / uneven),
        text,
        judged(uneven_soft < 0.9 * uneven, uneven_soft < 0.98 * uneven),
    )


@claim(
    "K",
    "Fig. 5",
    "in stage 1 external overlap is dynamic and internal static, in stage 3 the other way round",
)
def overlaps(runs: Runs) -> Found:
    result = runs.cold_staged
    middle = {stage.name: 0.5 * (stage.start + stage.end) for stage in result.stages}
    of = sb.results.overlap(result, [middle["stage_1"], middle["stage_3"]])
    outer = np.asarray(of.external_dynamic) > np.asarray(of.external_static)
    inner = np.asarray(of.internal_dynamic) > np.asarray(of.internal_static)
    text = (
        f"external {of.external_dynamic[0]:.2f} dynamic, internal "
        f"{of.internal_static[0]:.2f} static in stage 1; {of.external_static[1]:.2f} "
        f"static, {of.internal_dynamic[1]:.2f} dynamic in stage 3"
    )
    return Found(
        float(of.external_dynamic[0]),
        text,
        judged(list(outer) == [True, False] and list(inner) == [False, True]),
    )


@claim(
    "K",
    "thermal shock",
    "a short heating before service stabilises the brake's effect",
    "equal lever, new linings",
)
def thermal_shock(_: Runs) -> Found:
    cold = stop(stiffness=None)
    heat = sb.lumped_heat(
        rim=8e4, linings=6e3, partition=0.9, rim_cooling=0.0, temperature=423.15
    )

    def run(c: Any, omega: float, start: float, end: float) -> sb.Result:
        # burn-off by heat, and running-in by work: assumptions
        process = sb.friction.MemoryProcess
        changes = (process(end, rate=1e5, activation=7e4), process(0.9, work=20e6))
        law = sb.friction.FrictionWithMemory(
            sb.ConstantFriction(0.35), changes, np.broadcast_to(c, (LININGS,))
        )
        brake = dataclasses.replace(
            cold.brake, linings=dataclasses.replace(cold.brake.linings, friction=law)
        )
        hot = sb.results.with_temperatures(heat, np.full(2, start))
        return sb.simulate(
            dataclasses.replace(
                cold, brake=brake, heat=hot, initial=sb.Initial(omega), end_time=30.0
            )
        )

    def spread(c: Any, end: float) -> float:
        times = []
        for _ in range(4):
            result = run(c, 24.0, 423.15, end)
            times.append(result.metrics["stopping_time"])
            c = np.asarray(result.series([30.0]).friction_memory)[0]
        return 100 * (max(times) / min(times) - 1)

    shocked = {
        end: np.asarray(run(1.15, 0.0, 673.15, end).series([30.0]).friction_memory)[0]
        for end in (0.9, 0.75)
    }
    before = spread(1.15, 0.9)
    after = spread(shocked[0.9], 0.9)
    more = spread(shocked[0.75], 0.75)
    text = (
        f"stopping times of four stops differ by {before:.1f} % with new linings, by "
        f"{after:.1f} % after 30 s at 400 °C if heat and running-in end at one "
        f"friction, by {more:.1f} % if heat takes it lower; the law's numbers are "
        "assumptions"
    )
    return Found(
        after / before, text, judged(max(after, more) < before, after < before)
    )


@claim(
    "K",
    "overlap",
    "two surfaces under N each have more real contact than one of twice the area under 2 N",
    fast=True,
)
def two_surfaces(_: Runs) -> Found:
    face = 0.75 * WRAP * 0.590 * 0.220 / LININGS
    N = 20e3
    hardness = float(sb.formulas.lining_material("FK-24A").hardness)
    two = 2 * float(sb.formulas.real_contact_area(face, N / face, hardness))
    one = float(sb.formulas.real_contact_area(2 * face, 2 * N / (2 * face), hardness))
    text = (
        f"{1e4 * two:.2f} cm² for the two together, {1e4 * one:.2f} cm² for the one: "
        "plastic spots carry the hardness "
        "(S-34), their area is load over hardness, so that S and K contradict each other"
    )
    return Found(two / one, text, judged(two > 1.001 * one))


@claim(
    "K",
    "overlap",
    "a larger contact area raises friction",
    "equal pressure, as K has it; equal load",
    fast=True,
)
def larger_area(_: Runs) -> Found:
    # friction that falls with pressure: reference and exponent are assumptions
    law = sb.friction.ProductFriction(
        sb.ConstantFriction(0.35), (sb.friction.PressureFactor(1e6, 0.1),)
    )
    f = [
        float(law.kinetic(sb.friction.Contact(np.float64(5.0), p=np.float64(p))))
        for p in (6e5, 6e5, 3e5)
    ]
    same_pressure = f[1] / f[0]
    same_load = f[2] / f[0]
    real = [
        float(sb.formulas.real_contact_area(a, 6e5, 200e6)) / a for a in (0.046, 0.092)
    ]
    text = (
        f"twice the area: friction × {same_pressure:.3f} at one pressure, where the "
        f"real share of the face stays {real[0]:.4f} and {real[1]:.4f} (S-34); × "
        f"{same_load:.3f} at one load, if it falls with pressure (assumption)"
    )
    return Found(same_pressure, text, judged(same_pressure > 1, same_load > 1))


@claim(
    "K",
    "operation of the brake",
    "if the outer faces are the smaller ones, the stages need a higher pressure on the inner ones",
    "equal lever; outer faces 0.6 to 1 of the inner ones",
)
def smaller_outside(_: Runs) -> Found:
    ratio = []
    names = []
    share = (1.0, 0.8, 0.6)
    of = stop(0.42, stiffness=None, bandage=floating())
    inner = float(of.brake.bandage.area)
    for part in share:
        result = sb.simulate(sb.with_values(of, {"brake.linings.area": part * inner}))
        third = next(stage for stage in result.stages if stage.name == "stage_3")
        pairs = result.series([0.5 * (third.start + third.end)]).pairs
        load = [
            float(np.mean(np.asarray(pairs[pair].normal_load)))
            for pair in ("internal", "external")
        ]
        ratio.append(load[0] / load[1] * part)
        names.append([stage.name for stage in result.stages][:3])
    staged = [one == ["stage_1", "stage_2", "stage_3"] for one in names]
    text = (
        f"mean pressure inside over outside in stage 3 {of_each(ratio)} with outer "
        f"faces of {of_each(share, '.1f')} of the inner ones; the three stages come in "
        f"{sum(staged)} of {len(staged)} runs: friction and loads decide, areas only "
        "where friction depends on pressure"
    )
    needed = [came == (higher > 1) for came, higher in zip(staged, ratio, strict=True)]
    return Found(ratio[-1], text, judged(needed))


@claim(
    "K",
    "advantages, 5",
    "two pairs make forced cooling easier: heat is taken from the external and from "
    "the internal one",
    "steady drag, 10 kW inside, 5 kW into the band",
    fast=True,
)
def forced_cooling(runs: Runs) -> Found:
    of = runs.pair.scene().heat
    touching = sb.thermal.ThermalContact(
        "rim.front", "lining.front", WRAP * 0.590 * 0.220, 2e-3
    )
    drag = dataclasses.replace(
        of, links=(*of.links, touching), sources=(sb.thermal.Source("band", 5e3),)
    )

    def rises(inside: float, outside: float) -> np.ndarray:
        """Of track, inner lining faces and band (K), by the coefficients behind the rim
        and on the band."""
        given = {"rim.back": inside, "band": outside}
        links = (
            dataclasses.replace(link, coefficient=given[link.a])
            if isinstance(link, sb.thermal.Convection) and link.a in given
            else link
            for link in drag.links
        )
        T = sb.steady_state(
            dataclasses.replace(drag, links=tuple(links)),
            power=10e3,
            speed=10.0,
            closed=1.0,
        )
        return (
            np.asarray([float(T[name]) for name in ("rim[1]", "lining[1]", "band")])
            - sb.thermal.ROOM
        )

    plain, rim, band, both = (
        rises(*h) for h in ((25.0, 15.0), (1e3, 15.0), (25.0, 500.0), (1e3, 500.0))
    )
    text = (
        f"track, inner faces of the linings and band rise by {of_each(plain, '.0f')} K "
        f"in air, {of_each(rim, '.0f')} K with 1 kW/(m²·K) behind the rim, "
        f"{of_each(band, '.0f')} K with 0.5 kW/(m²·K) on the band, "
        f"{of_each(both, '.0f')} K with both: each way cools the metal of its own pair"
    )
    whole = (
        np.all(both < 0.5 * plain)
        and rim[0] < 0.5 * plain[0]
        and band[2] < 0.5 * plain[2]
    )
    return Found(float(np.max(both / plain)), text, judged(whole, both < 0.9 * plain))


@claim(
    "K",
    "operation of the brake",
    "the width of the linings is inverse to the stiffness of the springs between them",
    "equal wrap, mass, preload and lever; width along the band",
)
def springs(_: Runs) -> Found:
    plain = scenario("resolved_bandage").scene()

    def stretched(count: int, stiffness: float) -> tuple[float, float]:
        """Maximum elongation of the whole bandage and of a spring (m)."""
        of = plain.brake.bandage
        shared = plain.brake.linings.count / count
        bandage = dataclasses.replace(
            of, preload=of.preload * shared, mass=of.mass * shared, spring=stiffness
        )
        linings = sb.uniform_linings(count, WRAP, sb.ConstantFriction(0.42))
        brake = dataclasses.replace(plain.brake, linings=linings, bandage=bandage)
        t = np.linspace(0.0, float(plain.end_time), 4001)
        speed = np.asarray(
            sb.simulate(dataclasses.replace(plain, brake=brake)).series(t).lining_speed
        )
        between = np.diff(speed, axis=1) * float(brake.band.radius)
        x = np.cumsum(0.5 * np.diff(t)[:, None] * (between[1:] + between[:-1]), axis=0)
        return float(np.max(np.abs(np.sum(x, axis=1)))), float(np.max(np.abs(x)))

    narrow = stretched(8, 2e5)
    inverse = stretched(4, 1e5)
    same = stretched(4, 2e5)
    whole, each = (b / a for a, b in zip(narrow, inverse, strict=True))
    text = (
        "linings of twice the width on springs of half the stiffness: elongation of "
        f"the bandage × {whole:.2f}, of each spring × {each:.2f}; with the same "
        f"springs × {same[0] / narrow[0]:.2f} and × {same[1] / narrow[1]:.2f}: the "
        "rule keeps the compliance of the bandage, not the load of a spring"
    )
    return Found(
        whole,
        text,
        judged([abs(whole - 1) < 0.2, abs(each - 1) < 0.2], abs(whole - 1) < 0.2),
    )
