"""Tables of a run for other programs: an Excel workbook, CSV, a MATLAB file. Numbers are in SI."""

import pandas as pd
from scipy.io import savemat

import simbrake as sb

data = sb.dataset(sb.simulate(sb.read_scene("u2_5_5_stop")))
once = data.isel(time=data.side >= 0)  # every time once: at events the values after them


def of_lining(name: str) -> pd.DataFrame:
    return once[name].to_pandas().add_prefix(f"{name}_")


plain = [name for name, column in once.data_vars.items() if column.dims == ("time",)]
numbers = [(name, one.item(), one.units, one.meaning) for name, one in data.data_vars.items() if one.ndim == 0]
tables = {
    "series": once[plain].drop_vars("side").to_dataframe().join([of_lining("tension"), of_lining("normal_load")]),
    "events": data[["event_time", "event_name", "event_lining"]].to_dataframe(),
    "metrics": pd.DataFrame(numbers, columns=["name", "value", "unit", "meaning"]).set_index("name"),
}
with pd.ExcelWriter("stop.xlsx") as book:
    for title, table in tables.items():
        table.to_excel(book, sheet_name=title)
tables["series"].to_csv("series.csv")
savemat("stop.mat", {name: table.reset_index().to_dict("series") for name, table in tables.items()})
print({title: table.shape for title, table in tables.items()})
