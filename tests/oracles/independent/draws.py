"""Random scenes: numbers drawn by a seed, from which simbrake's scene and the
independent model are both made."""

import numpy as np
from oracles.independent.stepping import Filling, Lines
from scenes import random_points

import simbrake as sb

KINDS = (
    "rigid band", "elastic band", "staged, rigid band", "staged, elastic band", "chain", "disc", "shoe",
    "resolved bandage", "several bands",
)  # fmt: skip
#: brakes that may have two alike rims
BANDED = ("rigid band", "elastic band", "staged, rigid band", "staged, elastic band")
#: what a scene models beside its mechanism; scenes of one kind and flavour share one
#: program
FLAVOURS = ("plain", "hot", "fill")
#: linings of a resolved bandage
_RESOLVED = {"plain": 4, "hot": 3, "fill": 6}
#: linings of each of several bands, from and up to
BANDS = ((0, 1), (1, 3))
END = 4.0
HOOK_ARM = 0.05
AIR = 293.15
FADE_FROM = 305.0
BLEND = 4.0


def draw(kind, flavour, seed):
    """The numbers of a scene."""
    rng = np.random.default_rng([KINDS.index(kind), FLAVOURS.index(flavour), seed])
    n = 2 if kind == "shoe" else _RESOLVED[flavour] if kind == "resolved bandage" else 3
    p = {
        "kind": kind,
        "flavour": flavour,
        "seed": seed,
        "n": n,
        "end": END,
    }
    p["J"] = rng.uniform(50, 300)
    p["drag"] = rng.uniform(0, 15)
    p["omega"] = float(
        rng.choice([0.0, 20.0, 12.0, -15.0, 3.0]) * rng.uniform(0.9, 1.1)
    )
    lever, load = random_points(rng, seed, 300, 6e3, 0.3)
    p["lever_points"] = lever
    p["load_points"] = load
    p["filling"] = None
    p["lever"] = Lines(*map(list, lever))
    p["load"] = Lines(*map(list, load))
    p["hook_inertia"] = p["hook_torque"] = p["mass"] = 0.0
    if flavour == "fill":
        p["filling"] = (
            rng.uniform(1e3, 6e3),
            rng.uniform(0.1, 0.6),
            rng.uniform(0.05, 0.8),
        )
        p["lever"] = Filling(*p["filling"])
        p["load"] = Lines([0.0], [0.0])
        p["mass"] = rng.uniform(500, 5e3)
        p["hook_inertia"], p["hook_torque"] = (
            p["mass"] * HOOK_ARM**2,
            p["mass"] * 9.80665 * HOOK_ARM,
        )
    p["beta"] = np.radians(rng.uniform(40, 62, n)) * min(1.0, 4 / n)
    p["R"] = 0.59
    p["R_b"] = 0.64
    p["C"] = None
    p["x"] = 0.0
    p["bandage"] = None
    p["rims"] = 2 if seed % 5 == 4 and kind in BANDED else 1
    p["track"] = 0.59
    p["areas"] = [rng.uniform(0.02, 0.04, n)]
    _friction(p, rng, kind, flavour, n)
    _mechanism(p, rng, kind, n)
    _heat(p, rng, flavour, n)
    if p["bandage"] is not None and seed % 2:  # linings with a centrifugal force
        p["bandage"] |= {"mass": rng.uniform(2.0, 15.0, n), "mass_radius": 0.61}
    return p


def _friction(p, rng, kind, flavour, n):
    kinetic = rng.uniform(0.2, 0.4, n)
    ratio = float(rng.choice([1.0, rng.uniform(1.02, 1.3)]))
    p["law"] = {"kinetic": kinetic, "static": ratio * kinetic}
    inner = rng.uniform(0.1, 0.35, n)
    inner_ratio = float(rng.choice([1.0, rng.uniform(1.02, 1.3)]))
    p["inner"] = {"kinetic": inner, "static": inner_ratio * inner}
    p["ratios"] = (ratio, inner_ratio)
    if flavour != "plain":
        p["law"] = {
            "kinetic": kinetic,
            "static": kinetic * rng.uniform(1.0, 1.2, n),
            "speed": rng.uniform(1.0, 6.0),
        }
        if kind == "resolved bandage":
            p["inner"] = {
                "kinetic": inner,
                "static": inner * rng.uniform(1.0, 1.2, n),
                "speed": rng.uniform(1.0, 6.0),
            }


def _mechanism(p, rng, kind, n):
    if kind in ("elastic band", "staged, elastic band", "chain"):
        p["C"] = 10 ** rng.uniform(4.3, 5.6)
        taut = p["lever_points"][1][0] / p["C"] * rng.uniform(0.3, 1.0)
        p["x"] = float(rng.choice([0.0, taut])) if p["filling"] is None else 0.0
    if kind.startswith("staged") or kind == "resolved bandage":
        p["bandage"] = {
            "J": rng.uniform(3.0, 20.0),
            "law": p["inner"],
            "preload": rng.uniform(0, 1500, n),
        }
        p["areas"] = [p["areas"][0], rng.uniform(0.02, 0.04, n)]
    if kind == "resolved bandage":
        p["bandage"] |= {
            "J": rng.uniform(0.5, 5.0, n),
            "spring": 10 ** rng.uniform(3.5, 5.5, n - 1),
            "damping": rng.choice([0.0, 0.05, 0.3], n - 1),
        }
    if kind == "chain":
        p["x"] = rng.uniform(300, 1500) / p["C"]
        p["segments"] = {
            "mass": rng.uniform(5, 20, n),
            "stiffness": 10 ** rng.uniform(4.5, 6.0, n - 1),
            "damping": rng.uniform(0.05, 0.4, n - 1),
            "anchor": rng.uniform(200, 2e3),
        }
    if kind == "several bands":  # shares by their stiffness, or given
        p["stiffness"] = 10 ** rng.uniform(4.0, 6.0, 2)
        p["given"] = rng.uniform(0.5, 2.0, 2)
        p["by_stiffness"] = rng.random() < 0.5
    if kind == "disc":
        p |= {
            "radii": (rng.uniform(0.4, 0.5), rng.uniform(0.55, 0.7)),
            "angle": 0.6,
            "worn_in": True,
        }
        p["areas"] = [
            np.full(n, 0.5 * p["angle"] * (p["radii"][1] ** 2 - p["radii"][0] ** 2))
        ]
        p["track"] = 0.5 * sum(p["radii"])
    if kind == "shoe":
        p |= {
            "radius": 0.35,
            "width": 0.1,
            "pin": rng.uniform(0.24, 0.3),
            "arm": rng.uniform(0.5, 0.7),
        }
        p["angles"] = (rng.uniform(0.05, 0.4), rng.uniform(1.8, 2.3))
        p["areas"] = [
            np.full(n, p["width"] * p["radius"] * (p["angles"][1] - p["angles"][0]))
        ]
        p["track"] = p["radius"]


def _heat(p, rng, flavour, n):
    p["heat"] = p["wear"] = None
    if flavour != "hot":
        return
    p["heat"] = {
        "rim": rng.uniform(3e3, 1e4), "lining": rng.uniform(200, 600), "band": rng.uniform(300, 1e3), "air": AIR,
        "start": np.concatenate([[rng.uniform(293, 330)], rng.uniform(293, 330, n), [rng.uniform(293, 320)]]),
        "covered": rng.uniform(0.2, 0.8), "rim_area": rng.uniform(0.5, 2.0), "h": rng.uniform(5, 40), "h_speed": 3.0,
        "emissivity": rng.uniform(0.3, 0.9), "conductance": rng.uniform(1, 20), "band_loss": rng.uniform(2, 20),
        "metal": rng.uniform(0.5, 0.9), "metal_out": rng.uniform(0.3, 0.7),
    }  # fmt: skip
    p["fade"] = {
        "slope": rng.uniform(5e-4, 2.5e-3), "above": FADE_FROM, "floor": rng.uniform(0.3, 0.6), "blend": BLEND
    }  # fmt: skip
    # between rim and linings, in sum; of the outer faces of the linings; at rest as of
    # the rim
    p["heat"] |= {"contact": rng.uniform(5, 60), "lining_area": rng.uniform(0.05, 0.2)}
    wear = {
        "k": rng.uniform(1e-14, 3e-14, n),
        "slope": rng.uniform(0, 5e-3),
        "at": 293.15,
    }
    p["wear"] = (
        [wear]
        if p["bandage"] is None
        else [wear, {"k": rng.uniform(1e-14, 3e-14, n), "slope": 0.0, "at": 1.0}]
    )


# --- simbrake's scene of the same numbers -------------------------------------------


def _law(p, law, ratio):
    if "speed" in law:
        base = sb.StribeckFriction(law["static"], law["kinetic"], law["speed"])
    else:
        base = sb.ConstantFriction(law["kinetic"], ratio)
    if p.get("fade") is None:
        return base
    q = p["fade"]
    return sb.friction.ProductFriction(
        base, (sb.LinearFade(q["slope"], q["above"], q["floor"], q["blend"]),)
    )


def _brake(p):
    law = _law(p, p["law"], p["ratios"][0])
    kind = p["kind"]
    n = p["n"]
    if kind == "disc":
        return sb.DiscBrake(p["J"], sb.Pads(law, *p["radii"], p["angle"], n))
    if kind == "shoe":
        return sb.ShoeBrake(
            p["J"],
            sb.Shoes(law, p["radius"], p["width"], *p["angles"]),
            p["pin"],
            p["arm"],
        )
    if kind == "several bands":
        return _bands(p)
    segments = bandage = mass = None
    if kind == "chain":
        q = p["segments"]
        segments = sb.Segments(q["stiffness"], q["damping"], q["anchor"])
        mass = q["mass"]
    if p["bandage"] is not None:
        q = p["bandage"]
        more = (
            {"spring": q["spring"], "spring_damping": q["damping"]}
            if kind == "resolved bandage"
            else {}
        )
        more |= {key: q[key] for key in ("mass", "mass_radius") if key in q}
        bandage = sb.Bandage(
            q["J"],
            _law(p, q["law"], p["ratios"][1]),
            q["preload"],
            p["areas"][1],
            **more,
        )
    linings = sb.Lining(law, p["beta"], p["areas"][0], mass)
    return sb.Brake(
        sb.Pulley(p["R"], p["J"]),
        sb.Band(p["R_b"], p["C"], segments),
        linings,
        bandage,
        p["rims"],
    )


def _bands(p):
    made = []
    for (first, last), C, share in zip(BANDS, p["stiffness"], p["given"], strict=True):
        numbers = {
            key: x[first:last] if np.ndim(x) else x for key, x in p["law"].items()
        }
        linings = sb.Lining(
            _law(p, numbers, p["ratios"][0]),
            p["beta"][first:last],
            p["areas"][0][first:last],
        )
        by_stiffness = p["by_stiffness"]
        made.append(
            sb.brakes.LinedBand(
                linings, C if by_stiffness else None, None if by_stiffness else share
            )
        )
    return sb.brakes.MultiBandBrake(sb.Pulley(p["R"], p["J"]), p["R_b"], tuple(made))


def _thermal(p):
    q = p["heat"]
    n = p["n"]
    if q is None:
        return None, None
    rim = sb.thermal.Lump("rim", q["rim"], q["start"][0])
    linings = sb.thermal.Lump(
        "linings", np.full(n, q["lining"]), q["start"][1:-1], count=n
    )
    band = sb.thermal.Lump("band", q["band"], q["start"][-1])
    h = sb.thermal.SpeedCoefficient(q["h"], q["h_speed"])
    staged = p["bandage"] is not None
    heat = sb.Heat(
        bodies=(rim, linings, band, sb.thermal.Reservoir("air", q["air"])),
        links=(
            sb.thermal.Convection("rim", q["rim_area"], h, covered=q["covered"]),
            sb.thermal.Radiation(
                "rim", q["rim_area"], q["emissivity"], covered=q["covered"]
            ),
            sb.thermal.ThermalContact(
                "rim", "linings", 1.0, 1 / q["contact"], opens=True
            ),
            sb.thermal.Conductance("linings", "band", q["conductance"], opens=staged),
            sb.thermal.Convection("linings", q["lining_area"], h),
            sb.thermal.Convection("band", 1.0, q["band_loss"]),
        ),
        friction=sb.thermal.FrictionHeat("rim", "linings", q["metal"]),
        external=sb.thermal.FrictionHeat("band", "linings", q["metal_out"])
        if staged
        else None,
        rim="rim",
        linings="linings",
        band="band",
    )
    outer, *inner = p["wear"]
    rate = sb.wear.LinearWear(outer["k"], outer["slope"], outer["at"])
    return heat, sb.Wear(
        rate, internal=sb.wear.ConstantWear(inner[0]["k"]) if inner else None
    )


def scene(p):
    """simbrake's scene of the numbers."""
    if p["filling"] is None:
        lever = sb.PiecewiseLinear(*p["lever_points"])
        load = sb.TorqueLoad(sb.PiecewiseLinear(*p["load_points"]), p["drag"])
    else:
        lever = sb.profiles.ExponentialRise(*p["filling"])
        load = sb.HookLoad(p["mass"], HOOK_ARM, 1.0, drag=p["drag"])
    duty = (sb.ForceDuty if p["kind"] in ("disc", "shoe") else sb.Duty)(lever, load)
    heat, wear = _thermal(p)
    return sb.Scene(
        _brake(p), duty, sb.Initial(p["omega"], p["x"]), p["end"], heat, wear=wear
    )


__all__ = ["FLAVOURS", "KINDS", "draw", "scene"]
