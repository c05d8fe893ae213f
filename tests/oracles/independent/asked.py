"""Random scenes that a script is asked for."""

import argparse

from oracles.independent.draws import FLAVOURS, KINDS


def scenes_asked(words, seeds):
    """Kinds, flavours and seeds from the command line, by default that many seeds of
    each, and the file for the numbers, if any."""
    parser = argparse.ArgumentParser(
        description=words, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--seeds", type=int, default=seeds, help="scenes of each kind and flavour"
    )
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument(
        "--kinds", default=";".join(KINDS), help="separated by semicolons; default: all"
    )
    parser.add_argument("--flavours", default=",".join(FLAVOURS), help="default: all")
    parser.add_argument("--json", help="file for the numbers")
    options = parser.parse_args()
    kinds = options.kinds.split(";")
    flavours = options.flavours.split(",")
    if unknown := [*(set(kinds) - set(KINDS)), *(set(flavours) - set(FLAVOURS))]:
        parser.error(
            f"unknown: {', '.join(unknown)}; there are {'; '.join(KINDS)} and {', '.join(FLAVOURS)}"
        )
    scenes = [
        (kind, flavour, seed)
        for kind in kinds
        for flavour in flavours
        for seed in range(options.first, options.first + options.seeds)
    ]
    return scenes, options.json
