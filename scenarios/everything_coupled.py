"""Everything at once: a staged brake with an elastic band, linings with separate walls,
a layered rim, fade, memory.

Two brake applications of a hook on a U2-5-5: lowered, braked, held, released, lowered
again and braked hotter. One system of equations: k sliding linings on the band,
internal pair with centrifugal force, band compliance from geometry, thermal network
with the pulley's structure and contacts that open, friction with memory and oil on two
linings, auxiliary brakes and bearings on the shaft, layers of an elastic rope, every
event located. Values that the papers (V, K, Z) do not give are marked as assumptions.
"""

import dataclasses
import math

import simbrake as sb

# m: V table 1, V, V, K
TRACK_RADIUS = 0.590
TRACK_WIDTH = 0.220
BAND = 0.006
LINING = 0.045
# Z: even, 8…26
LININGS = 10
WRAP = math.radians(270.0)
OUTER = TRACK_RADIUS + LINING


def fading(coefficient: float) -> sb.friction.ProductFriction:
    """Static friction 10 % above kinetic, 5 % lost every 100 K above 120 °C
    (assumptions)."""
    return sb.friction.ProductFriction(
        sb.ConstantFriction(coefficient, static_ratio=1.1),
        (sb.LinearFade(5e-4, above=393.15, floor=0.1, blend=5.0),),
    )


def remembering(law: sb.friction.ProductFriction) -> sb.friction.FrictionWithMemory:
    """The law with recovery, burn-off and running-in (assumptions)."""
    process = sb.friction.MemoryProcess
    recovery = process(
        1.0, sb.LinearFade(3e-4, above=423.15, floor=0.5, blend=5.0), rate=0.2
    )
    return sb.friction.FrictionWithMemory(
        law,
        (recovery, process(0.0, rate=2e4, activation=6e4), process(1.05, work=40e6)),
        initial=0.95,
    )


def oiled(law: sb.friction.FrictionWithMemory) -> sb.friction.ChangingFriction:
    """The law with oil on two linings during the second brake application
    (assumption)."""
    oil = sb.PiecewiseLinear([0.0, 5.0, 5.1], [1.0, 1.0, 0.7])
    return sb.friction.ChangingFriction(law, (sb.friction.FrictionChange(oil, [3, 4]),))


def brake() -> sb.Brake:
    material = sb.material("FK-24A")
    # kg
    mass = material.density * WRAP * (OUTER**2 - TRACK_RADIUS**2) / 2 * TRACK_WIDTH
    band = sb.brakes.LiningsOnPlates(
        modulus=2.06e11,  # Pa; assumption: carbon steel
        area=TRACK_WIDTH * BAND,
        slack_end=0.35,  # m; assumption
        tight_end=0.60,  # m; assumption
        linkage=1.0e5,  # N/m; assumption: lever, shaft and anchor dominate
    )
    return sb.Brake(
        sb.Pulley(TRACK_RADIUS, inertia=1200.0, width=TRACK_WIDTH),  # kg·m²; assumption
        sb.Band(OUTER + BAND / 2, stiffness=band),
        sb.uniform_linings(
            LININGS,
            WRAP,
            oiled(remembering(fading(0.42))),
            area=WRAP * OUTER * TRACK_WIDTH / LININGS,
        ),
        sb.Bandage(
            inertia=mass * (OUTER**2 + TRACK_RADIUS**2) / 2,
            friction=remembering(fading(0.30)),
            preload=8.0e3,  # N for each lining; assumption
            area=WRAP * TRACK_RADIUS * TRACK_WIDTH / LININGS,
            mass=mass / LININGS,
            mass_radius=(TRACK_RADIUS + OUTER) / 2,
        ),
    )


def heat() -> sb.Heat:
    rim = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    band = sb.material("band_steel")
    area = WRAP * TRACK_RADIUS * TRACK_WIDTH
    network = sb.layered_heat(
        rim=rim,
        rim_thickness=0.025,  # m, V table 1
        track_area=2 * math.pi * TRACK_RADIUS * TRACK_WIDTH,
        partition=sb.thermal.EffusivityPartition(rim, lining),
        rim_layers=10,
        lining=lining,
        lining_thickness=LINING,
        lining_area=area,
        lining_layers=14,
        lining_both=True,
        # m; thin, as the heat of a brake application stays near the faces
        lining_first=2e-4,
        each=LININGS,
        band=band,
        band_thickness=BAND,
        # W/(m²·K), m/s; assumptions
        inside=sb.thermal.SpeedCoefficient(at_rest=8.0, speed=6.0),
        # W/(m²·K), m/s; assumptions
        outside=sb.thermal.SpeedCoefficient(at_rest=10.0, speed=8.0),
        band_coefficient=15.0,  # W/(m²·K); assumption
        emissivity=0.6,  # assumption: bare, oxidised steel
        permissible=673.15,  # K; assumption for FK-24A
        contact_resistance=2e-3,  # m²·K/W, linings on the rim; assumption
        band_resistance=5e-4,  # m²·K/W, linings under the band; assumption
    )
    network = sb.thermal.with_pulley_structure(network, rim)
    # the external pair: k_1 to the rim at once, k_2 to the band, the rest to the
    # linings (S-12…14; figures assumed)
    network = sb.thermal.with_external_pair(
        network, sb.thermal.ConstantPartition(0.85), rim_share=0.02
    )
    # with the band open the bandage cools in the air through which it turns; W/(m²·K),
    # m/s: assumptions
    cooling = sb.thermal.Convection(
        "lining.back",
        area / LININGS,
        sb.thermal.SpeedCoefficient(8.0, 6.0),
        covered=1.0,
    )
    return dataclasses.replace(network, links=(*network.links, cooling))


def shaft() -> tuple[sb.loads.AbstractShaftTorque, ...]:
    """An eddy-current brake whose heat goes into the flange, churning, bearings and the
    tackle (assumptions)."""
    return (
        sb.loads.EddyCurrentBrake(
            "2 kN*m", "12 rad/s", sb.ramp(0.0, 0.5, 0.0, 1.0), place="flange"
        ),
        sb.loads.HydrodynamicBrake(0.2, 0.3),
        sb.loads.ViscousDrag(5.0),
        sb.loads.BearingFriction(100.0),
        sb.loads.TackleLoss(lowering_efficiency=0.95),
    )


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    # s, N; assumptions: braked, held, released, braked again
    lever = sb.PiecewiseLinear(
        times=[0.0, 0.4, 3.0, 3.2, 4.4, 4.8],
        values=[2.0e3, 22.0e3, 22.0e3, 0.0, 0.0, 24.0e3],
    )
    rope = sb.loads.RopeLayers("32 mm", turns_per_layer=5.0, turns=12.3)  # assumptions
    elasticity = sb.loads.RopeElasticity("8 MN/m", "60 kN*s/m")  # assumptions
    # assumptions, as in u2_5_5_stop
    load = sb.HookLoad(
        mass=60.0e3, drum_radius=0.40, line_count=8, rope=rope, elasticity=elasticity
    )
    duty = sb.Duty(lever, load)
    return sb.Scene(
        brake(), duty, sb.Initial(omega=24.0), end_time=8.0, heat=heat(), shaft=shaft()
    )


def main() -> None:
    print(sb.simulate(scene()))


if __name__ == "__main__":
    main()
