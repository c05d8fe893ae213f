"""The qualitative claims of the four papers, each as a run or a formula with its number
and a verdict.

`python papers/claims.py` prints them, `--write-docs` keeps them in
`docs/measured/claims.json`, `--fast` omits those that need runs of more than some
seconds. A claim is stated in our own words with its place in the paper; the verdict
follows from the number. Papers: Z Zhuravlov et al., S Skrypnyk, K Kryshtopa, V
Volchenko et al. Geometry from V and Z; all other numbers are the assumptions of the
scenarios that are used.
"""

import argparse
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
NUMBERS = HERE.parent / "docs" / "measured" / "claims.json"
sys.path.insert(0, str(HERE))
import claims_of_heat  # noqa: E402, F401  (each enters its claims)
import claims_of_layouts  # noqa: E402, F401
import claims_of_staged  # noqa: E402, F401
import claims_of_stress  # noqa: E402, F401
from claim import CLAIMS, CONFIRMED, CONTRADICTED, LIMITED, Claim, Found, Runs  # noqa: E402

PAPERS = {
    "Z": "Zhuravlov et al., *Dynamics of friction couples of a band-shoe brake*",
    "S": "Skrypnyk, *Assessment of energy loading of friction units*",
    "K": "Kryshtopa, *Compliance of elements of friction units*, part III",
    "V": "Volchenko et al., *Thermal transmission through metal friction elements*",
}

#: claims of which the package says nothing: paper, place, words, and why
WITHOUT_RUN = (
    (
        *("Z", "review, [6]", "microcracks grow until the rim breaks"),
        "there is no fracture mechanics; the cycles above are those to a first crack",
    ),
    (
        *(
            "S",
            "heat load",
            "above the permissible temperature double electric layers form on metal and linings",
        ),
        "surfaces have no electric state; electricity is at most a share of the friction power",
    ),
    (
        *(
            "S",
            "heat load",
            "hard and soft oxide films bridge the contact as thermoelements",
        ),
        "contacts have no films; a factor of friction over time is what can be given",
    ),
    (
        *(
            "S",
            "stabilisation",
            "desorption and decomposition of the linings' surface turn the heat flow round",
        ),
        "linings do not change in composition; the run above turns it by conduction alone",
    ),
    (
        *(
            "K",
            "thermal shock",
            "polarisation of the linings shifts their energy levels and stabilises them",
        ),
        "materials have no electric state; the run above has friction with memory instead",
    ),
    (
        *(
            "K",
            "advantages, 1",
            "metal parts of different stiffness in the two pairs lower the dynamic loads",
        ),
        "the rim is rigid, and bodies move along the band and about the shaft only",
    ),
    (
        *(
            "K",
            "advantages, 5",
            "thermoelectric or magnetic coolers and heat pipes are easy to fit",
        ),
        "this is about construction; a cooler is a coefficient or a conductance, as in "
        "the run above",
    ),
    (
        *(
            "K",
            "overlap",
            "asperities of the band cut grooves, by which the overlap grows in the first stage",
        ),
        "overlap is that of faces, which are smooth",
    ),
    (
        *(
            "V",
            "introduction",
            "spots of contact bulge by their heat, take up the load, wear and part again",
        ),
        "temperatures are means around the track, and faces keep their shape",
    ),
)


def unsaid() -> list[str]:
    """A line for each claim without a run."""
    return [
        f"{paper}, {place}: {words}. No run: {why}."
        for paper, place, words, why in WITHOUT_RUN
    ]


def page(found: list[dict[str, str]]) -> str:
    """Tables by paper, as `docs/published.md` shows them."""
    verdicts = [row["verdict"] for row in found]
    counts = ", ".join(
        f"{verdicts.count(v)} {v}" for v in (CONFIRMED, LIMITED, CONTRADICTED)
    )
    lines = [f"{len(found)} claims: {counts}."]
    for paper, title in PAPERS.items():
        lines += [
            "",
            f"## {paper}",
            "",
            f"{title}.",
            "",
            "| claim | place | found | verdict |",
            "|---|---|---|---|",
        ]
        mine = [row for row in found if row["paper"] == paper]
        lines += [
            f"| {r['claim']} | {r['place']} | {r['found']} | **{r['verdict']}** |"
            for r in mine
        ]
    lines += ["", "## Claims without a run", "", *(f"- {line}" for line in unsaid())]
    return "\n".join(lines) + "\n"


def row_of(one: Claim, result: Found) -> dict[str, str]:
    """What is kept of a claim."""
    words = f"{one.words} ({one.like})" if one.like else one.words
    return {
        "paper": one.paper,
        "claim": words,
        "place": one.place,
        "found": result.text,
        "verdict": result.verdict,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n\n")[0])
    parser.add_argument("--fast", action="store_true", help="formulas alone, no runs")
    parser.add_argument(
        "--write-docs", action="store_true", help="write docs/measured/claims.json"
    )
    options = parser.parse_args()
    if options.fast and options.write_docs:
        parser.error("the page has all claims: --write-docs without --fast")
    runs = Runs()
    found = []
    for one in CLAIMS:
        if one.fast or not options.fast:
            result = one.find(runs)
            found.append((one, result))
            print(
                f"{one.paper}, {one.place}: {one.words}\n    {result.text}\n    -> "
                f"{result.verdict}",
                flush=True,
            )
    print("\nwithout a run:", *unsaid(), sep="\n")
    if options.write_docs:
        kept = sorted(
            (row_of(*pair) for pair in found),
            key=lambda row: list(PAPERS).index(row["paper"]),
        )
        NUMBERS.write_text(
            json.dumps(kept, indent=1, ensure_ascii=False) + "\n", "utf-8"
        )


if __name__ == "__main__":
    main()
