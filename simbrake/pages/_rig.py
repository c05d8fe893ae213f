"""The duty ledger of a rig as a page, and in files."""

from collections.abc import Iterator
from pathlib import Path

from .._base._faults import whole_folder
from .._base._numbers import Number, number
from .._base._table import Table
from ..outputs.judgement import Colour
from ..rig import figures
from ..rig._ledger import Ledger
from ..rig._replay import Comparison, Replay, compare
from ..runs.findings import upper
from ._page import Contents, Picture, draw, flat, render, write_json
from ._rows import BADGES, Tile, in_prose, key_figures

#: the figures of a ledger and of a replay
PICTURE = Picture(figures.ledger, "Lowerings and their work")
REPLAYED = Picture(figures.replay, "Replayed on the scene")


def contents(book: Ledger, comparison: Comparison | None = None) -> Contents:
    """Contents of the page of a ledger, with those of a replay beside its log."""
    page = _of_ledger(book)
    if comparison is None:
        return page
    replay = comparison.replay
    compared = list(comparison.parts())
    verdict = replay.verdict
    # (the limits are those of the run, the headline says what made its colour)
    answer = [in_prose(text) for text in replay.answer]
    section = (
        replay.readable,
        *compared[:-1],
        comparison.table.readable(*_COMPARED, title="beside the recording"),
    )
    notes = Table(["note"], [(text,) for text in replay.notes])
    return page | {
        "verdict": verdict._replace(headline=in_prose(verdict.headline)),
        "badges": BADGES,
        "outcome": upper("; ".join([*answer[:1], *answer[2:], *book.answer])) + ".",
        "figures": [*key_figures(replay.result.report()), *page["figures"]],
        "pictures": [draw(comparison, REPLAYED), *page["pictures"]],
        "sections": [("replay", "Replay", (*section, notes)), *page["sections"]],
    }


#: columns of a comparison for reading
_COMPARED = (
    "begin",
    *(
        f"{channel}_{name}"
        for channel in ("position", "load")
        for name in ("count", "rmse", "bias", "within")
    ),
)


def _of_ledger(book: Ledger) -> Contents:
    """Contents of the page of a ledger alone."""
    answer = book.answer
    source = book.lowerings.log.source
    return {
        "title": "Duty of the brakes" + ("" if source == "log" else f": {source}"),
        "kind": "ledger",
        # without limits nothing can be exceeded, and nothing be good
        "verdict": {
            "colour": Colour.AMBER,
            "headline": upper(answer[0]),
            "rows": (),
            "reason": "",
        },
        "badges": {},
        "outcome": "; ".join(answer[1:]) + ".",
        "figures": sorted(_figures(book), key=lambda tile: not tile.decides),
        "film": False,
        "panel": "",
        "data": None,
        "pictures": [draw(book, PICTURE)],
        "notes": (),
        "sections": [
            ("lowerings", "Lowerings", book.tables[:-2]),
            ("totals", "Totals", book.tables[-2:]),
            ("assumptions", "Assumptions and refusals", tuple(_assumptions(book))),
        ],
    }


def _figures(book: Ledger) -> Iterator[Tile]:
    """Key figures; the work at the hook and by friction decide."""
    totals = book.totals
    counts = book.counts
    lowerings = book.lowerings
    words = {
        "hook_work": "Work at the hook",
        "drum_work": "Work at the drum",
        "tackle_loss": "Loss of the tackle",
        "auxiliary_work": "Auxiliary brake or motor",
        "friction_work": "Friction brakes",
    }
    for name, title in words.items():
        ends = [
            number(totals.get(f"{name}_{end}"), "J", count=3) for end in ("low", "high")
        ]
        note = f"{ends[0]} … {ends[1]}" if name == "hook_work" else ""
        if totals[name] is not None:
            yield Tile(
                title,
                number(totals[name], "J", count=3),
                note,
                name in ("hook_work", "friction_work"),
            )
    yield Tile("Travel downwards", number(totals["travel"], "m", count=3), "")
    yield Tile(
        "Lowerings",
        Number(str(counts["valid"])),
        f"{counts['flagged']} more are flagged and left out",
    )
    yield Tile(
        "Load not decidable",
        Number(str(counts["not_decidable"])),
        "string, or block alone",
    )
    if lowerings.tare is not None:
        value, low, high = (number(x, "N", count=3) for x in lowerings.tare)
        yield Tile("Load without string", value, f"{low} … {high}")


def _assumptions(book: Ledger) -> Iterator[str | Table]:
    lowerings = book.lowerings
    yield Table(
        ["note"],
        [(text,) for text in dict.fromkeys((*book.notes, *lowerings.log.guesses))],
    )
    limits = {name: x for name, x in lowerings.thresholds.items() if x is not None}
    yield Table(["argument", "value"], flat({**book.given, **limits}), "in SI units")


def write_ledger(recorded: Ledger | Replay, folder: str | Path) -> list[Path]:
    """Write a ledger, or a replay with its ledger, into a folder, all or none; return
    the paths.

    The files are `ledger.html` (a page), `.csv`, `.json`, `.png` and `.txt`; of a
    replay also `replay.csv` and `.png`.

    Raises `InputError` where the folder cannot be written.

    Example:
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     sorted(path.name for path in sb.pages.write_ledger(book, folder))
        ['ledger.csv', 'ledger.html', 'ledger.json', 'ledger.png', 'ledger.txt']
    """
    book = recorded.book if isinstance(recorded, Replay) else recorded
    comparison = compare(recorded) if isinstance(recorded, Replay) else None
    with whole_folder(Path(folder)) as (scratch, written):
        (scratch / "ledger.html").write_text(
            render(contents(book, comparison)), "utf-8"
        )
        (scratch / "ledger.txt").write_text(f"{recorded}\n", "utf-8")
        write_json(scratch / "ledger.json", recorded.as_dict())
        if comparison is not None:
            _as_csv(recorded.table, scratch / "replay.csv")
            REPLAYED.figure(comparison).savefig(scratch / "replay.png", dpi=130)
        _as_csv(book.table, scratch / "ledger.csv")
        PICTURE.figure(book).savefig(scratch / "ledger.png", dpi=130)
    return written


def _as_csv(table: Table, file: Path) -> None:
    frame = table.frame()
    frame["flags"] = [", ".join(flags) for flags in frame["flags"]]
    frame.to_csv(file, index=False, lineterminator="\n")
