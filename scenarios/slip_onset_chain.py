"""The onset of slip and a stop of a U2-5-5 drawworks, lining by lining: a resolved
chain of 20 linings.

The brake of `u2_5_5_stop.py` (V: Volchenko et al.; Z: Zhuravlov et al.) under a
constant slack tension from the onset of slip on, with each lining on its own segment of
the band (model §3.1). Values not in the papers are marked as assumptions.
"""

import dataclasses
import math

import simbrake as sb

SLACK_TENSION = 2.0e3  # N; assumption: as at the start of the main scenario
ANCHOR = 1.0e5  # N/m; assumption: linkage and anchor dominate, not the steel band


def scene() -> sb.Scene:
    """The scene with its band in segments."""
    # m, V table 1; FK-24A; brake band
    track_radius = 0.590
    lining_thickness = 0.030
    band_thickness = 0.006
    # lines strung, m to the rope; assumptions
    line_count = 8
    drum_radius = 0.40
    linings = sb.uniform_linings(
        20,  # Z: even, 8…26
        math.radians(270.0),  # Z: wrap
        sb.ConstantFriction(0.35),  # assumption: FK-24A on steel, within Z's 0.1…0.5
        # kg; assumption: 1.9 kg of FK-24A and 1.5 kg of band over 0.147 × 0.22 m
        mass=3.5,
    )
    segments = sb.Segments(
        # N/m; assumption: bolted joints take up most of it; the bare steel band has
        # 1.8e9
        stiffness=1.0e8,
        damping_ratio=0.05,  # assumption
    )
    return sb.Scene(
        brake=sb.Brake(
            # kg·m²; assumption: drum, pulleys, fast line
            pulley=sb.Pulley(radius=track_radius, inertia=1200.0),
            band=sb.Band(
                track_radius + lining_thickness + band_thickness / 2, ANCHOR, segments
            ),
            linings=linings,
        ),
        duty=sb.Duty(
            slack_tension=sb.Constant(SLACK_TENSION),
            # kg; assumption: empty hook
            load=sb.HookLoad(
                mass=5.0e3, drum_radius=drum_radius, line_count=line_count
            ),
        ),
        # at the onset of slip: the band is stretched by the slack tension all along
        # rad/s, hook at 0.3 m/s; assumption
        initial=sb.Initial(omega=6.0, elongation=SLACK_TENSION / ANCHOR),
        end_time=3.0,  # s: well past the stop
    )


def as_a_whole(scene: sb.Scene) -> sb.Scene:
    """The same scene with the band as one spring and linings without mass (model
    §3)."""
    brake = scene.brake
    brake = dataclasses.replace(
        brake,
        band=dataclasses.replace(brake.band, segments=None),
        linings=dataclasses.replace(brake.linings, mass=None),
    )
    return dataclasses.replace(scene, brake=brake)


def main() -> None:
    chain = scene()
    n = 20
    result = sb.simulate(chain)
    print(result)
    print()
    found = {}
    for event in result.events:
        found.setdefault((event.name, event.lining), event.time)
    slips = [found["lining_slip", i + 1] for i in range(n)]
    full = float(result.full_slip_time)
    stop = float(result.stopping_time)
    whole = sb.simulate(as_a_whole(chain))
    log = {(event.name, event.lining): event.time for event in whole.events}
    limits = [log["lining_limit", i + 1] for i in range(n)]
    print("lining   slip, chain     limit of the whole band")
    for i in range(n):
        print(f"{i + 1:6d} {slips[i] * 1e3:12.4f} ms {limits[i] * 1e3:14.4f} ms")
    print(EXPLANATION)
    print("k-th to slip   of the chain              of the whole band")
    for k in range(n):
        last = n - 1 - k
        mine = f"lining {last + 1:2d} {slips[last] * 1e3:9.4f} ms"
        theirs = f"lining {k + 1:2d} {limits[k] * 1e3:9.4f} ms"
        print(f"{k + 1:12d}   {mine}   {theirs}")
    print(
        f"full slip      chain {full * 1e3:.4f} ms   whole band "
        f"{log['full_slip', None] * 1e3:.4f} ms"
    )
    print(
        f"stop           chain {stop:.5f} s    whole band {float(whole.stopping_time):.5f} s"
    )


EXPLANATION = """
Both count the same limits, in opposite order. In the chain the anchor's spring pulls on the last lining alone. That
lining carries the whole rise of the tension until it slips, then its neighbour takes over: the front of slip runs
from the tight to the slack end. The rule of the whole band counts from the slack end: the load sharing of
rigid bodies is undetermined, and the published model loads the first ones.
The torque is R_b (T_n - T_0) with T_n = C x in both, for any load sharing; and k equal linings at their limit hold T_n
up to T_0 Pi_k at any position. So the k-th lining of the chain slips when the k-th limit of the whole band is
reached, delayed by the elasticity of the segments (K against C) and the mass of the linings. The sliding linings and
their loads differ meanwhile: heat and wear begin at the tight end. The stop comes a little later, too: the
linings oscillate undamped on the anchor's spring, stick once in each period, and carry less than their limit then.
"""


if __name__ == "__main__":
    main()
