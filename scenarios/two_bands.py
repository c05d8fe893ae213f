"""U2-5-5 with two unequal bands under one lever: load sharing.

The emergency stop of `u2_5_5_stop.py`, but the band's stiffness follows from its
dimensions (K: Kryshtopa, compliance of friction units), and one of the two bands has
been replaced by a thinner one with a longer tight end. Geometry from V: Volchenko et
al., table 1, and Z: Zhuravlov et al.; other values are marked as assumptions.
"""

import math

import simbrake as sb

TRACK_RADIUS = 0.590  # m, V table 1
LINING_THICKNESS = 0.030  # m, V: lining FK-24A
BAND_THICKNESS = 0.006  # m, V: brake band
WIDTH = 0.220  # m, V: of the rim; assumption: band and linings are as wide


def band(thickness: float, tight_end: float) -> sb.brakes.BondedLinings:
    """One band with riveted linings (K-1)."""
    return sb.brakes.BondedLinings(
        modulus=2.06e11,  # Pa; assumption: carbon steel
        area=WIDTH * thickness,
        lining_modulus=3.0e9,  # Pa; assumption: moulded asbestos friction material
        lining_area=WIDTH * LINING_THICKNESS,
        lining_radius=TRACK_RADIUS + LINING_THICKNESS / 2,
        slack_end=0.35,  # m; assumption
        tight_end=tight_end,
        # rad; assumption: the linings' angles below are their pitch, gaps between them
        # are not resolved
        gap=0.0,
    )


def scene() -> sb.Scene:
    """The scene that `simbrake run` integrates."""
    line_count = 8  # lines strung; assumption: 4 × 5 sheaves
    drum_radius = 0.40  # m to the rope; assumption: first layer of a mid-size drum
    hook_speed = 1.2  # m/s downwards; assumption: lowering of a heavy string
    bands = sb.brakes.ParallelBands(
        (
            band(BAND_THICKNESS, tight_end=0.60),  # m; assumption
            # m; assumptions: a replaced band, 1 mm thinner, on a longer anchor strap
            band(0.005, tight_end=1.40),
        ),
        # both bands end at one rigid beam at the anchor and at one lever shaft
        # (assumption): they have equal elongation (K-8); beam, shaft and frame are in
        # series with them
        # N/m at the tight end; assumption: it dominates, not the steel bands
        linkage=1.0e5,
    )
    return sb.Scene(
        brake=sb.Brake(
            pulley=sb.Pulley(
                radius=TRACK_RADIUS,
                inertia=1200.0,  # kg·m²; assumption: drum, both pulleys and fast line
            ),
            # one band circle for both: the thinner band's lies 0.5 mm further in, which
            # is left out
            band=sb.Band(
                radius=TRACK_RADIUS + LINING_THICKNESS + BAND_THICKNESS / 2,
                stiffness=bands,
            ),
            linings=sb.uniform_linings(
                20,  # Z: even, 8…26
                math.radians(270.0),  # Z: wrap
                # assumption: FK-24A on steel, within Z's 0.1…0.5
                sb.ConstantFriction(0.35),
            ),
        ),
        duty=sb.Duty(
            slack_tension=sb.Lever(
                sb.PiecewiseLinear(
                    times=[0.0, 0.35],  # s; assumption: the driller applies the lever
                    # N; assumptions: pretension and final force, with the pneumatic
                    # assistance
                    values=[50.0, 605.0],
                ),
                arm=1.40,  # m; assumption
                slack_arm=0.030,  # m; assumption: crank of the lever shaft
                efficiency=0.85,  # assumption
            ),
            load=sb.HookLoad(
                mass=60.0e3,  # kg; assumption: string in mud, hook and travelling block
                drum_radius=drum_radius,
                line_count=line_count,
            ),
        ),
        initial=sb.Initial(omega=hook_speed * line_count / drum_radius),
        end_time=5.0,  # s: well past the stop
    )


def main() -> None:
    import numpy as np

    given = scene()
    brake = given.brake
    result = sb.simulate(given)
    print(result)

    angle = brake.linings.angle
    f = brake.linings.friction.coefficient
    R_b = float(brake.band.radius)
    shares = np.asarray(sb.brakes.tension_shares(brake))
    alone = [float(b.stiffness(f, angle, R_b)) for b in brake.band.stiffness.bands]
    compliance = [
        float(b.compliance(f, angle, R_b)) for b in brake.band.stiffness.bands
    ]
    ratios, _ = sb.brakes.tension_ratio(sb.brakes.grip(f, np.asarray(angle)))
    T_0 = float(given.duty.slack_tension.scale())
    Pi = float(np.prod(ratios))
    force = float(given.duty.slack_tension.force.scale())
    print(
        f"\nin full slip, lever at {force:.0f} N: slack tension {T_0 / 1e3:.2f} kN of "
        f"both, T_n/T_0 = {Pi:.3f}"
    )
    print(
        "stiffness at the tight end with all in series "
        f"{float(sb.brakes.stiffness_of(brake)) / 1e3:.2f} kN/m"
    )

    rows = []
    for j, b in enumerate(brake.band.stiffness.bands):
        row = [f"{alone[j] / 1e6:.1f}", f"{compliance[j] * 1e9:.2f}"]
        for share in (shares[j], 0.5):
            tight = share * T_0 * Pi
            row += [
                f"{share * T_0 / 1e3:.2f}",
                f"{tight / 1e3:.2f}",
                f"{R_b * (tight - share * T_0) / 1e3:.2f}",
            ]
            row += [f"{tight / float(b.area) / 1e6:.1f}"]
        rows.append([f"{j + 1}", f"{shares[j] * 100:.2f}", *row])
    print(f"\n{'':38}{'equal elongation (K-8)':>36}{'equal split (balance beam)':>36}")
    heads = ["slack", "tight", "torque", "stress"] * 2
    units = ["kN", "kN", "kN·m", "MPa"] * 2
    print(
        f"{'band':>4}{'share':>9}{'stiffness':>12}{'compliance':>13}"
        + "".join(f"{head:>9}" for head in heads)
    )
    print(
        f"{'':>4}{'%':>9}{'MN/m':>12}{'m/GN':>13}"
        + "".join(f"{unit:>9}" for unit in units)
    )
    for row in rows:
        print(
            f"{row[0]:>4}{row[1]:>9}{row[2]:>12}{row[3]:>13}"
            + "".join(f"{cell:>9}" for cell in row[4:])
        )
    torque = R_b * T_0 * (Pi - 1)
    more = (shares.max() / shares.mean() - 1) * 100
    print(
        f"\nbraking torque {torque / 1e3:.2f} kN·m either way: it depends on the sum "
        "of the tensions."
    )
    print(
        f"Band {int(shares.argmax()) + 1} carries {more:.1f} % more than half, and so "
        "do its linings and its ends."
    )


if __name__ == "__main__":
    main()
