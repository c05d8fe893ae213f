from ._closed_form import InfeasibleLayout as InfeasibleLayout
from ._closed_form import chord_equal_load_angles as chord_equal_load_angles
from ._closed_form import equal_increment_angles as equal_increment_angles
from ._equal_layout import LayoutDesign as LayoutDesign
from ._equal_layout import LayoutRow as LayoutRow
from ._equal_layout import equal_layout as equal_layout
from ._least_tension import LeastTension as LeastTension
from ._least_tension import least_tension as least_tension
