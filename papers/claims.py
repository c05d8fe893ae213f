"""The qualitative claims of the four papers, each as a run or a formula with its number and a verdict.

`python papers/claims.py` prints them, `--write-docs` writes `docs/claims.md`, `--fast` omits those that need runs of
more than some seconds. A claim is stated in our own words with its place in the paper; the verdict follows from the
number. Papers: Z Zhuravlov et al., S Skrypnyk, K Kryshtopa, V Volchenko et al. Geometry from V and Z; all other numbers
are the assumptions of the scenarios that are used.
"""

import argparse
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE))
import claims_of_heat  # noqa: E402, F401  (each enters its claims)
import claims_of_layouts  # noqa: E402, F401
import claims_of_staged  # noqa: E402, F401
from claim import CLAIMS, CONFIRMED, CONTRADICTED, LIMITED, Claim, Found, Runs  # noqa: E402

PAPERS = {
    "Z": "Zhuravlov et al., *Dynamics of friction couples of a band-shoe brake*",
    "S": "Skrypnyk, *Assessment of energy loading of friction units*",
    "K": "Kryshtopa, *Compliance of elements of friction units*, part III",
    "V": "Volchenko et al., *Thermal transmission through metal friction elements*",
}


def page(found: list[tuple[Claim, Found]]) -> str:
    """`docs/claims.md`."""
    counts = ", ".join(f"{sum(f.verdict == v for _, f in found)} {v}" for v in (CONFIRMED, LIMITED, CONTRADICTED))
    lines = [
        "# The papers' claims",
        "",
        "What the four papers claim in words, examined by a run or a formula. Each claim is in our words "
        "with its place",
        "in the paper; the verdict is computed from the number. Scenes are those of `scenarios/`, with "
        "their assumptions;",
        "what a comparison keeps equal is in brackets. The printed tables: [the papers recomputed](published.md).",
        "",
        f"{len(found)} claims: {counts}. `python papers/claims.py` prints them,",
        "with `--write-docs` it writes this page.",
    ]
    for paper, title in PAPERS.items():
        lines += ["", f"## {paper}", "", f"{title}.", "", "| claim | place | found | verdict |", "|---|---|---|---|"]
        for one, result in found:
            if one.paper == paper:
                like = f" ({one.like})" if one.like else ""
                lines.append(f"| {one.words}{like} | {one.place} | {result.text} | **{result.verdict}** |")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--fast", action="store_true", help="formulas alone, no runs")
    parser.add_argument("--write-docs", action="store_true", help="write docs/claims.md")
    options = parser.parse_args()
    if options.fast and options.write_docs:
        parser.error("the page has all claims: --write-docs without --fast")
    runs, found = Runs(), []
    for one in CLAIMS:
        if one.fast or not options.fast:
            result = one.find(runs)
            found.append((one, result))
            print(f"{one.paper}, {one.place}: {one.words}\n    {result.text}\n    -> {result.verdict}", flush=True)
    if options.write_docs:
        (HERE.parent / "docs" / "claims.md").write_text(page(found), "utf-8")


if __name__ == "__main__":
    main()
