"""Tripping in 30 stands with a U2-5-5 drawworks: rim and linings heat up with each
stop, and friction fades.

Each cycle: release, lower 27 m against the auxiliary brake, brake to rest, set the
string in the slips, wait for the next stand. Lowering ends with the travel and braking
with the rest, so that a hot brake takes longer and every stand comes as far. Geometry
from the published description (V: Volchenko et al., table 1; Z: Zhuravlov et al.);
other values are marked as assumptions.
"""

import math

import simbrake as sb

STANDS = 30
# both bands of the drawworks act as one: areas and tensions are sums over the two
BANDS = 2


def heat() -> sb.Heat:
    """Layered rims, one wall for all linings, bands, and the structure of the pulleys
    behind the rims."""
    # m, V table 1
    track_radius = 0.590
    width = 0.220
    track_area = BANDS * 2 * math.pi * track_radius * width
    lining_area = 0.75 * track_area  # S: overlap coefficient about 0.75
    steel = sb.material("steel_20L")
    lining = sb.material("FK-24A")
    air = sb.thermal.SpeedCoefficient(
        at_rest=8.0, speed=2.0
    )  # W/(m²·K), m/s; assumption: free convection, then ∝ v^0.8
    layered = sb.layered_heat(
        rim=steel,
        rim_thickness=0.025,  # m, V table 1
        rim_layers=16,
        rim_first=0.4e-3,  # m: resolves the heat of one brake application
        track_area=track_area,
        lining=lining,
        lining_thickness=0.030,  # m, V
        lining_layers=12,
        lining_first=35e-6,  # m, V: surface layer up to 35.4 µm
        lining_area=lining_area,
        band=sb.material("band_steel"),
        band_thickness=0.006,  # m, V
        partition=sb.thermal.EffusivityPartition(steel, lining),  # Charron
        # m²·K/W; assumption: worn surfaces, averaged over one revolution
        contact_resistance=2e-3,
        outside=air,
        inside=air,
        band_coefficient=10.0,  # W/(m²·K); assumption
        emissivity=0.8,  # assumption: oxidised steel
        band_emissivity=0.8,
        permissible=273.15 + 130.0,  # K; assumption: the binder begins to soften
    )
    return sb.thermal.with_pulley_structure(layered, steel, pulleys=BANDS)


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    # assumptions: 4 × 5 sheaves; first layer of a mid-size drum
    line_count = 8
    drum_radius = 0.40
    hold = 30.0e3  # N slack tension; assumption
    fade = sb.LinearFade(
        slope=1.5e-3,  # 1/K; assumption
        above=273.15 + 120.0,  # K; assumption
        floor=0.6,
        blend=10.0,
    )
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(radius=0.590, inertia=1200.0),  # m, V; kg·m², assumption
            # m; N/m, assumption: linkage and anchor dominate
            band=sb.Band(radius=0.623, stiffness=1.0e5),
            linings=sb.uniform_linings(
                20,
                math.radians(270.0),
                sb.friction.ProductFriction(sb.ConstantFriction(0.35), (fade,)),
            ),
        ),
        duty=sb.Duty(
            slack_tension=sb.loads.Phases(
                (
                    # take the string, release in 1 s, lower; braking takes the rest of
                    # the 27 m
                    sb.loads.Phase(
                        sb.PiecewiseLinear([0.5, 1.5], [hold, 0.0]),
                        "travel 26 m",
                        "lower",
                    ),
                    sb.loads.Phase(sb.ramp(0.0, hold, 0.0, 0.35), "rest", "brake"),
                    sb.loads.Phase(hold, "18 s", "hold"),
                    sb.loads.Phase(hold, "10 s", "next stand", string_on_hook=False),
                ),
                count=STANDS,
            ),
            load=sb.loads.StringLoad(
                empty=8.0e3,  # kg: hook and travelling block; assumption
                string=80.0e3,  # kg in mud when the 30 stands begin; assumption
                stand=0.8e3,  # kg in mud; assumption: 27 m of 127 mm drill pipe
                drum_radius=drum_radius,
                line_count=line_count,
                # N·m·s; assumption: auxiliary brake, about 1.5 m/s at the hook
                drag=1.5e3,
            ),
        ),
        initial=sb.Initial(omega=0.0),
        end_time=STANDS * 60.0,  # at most: the run ends with the last phase
        heat=heat(),
    )


def main() -> None:
    print(sb.simulate(scene()))


if __name__ == "__main__":
    main()
