"""A program: reads lists of arguments of pytest as JSON, prints the tests that each of
them collects."""

import json
import sys

import pytest


class _Collected:
    """A plugin of pytest that keeps the names of the collected tests."""

    def __init__(self):
        self.names: list[str] = []

    def pytest_collection_finish(self, session):
        self.names = [item.nodeid for item in session.items]


def main():
    """Collect for every list on stdin in one process, which imports the test files
    once."""
    answers = []
    for arguments in json.load(sys.stdin):
        plugin = _Collected()
        pytest.main(
            ["--collect-only", "-qq", "-n", "0", "-p", "no:cacheprovider", *arguments],
            plugins=[plugin],
        )
        answers.append(plugin.names)
    print("\n" + json.dumps(answers))


if __name__ == "__main__":
    main()
