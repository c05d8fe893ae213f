"""The tests' own compile flags: used only where XLA accepts them, and not at all where the user asks."""

import json
import os

import compile_flags
import pytest


def test_only_accepted_flags_are_used_and_asked_once(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(compile_flags, "accepted", lambda flag: asked.append(flag) or flag == "--good")
    for _ in range(2):
        assert compile_flags.accepted_flags(tmp_path, ("--good", "--bad")) == ["--good"]
    assert asked == ["--good", "--bad"]
    (file,) = tmp_path.iterdir()
    assert json.loads(file.read_text("utf-8")) == {"--good": True, "--bad": False}
    file.write_text("{", "utf-8")  # a file cut short is asked for again
    assert compile_flags.accepted_flags(tmp_path, ("--good",)) == ["--good"]


@pytest.mark.parametrize(("flag", "survives"), [("--xla_no_such_flag=1", False), ("", True)])
def test_a_process_with_an_unknown_flag_dies(flag, survives):
    assert compile_flags.accepted(flag) == survives


@pytest.mark.parametrize(("before", "after"), [("--mine", "--mine --good"), ("", "--good")])
def test_flags_are_added_to_the_user_s(tmp_path, monkeypatch, before, after):
    monkeypatch.setattr(compile_flags, "accepted_flags", lambda folder: ["--good"])
    monkeypatch.setenv("XLA_FLAGS", before)
    compile_flags.set_flags(tmp_path)
    assert os.environ["XLA_FLAGS"] == after


def test_flags_of_the_tests_are_not_set_twice(tmp_path, monkeypatch):
    monkeypatch.setenv("XLA_FLAGS", compile_flags.FLAGS[1])  # as a worker inherits them
    compile_flags.set_flags(tmp_path)
    assert os.environ["XLA_FLAGS"] == compile_flags.FLAGS[1]
