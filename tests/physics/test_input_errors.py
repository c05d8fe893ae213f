"""Parts that cannot be: all errors of a scene in one report, as a whole beside the one
that is kept."""

import dataclasses
import functools
import math

import bandage_scenes
import chain_scenes
import numpy as np
import pytest
import staged_scenes
import test_every_friction as every
import test_memory as memory
import wear_scenes
from disc_scenes import FADE, disc_scene
from goldens import assert_refused
from heat_scenes import fading, lump, rigid_stop
from material_scenes import compared
from scenes import replaced, stop_run, stop_scene
from shoe_scenes import shoe_scene

import simbrake as sb
from simbrake import loads, thermal
from simbrake.friction import (
    ChangingFriction,
    FrictionChange,
    FrictionWithMemory,
    MemoryProcess,
    ProductFriction,
)
from simbrake.loads import BearingFriction, Phase, TabulatedDrag, TackleLoss

HOOK = sb.HookLoad(20e3, 0.4, 8)
BRAKE = stop_scene(C=None).brake


def changing(factor, linings=None, when=None, base=0.35):
    law = ChangingFriction(base, (FrictionChange(factor, linings, when),))
    return stop_scene(C=None, law=law)


def bands(law=0.35, stiffness=2e5, **linings):
    brakes = sb.brakes
    own = sb.Lining(law, np.full(3, 0.7), **linings)
    other = sb.Lining(0.3, np.full(2, 0.9))
    lined = brakes.LinedBand(own, stiffness), brakes.LinedBand(other, 2e5)
    brake = brakes.MultiBandBrake(sb.Pulley(0.59, 1200.0), 0.623, lined)
    return dataclasses.replace(stop_scene(), brake=brake)


def network(bodies, *links, **parts):
    return sb.Heat(bodies, tuple(thermal.Conductance(*ends, 1.0) for ends in links), **parts)  # fmt: skip


def programme(*lines, load=HOOK, **parts):
    return lambda: sb.programme_scene(BRAKE, lines, load, **{"pull": 30e3, **parts})


def wet(**changes):
    liquid = thermal.water("35 degC", "1.5 bar")
    jacket = thermal.WaterJacket("rim", 0.8, 3e-3, liquid, 4e3)
    bodies = thermal.Lump("rim", 5e4), thermal.Reservoir("water", 303.15)
    links = (dataclasses.replace(jacket, **changes),)
    heat = sb.Heat(bodies, links, thermal.FrictionHeat("rim", None, 1.0), rim="rim")
    return rigid_stop(sb.ConstantFriction(0.35), heat)


A, B = thermal.Lump("a", 1.0), thermal.Lump("b", 1.0, 300.0)
STAGED = staged_scenes.stop()
SPRUNG = bandage_scenes.scene()
CHAIN = chain_scenes.chain()
WEAR = sb.Wear(1e-14, permissible=8e-3)
WORN = wear_scenes.stop(WEAR)
LIFE = functools.partial(sb.lining_life, WORN)
F = sb.formulas
LAYERS = loads.RopeLayers(0.03, 10.0, 25.0)


def rope(length, **more):
    weight = loads.RopeWeight(10.0, 50.0, length)
    return stop_scene(C=None, load=sb.HookLoad(1e3, 0.5, 1, weight=weight, **more))


CASES = {
    "shaft": [
        stop_scene(
            load=loads.TabulatedLoad([0.0, 3.0], [1.0, 2.0, 4.0]),
            shaft=(
                loads.EddyCurrentBrake(1e3, 5.0, 1.05, place="nowhere"),
                loads.HydrodynamicBrake(1.0, -0.1),
                BearingFriction(100.0, 90.0, reverse=BearingFriction(1.0, 2.0)),
                TabulatedDrag([0.0, 3.0, 2.0], [0.0, 1.0, 2.0]),
                TabulatedDrag([0.0, 3.0], [1.0, 2.0]),
                TackleLoss(1.04),
                TackleLoss(1.04),
            ),
        ),
        lambda: TackleLoss(0.841),
        lambda: TackleLoss(efficiency=0.85),
        lambda: TackleLoss(),
        lambda: TackleLoss(1.04, lowering_efficiency=0.8),
        lambda: loads.Motor("60 kN*m", max_speed=40.0),
    ],
    "friction": [
        changing(0.5, [3, 29]),
        changing(sb.PiecewiseLinear([1.0, 1.0], [1.0, -0.1])),
        changing(0.5, base=changing(0.5).brake.linings.friction),
        changing(sb.Driller(sb.PiecewiseLinear([0.0], [1.0]), 1e3)),
        *(
            changing(0.5, when=when)
            for when in ("12 s", loads.AtStop(1.5), "temperature of the rim above 9 K")
        ),
        lambda: FrictionChange(0.5, when="stop x"),
        lambda: FrictionChange(0.5, [0]),
        stop_scene(law=ChangingFriction(0.3, ())),
        memory.band(
            FrictionWithMemory(memory.Timed(), (MemoryProcess(1.0, activation=4e4),))
        ),
        lambda: MemoryProcess(math.nan, rate=1.0),
        stop_scene(law=every.PRESSED(20)),
        stop_scene(C=None, law=np.append(np.full(19, 0.35), 9.0)),
        every.warm("disc brake", every.off_its_table),
        *(
            every.scene("staged, elastic band", law)
            for law in (every.without_changes, every.without_states)
        ),
    ],
    "bands": [
        lambda: sb.brakes.MultiBandBrake(sb.Pulley(0.59, 1200.0), 0.623, ()),
        bands(sb.ConstantFriction([0.3, 0.4]), None, area=0.02, mass=3.0),
        bands(2.8),
        bands(fading()),
        dataclasses.replace(
            bands(),
            initial=sb.Initial(20.0, elongation=1e-3),
            wear=sb.Wear(1e-14, geometry=True),
        ),
        *(
            lambda rims=rims: dataclasses.replace(BRAKE, rims=rims)
            for rims in (0, 1.5, "two")
        ),
        replaced(
            stop_scene(C=None),
            {
                "brake.rims": 2,
                "brake.pulley": sb.Pulley(0.725, 800.0, 0.3),
                "brake.linings": sb.Lining(0.3, np.full(20, 0.2), 0.02),
            },
        ),
        stop_scene(
            C=sb.brakes.LiningsOnPlates("210 GPa", [1e-3, 2e-3], 0.4, 0.9, gap=0.1)
        ),
        replaced(STAGED, {"brake.linings": sb.Lining(0.3, np.full(8, 0.5), continuous=True)}),
    ],
    "mechanisms": [
        replaced(CHAIN, {"brake.band": sb.Band(0.5, None, sb.Segments(np.full(4, 1e3)))}),
        replaced(CHAIN, {"brake.bandage": sb.Bandage(1.0, 0.1)}),
        replaced(SPRUNG, {"brake.band": sb.Band(0.64, 1e5)}),
        replaced(
            SPRUNG,
            {"brake.bandage": sb.Bandage(4.0, 0.2, spring=[1e3] * 3, mass=[2.0] * 3)},
        ),
        staged_scenes.stop(preload=np.full(3, 100.0), f_ext=3.6),
        staged_scenes.stop(heat=lump(1e3, linings=1e3), inner=fading()),
        *(
            lambda name=name: getattr(stop_run(), name)
            for name in (
                "internal_slip_time",
                "stages",
                "worn_thickness",
                "end_temperatures",
            )
        ),
    ],
    "pressed": [
        sb.with_values(
            disc_scene(friction=FADE, wear=sb.Wear(1e-13, geometry=True)),
            {"brake.linings.outer_radius": 0.2, "end_time": -1.0},
        ),
        disc_scene(friction=sb.ConstantFriction([0.3, 0.4])),
        dataclasses.replace(disc_scene(), duty=sb.Duty(1e3, 0.0)),
        *(
            lambda feature=feature: feature(disc_scene())
            for feature in (
                sb.estimates,
                sb.synthesize,
                lambda scene: sb.equal_layout(scene, "pressure"),
                sb.studies.turned_scene,
            )
        ),
        sb.with_values(
            shoe_scene(
                friction=ProductFriction(0.3, (sb.friction.PressureFactor(1e6, 0.2),))
            ),
            {"brake.linings.end": 0.1, "brake.pin": 0.2},
        ),
    ],
    "network": [
        *(
            lambda heat=heat: sb.simulate_heat(heat, [0.0, 1.0])
            for heat in (
                network((A, B, thermal.Lump("c", [0.0, 1.0], count=2)), "ab", "bc"),
                network(
                    (
                        A, thermal.Lump("c", 1.0),
                        thermal.Junction("j"), thermal.Junction("k"),
                        thermal.Wall("w", sb.material("steel_20L"), 0.08, 1.0, 3),
                    ),
                    *("jk", "aw", ("a", "nowhere")),
                ),
            )
        ),
        lambda: sb.steady_state(network((A, B), "ab")),
        *(
            lambda times=times: sb.simulate_heat(network((A, B), "ab"), times)
            for times in ([0.0, 10.0, 5.0], [0.0, math.nan], [], ["soon"])
        ),
        rigid_stop(
            fading(), dataclasses.replace(lump(), friction=thermal.FrictionHeat("x", "y", 0.5))
        ),
        lambda: sb.PowerShares(0.6, 0.5),
    ],
    "water": [
        *(wet(**change) for change in ({"a": "water"}, {"b": "rim"})),
        wet(coefficient=None, section="45 cm^2", diameter="36 mm"),
        lambda: wet(flow="3.3 kg/s"),
        lambda: wet(flow=0.0),
        lambda: thermal.water(30.0),
        lambda: thermal.with_water_jacket(lump(), 3e-3, coefficient=4e3),
    ],
    "loads": [
        rope(4000.0, rope=LAYERS),
        rope(40.0, elasticity=loads.RopeElasticity("8 MN/m", modulus=1e11)),
        rope(None, elasticity=loads.RopeElasticity()),
        *(
            stop_scene(C=None, load=loads.CounterweightLoad(*given))
            for given in ((0.0, 0.0, 0.5, 1.0, 3.0), (1.0, 0.0, 0.5, 1.0, 3.0, 1.0))
        ),
        stop_scene(
            load=loads.WindlassLoad(5e3, 100.0, 0.5, 20.0, 2e3, 1e3, freeboard=30.0)
        ),
        *(
            stop_scene(C=None, lever=lever)
            for lever in (
                loads.Actuator(sb.profiles.ExponentialRise(5e3, 0.2), 0.1),
                sb.Lever(sb.SpeedHold(1e3), [1.0, 2.0], 0.1),
                loads.Cylinder(sb.profiles.ExponentialRise(5e5, 0.2), 0.03, lag=0.1),
                loads.Phases(
                    (
                        Phase(1e3, "travel 3 m", motor=sb.PiecewiseLinear([0.0], [1.0])),
                        Phase(1e3, "temperature 350 degC"),
                    )
                ),
            )
        ),
        lambda: loads.Cylinder("8 bar"),
        lambda: loads.RopeLayers(0.03, 0.0, 5.0),
        *(
            lambda text=text: Phase(1e3, text)
            for text in ("until the cows come home", "travel 0 m", "12 m")
        ),
        stop_scene(
            C=None,
            load=loads.StringLoad(8e3, [1e4, 2e4], 0.4, 8),
            lever=loads.Phases((Phase(3e4, "9 s"),)),
            motor=loads.Motor(6e4, 1e6, 40.0, sb.PiecewiseLinear([0.0], [99.0])),
        ),
    ],
    "programme": [
        *(
            programme(*lines)
            for lines in (
                ("lower 27 at 1.2 m",),
                ("brake to rest",),
                ("lower 27 m at 1.2 m/s",),
                ("lower 1 m at 1.2 m/s", "brake to rest"),
                ("lower 9 m at 1 m/s", "break to rest"),
                ("lower 9 m at 1 m/s", "hold 3 s"),
                ("repeat 3 times", "hold 3 s"),
                ("take the string", "hold 3 s"),
                (),
                ("hoist 9 m at 1 m/s",),
                ("lower 9 m at 1 m/s on the auxiliary brake", "brake to rest"),
                ("hoist back at 1 m/s",),
                ("make up a stand in 9 s", "lay down a stand in 9 s"),
            )
        ),
        programme("hold 1 s", load=sb.with_values(stop_scene(load=HOOK), {"duty.load.mass": -3.0}).duty.load),
    ],
    "wear": [
        wear_scenes.stop(sb.Wear(np.full(3, 1e-14), internal=1e-14)),
        wear_scenes.stop(sb.Wear(1e-14, worn=[0, 0.03, 0, 0], thickness=0.03)),
        wear_scenes.stop(
            sb.Wear(1e-14, turned_at=[3.0]), angle=np.radians([50.0, 60.0, 60.0, 70.0])
        ),
        sb.with_values(WORN, {"brake.linings.area": None}),
        every.scene("rigid band", every.running_in, wear=sb.Wear(1e-14, turned_at=1.0)),
        *(
            lambda run=run: sb.lining_life(run)
            for run in (
                wear_scenes.stop(None),
                sb.with_values(WORN, {"wear.permissible": None}),
                sb.with_values(WORN, {"wear.worn": 9e-3}),
                sb.with_values(WORN, {"initial.omega": 0.0}),
                wear_scenes.stop(dataclasses.replace(WEAR, heat=True)),
            )
        ),
        lambda: LIFE(turn_at=[5.0, 3.0]),
        lambda: LIFE(turn_at="soon"),
        lambda: LIFE(step=0.5),
    ],
    "formulas": [
        lambda: F.penetration_depth(-1.0, 1.0),
        lambda: F.mean_bulk_rise(1.2, 1.0, 1.0, 1.0),
        lambda: F.stopping_rise(1.0, 2.0, 1.0, 1e4),
        lambda: F.schmidt(sb.material("brass"), 0.025, 1, 1.0, 1.0),
        lambda: F.ring_face(1.0, 0.5),
        lambda: F.parallel_resistance(1.0, 0.0),
        *(
            lambda scene=scene: sb.estimates(scene)
            for scene in (stop_scene(C=None, w0=0.0), stop_scene(C=None, load=1e6))
        ),
        lambda: sb.estimates(stop_scene(), F.EstimateData(track_area=1.0, lining_area=1.2, outer_area=0.7)),
        *(
            lambda options=options: compared(**{"rims": ["brass"], **options})
            for options in (
                {"rims": ["brass", "brass"]},
                {"energy": [-1.0]},
                {"energy": {"initial.omga": [1.0]}},
                {"scene": STAGED},
            )
        ),
    ],
    "times": [
        *(
            lambda times=times: stop_run().series(times)
            for times in ([-1.0, 99.0], [math.nan], [], [[1.0]], "soon")
        ),
    ],
}  # fmt: skip


@pytest.mark.parametrize("part", CASES)
def test_reports_are_as_kept(part, request):
    assert_refused(request, part, CASES[part])
