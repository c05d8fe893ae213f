"""Cooling of a wall by a liquid that flows past it: properties of water, its boiling,
and the jacket as a link."""

from typing import Annotated, Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._base._faults import Faults, Issues
from .._base._part import Part, part, positive_quantity, structural, takes_values
from .._base._quantity import Quantity, Scalar, Values
from ..hybrid.arrays import Array
from ..profiles import AbstractProfile, faults_of_sign
from .materials import ROOM
from .network import AbstractCoefficient, AbstractLink, Surroundings, Temperatures

#: standard atmosphere (Pa)
ATMOSPHERE = 101_325.0

# --- water ---------------------------------------------------------------------------

#: IAPWS R7-97(2012), table 34: coefficients n₁…n₁₀ of the saturation line
_SATURATION = (
    *(
        0.11670521452767e4,
        -0.72421316703206e6,
        -0.17073846940092e2,
        0.12020824702470e5,
        -0.32325550322333e7,
    ),
    *(
        0.14915108613530e2,
        -0.48232657361591e4,
        0.40511340542057e6,
        -0.23855557567849,
        0.65017534844798e3,
    ),
)
#: IAPWS SR6-08(2011), tables 1 to 4: coefficients and exponents of specific heat (over
#: the gas constant), specific volume, viscosity and conductivity
_HEAT_A = ((-1.661470539e5, 4), (2.708781640e6, 5), (-1.557191544e8, 7))
_HEAT_B = (
    (-8.237426256e-1, 2),
    (1.908956353, 3),
    (-2.017597384, 4),
    (8.546361348e-1, 5),
)
_VOLUME_A = (
    (6.74458446e3, 4),
    (-2.22521604e5, 5),
    (1.00231247e8, 7),
    (-1.63552118e9, 8),
    (8.32299658e9, 9),
)
_VOLUME_B = (
    *((5.78545292e-3, 1), (-1.53195665e-2, 2), (3.11337859e-2, 3)),
    *((-4.23546241e-2, 4), (3.38713507e-2, 5), (-1.19946761e-2, 6)),
)
_VISCOSITY = (
    (280.68e-6, -1.9),
    (511.45e-6, -7.7),
    (61.131e-6, -19.6),
    (0.45903e-6, -40.0),
)
_CONDUCTIVITY = ((1.6630, -1.15), (-1.7781, -3.4), (1.1567, -6.0), (-0.432115, -7.6))
_GAS = 461.51805  # J/(kg·K)


@takes_values
def saturation_temperature(
    pressure: Annotated[float, Quantity("Pa", "absolute pressure", 611.213, 22.064e6)],
) -> Values:
    """Temperature (K) at which water boils under an absolute pressure (Pa).

        E = β² + n₃ β + n₆,  F = n₁ β² + n₄ β + n₇,  G = n₂ β² + n₅ β + n₈,  D = 2 G/(−F
        − √(F² − 4 E G)) T_s = ½ [n₁₀ + D − √((n₁₀ + D)² − 4 (n₉ + n₁₀ D))],  β = (p/1
        MPa)^¼

    Raises `InputError` outside 611.213 Pa…22.064 MPa.

    Reference: IAPWS R7-97(2012), eq. (31).

    Example:
        >>> round(float(sb.thermal.saturation_temperature("1 bar")), 6)
        372.755919
    """
    n = (0.0, *_SATURATION)
    beta = (pressure * 1e-6) ** 0.25
    E, F, G = (
        factor * beta**2 + n[i] * beta + n[i + 3]
        for factor, i in ((1.0, 3), (n[1], 4), (n[2], 5))
    )
    D = 2 * G / (-F - (F**2 - 4 * E * G) ** 0.5)
    return 0.5 * (n[10] + D - ((n[10] + D) ** 2 - 4 * (n[9] + n[10] * D)) ** 0.5)


class Liquid(Part):
    """Properties of a coolant, constant in a run: those at its mean temperature.

    - `density` `ρ` (kg/m³), `specific_heat` `c_p` (J/(kg·K)), `conductivity` `λ`
      (W/(m·K)), `viscosity` `μ` (Pa·s)
    - `boiling` (K): temperature at which it boils under its pressure

    Example:
        >>> glycol = sb.thermal.Liquid(1055.0, 3500.0, 0.42, "2.2 mPa*s", "107 degC")  # half water; assumption
        >>> round(float(glycol.prandtl), 4)
        18.3333
    """

    density: Scalar = positive_quantity("kg/m^3", "density of the coolant")
    specific_heat: Scalar = positive_quantity(
        "J/(kg*K)", "specific heat of the coolant"
    )
    conductivity: Scalar = positive_quantity(
        "W/(m*K)", "thermal conductivity of the coolant"
    )
    viscosity: Scalar = positive_quantity("Pa*s", "dynamic viscosity of the coolant")
    boiling: Scalar = positive_quantity("K", "temperature at which the coolant boils")

    @property
    def prandtl(self) -> Scalar:
        """`Pr = μ c_p/λ`."""
        return self.viscosity * self.specific_heat / self.conductivity


@takes_values
def water(
    temperature: Annotated[
        float, Quantity("K", "temperature of the water", 273.15, 383.15)
    ] = ROOM,
    pressure: Annotated[
        float, Quantity("Pa", "absolute pressure of the water", 611.213, 22.064e6)
    ] = ATMOSPHERE,
) -> Liquid:
    """Water at a temperature (K), which boils as its absolute pressure (Pa) has it.

    - `temperature`: the mean of inlet and outlet; from 20 to 60 °C the viscosity falls
      by more than half, and the coefficient of Dittus–Boelter rises by 41 %
    - `pressure`: a gauge shows the excess over the atmosphere, 1.01 bar less

    Raises `InputError` outside 0…110 °C and 611.213 Pa…22.064 MPa.

    Reference: density, specific heat, viscosity, conductivity IAPWS SR6-08(2011), eqs.
    (1), (2), (7), (8), for 0.1 MPa (1 MPa changes them by some 0.1 %); boiling
    `saturation_temperature`.

    Example:
        >>> liquid = sb.thermal.water("25 degC", pressure="2 bar")
        >>> [round(float(x), 4) for x in (liquid.density, liquid.specific_heat, liquid.conductivity)]
        [997.047, 4181.4462, 0.6065]
        >>> round(1e6 * float(liquid.viscosity), 3), round(float(liquid.boiling) - 273.15, 3)
        (889.997, 120.212)
    """
    T = temperature
    alpha = 10 / (593 - T)
    beta = 10 / (T - 232)
    tau = T / 10
    ratio = T / 300
    curved = sum(k * (k + 1) * c * alpha ** (k + 2) for c, k in _HEAT_A)
    curved = curved + sum(k * (k + 1) * c * beta ** (k + 2) for c, k in _HEAT_B)
    volume = (
        1.93763157e-2
        + sum(c * alpha**k for c, k in _VOLUME_A)
        + sum(c * beta**k for c, k in _VOLUME_B)
    )
    return Liquid(
        density=1e5 / (10 * _GAS * volume),
        specific_heat=_GAS * (8.983025854 - tau * curved),
        conductivity=sum(c * ratio**k for c, k in _CONDUCTIVITY),
        viscosity=sum(c * ratio**k for c, k in _VISCOSITY),
        boiling=saturation_temperature(pressure),
    )


def dittus_boelter(speed: Values, diameter: Values, liquid: Liquid) -> Values:
    """Heat transfer coefficient (W/(m²·K)) of a liquid that a wall heats, in turbulent
    flow through a channel.

        Nu = 0.023 Re^0.8 Pr^0.4,  h = Nu λ/D,  Re = ρ v D/μ

    - `speed` `v` (m/s)
    - `diameter` `D` (m): hydraulic, `4 A/P` of the section `A` with the wetted
      perimeter `P`, of a gap twice its width

    Holds for `Re` > 10,000, 0.7 < `Pr` < 160, lengths above 10 `D`, smooth walls and
    small differences of temperature (within some 25 %); this function does not check
    it, a scene with a `WaterJacket` warns.

    Reference: F. W. Dittus, L. M. K. Boelter, *Univ. Calif. Publ. Eng.* 2 (1930) 443,
    in the form of F. P. Incropera, D. P. DeWitt, *Fundamentals of Heat and Mass
    Transfer*, eq. (8.60).

    Example:
        >>> round(float(sb.thermal.dittus_boelter(1.0, 0.04, sb.thermal.water("40 degC"))))
        4366
    """
    nusselt = 0.023 * _reynolds(speed, diameter, liquid) ** 0.8 * liquid.prandtl**0.4
    return nusselt * liquid.conductivity / diameter


def _reynolds(speed: Values, diameter: Values, liquid: Liquid) -> Values:
    return liquid.density * speed * diameter / liquid.viscosity


#: range of Dittus–Boelter: Reynolds number, length over diameter, Prandtl number
_TURBULENT = 1e4
_LONG = 10.0
_PRANDTL = (0.7, 160.0)

# --- the jacket ----------------------------------------------------------------------


class WaterJacket(AbstractLink):
    """Coolant that flows past a wall: a stream of steady state over a wall of one
    temperature (ε-NTU).

        Q = C (1 − e^{−NTU}) (T_w − T_in),  NTU = h A/C,  C = ρ c_p V̇,  T_out = T_in +
        Q/C

    - `a`: the wetted place, a face of a wall or a lump
    - `b`: a `Reservoir` with the temperature of the inlet `T_in`
    - `area` `A` (m²) that it wets
    - `flow` `V̇` (m³/s): volume flow, a number or a profile over time. While nothing
      flows the wall gives it no heat
    - `liquid`: `water("40 degC")`, at the mean temperature of the stream
    - `coefficient` `h` (W/(m²·K)): a number, a law of the speed `V̇/section` (m/s), or
      `None`: `dittus_boelter`
    - `section` (m²) of the channel, its hydraulic `diameter` (m) and its `length` (m),
      where the coefficient needs them

    Of a place of several nodes `area` and `flow` are those of each. The stream has no
    heat capacity of its own: it follows the wall at once, instead of within the time
    that the water takes to pass, `V/V̇`. While the wall warms up it takes less heat
    than the water in the jacket would. A stirred tank is a `Lump` between two other
    links, but then `1 − e^{−NTU}` becomes `NTU/(1 + NTU)`, up to 23 % less.

    Where the wetted wall becomes as hot as the liquid boils the log has the event
    `coolant_boils`; the coefficient of a liquid goes on there.

    Reference: Incropera & DeWitt (see `dittus_boelter`), table 11.3, `C_r = 0`.

    Example:
        >>> liquid = sb.thermal.water("40 degC")
        >>> jacket = sb.thermal.WaterJacket("rim.back", 0.8, "200 l/min", liquid, coefficient=4000.0)
        >>> round(float(jacket.conductance(400.0, 303.15, sb.thermal.Surroundings())), 1)
        2856.6
    """

    a: str = structural()
    area: Scalar = positive_quantity("m^2", "wetted area")
    flow: AbstractProfile | Any = positive_quantity(
        "m^3/s", "volume flow of the coolant"
    )
    liquid: Liquid = part(Liquid)
    coefficient: AbstractCoefficient | Any = positive_quantity(
        "W/(m^2*K)", "heat transfer coefficient of the coolant", default=None
    )
    section: Scalar | None = positive_quantity(
        "m^2", "section of the channel", default=None
    )
    diameter: Scalar | None = positive_quantity(
        "m", "hydraulic diameter of the channel", default=None
    )
    length: Scalar | None = positive_quantity(
        "m", "length of the channel", default=None
    )
    b: str = structural(default="water")

    def rate(self, around: Surroundings) -> Float[Array, ""]:
        """Heat capacity rate `ρ c_p V̇` of the stream (W/K)."""
        flow = around.flow if isinstance(self.flow, AbstractProfile) else self.flow
        return self.liquid.density * self.liquid.specific_heat * jnp.asarray(flow)

    def conductance(
        self, T_a: Temperatures, T_b: Temperatures, around: Surroundings
    ) -> Temperatures | None:
        rate = self.rate(around)
        flows = rate > 0
        C = jnp.where(flows, rate, 1.0)  # (a power of 0 has no derivative)
        h = self.coefficient
        v = C / (self.liquid.density * self.liquid.specific_heat)
        if self.section is not None:
            v = v / jnp.asarray(self.section)
        if h is None:
            h = dittus_boelter(v, self.diameter, self.liquid)
        elif isinstance(h, AbstractCoefficient):
            h = h.value(v, T_a, T_b)
        return jnp.where(flows, -C * jnp.expm1(-h * jnp.asarray(self.area) / C), rate)

    @property
    def largest_flow(self) -> Scalar:
        """Maximum volume flow (m³/s)."""
        return (
            self.flow.scale() if isinstance(self.flow, AbstractProfile) else self.flow
        )

    def faults(self, path: str) -> Faults:
        """Errors of a channel that the coefficient lacks or does not need, and of a
        flow below 0."""
        names = ("section", "diameter", "length")
        faults = Issues()
        needed = (
            names
            if self.coefficient is None
            else names[: isinstance(self.coefficient, AbstractCoefficient)]
        )
        for name in names:
            if name in needed and getattr(self, name) is None:
                hint = "give it, or the heat transfer coefficient as a number"
                faults.add(
                    f"{path}.{name}",
                    "is missing: the coefficient follows from the channel",
                    hint,
                )
            elif name not in needed and getattr(self, name) is not None:
                faults.add(
                    f"{path}.{name}",
                    "has no effect on this coefficient",
                    "leave out one of the two",
                )
        if isinstance(self.flow, AbstractProfile):
            faults += faults_of_sign(
                self.flow, f"{path}.flow", "m^3/s", "the coolant flows one way"
            )
        return faults

    def outside_range(self) -> list[str]:
        """Numbers that Dittus–Boelter does not hold for, in words (concrete values
        only)."""
        if (
            self.coefficient is not None
            or self.diameter is None
            or self.section is None
            or self.length is None
        ):
            return []
        liquid = self.liquid
        D = float(self.diameter)
        phrases = list[str]()
        (low, high) = _PRANDTL
        flows = np.atleast_1d(
            np.asarray(getattr(self.flow, "values", self.largest_flow), float)
        )
        Re = float(_reynolds(1.0 / float(self.section), D, liquid))  # of 1 m³/s
        enough = f"{60_000 * _TURBULENT / Re:.4g} l/min"
        least = np.min(flows[flows > 0], initial=np.inf)
        lasts = (
            np.diff(
                np.asarray(getattr(self.flow, "times", np.zeros(flows.size)), float)
            )
            > 0
        )
        if Re * least < _TURBULENT:
            phrases.append(
                f"Re = {Re * least:.4g} is below 10,000, reached at {enough}"
            )
        elif np.any(
            lasts
            & (np.minimum(flows[1:], flows[:-1]) == 0)
            & (np.maximum(flows[1:], flows[:-1]) > 0)
        ):
            phrases.append(
                f"Re falls below 10,000 while the flow passes through values under {enough}"
            )
        if not low < (Pr := float(liquid.prandtl)) < high:
            phrases.append(f"Pr = {Pr:.4g} is not within {low:g}…{high:g}")
        if (over := float(self.length) / D) < _LONG:
            phrases.append(f"length/diameter = {over:.4g} is below {_LONG:g}")
        return phrases
