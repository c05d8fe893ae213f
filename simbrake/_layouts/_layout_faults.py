"""What cannot be right in a layout that is asked for, all at once."""

from typing import Any

import numpy as np

from .._base._faults import Fault
from .._parts._scene import Scene, band_brake, faults, read_by_linings
from .._run._linings import fault_of_pair
from ._layout_targets import TARGETS, Target

FREE = ("angle", "area", "both")
OVER = ("static", "braking")
STARTS = ("closed form", "given")
#: targets that look at the areas
NEEDS_AREA = ("pressure", "wear")


def faults_of_wish(
    scene: Scene, targets: tuple[Target, ...], free: str, over: str, rate: Any, pair: str, start: str
) -> list[Fault]:
    """Everything wrong with a layout asked for, the scene's own faults included (arguments as of `equal_layout`)."""
    found = faults(scene)
    if start not in STARTS:
        found.append(Fault("start", f"{start!r} is unknown", f"there are: {', '.join(STARTS)}"))
    if free not in FREE:
        found.append(Fault("free", f"{free!r} cannot be freed", f"there are: {', '.join(FREE)}"))
    if over not in OVER:
        found.append(Fault("over", f"{over!r} is unknown", f"there are: {', '.join(OVER)}"))
    pairs = list(band_brake(scene).pairs)
    if missing := fault_of_pair(pair, pairs):
        found.append(missing)
    elif pair != pairs[0] and over == "static":
        found.append(Fault("pair", "statics are those of the band on the linings", 'give over="braking"'))
    for one in targets:
        if isinstance(one, str) and one not in TARGETS:
            hint = f"there are: {', '.join(TARGETS)}, or a function of a result to one number per lining"
            found.append(Fault("target", f"{one!r} is unknown", hint))
        elif not isinstance(one, str) and over == "static":
            found.append(Fault("target", "a function of a result needs a run", 'give over="braking"'))
    if len(targets) != (2 if free == "both" else 1):
        hint = 'as ("tension_increment", "pressure"): the first for the angles, the second for the areas'
        words = f"{free!r} levels {2 if free == 'both' else 1}, there are {len(targets)}"
        found.append(Fault("target", words, hint if free == "both" else 'free="both" levels two'))
    if "wear" in targets and rate is None:
        found.append(Fault("rate", "is missing", "wear needs a wear rate in m³/(N·m)"))
    return found + _faults_of_areas(scene, targets, free, pair)


def _faults_of_areas(scene: Scene, targets: tuple[Target, ...], free: str, pair: str) -> list[Fault]:
    brake, found = band_brake(scene), []
    n = int(np.size(brake.linings.angle))
    if n < 2:
        found.append(Fault("brake.linings.angle", "one lining has no layout", "give two or more"))
    first, *others = brake.pairs
    looked_at = {pair} & set(brake.pairs) if any(one in NEEDS_AREA for one in targets) else set()
    looked_at |= {first} if free in ("area", "both") else set()
    for one in sorted(looked_at):
        if brake.rubbing_part(one).area is None:
            found.append(Fault(f"brake.{brake.pairs[one].field}.area", "is missing", "the areas are looked at"))
    if free != "angle" and pair in others:
        found.append(Fault("free", "the areas that can be freed are those towards the band", 'free="angle"'))
    if free == "area" and not read_by_linings(scene).p:
        for one in targets:
            if isinstance(one, str) and one in TARGETS and one not in NEEDS_AREA:
                found.append(Fault("target", f"{one} does not depend on the areas", "free the angles"))
    return found
