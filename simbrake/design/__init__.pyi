from . import formulas as formulas
from . import layouts as layouts
