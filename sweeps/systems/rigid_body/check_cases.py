"""Check cases for simulators: exact motions of free rigid bodies, computed in 60 digits and rounded to doubles.

`check_cases.nc` has thirteen motions of 1,001 rows. Moments, first angular velocity and times are exact in decimal and
in binary; the body's axes at time 0 are those of space. `tests/check_cases.py` makes the file.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from sweeps.schema.datasets import Dataset
from sweeps.systems.bodies.variables import MOMENTS
from sweeps.systems.motion import label_columns, time_axis

PATH = Path(__file__).with_suffix(".nc")
RATES = ("omega1", "omega2", "omega3")
HOW = "computed in 60 digits, rounded"
NUMBERS = {  # name → meaning of a number of a case
    "conditioning_rad": "largest distance to the motions whose starts differ by the resolution of doubles, 2 ulp",
    "error_bound_rad": "bound on the error of every attitude",
}


def motions() -> Iterator[tuple[str, Dataset]]:
    """Yield name and motion of each check case: omega1 … omega3 and q0 … q3 over `time`, moments as scalars."""
    with xr.open_dataset(PATH) as cases:
        for name in cases["case"].values:
            case = cases.sel(case=name).load()
            columns = label_columns(case["omega"].values, case["q"].values, HOW)
            for rate in RATES:
                columns[rate][2]["units"] = case["unit"].item()
            unit = {"units": "1", "long_name": "principal moment of inertia, in any one unit"}
            columns |= {moment: ((), x, unit) for moment, x in zip(MOMENTS, case["moments"].values, strict=True)}
            columns |= {
                number: ((), case[number].item(), {"units": "rad", "long_name": text})
                for number, text in NUMBERS.items()
            }
            times = np.arange(case.sizes["time"]) * case["step"].item()
            yield (
                str(name),
                xr.Dataset(columns, {"time": time_axis(times, "the start")}, {"title": case["title"].item()}),
            )


def table(cases: dict[str, Dataset]) -> str:
    """Return a CSV table of the cases: title, moments, start, step and number of rows, conditioning and error."""
    lines = [
        "name,I1,I2,I3,omega1,omega2,omega3,unit of omega,step (s),rows,conditioning (rad),error bound (rad),title"
    ]
    for name, case in cases.items():
        numbers = [case[key].item() for key in MOMENTS] + [case[key].values[0] for key in RATES]
        numbers += [case["time"].values[1], case.sizes["time"]]
        texts = [*(f"{x:.17g}" for x in numbers), *(f"{case[key].item():.3g}" for key in NUMBERS), f'"{case.title}"']
        lines.append(",".join([name, *texts[:6], case["omega1"].attrs["units"], *texts[6:]]))
    return "\n".join(lines) + "\n"
