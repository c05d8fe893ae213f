"""Frozen truths of `simbrake validate`: closed forms, quadrature, the models in `independent`; no simbrake.

    python tests/oracles/truths.py

writes `simbrake/checks/truths.csv`. Every function of the oracles is one subject and yields rows (what, truth, source,
tolerance). The numbers of a scene stand here and in the case that reads them, written twice. Derivatives are
closed forms, or sixth-order central differences of the oracle. Where it solves equations it has 16 digits at most.
"""

import csv
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[1]))

from oracles import closed_forms, laws, mechanisms

FILE = pathlib.Path(__file__).parents[2] / "simbrake" / "checks" / "truths.csv"
SUBJECTS = {16: mechanisms.SUBJECTS | laws.SUBJECTS, 17: closed_forms.SUBJECTS}


def rows():
    for digits, subjects in SUBJECTS.items():
        for subject, oracle in subjects.items():
            for what, truth, source, tolerance in oracle():
                yield subject, what, float(f"{truth:.{digits}g}"), tolerance, source


if __name__ == "__main__":
    with FILE.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("subject", "what", "truth", "tolerance", "source"))
        for subject, what, truth, tolerance, source in rows():
            writer.writerow((subject, what, repr(truth), f"{tolerance:g}", source))
