"""Validation of mechanisms: staged brake, chain, bands, rope, phases, retarders, linings by themselves and floating.

The truths are in `truths.csv`, made by `tests/oracles/truths.py`, which imports nothing of simbrake.
"""

import functools
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from case_tools import (
    FORM,
    Case,
    Row,
    Slope,
    cases_of,
    cases_with_slopes,
    differentiated,
    frozen_cases,
)
from scipy.optimize import brentq
from stop_scenes import closed_form, staged_pair, stop_scene, time_of

from simbrake import (
    Band,
    Bandage,
    Brake,
    Constant,
    ConstantFriction,
    Duty,
    Heat,
    Initial,
    Lining,
    PiecewiseLinear,
    Pulley,
    Result,
    Scene,
    Segments,
    StribeckFriction,
    TorqueLoad,
    with_values,
)
from simbrake._physics._assemble import assemble
from simbrake._physics._mechanism import SLIP
from simbrake.brakes import BondedLinings
from simbrake.friction import PressureFactor, ProductFriction
from simbrake.loads import HydrodynamicBrake, ViscousDrag
from simbrake.results import ring_wear
from simbrake.thermal import ConstantPartition, Convection, FrictionHeat, Lump, Reservoir, SpeedCoefficient

#: bodies of a staged brake with heat, as the nodes are counted
_PLACES = ("rim", "linings", "band")


def _staged(lever: PiecewiseLinear, load: float, stiffness: float | None, preload: Any, end: float) -> Scene:
    """Eight linings of 33°, with a grip that depends on the tensions of the band."""
    linings = Lining(ConstantFriction(0.40), np.full(8, math.radians(33.0)), 0.03)
    bandage = Bandage(45.0, ConstantFriction(0.22), preload)
    brake = Brake(Pulley(0.59, 900.0), Band(0.64, stiffness), linings, bandage)
    return Scene(brake, Duty(lever, TorqueLoad(Constant(load))), Initial(20.0), end)


def staged_cases() -> list[Case]:
    """T_on, the lock and the stop in stage 3 of an elastic staged brake under a rising lever."""
    scene = _staged(PiecewiseLinear([0.0, 7.5], [200.0, 30200.0]), 300.0, 3e5, 900.0, 4.0)

    def tension(result: Result) -> float:
        return result.series([float(result.internal_slip_time)]).slack_tension[0]

    return frozen_cases(
        "staged stop",
        scene,
        {
            "internal slip": "internal_slip_time",
            "tension at internal slip": tension,
            "external lock": "external_lock_time",
            "stopping time": "stopping_time",
        },
        {
            "∂(stopping time)/∂f_i": "brake.bandage.friction.coefficient",
            "∂(stopping time)/∂N_p": "brake.bandage.preload",
        },
    )


def pressed_stage_cases() -> list[Case]:
    """All stages of a staged brake of one lining whose inner friction falls with the pressure, and the pull that holds.

    Stage 2 is uniformly decelerated on both sides of the inner face; in stage 3 the band only just holds the bandage:
    `R_b (T_1 − T_0) = R f(p) N`, `N = (T_1 + T_0) sin β/2 + N_pre`, `p = N/A`.
    """
    T_0, J, J_b, R, R_b, half, w0, pre, area = 6e3, 900.0, 45.0, 0.59, 0.64, math.radians(55.0), 20.0, 2e3, 0.02
    f, reference, exponent = 0.12, 6e5, 0.35
    ratio = (1 + 0.4 * math.tan(half)) / (1 - 0.4 * math.tan(half))

    def load(T_1: float) -> float:
        return (T_1 + T_0) * math.sin(half) + pre

    def friction(T_1: float, exponent: float = exponent) -> float:
        return f * (1 + load(T_1) / area / reference) ** -exponent

    def torque(T_1: float, exponent: float = exponent) -> float:
        return R * friction(T_1, exponent) * load(T_1)

    def stages(exponent: float = exponent) -> tuple[float, float, float]:
        """Times of the lock and of the stop, and the tension that holds the bandage."""
        inner = torque(ratio * T_0, exponent)
        lock = J_b * w0 / (R_b * T_0 * (ratio - 1) - inner)
        holds: Any = brentq(lambda T: R_b * (T - T_0) - torque(T, exponent), T_0, ratio * T_0, xtol=1e-10)
        return lock, lock + (J * w0 - inner * lock) / torque(holds, exponent), holds

    (lock, stop, holds), h = stages(), 1e-3
    slope = sum(c * (stages(exponent + k * h)[1] - stages(exponent - k * h)[1]) for k, c in ((1, 45), (2, -9), (3, 1)))
    source = f"{FORM}R_b (T_1 − T_0) = R f(p) N in stage 3"

    def at_one_second(name: str) -> Any:
        return lambda result: getattr(result.series([1.0]).pairs["internal"], name)[0, 0]

    rows: list[Row] = [
        ("external lock", f"{FORM}J_b ω_0/(R_b T_0 (μ − 1) − R f(p) N)", lock, "external_lock_time"),
        ("stopping time", source, stop, "stopping_time"),
        ("tension in stage 3", source, holds, lambda result: result.series([1.0]).tension[0, 0]),
        ("load in stage 3", f"{source}; N", load(holds), at_one_second("normal_load")),
        ("friction in stage 3", f"{source}; f(p)", friction(holds), at_one_second("friction_coefficient")),
        (
            "∂(stopping time)/∂m",
            f"{source}, differences",
            slope / (60 * h),
            Slope("brake.bandage.friction.factors.0.exponent"),
            1e-9,
        ),
    ]
    law = ProductFriction(ConstantFriction(f), (PressureFactor(reference, exponent),))
    linings = Lining(ConstantFriction(0.4), np.array([2 * half]), 0.03)
    bandage = Bandage(J_b, law, pre, area)
    brake = Brake(Pulley(R, J), Band(R_b), linings, bandage)
    scene = Scene(brake, Duty(Constant(T_0), TorqueLoad()), Initial(w0), 40.0)
    return cases_with_slopes("staged, friction under pressure", scene, rows, tolerance=1e-10)


def staged_heat_cases() -> list[Case]:
    """Heat of both pairs of a staged brake into rim, linings and band; linings on a ring that turns are cooled.

    The stop is that of the subject "staged pair": torque `c t` of the band, capacity `M_i` of the internal pair.
    """
    J_1, J_2, w0, M, c, end, cold = 40.0, 4.0, 20.0, 600.0, 500.0, 3.0, 300.0
    C, start, area, h_0, v_0 = (50.0, 20.0, 10.0), 400.0, 0.2, 2.0, 3.0
    share, band, beyond = 0.8, 0.6, 0.4
    t_0 = M * (J_1 + J_2) / (c * J_1)
    first = np.polynomial.Polynomial([w0, 0.0, -c / (2 * (J_1 + J_2))])
    both = np.polynomial.Polynomial([first(t_0), (M - c * t_0) / J_2, -c / (2 * J_2)])
    lock = t_0 + float(np.max(both.roots()))
    # ω of the rim less ω of the ring after t_0, until the lock; then that of the rim alone
    apart = np.polynomial.Polynomial([first(t_0), -M / J_1]) - both
    after = first(t_0) - M * (lock - t_0) / J_1
    internal = M * apart.integ()(lock - t_0) + J_1 * after**2 / 2
    external = (J_1 + J_2) * w0**2 / 2 - internal
    turned = (first**2).integ()(t_0) + (both**2).integ()(lock - t_0)

    def cooled(area: complex) -> complex:
        return cold + (start - cold) * np.exp(-h_0 * area * (end + turned / v_0**2) / C[1])

    lumps = tuple(Lump(name, C[i], start if name == "linings" else cold) for i, name in enumerate(_PLACES))
    air = Convection("linings", area, SpeedCoefficient(h_0, v_0, 2.0))
    rubs = FrictionHeat("rim", None, ConstantPartition(share), "rim")
    outer = FrictionHeat("band", None, ConstantPartition(band), "linings", "rim", beyond)
    heat = Heat((*lumps, Reservoir("air", cold)), (air,), rubs, (), None, *_PLACES, external=outer)
    scene = staged_pair(M, J_1, J_2, w0, ([0.0, 10.0], [0.0, 10.0 * c]), end)
    scene = Scene(scene.brake, scene.duty, scene.initial, end, heat)
    work, lost = f"{FORM}work of the pairs, over C", f"{FORM}e^(−∫ h_0 A (1 + (R_b ω_b/v_0)²) dt/C)"
    rows = [
        ("rim", work, cold + (share * internal + beyond * external) / C[0], "end_temperatures.0"),
        ("linings", lost, cooled(area).real, "end_temperatures.1"),
        ("band", work, cold + band * external / C[2], "end_temperatures.2"),
        ("∂(linings)/∂A", f"{lost}, differentiated", differentiated(cooled, area), Slope("heat.links.0.area"), 1e-9),
        ("heat to the rim", work, share * internal + beyond * external, "energy.heat_to_metal"),
        ("heat to the band", work, band * external, "energy.heat_to_band"),
        (
            "heat lost",
            f"{work}, + C ΔT of the linings",
            (1 - share) * internal + C[1] * (start - cooled(area).real),
            "energy.heat_lost",
        ),
    ]
    return cases_with_slopes("heat of a staged brake", scene, rows, lambda result: result.end_temperatures[1])


def flutter_cases() -> list[Case]:
    """A lining that slides at a steady speed, its friction falling with the speed: small swings grow or decay.

    With `N = (T + T_0) tan(β/2)`; mass, damping and stiffness act as `m`, `c = (1 − f tan β/2) D` and
    `k = (1 − f tan β/2) C`, as friction takes its part of the tension's changes.
    """
    N, m, c, k, f_s, f_k, v_s, z = 1e4, 8.0, 200.0, 60e3, 0.45, 0.30, 0.5, math.tan(math.radians(20.0))

    @jax.jit
    def jacobian(scene: Scene, stretch: Any) -> Any:
        system, y, mode = assemble(scene)
        mode = mode._replace(band=jnp.asarray(SLIP), own=mode.own._replace(linings=jnp.ones(1, jnp.int32)))

        def rates(own: Any) -> Any:
            moved = y._replace(own=y.own._replace(e=own[:1], v=own[1:]))
            found = system.rhs(jnp.asarray(0.0), moved, mode).own
            return jnp.concatenate([found.e, found.v])

        return jax.jacfwd(rates)(jnp.stack([stretch, 0.0]))

    def swing(v: float) -> complex:
        """Eigenvalue of the swing at the slip speed `v`."""
        f = f_k + (f_s - f_k) * math.exp(-v / v_s)
        left, slack = 1 - f * z, (N / z - f * N) / 2
        band = Band(0.9, k / left, Segments(1e3, c / left, c / left))
        lining = Lining(StribeckFriction(f_s, f_k, v_s, 1.0), [2 * math.atan(z)], mass=m)
        brake = Brake(Pulley(0.9, 1e3), band, lining)
        scene = Scene(brake, Duty(Constant(slack), TorqueLoad()), Initial(v / 0.9), 1.0)
        found = jacobian(scene, (slack + f * N) * left / k)
        return max(np.linalg.eigvals(np.asarray(found)), key=lambda x: x.imag)

    def rate(v: float) -> float:
        return (N * (f_s - f_k) / v_s * math.exp(-v / v_s) - c) / (2 * m)

    source = f"{FORM}(−N f'(v) − c)/2m"
    rows = [
        (f"growth rate at {v} m/s", source, rate(v), functools.partial(lambda found, v: found(v).real, v=v))
        for v in (0.5, 2.0)
    ]
    rows += [
        (
            "frequency at 0.5 m/s",
            f"{FORM}√(k/m − σ²)",
            math.sqrt(k / m - rate(0.5) ** 2),
            lambda found: found(0.5).imag,
        ),
        (
            "speed above which it decays",
            f"{FORM}v_s ln(N (f_s − f_k)/(c v_s))",
            v_s * math.log(N * (f_s - f_k) / (c * v_s)),
            lambda found: brentq(lambda v: found(v).real, 1.0, 2.0, xtol=1e-13),
        ),
    ]
    return cases_of("flutter of a lining", lambda: swing, 1e-10, rows)


def elongation_cases() -> list[Case]:
    """A stop on a soft band whose stiffness follows from arcs, gaps and ends."""
    geometry = BondedLinings(
        *(2e9, 13e-4, 0.3, 0.5, math.radians(4.0)), lining_modulus=1e8, lining_area=60e-4, lining_radius=0.71
    )

    def longest(result: Result) -> Any:
        return result.series([float(result.full_slip_time)]).elongation[0]

    return frozen_cases(
        "elongation of the band",
        stop_scene(n=4, beta=50.0, C=geometry),
        {"full slip": "full_slip_time", "stopping time": "stopping_time", "elongation at full slip": longest},
        {"∂(stopping time)/∂E_1": "brake.band.stiffness.modulus"},
    )


def retarder_cases() -> list[Case]:
    """A hydrodynamic brake and viscous drag slow a pulley down; the band is open."""
    k, c, low = 14.0, 60.0, 4.0
    time = 800.0 / c * math.log(20.0 * (k * low + c) / (low * (k * 20.0 + c)))
    scene = stop_scene(C=None, T0=0.0, end=time)
    scene = Scene(
        scene.brake,
        scene.duty,
        scene.initial,
        time,
        shaft=(HydrodynamicBrake(k), ViscousDrag(c)),
    )
    return frozen_cases(
        "retarders on the shaft",
        scene,
        {"speed": "record.y_end.omega"},
        {"∂(speed)/∂k": "shaft.0.coefficient"},
        of=lambda result: result.record.y_end.omega,
    )


# --- linings of a staged brake: their travel and their contact --------------------------------------------------------

#: of linings that may lift off: preload (N), mass (kg), radius of the centre of mass (m)
_PRELOAD, _MASS, _RADIUS = np.array([9e3, 9e3, 400.0, 9e3, 500.0, 9e3, 9e3, 9e3]), np.full(8, 2.0), 0.61


def _floating(tension: float, load: float, preload: Any, mass: Any) -> Scene:
    """A staged brake on a rigid band under a constant lever, with centrifugal forces on its linings."""
    scene = _staged(PiecewiseLinear([0.0, 7.5], [tension, tension]), load, None, preload, 3.0)
    return with_values(
        scene, {"brake.bandage.mass": mass, "brake.bandage.mass_radius": _RADIUS, "brake.bandage.preload": preload}
    )


def _travel_and_contact(result: Result) -> tuple[Any, Any]:
    """Angle of the stop, and the time at which lining 3 lifts off: that of the first row in which it is off."""
    record = result.record
    lifted = jnp.asarray(record.modes.lifted)[:, 2] != 0
    return result.stopping_angle, jnp.asarray(record.rows.t)[jnp.argmax(lifted)]


def travel_cases() -> list[Case]:
    """Linings carried round by the rim while they are braked: two thirds of a turn after a whole one."""
    scene = _floating(2e3, 300.0, np.full(8, 1e5), np.zeros(8))

    def depth(lining: int):
        return lambda result: ring_wear(result, 11, 2e-14).depth[lining]

    return frozen_cases(
        "linings that travel",
        scene,
        {"lining 1": depth(0), "lining 6": depth(5), "travel": "stopping_angle"},
        {
            "∂(travel)/∂T_0": Slope("duty.slack_tension.values", 0),
            "∂(travel)/∂f": Slope("brake.linings.friction.coefficient", 0),
        },
        of=_travel_and_contact,
        program="floating linings",
    )


def lift_cases() -> list[Case]:
    """Linings that their centrifugal force lifts off the rim, as the load speeds up the pulley under a light band."""
    T_0, load, r, R_b, J, f_i = 150.0, 3e3, 0.59, 0.64, 945.0, 0.22
    mu, s = closed_form(n=8, f=0.40, beta=33.0)["Pi"] ** (1 / 8), math.sin(math.radians(16.5))
    pressed = T_0 * (mu ** np.arange(1, 9) + mu ** np.arange(8)) * s + _PRELOAD
    drive = load - R_b * T_0 * (mu**8 - 1)

    def time(i: int, mass: complex = 2.0, preload: complex | None = None) -> complex:
        force = pressed[i] if preload is None else pressed[i] - _PRELOAD[i] + preload
        return (np.sqrt(force / (mass * _RADIUS)) - 20.0) * J / drive

    grip = r * f_i * np.maximum(pressed - _MASS * _RADIUS * (20.0 + drive / J * 2.9) ** 2, 0.0).sum()
    source = f"{FORM}m r_m ω² = (T_i + T_(i−1)) sin β/2 + N_pre, ω = ω_0 + M t/J"
    preload = float(_PRELOAD[2])
    rows = [
        ("lining 3 lifts off", source, time(2).real, time_of("lining_lift_off", 3)),
        ("lining 5 lifts off", source, time(4).real, time_of("lining_lift_off", 5)),
        (
            "capacity after it",
            f"{FORM}r f_i Σ max((T_i + T_(i−1)) sin β/2 + N_pre − m r_m ω², 0)",
            grip,
            lambda result: result.series([2.9]).pairs["internal"].capacity[0],
        ),
        (
            "∂(lining 3 lifts off)/∂m",
            f"{source}, differentiated",
            differentiated(lambda x: time(2, x), 2.0),
            Slope("brake.bandage.mass.2", 1),
            1e-9,
        ),
        (
            "∂(lining 3 lifts off)/∂N_pre",
            f"{source}, differentiated",
            differentiated(lambda x: time(2, preload=x), preload),
            Slope("brake.bandage.preload.2", 1),
            1e-9,
        ),
    ]
    scene = _floating(T_0, load, _PRELOAD, _MASS)
    return cases_with_slopes("linings that lift off", scene, rows, _travel_and_contact, program="floating linings")


CASES = (
    staged_cases,
    pressed_stage_cases,
    staged_heat_cases,
    flutter_cases,
    retarder_cases,
    elongation_cases,
    travel_cases,
    lift_cases,
)
