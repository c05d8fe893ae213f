"""What is wrong with an input; free of JAX, so that a command can say it before it loads."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Fault:
    """One thing wrong with an input: where, what stands there, and what to do."""

    path: str
    problem: str
    hint: str = ""

    def __str__(self) -> str:
        return f"{self.path}: {self.problem}" + (f" — {self.hint}" if self.hint else "")


class InputError(ValueError):
    """All faults of an input in one report."""

    def __init__(self, faults: list[Fault]):
        self.faults = tuple(faults)
        count = "1 fault" if len(faults) == 1 else f"{len(faults)} faults"
        super().__init__("\n".join([f"the input has {count}:", *(f"  {fault}" for fault in faults)]))
