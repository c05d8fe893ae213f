"""Types checked at run time as pyright reads them: a whole number is a float, too (PEP
484's numeric tower)."""

from beartype import BeartypeConf, beartype

checked = beartype(conf=BeartypeConf(is_pep484_tower=True))
