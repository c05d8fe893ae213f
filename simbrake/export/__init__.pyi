from ._c_export import Export as Export
from ._c_export import c_text as c_text
from ._c_export import export_c as export_c
from ._c_export import possible_inputs as possible_inputs
from ._fmu import export_fmu as export_fmu
