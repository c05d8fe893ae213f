"""The releases of JAX that simbrake was tested with."""

import warnings

#: the bounds of JAX in pyproject.toml: its minor releases change what simbrake calls
OLDEST_JAX = (0, 9)
FIRST_UNTESTED_JAX = (0, 13)


def warn_of_untested_jax(version: tuple[int, ...]) -> None:
    """Warn in one line if this version of JAX is newer than tested: pip may be told to ignore the bounds."""
    if version >= FIRST_UNTESTED_JAX:
        installed, bound = (".".join(map(str, numbers)) for numbers in (version, FIRST_UNTESTED_JAX))
        text = f"JAX {installed} is newer than simbrake was tested with (below {bound}); pip install 'jax<{bound}'"
        # a file name that is none: Python would print the source line as a second line
        warnings.warn_explicit(text, UserWarning, "<simbrake>", 0)
