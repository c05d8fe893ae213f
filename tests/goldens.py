"""Texts that are compared as a whole with those kept in tests/files/golden;
`pytest --renew` writes them anew."""

import pathlib

import pytest
from picture_scenes import legend

import simbrake as sb

FOLDER = pathlib.Path(__file__).parent / "files" / "golden"


def assert_kept(request, name, text):
    """`text` is that of the file `name`.txt; their difference is for review."""
    file = FOLDER / f"{name}.txt"
    if request.config.getoption("renew"):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, "utf-8")
    assert text == file.read_text("utf-8"), (
        f"renew it with --renew, if this is meant: {file.name}"
    )


def words_of(figure):
    """Title, legends and axes of a figure, a line for each."""
    rules = [one.get_title().get_text() for one in figure.legends]
    lines = (
        [
            figure.get_suptitle() or "",
            *(f"rule: {text}" for text in rules if text),
            *(f"legend: {text}" for text in legend(figure)),
        ]
        if figure.axes
        else []
    )
    for axes in figure.axes:
        if axes.axison or axes.get_legend():
            titles = [axes.get_title(), axes.get_title(loc="left")]
            lines.append(
                " | ".join(
                    [
                        "axes",
                        *filter(None, titles),
                        axes.get_xlabel(),
                        axes.get_ylabel(),
                    ]
                )
            )
            lines += [f"  {text}" for text in legend(axes)]
    return "\n".join(line.replace("\n", " / ") for line in lines) + "\n"


def assert_refused(request, name, cases):
    """The reports of input errors, one after the other, are those kept: of scenes, and
    of functions that raise them or make such a scene."""
    reports = []
    for case in cases:
        with pytest.raises((sb.InputError, TypeError, ValueError)) as caught:
            sb.check_scene(case() if callable(case) else case)
        reports.append(f"{caught.value}\n")
    assert_kept(request, f"errors/{name}", "\n".join(reports))
