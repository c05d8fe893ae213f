"""Thermal stabilisation: in repeated braking the flange reaches the rim's temperature, and heat flow into it ceases.

`simbrake run` integrates one cycle from cold. Run as a script, it also computes the cyclic steady state directly and
compares the two: the distribution of the friction heat and the part into the flange (S: that flow ceases). Sources and
assumptions as in the tripping scenario.
"""

import math

import simbrake as sb

PERIOD = 90.0  # s between brake applications; assumption
BANDS = 2


def heat() -> sb.Heat:
    """Rim, linings and band as lumps, and the structure of the pulley behind the rim."""
    track = BANDS * 2 * math.pi * 0.590 * 0.220  # m², V table 1
    steel, lining, band = sb.material("steel_20L"), sb.material("FK-24A"), sb.material("band_steel")
    lumps = sb.lumped_heat(
        rim=float(steel.density * steel.specific_heat) * track * 0.025,  # J/K; V: rim of 25 mm
        linings=float(lining.density * lining.specific_heat) * 0.75 * track * 0.030,  # V: linings of 30 mm
        band=float(band.density * band.specific_heat) * 0.75 * track * 0.006,  # V: band of 6 mm
        partition=sb.thermal.EffusivityPartition(steel, lining),
        rim_cooling=25.0 * 2 * track,  # W/K; assumption: 25 W/(m²·K) inside and outside
        lining_to_band=float(lining.conductivity) * 0.75 * track / 0.030,
        band_cooling=10.0 * 0.75 * track,  # assumption
        permissible=273.15 + 250.0,  # K; assumption
    )
    return sb.thermal.with_pulley_structure(lumps, steel, rim_place="rim", inside=15.0)


def scene() -> sb.Scene:
    """One cycle: the driller brakes a turning pulley, which stops and is held until the next application."""
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=0.590, inertia=1200.0),
            band=sb.Band(radius=0.623),  # rigid: elasticity does not matter for the heat of a whole stop
            linings=sb.uniform_linings(20, math.radians(270.0), sb.ConstantFriction(0.35)),
        ),
        duty=sb.Duty(
            slack_tension=sb.ramp(2.0e3, 24.0e3, 0.0, 0.35),
            load=sb.HookLoad(mass=60.0e3, drum_radius=0.40, line_count=8),
        ),
        initial=sb.Initial(omega=24.0),
        end_time=PERIOD,
        heat=heat(),
    )


def main() -> None:
    import jax

    jax.config.update("jax_enable_x64", True)
    cold = sb.simulate(scene())
    found = sb.cyclic_steady_state(scene())
    print(found.result)
    print(f"found with {found.cycles} cycles; change over a cycle {found.change:.1e} K")
    for name, run in (("first cycle, from cold", cold), ("cyclic steady state", found.result)):
        given = float(run.energy["heat_to_metal"])
        taken = float(run.stored_heat["flange"])
        hot = dict(zip(run.nodes, run.end_temperatures - 273.15, strict=True))
        print(
            f"{name:24} rim {float(hot['rim']):7.2f} °C, flange {float(hot['flange']):7.2f} °C; "
            f"of {given / 1e3:.1f} kJ into the metal the flange keeps {taken / 1e3:.2f} kJ"
        )


if __name__ == "__main__":
    main()
