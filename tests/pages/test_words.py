"""Phrases replaced by a standard term do not come back in strings and comments, docs, scenarios and data."""

import io
import pathlib
import re
import tokenize

ROOT = pathlib.Path(__file__).parents[2]

#: phrases that have a standard term instead; words with good uses elsewhere (found, number, passed) are not here
RETIRED = (
    r"\bnot admissible\b|\binadmissible\b",
    r"\bmend(?:s|ed|ing)?\b",
    r"\bno news\b",
    r"\b\d+ faults?\b",
    r"\bends? to hold\b",
    r"\bto blame\b",
    r"\btells? two \w+ apart\b",
    r"\bstands on\b",
    r"\bwhy they part\b",
    r"\bdepth of heat\b",
    r"\bshare into the rim\b",
    r"\bheat given away\b",
    r"\bpower at first\b",
    r"\banswers? from outside\b",
    r"\bthrown over\b|\bthrows? the lever\b",
    r"\blines of the tackle\b",
    r"\bset (?:it )?into the slips\b|\brun in \d+ stands\b",
    r"\bmay stand (?:in|there|for)\b",
    r"\bis no (?:key|metric|result)\b",
    r"\bat the door\b",
    r"\bcame to no end\b",
    r"\bsays so beside\b",
    r"\bhandy units?\b",
    r"\bfair sample\b",
    r"\bbod(?:y|ies) of (?:its|their) own\b",
    r"\bmoves? for (?:itself|themselves)\b",
    r"\bwhat (?:a person|people) reads?\b",
    r"\ba \w+ of its own\b",
    r"\broom for\b",
    r"\bnobody (?:knows|reads)\b",
    r"\bcannot be meant\b",
    r"\bin sum\b",
    r"\bgo on from there\b|\bgoes on from there\b",
    r"\bwhat gave what\b",
)


def prose(path: pathlib.Path) -> str:
    """Strings and comments of a module, all of another file."""
    text = path.read_text("utf-8")
    if path.suffix != ".py":
        return text
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    words = {"STRING", "FSTRING_MIDDLE", "COMMENT"}
    return "\n".join(token.string for token in tokens if tokenize.tok_name[token.type] in words)


def test_retired_phrases_stay_retired():
    patterns = ("simbrake/**/*.py", "simbrake/**/*.csv", "docs/**/*.md", "scenarios/*.*", "README.md")
    texts = {path: prose(path) for pattern in patterns for path in ROOT.glob(pattern)}
    assert len(texts) > 150
    retired = re.compile("|".join(RETIRED), re.IGNORECASE)
    # a phrase may continue on the next line, with quotes or the sign of a comment in between
    joined = {path.relative_to(ROOT): re.sub(r"\"?\n[\s#:>f\"-]*", " ", text) for path, text in texts.items()}
    found = [f"{path}: {match[0]}" for path, text in joined.items() for match in retired.finditer(text)]
    assert found == []
