"""A claim of a paper, what is found of it, and the scenes and runs that several claims
use."""

import dataclasses
import functools
import importlib.util
import math
import pathlib
from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

import simbrake as sb

HERE = pathlib.Path(__file__).parents[1] / "scenarios"
CONFIRMED = "confirmed"
LIMITED = "confirmed within limits"
CONTRADICTED = "contradicted"
ZERO = 273.15
# Z, tables 5 and 6
WRAP = math.radians(270.0)
LININGS = 10
FRICTIONS = np.asarray([0.1, 0.2, 0.3, 0.4, 0.5])  # Z: f 0.1…0.5


class Found(NamedTuple):
    """What was found of a claim: a number, a sentence around it, and the verdict that
    follows from it."""

    value: float
    text: str
    verdict: str


@dataclasses.dataclass(frozen=True)
class Claim:
    """A claim of a `paper` at a `place` in it, in our words; `find` examines it;
    `like`: what is kept equal."""

    paper: str
    place: str
    words: str
    find: Callable[["Runs"], Found]
    like: str = ""
    fast: bool = False


CLAIMS: list[Claim] = []


def claim(
    paper: str, place: str, words: str, like: str = "", *, fast: bool = False
) -> Callable[..., Any]:
    """Enter a claim that the decorated function examines."""

    def enter(find: Callable[["Runs"], Found]) -> Callable[["Runs"], Found]:
        CLAIMS.append(Claim(paper, place, words, find, like, fast))
        return find

    return enter


def judged(whole: Any, part: Any = False) -> str:
    """Verdict: whether a claim holds throughout, or in a part of its range."""
    return CONFIRMED if np.all(whole) else LIMITED if np.any(part) else CONTRADICTED


# --- scenes and runs that several claims use ----------------------------------------


def scenario(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def stop(
    friction: Any = 0.35,
    angle: Any = None,
    stiffness: float | None = 1e5,
    bandage: Any = None,
) -> sb.Scene:
    """The stop of `u2_5_5_stop`, without heat; linings over a quarter less than their
    sections, 0.220 m wide."""
    plain = scenario("u2_5_5_stop").scene()
    angle = np.full(LININGS, WRAP / LININGS) if angle is None else angle
    area = 0.75 * WRAP * 0.590 * 0.220 / LININGS
    brake = sb.Brake(
        dataclasses.replace(plain.brake.pulley, width=0.220),
        dataclasses.replace(plain.brake.band, stiffness=stiffness),
        sb.Lining(sb.ConstantFriction(friction), angle, area),
        bandage,
    )
    return dataclasses.replace(plain, brake=brake, end_time=8.0)


def floating(internal: float = 0.30, preload: float = 8e3) -> sb.Bandage:
    """The bandage of `staged_vs_standard`, for ten linings."""
    return sb.Bandage(
        22.0,
        sb.ConstantFriction(internal),
        preload,
        area=0.75 * WRAP * 0.590 * 0.220 / LININGS,
    )


def levered(of: sb.Scene, factor: float) -> sb.Scene:
    """The same stop with another lever force."""
    values = np.asarray(of.duty.slack_tension.values)
    return sb.with_values(of, {"duty.slack_tension.values": factor * values})


def stopping_in(time: float, of: sb.Scene) -> tuple[sb.Result, float]:
    """The run that stops after the time (s), by the factor of its lever force, and that
    factor."""
    from scipy.optimize import brentq

    def late(factor: float) -> float:
        taken = sb.simulate(levered(of, factor)).metrics.get("stopping_time")
        return (
            float(of.end_time) if taken is None or not np.isfinite(taken) else taken
        ) - time

    factor = brentq(late, 0.3, 2.0, xtol=1e-6)
    return sb.simulate(levered(of, factor)), factor


def uniform(f: float) -> np.ndarray:
    return np.full(LININGS, WRAP / LININGS)


def even(f: float) -> np.ndarray:
    """Z's angles of equal tension increments, all linings sliding."""
    return sb.layouts.equal_increment_angles(f, LININGS, LININGS, WRAP).angle


def loads(f: float, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tensions behind and loads on sliding linings over the slack tension."""
    tension = np.cumprod(
        np.asarray(
            sb.brakes.tension_ratio(sb.brakes.grip(np.full(angle.size, f), angle))[0]
        )
    )
    return tension, (tension + np.append(1.0, tension[:-1])) * np.sin(angle / 2)


def layers_of(
    result: sb.Result, t: np.ndarray, name: str
) -> tuple[np.ndarray, np.ndarray]:
    """Temperatures (m, k) of a wall's layers and their depths (k,)."""
    (wall,) = (body for body in result.scene.heat.bodies if body.name == name)
    at = [i for i, node in enumerate(result.nodes) if node.split("[")[0] == name]
    return np.asarray(result.series(t).temperature)[:, at], np.asarray(wall.centres)


def of_each(numbers: Any, form: str = ".2f") -> str:
    """Numbers in the order of `FRICTIONS`."""
    return ", ".join(f"{number:{form}}" for number in numbers)


class Runs:
    """Runs that several claims look at, each made when it is first asked for."""

    @functools.cached_property
    def pair(self) -> ModuleType:
        return scenario("staged_vs_standard")

    @functools.cached_property
    def standard(self) -> sb.Result:
        return sb.simulate(self.pair.standard())

    @functools.cached_property
    def staged(self) -> tuple[sb.Result, float]:
        """The staged brake at the stopping time of the standard one, its internal pair
        with the same friction."""
        of = self.pair.scene()
        same = {
            "brake.bandage.friction.base.coefficient": 0.35,
            "brake.linings.friction.base.coefficient": 0.49,
        }
        return stopping_in(
            self.standard.metrics["stopping_time"], sb.with_values(of, same)
        )

    @functools.cached_property
    def cold_staged(self) -> sb.Result:
        """A staged stop without heat, rigid band."""
        return sb.simulate(stop(0.42, stiffness=None, bandage=floating()))

    @functools.cached_property
    def fading(self) -> sb.Result:
        """A long stop of hot linings that fade, each with its own temperature."""
        law = sb.friction.ProductFriction(
            sb.ConstantFriction(0.35), (sb.LinearFade(8e-4, 423.15, 0.3, 5.0),)
        )
        cold = stop(stiffness=None)
        linings = dataclasses.replace(cold.brake.linings, friction=law)
        heat = sb.Heat(
            (
                sb.thermal.Lump("rim", 8e4),
                sb.thermal.Lump("linings", 120.0, count=LININGS, temperature=423.15),
            ),
            friction=sb.thermal.FrictionHeat(
                "rim", "linings", sb.thermal.ConstantPartition(0.9)
            ),
            linings="linings",
        )
        return sb.simulate(
            dataclasses.replace(
                cold, brake=dataclasses.replace(cold.brake, linings=linings), heat=heat
            )
        )

    @functools.cached_property
    def heavy(self) -> sb.Result:
        """A stop of 80 t and the minute after it: thin layers of the rim, a resistance
        between rim and linings."""
        of = sb.with_values(self.pair.standard(), {"duty.load.mass": 80e3})
        # assumption
        touching = sb.thermal.ThermalContact(
            "rim.front", "lining.front", WRAP * 0.590 * 0.220, 1e-3
        )
        bodies = tuple(
            dataclasses.replace(
                body, growth=sb.thermal.layer_growth(3e-4, body.thickness, body.layers)
            )
            if body.name == "rim"
            else body
            for body in of.heat.bodies
        )
        heat = dataclasses.replace(
            of.heat, bodies=bodies, links=(*of.heat.links, touching)
        )
        return sb.simulate(dataclasses.replace(of, heat=heat, end_time=60.0))
