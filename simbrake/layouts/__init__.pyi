from ._equal_layout import LayoutDesign as LayoutDesign
from ._equal_layout import LayoutRow as LayoutRow
from ._equal_layout import equal_layout as equal_layout
from ._least_tension import LeastTension as LeastTension
from ._least_tension import least_tension as least_tension
