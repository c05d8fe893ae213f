"""The printed tables as `docs/published.md` shows them.

`python papers/write_page.py` draws the figures of that page, in half a minute.
"""

import itertools
import pathlib
import sys

import printed_tables as tables
from printed_tables import AGREES, published_rows

DOCS = pathlib.Path(__file__).parents[1] / "docs"
NAMES = {
    "k": "k",
    "f": "f",
    "scheme": "pitch",
    "w0": "w₀",
    "tau_m": "τ_m",
    "T_max": "T_max",
    "N_max": "N_max",
} | {
    "gamma": "γ",
    "alpha_deg": "α, °",
    "beta_deg": "β, °",
    "r_m": "r, m",
    "R_m": "R, m",
    "L_m": "L, m",
    "lambda_W_mK": "λ, W/(m·K)",
    "resistance": "W, K/W",
    "K": "1/W, W/K",
    "T_polished_C": "polished, °C",
    "T_matte_C": "matte, °C",
    "T_band_C": "band, °C",
    "delta_s_um": "δ_s, µm",
    "share_metal": "a, metal",
    "share_lining": "1 − a, lining",
    "delta_mm": "δ, mm",
    "B": "B, 1/s",
    "tau_m_consistent": "τ_m*",
}
#: columns that identify a row
LABELS = {
    "Z1": "f",
    "Z2": "f",
    "Z3": "f",
    "Z4": "f",
    "Z5": "k scheme",
    "Z6": "k scheme",
    "V1": "element lambda_W_mK",
}
LABELS |= {"V2": "T_polished_C", "S1": "part material delta_mm"}


def named(column: str) -> str:
    """Heading of a column of a printed table."""
    digits = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
    if column in NAMES:
        return NAMES[column]
    if column.startswith("beta"):
        return f"β{column[4:-4].translate(digits)}, °"
    return column.replace("alpha", "α").translate(digits)


def shown(printed: str, computed: float) -> str:
    """The computed number with one place more than the printed one."""
    return f"{computed:.{len(printed.partition('.')[2]) + 1}f}"


def section(name: str, of: list) -> list[str]:
    """One table: printed above computed, misprints in bold, and the reason of each."""
    rows = published_rows(name)
    found = {(c.row, c.column): c for c in of}
    extra = [
        column
        for column in dict.fromkeys(c.column for c in of)
        if column not in rows[0]
    ]
    head = [*rows[0], *extra]
    lines = [
        "| " + " | ".join(named(column) for column in head) + " |",
        "|---" * len(head) + "|",
    ]
    for i, row in enumerate(rows):
        cells = []
        for column in head:
            printed = row.get(column, "")
            cell = found.get((i, column))
            if cell is None:
                cells.append(printed.replace("_", " ") or "–")
            elif column in extra:
                cells.append(shown("0.00", cell.computed))
            elif column in ("k", "f"):
                cells.append(
                    printed
                    if cell.verdict == AGREES
                    else f"**{printed}**<br>{cell.computed:g}"
                )
            elif cell.verdict == AGREES:
                cells.append(f"{printed}<br>{shown(printed, cell.computed)}")
            else:
                cells.append(f"**{printed}**<br>{shown(printed, cell.computed)}")
        lines.append("| " + " | ".join(cells) + " |")
    wrong = [c for c in of if c.verdict != AGREES and c.column not in extra]
    if wrong:
        lines.append("")
    for (row, reason), group in itertools.groupby(wrong, lambda c: (c.row, c.reason)):
        label = ", ".join(
            f"{named(column)} {rows[row][column]}" for column in LABELS[name].split()
        )
        columns = ", ".join(named(c.column).removesuffix(", °") for c in group)
        lines.append(f"- {label.replace('_', ' ')}: {columns}: {reason}")
    lines.append("")
    return lines


def block(table: str) -> str:
    """One table, counts first; all of them counted for `all`."""
    if table == "all":
        return f"All tables: {tables.counted(tables.cells())}."
    of = [c for c in tables.cells() if c.table == table]
    return "\n".join([f"{tables.counted(of)}.", "", *section(table, of)])


def main() -> None:
    sys.path.insert(0, str(DOCS))
    from make_pictures import save
    from paper_figures import PUBLISHED, file_stem, published

    for name in PUBLISHED:
        save(published(name), file_stem(name))


if __name__ == "__main__":
    main()
