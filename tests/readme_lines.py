"""The set-up lines that README.md promises, which CI runs, and the commands named as
evidence of claims."""

import re


def set_up_line(pattern, text):
    """The one line of the `sh` blocks of `text` that matches; `ValueError` if there is
    none, or more than one."""
    lines = [
        line
        for block in re.findall(r"^```sh\n(.*?)^```", text, re.S | re.M)
        for line in block.splitlines()
    ]
    found = [line for line in lines if re.fullmatch(pattern, line)]
    if len(found) != 1:
        raise ValueError(
            f"README.md: {len(found)} lines of its sh blocks match {pattern!r}, one is needed"
        )
    return found[0]


def install_and_run(text):
    """The line of README.md that installs simbrake and runs its main scenario."""
    return set_up_line(r"pip install -e \. && simbrake run \S+", text)


def install_and_test(text):
    """The line of README.md that installs what the tests need and runs them."""
    return set_up_line(r"pip install -e '\.\[test\]' && pytest", text)


def claims(text):
    """The commands of each row of the table of claims, from its last column."""
    table = text.split("| claim | figure | command |\n", 1)[1].split("\n\n", 1)[0]
    return [
        re.findall(r"`([^`]+)`", row.rsplit("|", 2)[1])
        for row in table.splitlines()[1:]
    ]
