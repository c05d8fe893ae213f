"""Frozen truths of validation cases: closed forms, quadrature, SciPy's integrators; imports nothing of simbrake.

    python tests/oracles/truths.py

writes `tests/validation/truths.csv`, and anew the rows of those subjects that `simbrake/checks/truths.csv` has.
Every function of the oracles is one subject and yields rows (what, truth, source, tolerance). The numbers of a scene
stand here and in the case that reads them, written twice. Derivatives are sixth-order central differences of the
oracle.
"""

import csv
import pathlib

import duties
import laws
import mechanisms

ROOT = pathlib.Path(__file__).parents[2]
SUBJECTS = mechanisms.SUBJECTS | laws.SUBJECTS | duties.SUBJECTS


def rows():
    for subject, oracle in SUBJECTS.items():
        for what, truth, source, tolerance in oracle():
            yield subject, what, float(truth), tolerance, source


def write(path, rows):
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("subject", "what", "truth", "tolerance", "source"))
        for subject, what, truth, tolerance, source in rows:
            writer.writerow((subject, what, f"{truth:.16g}", f"{tolerance:g}", source))


if __name__ == "__main__":
    found, shown = list(rows()), ROOT / "simbrake" / "checks" / "truths.csv"
    with shown.open(encoding="utf-8", newline="") as file:
        subjects = {row["subject"] for row in csv.DictReader(file)}
    write(ROOT / "tests" / "validation" / "truths.csv", found)
    write(shown, [row for row in found if row[0] in subjects])
