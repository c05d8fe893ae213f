"""Validation of the thermal laws of a run: cooling, contacts, shares of the heat, rims, maximum temperatures."""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from case_tools import AIR, EXPLICIT, FORM, SIGMA, STIFF, Case, Row, Slope, cases_of, cases_with_slopes, differentiated
from scipy.linalg import expm
from stop_scenes import stop_scene

from simbrake import (
    Constant,
    ConstantFriction,
    Duty,
    Heat,
    Initial,
    Lining,
    PiecewiseLinear,
    PowerShares,
    Pulley,
    Result,
    Scene,
    TorqueLoad,
    cyclic_steady_state,
    simulate,
    with_values,
)
from simbrake.brakes import LinedBand, MultiBandBrake
from simbrake.thermal import (
    Conductance,
    ConstantPartition,
    Convection,
    FrictionHeat,
    Lump,
    MetalContact,
    Radiation,
    Reservoir,
    Source,
    SpeedCoefficient,
    TemperatureCoefficient,
    ThermalContact,
    TransmissionPartition,
)

# the stop of the cases: linings, their angle (rad) and area, friction, radius, inertia, lever and speed at the start
_N, _BETA, _AREA, _F, _R, _J, _T0, _W0 = 4, math.radians(50.0), 0.002, 0.35, 0.725, 800.0, 2e3, 20.0
_RELEASE, _END = 6.0, 10.0  # s


def _mu(f: complex = _F) -> Any:
    """Ratio of the tensions at either side of a lining that slides."""
    return (1 + f * math.tan(_BETA / 2)) / (1 - f * math.tan(_BETA / 2))


_TORQUE = _R * _T0 * (_mu() ** _N - 1)
_STOP = _J * _W0 / _TORQUE
_WORK = 0.5 * _J * _W0**2

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(80)


def _over(function: Callable[[Any], Any], a: complex, b: complex) -> complex:
    """The integral of a smooth function, its numbers and ends also complex."""
    return complex(np.sum(_WEIGHTS * function(a + 0.5 * (b - a) * (_NODES + 1)))) * 0.5 * (b - a)


def _root(function: Callable[[Any], Any], slope: Callable[[Any], Any], x: complex) -> complex:
    """The root of a smooth function near `x` by Newton's method, its numbers also complex."""
    for _ in range(60):
        x = x - function(x) / slope(x)
    return x


# --- a stop beside which bodies cool, warm up and touch each other ----------------------------------------------------

#: number of each body among the temperatures
_AT = {
    name: i
    for i, name in enumerate(
        ("rim", "lining", "by speed", "covered", "radiating", "free", "varying", "plate", "1", "2", "3", "4", "a", "b")
    )
}


def _ends(result: Result) -> Any:
    return result.end_temperatures


@functools.cache
def _stop_with_bodies() -> Scene:
    """A stop of a rigid band, held and then released, with bodies of which each shows one law of the network."""
    table = TransmissionPartition(
        *([200.0, 280.0, 420.0], [4.0, 6.0, 14.0], [5.0, 9.0, 20.0], [3.0, 5.0, 11.0], [1e-3, 2e-3, 5e-3]),
        *(0.028, 4.0, 0.3, 0.03, 0.7, 0.006, 2.0),
    )
    law = MetalContact([50.0, 20.0], [0.15, 0.1], [2e-6, 1e-6], 1e8)
    bodies = (
        *(Lump("rim", 1.2e3, AIR), Lump("lining", 900.0, 330.0)),
        *(Lump("by speed", 500.0, 400.0), Lump("covered", 300.0, 400.0), Lump("radiating", 200.0, 600.0)),
        *(Lump("free", 150.0, 390.0), Lump("varying", 400.0, 310.0, 1.5e-3, 300.0)),
        *(Lump("plate", 600.0, 420.0), Lump("blocks", [80.0, 90.0, 100.0, 110.0], 300.0, count=_N)),
        *(Lump("a", 400.0, 420.0), Lump("b", 300.0, 300.0)),
        *(Reservoir("air", AIR), Reservoir("space", 0.0)),
    )
    links = (
        Convection("by speed", 0.5, SpeedCoefficient(8.0, 2.0, 0.8)),
        Convection("covered", 0.6, 30.0, covered=0.3),
        Radiation("radiating", 0.8, 0.9, "space", covered=0.3),
        Convection("free", 0.7, TemperatureCoefficient(3.0, 0.5)),
        ThermalContact("plate", "blocks", 2e-4, opens=True, law=law),
        ThermalContact("a", "b", 6e-4, opens=True, law=law),
    )
    heat = Heat(bodies, links, FrictionHeat("rim", "lining", table), (Source("varying", 2e3),))
    lever = PiecewiseLinear([0.0, _RELEASE, _RELEASE, _END], [_T0, _T0, 0.0, 0.0])
    scene = stop_scene(n=_N, beta=50.0, C=None, lever=lever, end=_END)
    scene = with_values(scene, {"brake.linings.area": _AREA})
    return dataclasses.replace(scene, heat=heat, power_shares=PowerShares(0.02, 0.1))


def _of_the_stop(subject: str, rows: Sequence[Row], tolerance: float = 1e-12) -> list[Case]:
    explicit = EXPLICIT
    return cases_with_slopes(subject, _stop_with_bodies(), rows, _ends, tolerance, "stop with bodies", explicit)


def _by(path: str, body: str) -> Slope:
    return Slope(f"heat.{path}", _AT[body])


def _end(body: str) -> str:
    return f"end_temperatures.{_AT[body]}"


def speed_cooling_cases() -> list[Case]:
    """A lump that the air cools as fast as the pulley turns, which slows down at a constant rate."""

    def cooled(at_rest: complex = 8.0, speed: complex = 2.0, exponent: complex = 0.8) -> Any:
        fast = _over(lambda v: (1 + (v / speed) ** 2) ** (exponent / 2), 0.0, _R * _W0) * _STOP / (_R * _W0)
        return AIR + (400.0 - AIR) * np.exp(-0.5 / 500.0 * at_rest * (fast + _END - _STOP))

    source = f"{FORM}θ_0 e^(−(A/C) ∫ h dt), h = h_0 [1 + (v/v_0)²]^(m/2), v in a straight line to 0"
    rows: list[Row] = [("temperature", source, cooled().real, _end("by speed"))]
    for name, field, slope in (
        ("h_0", "at_rest", differentiated(lambda x: cooled(at_rest=x), 8.0)),
        ("v_0", "speed", differentiated(lambda x: cooled(speed=x), 2.0)),
        ("m", "exponent", differentiated(lambda x: cooled(exponent=x), 0.8)),
    ):
        at = _by(f"links.0.coefficient.{field}", "by speed")
        rows.append((f"∂T/∂{name}", "the same, differentiated", slope, at, 1e-10))
    return _of_the_stop("convection by speed", rows)


def covered_cases() -> list[Case]:
    """Convection and radiation from a surface of which linings cover 0.3, until the band is released."""

    def convecting(share: complex = 0.3) -> Any:
        open_for = (1 - share) * _RELEASE + _END - _RELEASE
        return AIR + (400.0 - AIR) * np.exp(-30.0 * 0.6 / 300.0 * open_for)

    def radiating(share: complex = 0.3) -> complex:
        open_for = (1 - share) * _RELEASE + _END - _RELEASE
        return 600.0 * (1 + 3 * 0.9 * SIGMA * 0.8 / 200.0 * 600.0**3 * open_for) ** (-1 / 3)

    rows: list[Row] = []
    for i, name, of, source in (
        (1, "covered", convecting, f"{FORM}θ_0 e^(−(hA/C)((1 − κ) t_1 + t − t_1))"),
        (2, "radiating", radiating, f"{FORM}T_0 (1 + 3 (εσA/C) T_0³ ((1 − κ) t_1 + t − t_1))^(−1/3)"),
    ):
        kind = "convection" if name == "covered" else "radiation"
        slope = differentiated(of, 0.3)
        rows.append((f"temperature by {kind}", source, of().real, _end(name)))
        rows.append((f"∂T/∂κ by {kind}", f"{source}, differentiated", slope, _by(f"links.{i}.covered", name), 1e-10))
    return _of_the_stop("covered surface", rows)


def free_convection_cases() -> list[Case]:
    """A lump that cools by free convection with the square root of its excess temperature."""

    def rise(h: complex) -> complex:
        """Root of `½ ln((s − 1)/(s + 1)) + arctan s = that at the start − (h_1 A/C) t`, `s⁴ = θ² + 1`."""

        def course(s: complex) -> Any:
            return 0.5 * np.log((s - 1) / (s + 1)) + np.arctan(s)

        start = ((390.0 - AIR) ** 2 + 1) ** 0.25
        lag = h * 0.7 / 150.0 * _END
        s = _root(lambda s: course(s) - course(start) + lag, lambda s: 2 * s**2 / (s**4 - 1), start - 4.0)
        return (s**4 - 1) ** 0.5

    source = f"{FORM}½ ln((s − 1)/(s + 1)) + arctan s falls by (h_1 A/C) t, s⁴ = θ² + 1"
    rows: list[Row] = [
        ("temperature", source, AIR + rise(3.0).real, _end("free")),
        (
            "∂T/∂h_1",
            f"{source}, differentiated",
            differentiated(rise, 3.0),
            _by("links.3.coefficient.at_one_kelvin", "free"),
            1e-10,
        ),
    ]
    return _of_the_stop("free convection", rows)


def capacity_cases() -> list[Case]:
    """A heated lump whose capacity grows with its temperature: the balance of its heat is a quadratic."""

    def warmed(b: complex = 1.5e-3) -> complex:
        content = 10.0 + b * 10.0**2 / 2 + 2e3 * _END / 400.0
        return 300.0 + ((1 + 2 * b * content) ** 0.5 - 1) / b

    source = f"{FORM}P t = C [(T − T_r) + b (T − T_r)²/2] from T_0"
    rows: list[Row] = [
        ("temperature", source, warmed().real, _end("varying")),
        (
            "∂T/∂b",
            f"{source}, differentiated",
            differentiated(warmed, 1.5e-3),
            _by("bodies.6.capacity_slope", "varying"),
            1e-10,
        ),
    ]
    return _of_the_stop("capacity by temperature", rows)


def partition_cases() -> list[Case]:
    """Heat of a stop divided by the transmissions to both sides of the contact, which change with the temperature."""

    def share(T: Any, alpha: complex = 6.0) -> Any:
        """Of the metal, from the resistances in series on either side, between 280 and 420 K."""
        x = (T - 280.0) / 140.0
        polished, matte, band = alpha + (14.0 - alpha) * x, 9.0 + 11.0 * x, 5.0 + 6.0 * x
        to_metal = 1 / polished + 0.028 / 4.0 + 1 / matte
        to_lining = 1 / matte + (2e-3 + 3e-3 * x) / 0.3 + 0.03 / 0.7 + 0.006 / 2.0 + 1 / band
        return to_lining / (to_metal + to_lining)

    def rim(electrical: complex = 0.02, mechanical: complex = 0.1, alpha: complex = 6.0) -> complex:
        heat = (1 - electrical - mechanical) * _WORK / 1.2e3

        def taken(T: complex) -> complex:
            return _over(lambda x: 1 / share(x, alpha), AIR, T) - heat

        return _root(taken, lambda T: 1 / share(T, alpha), AIR + 0.5 * heat)

    source = "quadrature: ∫ C dT/a(T) = heat, a = K_1/(K_1 + K_2) by hand"
    split = f"{FORM}share of J ω_0²/2"
    lining = 330.0 + (0.88 * _WORK - 1.2e3 * (rim().real - AIR)) / 900.0
    rows: list[Row] = [
        ("rim", source, rim().real, _end("rim")),
        ("lining", f"{source}; the rest", lining, _end("lining")),
        (
            "∂(rim)/∂α_1",
            f"{source}, differentiated",
            differentiated(lambda x: rim(alpha=x), 6.0),
            _by("friction.partition.alpha_1.1", "rim"),
            1e-10,
        ),
    ]
    shares: list[Row] = [
        ("heat", split, 0.88 * _WORK, "energy.friction_heat"),
        ("electrical", split, 0.02 * _WORK, "energy.electrical_work"),
        ("mechanical", split, 0.1 * _WORK, "energy.mechanical_work"),
    ]
    shares += [
        (f"∂(rim)/∂({name})", f"{source}, differentiated", slope, Slope(f"power_shares.{name}", 0), 1e-10)
        for name, slope in (
            ("electrical", differentiated(lambda x: rim(electrical=x), 0.02)),
            ("mechanical", differentiated(lambda x: rim(mechanical=x), 0.1)),
        )
    ]
    return [*_of_the_stop("partition by transmission", rows), *_of_the_stop("power shares", shares)]


def metal_contact_cases() -> list[Case]:
    """Bodies that exchange heat through metal contacts under the pressures of the linings, until the band opens."""

    def conductances(hardness: complex, sigma: complex, pressures: Any) -> Any:
        k, m = 2 * 50.0 * 20.0 / (50.0 + 20.0), math.hypot(0.15, 0.1)
        return 1.25 * k * m / ((2e-6) ** 2 + sigma**2) ** 0.5 * (pressures / hardness) ** 0.95

    def ends(hardness: complex = 1e8, sigma: complex = 1e-6) -> tuple[Any, Any]:
        tensions = _T0 * _mu() ** np.arange(_N + 1)
        turning = (tensions[1:] + tensions[:-1]) * math.sin(_BETA / 2) / _AREA
        resting = np.full(_N, 2 * _T0 * math.sin(_BETA / 2) / _AREA)
        many: Any = np.array([420.0, *(300.0,) * _N])
        one: Any = np.array([420.0, 300.0])
        for pressures, lasts in ((turning, _STOP), (resting, _RELEASE - _STOP)):
            g = conductances(hardness, sigma, pressures)
            many = expm(_relaxing([600.0, 80.0, 90.0, 100.0, 110.0], 2e-4 * g) * lasts) @ many
            one = expm(_relaxing([400.0, 300.0], [6e-4 * np.mean(g)]) * lasts) @ one
        return many, one

    law, source = "links.4.law", f"{FORM}e^(At), h_c = 1.25 k_s (m/σ)(p/H)^0.95 (Yovanovich), p = (T_i + T_(i−1)) s/A"
    many, one = ends()
    rows: list[Row] = [
        ("plate", source, many[0], _end("plate")),
        ("block at lining 1", source, many[1], _end("1")),
        ("block at lining 4", source, many[4], _end("4")),
        ("pair at the mean pressure", source, one[0], _end("a")),
    ]
    # below p/H = 1e-6 the law is made linear, which is felt to 1e-9 here
    slopes: list[Row] = [
        (f"∂(block 4)/∂{name}", f"{source}, differentiated", slope, _by(f"{law}.{path}", "4"), 1e-8)
        for name, slope, path in (
            ("H", differentiated(lambda x: ends(hardness=x)[0][4], 1e8), "hardness"),
            ("σ_2", differentiated(lambda x: ends(sigma=x)[0][4], 1e-6), "roughness.1"),
        )
    ]
    return _of_the_stop("metal contact", [*rows, *slopes], 1e-10)


def _relaxing(capacities: Sequence[float], conductances: Any) -> Any:
    """Matrix of `dT/dt` of a body that gives heat to others, each through its conductance (W/K)."""
    g, C = np.asarray(conductances), np.asarray(capacities)
    A = np.zeros((C.size, C.size), g.dtype)
    A[0, 1:], A[1:, 0] = g, g
    A[0, 0] = -np.sum(g)
    A[1:, 1:] = -np.diag(g)
    return A / C[:, None]


# --- several rims -----------------------------------------------------------------------------------------------------


def rims_cases() -> list[Case]:
    """Two bands on a rim each: every rim takes the heat of its own linings, and every lining its own."""
    friction, counts, tensions, angle = (0.35, 0.25), (2, 3), (0.75 * 3e3, 0.25 * 3e3), 0.8
    metal, rims, each = 0.9, np.array([2e3, 1.5e3]), 400.0
    forces = []
    for f, n, T in zip(friction, counts, tensions, strict=True):
        mu = (1 + f * math.tan(angle / 2)) / (1 - f * math.tan(angle / 2))
        forces.append(T * (mu - 1) * mu ** np.arange(n))
    work = _WORK / np.sum(np.concatenate(forces))
    bands = tuple(
        LinedBand(Lining(ConstantFriction(f), np.full(n, angle)), share=T)
        for f, n, T in zip(friction, counts, tensions, strict=True)
    )
    heat = Heat(
        (Lump("rims", rims, AIR, count=2), Lump("linings", each, AIR, count=5)),
        friction=FrictionHeat("rims", "linings", ConstantPartition(metal)),
    )
    brake = MultiBandBrake(Pulley(_R, _J), _R, bands)
    scene = Scene(brake, Duty(Constant(3e3), TorqueLoad(Constant(0.0))), Initial(_W0), 12.0, heat)
    source = f"{FORM}a J ω_0²/2 · F/Σ F over C, F = T (μ − 1) μ^(i − 1)"
    rows: list[Row] = [
        (f"rim {j + 1}", source, metal * work * np.sum(own) / rims[j], _warmer(j)) for j, own in enumerate(forces)
    ]
    found = (1 - metal) * work * np.concatenate(forces) / each
    rows += [(f"lining {i + 1}", source, found[i], _warmer(2 + i)) for i in (0, 4)]
    run = functools.partial(simulate, scene, rtol=1e-12, solver=EXPLICIT)
    return cases_of("several rims", run, 1e-11, rows)


def _warmer(i: int) -> Callable[[Result], Any]:
    return lambda result: result.end_temperatures[i] - AIR


# --- maximum temperature, and the cyclic steady state -----------------------------------------------------------------

_COOLED, _COOLING, _CYCLE, _PULSE, _POWER = 2e4, 6e3, 10.0, 2.0, 4e3  # J/K, W/K, s, s, W
_BLOCKS = np.linspace(300.0, 600.0, 20)  # J/K, each cooled through 50 W/K


@functools.cache
def _repeated() -> Scene:
    """A stop whose heat goes into a cooled rim, beside blocks that a source heats at the begin of each cycle."""
    bodies = Lump("blocks", _BLOCKS, AIR, count=_BLOCKS.size), Reservoir("air", AIR), Lump("rim", _COOLED, AIR)
    links = Conductance("rim", "air", _COOLING), Conductance("blocks", "air", 50.0)
    power = PiecewiseLinear([0.0, _PULSE, _PULSE, _CYCLE], [_POWER, _POWER, 0.0, 0.0])
    pair = FrictionHeat("rim", None, ConstantPartition(1.0))
    heat = Heat(bodies, links, pair, (Source("blocks", power),), rim="rim")
    lever = PiecewiseLinear([0.0, _CYCLE], [_T0, _T0])
    return dataclasses.replace(stop_scene(n=_N, beta=50.0, C=None, lever=lever, end=_CYCLE), heat=heat)


def _rise(t: float, start: float = 0.0, cooling: complex = _COOLING) -> Any:
    """Rise of the rim in a stop, from that at its start: the heat of friction falls in a straight line to 0."""
    b, most = cooling / _COOLED, _TORQUE * _W0 / cooling
    return start * np.exp(-b * t) + most * ((1 + 1 / (b * _STOP)) * (1 - np.exp(-b * t)) - t / _STOP)


def _greatest(cooling: complex = _COOLING, start: float = 0.0) -> tuple[Any, Any]:
    """Time at which the rim is hottest in a stop, and its rise then."""
    b, most = cooling / _COOLED, _TORQUE * _W0 / cooling
    t = np.log(1 + b * _STOP * (1 - start / most)) / b
    return t, most * (1 - t / _STOP)


def _hottest(result: Result) -> Any:
    return result.peak_rim_temperature.value


def repeated_stop_cases() -> list[Case]:
    """Maximum of the temperature in a stop, and the temperatures with which a cycle of stops ends as it began."""
    t, most = _greatest()
    solver = STIFF
    first = functools.cache(lambda: simulate(_repeated(), rtol=1e-12, solver=solver))
    cycle = functools.cache(lambda: cyclic_steady_state(_repeated(), tolerance=1e-10, rtol=1e-12, solver=solver))

    b = _COOLING / _COOLED
    start = _rise(_STOP) * math.exp(-b * (_CYCLE - _STOP)) / -math.expm1(-b * _CYCLE)
    hottest = _greatest(start=start)[1]
    k = 50.0 / _BLOCKS
    block = (
        _POWER / _BLOCKS.size / 50.0 * -np.expm1(-k * _PULSE) * np.exp(-k * (_CYCLE - _PULSE)) / -np.expm1(-k * _CYCLE)
    )

    linear = f"{FORM}C θ' = P_0 (1 − t/t_s) − G θ"
    series = "geometric series of the cycles: θ(t_c)/(1 − e^(−G t_c/C))"
    slope = differentiated(lambda G: _greatest(G)[1], _COOLING)
    rows: list[Row] = [
        ("rise", f"{linear}: (P_0/G)(1 − t/t_s)", most, lambda r: r["peak_rim_temperature"] - AIR),
        ("time", f"{linear}: ln(1 + G t_s/C)/(G/C)", t, lambda r: r.peak_rim_temperature.time, 1e-6),
    ]
    cycles: list[Row] = [
        ("rim", f"{linear}; {series}", start, lambda found: found.scene.heat.bodies[2].temperature - AIR),
        ("block 1", f"{FORM}{series}", block[0], lambda found: found.scene.heat.bodies[0].temperature[0] - AIR),
        ("block 20", f"{FORM}{series}", block[-1], lambda found: found.scene.heat.bodies[0].temperature[-1] - AIR),
        ("rim at the end", f"{linear}; {series}", start, lambda found: found.result.end_temperatures[-1] - AIR),
        ("greatest rise", f"{linear}; {series}", hottest, lambda found: found.result["peak_rim_temperature"] - AIR),
    ]
    slopes: list[Row] = [("∂(rise)/∂G", f"{linear}, differentiated", slope, Slope("heat.links.0.value"))]
    return [
        *cases_of("maximum temperature", first, 1e-10, rows),
        *cases_with_slopes("maximum temperature", _repeated(), slopes, _hottest, 1e-7, solver=EXPLICIT),
        *cases_of("cyclic steady state", cycle, 1e-9, cycles),
    ]


CASES = (
    speed_cooling_cases,
    covered_cases,
    free_convection_cases,
    capacity_cases,
    partition_cases,
    metal_contact_cases,
    rims_cases,
    repeated_stop_cases,
)
