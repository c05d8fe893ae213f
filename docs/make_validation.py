"""Writes the table of cases in docs/validation.md: `python docs/make_validation.py`."""

import pathlib

BEGIN, END = "<!-- cases: begin -->\n", "<!-- cases: end -->\n"


def table() -> str:
    """The cases of `simbrake validate` as a table, in Markdown."""
    from simbrake.checks._validate import chosen

    lines = ["| case | truth | source | tolerance |", "|---|---|---|---|"]
    for lane in chosen():
        for case in lane:
            source = case.source.replace("|", "\\|")
            lines.append(f"| {case.name} | {case.truth:.12g} | {source} | {case.tolerance:.1e} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    file = pathlib.Path(__file__).parent / "validation.md"
    text = file.read_text("utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    file.write_text(before + BEGIN + table() + END + after, "utf-8")


if __name__ == "__main__":
    main()
