"""The modes of the scenes as expressions, for tools that take symbols or text;
`written(case)` gives them."""

from benchmarks.peers.written import chain, cycles, staged, stop
from benchmarks.peers.written.form import Written
from benchmarks.scenes import Case, Chain, Cycles, Staged, Stop

_SCENES = {Stop: stop, Staged: staged, Chain: chain, Cycles: cycles}


def written(case: Case) -> dict[str, Written]:
    """Modes by name, those in which nothing changes left out; states and guards as in
    `equations.automaton_of`."""
    return _SCENES[type(case.plain)].written(case.plain)
