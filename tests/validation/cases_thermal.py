"""Validation of the thermal laws of a run: cooling, contacts, shares of the heat, rims,
maximum temperatures."""

import dataclasses
import functools
import math

import numpy as np
from case_tools import (
    AIR,
    EXPLICIT,
    FORM,
    STIFF,
    Slope,
    cases_of,
    cases_with_slopes,
    differentiated,
)
from scenes import lining_ratio, stop_scene

from simbrake import (
    Heat,
    PiecewiseLinear,
    PowerShares,
    cyclic_steady_state,
    simulate,
    with_values,
)
from simbrake.thermal import (
    Conductance,
    Convection,
    FrictionHeat,
    Lump,
    Reservoir,
    Source,
    SpeedCoefficient,
    TemperatureCoefficient,
    TransmissionPartition,
)

# the stop of the cases: linings, their angle (rad) and area, friction, radius, inertia,
# lever and speed at the start
_N = 4
_BETA = math.radians(50.0)
_AREA = 0.002
_F = 0.35
_R = 0.725
_J = 800.0
_T0 = 2e3
_W0 = 20.0
# s
_RELEASE = 6.0
_END = 10.0


def _mu(f=_F):
    """Ratio of the tensions at either side of a lining that slides."""
    return lining_ratio(f, _BETA)


_TORQUE = _R * _T0 * (_mu() ** _N - 1)
_STOP = _J * _W0 / _TORQUE
_WORK = 0.5 * _J * _W0**2

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(80)


def _over(function, a, b):
    """The integral of a smooth function, its numbers and ends also complex."""
    return (
        complex(np.sum(_WEIGHTS * function(a + 0.5 * (b - a) * (_NODES + 1))))
        * 0.5
        * (b - a)
    )


def _root(function, slope, x):
    """The root of a smooth function near `x` by Newton's method, its numbers also
    complex."""
    for _ in range(60):
        x = x - function(x) / slope(x)
    return x


# --- a stop beside which bodies cool, warm up and touch each other ------------------

#: number of each body among the temperatures
_AT = {
    name: i for i, name in enumerate(("rim", "lining", "by speed", "free", "varying"))
}


def _ends(result):
    return result.end_temperatures


@functools.cache
def _stop_with_bodies():
    """A stop of a rigid band, held and then released, with bodies of which each shows
    one law of the network."""
    table = TransmissionPartition(
        *(
            [200.0, 280.0, 420.0],
            [4.0, 6.0, 14.0],
            [5.0, 9.0, 20.0],
            [3.0, 5.0, 11.0],
            [1e-3, 2e-3, 5e-3],
        ),
        *(0.028, 4.0, 0.3, 0.03, 0.7, 0.006, 2.0),
    )
    bodies = (
        Lump("rim", 1.2e3, AIR),
        Lump("lining", 900.0, 330.0),
        Lump("by speed", 500.0, 400.0),
        Lump("free", 150.0, 390.0),
        Lump("varying", 400.0, 310.0, 1.5e-3, 300.0),
        Reservoir("air", AIR),
    )
    links = (
        Convection("by speed", 0.5, SpeedCoefficient(8.0, 2.0, 0.8)),
        Convection("free", 0.7, TemperatureCoefficient(3.0, 0.5)),
    )
    heat = Heat(
        bodies, links, FrictionHeat("rim", "lining", table), (Source("varying", 2e3),)
    )
    lever = PiecewiseLinear([0.0, _RELEASE, _RELEASE, _END], [_T0, _T0, 0.0, 0.0])
    scene = stop_scene(n=_N, beta=50.0, C=None, lever=lever, end=_END)
    scene = with_values(scene, {"brake.linings.area": _AREA})
    return dataclasses.replace(scene, heat=heat, power_shares=PowerShares(0.02, 0.1))


def _of_the_stop(subject, rows, tolerance=1e-12):
    explicit = EXPLICIT
    return cases_with_slopes(
        subject,
        _stop_with_bodies(),
        rows,
        _ends,
        tolerance,
        "stop with bodies",
        explicit,
    )


def _by(path, body):
    return Slope(f"heat.{path}", _AT[body])


def _end(body):
    return f"end_temperatures.{_AT[body]}"


def speed_cooling_cases():
    """A lump that the air cools as fast as the pulley turns, which slows down at a
    constant rate."""

    def cooled(at_rest=8.0, speed=2.0, exponent=0.8):
        fast = (
            _over(lambda v: (1 + (v / speed) ** 2) ** (exponent / 2), 0.0, _R * _W0)
            * _STOP
            / (_R * _W0)
        )
        return AIR + (400.0 - AIR) * np.exp(
            -0.5 / 500.0 * at_rest * (fast + _END - _STOP)
        )

    source = f"{FORM}θ_0 e^(−(A/C) ∫ h dt), h = h_0 [1 + (v/v_0)²]^(m/2), v in a straight line to 0"
    rows = [("temperature", source, cooled().real, _end("by speed"))]
    for name, field, slope in (
        ("h_0", "at_rest", differentiated(lambda x: cooled(at_rest=x), 8.0)),
        ("v_0", "speed", differentiated(lambda x: cooled(speed=x), 2.0)),
        ("m", "exponent", differentiated(lambda x: cooled(exponent=x), 0.8)),
    ):
        at = _by(f"links.0.coefficient.{field}", "by speed")
        rows.append((f"∂T/∂{name}", "the same, differentiated", slope, at, 1e-10))
    return _of_the_stop("convection by speed", rows)


def free_convection_cases():
    """A lump that cools by free convection with the square root of its excess
    temperature."""

    def rise(h):
        """Root of `½ ln((s − 1)/(s + 1)) + arctan s = that at the start − (h_1 A/C)
        t`, `s⁴ = θ² + 1`."""

        def course(s):
            return 0.5 * np.log((s - 1) / (s + 1)) + np.arctan(s)

        start = ((390.0 - AIR) ** 2 + 1) ** 0.25
        lag = h * 0.7 / 150.0 * _END
        s = _root(
            lambda s: course(s) - course(start) + lag,
            lambda s: 2 * s**2 / (s**4 - 1),
            start - 4.0,
        )
        return (s**4 - 1) ** 0.5

    source = f"{FORM}½ ln((s − 1)/(s + 1)) + arctan s falls by (h_1 A/C) t, s⁴ = θ² + 1"
    rows = [
        ("temperature", source, AIR + rise(3.0).real, _end("free")),
        (
            "∂T/∂h_1",
            f"{source}, differentiated",
            differentiated(rise, 3.0),
            _by("links.1.coefficient.at_one_kelvin", "free"),
            1e-10,
        ),
    ]
    return _of_the_stop("free convection", rows)


def capacity_cases():
    """A heated lump whose capacity grows with its temperature: the balance of its heat
    is a quadratic."""

    def warmed(b=1.5e-3):
        content = 10.0 + b * 10.0**2 / 2 + 2e3 * _END / 400.0
        return 300.0 + ((1 + 2 * b * content) ** 0.5 - 1) / b

    source = f"{FORM}P t = C [(T − T_r) + b (T − T_r)²/2] from T_0"
    rows = [
        ("temperature", source, warmed().real, _end("varying")),
        (
            "∂T/∂b",
            f"{source}, differentiated",
            differentiated(warmed, 1.5e-3),
            _by("bodies.4.capacity_slope", "varying"),
            1e-10,
        ),
    ]
    return _of_the_stop("capacity by temperature", rows)


def partition_cases():
    """Heat of a stop divided by the transmissions to both sides of the contact, which
    change with the temperature."""

    def share(T, alpha=6.0):
        """Of the metal, from the resistances in series on either side, between 280 and
        420 K."""
        x = (T - 280.0) / 140.0
        polished = alpha + (14.0 - alpha) * x
        matte = 9.0 + 11.0 * x
        band = 5.0 + 6.0 * x
        to_metal = 1 / polished + 0.028 / 4.0 + 1 / matte
        to_lining = (
            1 / matte + (2e-3 + 3e-3 * x) / 0.3 + 0.03 / 0.7 + 0.006 / 2.0 + 1 / band
        )
        return to_lining / (to_metal + to_lining)

    def rim(electrical=0.02, mechanical=0.1, alpha=6.0):
        heat = (1 - electrical - mechanical) * _WORK / 1.2e3

        def taken(T):
            return _over(lambda x: 1 / share(x, alpha), AIR, T) - heat

        return _root(taken, lambda T: 1 / share(T, alpha), AIR + 0.5 * heat)

    source = "quadrature: ∫ C dT/a(T) = heat, a = K_1/(K_1 + K_2) by hand"
    lining = 330.0 + (0.88 * _WORK - 1.2e3 * (rim().real - AIR)) / 900.0
    rows = [
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
    return _of_the_stop("partition by transmission", rows)


# --- maximum temperature, and the cyclic steady state -------------------------------

# J/K, W/K, s, s, W
_COOLED = 2e4
_COOLING = 6e3
_CYCLE = 10.0
_PULSE = 2.0
_POWER = 4e3
_BLOCKS = np.linspace(300.0, 600.0, 20)  # J/K, each cooled through 50 W/K


@functools.cache
def _repeated():
    """A stop whose heat goes into a cooled rim, beside blocks that a source heats at
    the begin of each cycle."""
    bodies = (
        Lump("blocks", _BLOCKS, AIR, count=_BLOCKS.size),
        Reservoir("air", AIR),
        Lump("rim", _COOLED, AIR),
    )
    links = Conductance("rim", "air", _COOLING), Conductance("blocks", "air", 50.0)
    power = PiecewiseLinear([0.0, _PULSE, _PULSE, _CYCLE], [_POWER, _POWER, 0.0, 0.0])
    pair = FrictionHeat("rim", None, 1.0)
    heat = Heat(bodies, links, pair, (Source("blocks", power),), rim="rim")
    lever = PiecewiseLinear([0.0, _CYCLE], [_T0, _T0])
    return stop_scene(n=_N, beta=50.0, C=None, lever=lever, end=_CYCLE, heat=heat)


def _rise(t, start=0.0, cooling=_COOLING):
    """Rise of the rim in a stop, from that at its start: the heat of friction falls in
    a straight line to 0."""
    b = cooling / _COOLED
    most = _TORQUE * _W0 / cooling
    return start * np.exp(-b * t) + most * (
        (1 + 1 / (b * _STOP)) * (1 - np.exp(-b * t)) - t / _STOP
    )


def _greatest(cooling=_COOLING, start=0.0):
    """Time at which the rim is hottest in a stop, and its rise then."""
    b = cooling / _COOLED
    most = _TORQUE * _W0 / cooling
    t = np.log(1 + b * _STOP * (1 - start / most)) / b
    return t, most * (1 - t / _STOP)


def _hottest(result):
    return result.peak_rim_temperature.value


def repeated_stop_cases():
    """Maximum of the temperature in a stop, and the temperatures with which a cycle of
    stops ends as it began."""
    t, most = _greatest()
    solver = STIFF
    first = functools.cache(lambda: simulate(_repeated(), rtol=1e-12, solver=solver))
    cycle = functools.cache(
        lambda: cyclic_steady_state(
            _repeated(), tolerance=1e-10, rtol=1e-12, solver=solver
        )
    )

    b = _COOLING / _COOLED
    start = _rise(_STOP) * math.exp(-b * (_CYCLE - _STOP)) / -math.expm1(-b * _CYCLE)
    hottest = _greatest(start=start)[1]
    k = 50.0 / _BLOCKS
    block = (
        _POWER
        / _BLOCKS.size
        / 50.0
        * -np.expm1(-k * _PULSE)
        * np.exp(-k * (_CYCLE - _PULSE))
        / -np.expm1(-k * _CYCLE)
    )

    linear = f"{FORM}C θ' = P_0 (1 − t/t_s) − G θ"
    series = "geometric series of the cycles: θ(t_c)/(1 − e^(−G t_c/C))"
    slope = differentiated(lambda G: _greatest(G)[1], _COOLING)
    rows = [
        (
            "rise",
            f"{linear}: (P_0/G)(1 − t/t_s)",
            most,
            lambda r: r["peak_rim_temperature"] - AIR,
        ),
        (
            "time",
            f"{linear}: ln(1 + G t_s/C)/(G/C)",
            t,
            lambda r: r.peak_rim_temperature.time,
            1e-6,
        ),
    ]
    cycles = [
        (
            "rim",
            f"{linear}; {series}",
            start,
            lambda found: found.scene.heat.bodies[2].temperature - AIR,
        ),
        (
            "block 1",
            f"{FORM}{series}",
            block[0],
            lambda found: found.scene.heat.bodies[0].temperature[0] - AIR,
        ),
        (
            "block 20",
            f"{FORM}{series}",
            block[-1],
            lambda found: found.scene.heat.bodies[0].temperature[-1] - AIR,
        ),
        (
            "rim at the end",
            f"{linear}; {series}",
            start,
            lambda found: found.result.end_temperatures[-1] - AIR,
        ),
        (
            "greatest rise",
            f"{linear}; {series}",
            hottest,
            lambda found: found.result["peak_rim_temperature"] - AIR,
        ),
    ]
    slopes = [
        ("∂(rise)/∂G", f"{linear}, differentiated", slope, Slope("heat.links.0.value"))
    ]
    return [
        *cases_of("maximum temperature", first, 1e-10, rows),
        *cases_with_slopes(
            "maximum temperature", _repeated(), slopes, _hottest, 1e-7, solver=EXPLICIT
        ),
        *cases_of("cyclic steady state", cycle, 1e-9, cycles),
    ]


CASES = (
    speed_cooling_cases,
    free_convection_cases,
    capacity_cases,
    partition_cases,
    repeated_stop_cases,
)
