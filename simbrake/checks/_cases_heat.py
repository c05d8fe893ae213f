"""Validation of heat: thermal networks alone, and brakes whose friction fades as they warm up."""

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from diffrax import Tsit5
from jaxtyping import Float
from scipy.integrate import quad
from scipy.special import erfc

from .._parts._scene import Scene
from .._run._networks import simulate_heat
from ..friction import ConstantFriction, LinearFade, ProductFriction
from ..hybrid._arrays import Array
from ..profiles import Constant
from ..thermal._builders import lumped_heat
from ..thermal._heat import ConstantPartition, Heat
from ..thermal._material import ROOM, Material
from ..thermal._network import Conductance, Lump, Source, Wall
from ._cases_band import stop_scene
from ._validation import FORM, Case, cases_of, cases_of_run

_K, _A = 50.0, 1.4e-5  # conductivity and diffusivity of the half-spaces
_STEEL = Material(_K, 7800.0, _K / (7800.0 * _A))

# --- lumps ------------------------------------------------------------------------------------------------------------


def _temperatures(
    subject: str,
    heat: Heat,
    source: str,
    truths: dict[float, tuple[str, float]],
    tolerance: float = 1e-9,
    rtol: float = 1e-12,
    less: float = 0.0,
) -> list[Case]:
    """Cases of the first temperature of a network: names and truths at times (s); `less`: taken from it (K)."""
    rows = [
        (name, source, truth, lambda T, i=i: T[i, 0] - less) for i, (name, truth) in enumerate(truths.values(), start=1)
    ]
    return cases_of(subject, lambda: simulate_heat(heat, [0.0, *truths], rtol=rtol).temperature, tolerance, rows)


def lump_cases() -> list[Case]:
    """Two lumps that come to one temperature."""
    C, G = 15.0, 10.0
    heat = Heat((Lump("a", C, 373.15), Lump("b", C, 273.15)), (Conductance("a", "b", G),))
    truths = {t: (f"T1 at {t} s", 323.15 + 50 * math.exp(-2 * G / C * t)) for t in (0.1, 0.5, 1.0)}
    return _temperatures("two lumps", heat, f"{FORM}T_m + ΔT/2 · e^(−2Gt/C)", truths)


# --- walls ------------------------------------------------------------------------------------------------------------

#: depths of the layers (m) and their rises (K) at the end
Rises: TypeAlias = tuple[Float[np.ndarray, " layer"], Float[np.ndarray, " layer"]]
_LAYERS = 36, 108


def _heated(q: float, end: float) -> list[Rises]:
    """Two half-spaces of so many layers under one constant flux, in one network."""
    walls = [Wall(f"w{layers}", _STEEL, 0.048, 1.0, layers) for layers in _LAYERS]
    heat = Heat(tuple(walls), sources=tuple(Source(f"{wall.name}.front", Constant(q)) for wall in walls))
    run = simulate_heat(heat, [0.0, end], rtol=1e-9, solver=Tsit5())
    rises = np.split(np.asarray(run.temperature)[-1] - ROOM, [_LAYERS[0]])
    return [((np.arange(n) + 0.5) * 0.048 / n, rise) for n, rise in zip(_LAYERS, rises, strict=True)]


def half_space_cases() -> list[Case]:
    """Constant flux into a half-space: order of the layers, surface and depth on the finest."""
    q, t = 1e6, 2.0

    def exact(x: float | Float[np.ndarray, " layer"]) -> Float[Array, "*layer"]:
        spread = np.exp(-(x**2) / (4 * _A * t))
        return q / _K * (2 * np.sqrt(_A * t / math.pi) * spread - x * erfc(x / np.sqrt(4 * _A * t)))

    def order(found: list[Rises]) -> float:
        errors = [np.abs(rise - exact(x)).max() for x, rise in found]
        return math.log(errors[0] / errors[1], 3)

    def inside(depth: float) -> Callable[[list[Rises]], float]:
        return lambda found: float(found[1][1][int(np.argmin(np.abs(found[1][0] - depth)))])

    source = "Carslaw & Jaeger 2.9: half-space under constant flux"
    # of 108 layers some have their centres just 2 and 10 mm deep
    rows = [
        ("order of the layers", "second-order finite volumes", 2.0, order, 0.05),
        ("surface", source, float(exact(0.0)), lambda found: found[1][1][0] + q * found[1][0][0] / _K),
        ("2 mm deep", source, float(exact(0.002)), inside(0.002)),
        ("10 mm deep", source, float(exact(0.010)), inside(0.010), 2e-3),
    ]
    return cases_of("half-space", lambda: _heated(q, t), 1e-3, rows)


# --- brakes -----------------------------------------------------------------------------------------------------------


def fade_cases() -> list[Case]:
    """A stop on a rigid band that heats one insulated lump, on whose temperature the friction depends."""
    J, R, T0, w0, n, f = 800.0, 0.725, 8e3, 20.0, 20, 0.35
    slope, capacity = 2e-3, 2e4
    z = math.tan(math.radians(13.5) / 2)
    warming = J * w0**2 / (2 * capacity)

    def torque(w: float, slope: float) -> float:
        now = f * (1 - slope * J * (w0**2 - w**2) / (2 * capacity))
        return R * T0 * (((1 + now * z) / (1 - now * z)) ** n - 1)

    def fading(slope: float) -> Scene:
        law = ProductFriction(ConstantFriction(f), (LinearFade(slope, ROOM, 0.0, 0.0),))  # pyright: ignore
        heat = lumped_heat(rim=capacity, partition=ConstantPartition(1.0), rim_cooling=0.0)
        scene = stop_scene(C=None, law=law, end=10.0)
        return Scene(scene.brake, scene.duty, scene.initial, scene.end_time, heat)

    time = quad(lambda w: J / torque(w, slope), 0.0, w0, epsabs=1e-13, epsrel=1e-13)[0]
    by_quadrature = "quadrature ∫ J dω/M(T(ω)), T = T_0 + J(ω_0² − ω²)/2mc"
    warm = [
        ("stopping time", by_quadrature, time, "stopping_time"),
        ("temperature at rest", f"{FORM}T_0 + Jω_0²/2mc", ROOM + warming, "end_temperatures.0"),
        ("heat-balance residual", "first law", 0.0, "energy.heat_closure", 1e-12),
    ]
    cold = [("stopping time", f"{FORM}J ω_0/M: as without heat", J * w0 / torque(w0, 0.0), "stopping_time")]
    return cases_of_run("stop with fade", fading(slope), warm, 1e-9, 1e-11) + cases_of_run(
        "stop with no fade", fading(0.0), cold, 1e-9, 1e-11
    )


CASES = (
    lump_cases,
    half_space_cases,
    fade_cases,
)
