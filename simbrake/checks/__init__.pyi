from ._cross_check import CrossCheck as CrossCheck
from ._cross_check import cross_check as cross_check
from ._validate import validate as validate
from ._validation import Case as Case
from ._validation import Check as Check
from ._validation import Validation as Validation
from ._validation import run_case as run_case
