"""Printed holding forces of a mooring winch by layers of rope."""

from helpers import near

import simbrake as sb

#: layers of rope on the drum: pull at which the brake slips (kN), of a holding test on
#: board (2014): drum of 450 mm, rope of 60 mm, designed for 363 kN at the radius 255 mm
PRINTED = {1: 344.0, 2: 279.0, 3: 234.0, 4: 202.0}


def test_holding_force_falls_with_the_layers():
    """The torque is one number, so that pulls are as the radii of the layers: the
    printed ones to their three digits."""
    scene = sb.with_values(
        sb.read_scene("winch"),
        {"initial.hook_speed": 0.0, "duty.slack_tension.values": "24 kN"},
    )
    pulls = {}
    for layer in PRINTED:
        turns = {"duty.load.rope.turns": 10 * layer - 5}
        held = sb.simulate(sb.with_values(scene, turns))
        weight = float(held.scene.duty.load.mass) * sb.loads.GRAVITY
        pulls[layer] = held["min_holding_reserve"] * weight
    for layer, printed in PRINTED.items():
        ratio = printed / PRINTED[1]
        near(pulls[layer] / pulls[1], ratio, 3e-3)
    # the setting of the template is that of 60 % of the breaking load, 347 kN
    near(pulls[1], 0.6 * 578e3, 0.03)
