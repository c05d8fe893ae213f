"""Random scenes of every kind of brake, run by simbrake and by an independent model,
and compared.

`python tests/oracles/random_scenes.py [--seeds 5] [--first 0] [--kinds "disc;shoe"]
[--flavours plain,hot] [--json F]`

The independent models (`oracles/independent`) are NumPy and SciPy, written from the
equations of docs/theory: they share the numbers of a scene with simbrake and nothing
else. A scene is drawn by its kind, flavour and seed:

- `plain`: a lever of straight lines with jumps and releases, a load torque of both
  signs, static above kinetic friction
- `hot`: the same with lumps for rim, linings and band, contacts that open, convection
  at the speed of each body, radiation, Stribeck friction that fades, wear
- `fill`: a filling actuator, a load on the hook, Stribeck friction

A resolved bandage has 4, 3 and 6 linings in these, springs with and without dampers,
and beside `plain` friction on the rim that depends on the speed of every lining.

Compared are the modes that last and the events, their times, and at the end states,
energies, temperatures and wear. Exit code 1 where anything differs.
"""

import json
import os
import pathlib
import sys
import time

os.environ.setdefault("JAX_PLATFORMS", "cpu")
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))

from oracles.independent.asked import scenes_asked
from oracles.independent.compare import compare


def row(one):
    """A line about a scene."""
    verdict = f"DIFFERS: {one.differs}" if one.differs else "agrees"
    return (
        f"{one.name:36} {one.modes:4} modes {one.events:4} events  {one.times:8.1e} "
        f"s {one.states:8.1e}  {verdict}"
    )


def main():
    scenes, file = scenes_asked(__doc__, 5)
    found = []
    start = time.process_time()
    for scene in scenes:
        found.append(compare(*scene))
        print(row(found[-1]), flush=True)
    wrong = [one for one in found if one.differs]
    events = sum(one.events for one in found)
    modes = sum(one.modes for one in found)
    times, margins, states = (
        max(each)
        for each in zip(*((x.times, x.margins, x.states) for x in found), strict=True)
    )
    print(
        f"{len(found)} scenes, {len(found) - len(wrong)} agree; {modes} modes, "
        f"{events} events; largest difference of a"
        f" time {times:.1e} s (as margin {margins:.1e}), of states and energies {states:.1e};"
        f" {time.process_time() - start:.0f} CPU s"
    )
    if file:
        pathlib.Path(file).write_text(
            json.dumps([one._asdict() for one in found], indent=1), "utf-8"
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
