"""The compiled functions that a survey of a rigid body calls, in the order of compiling: the longest first."""

from sweeps.systems.system import Kernel

A_POINT = {"I1": 1.0, "I2": 2.0, "I3": 3.0, "axis": 2, "omega0": 1.0, "epsilon": 1e-6, "phase": 0.6}
RUN = (1.0, 16, 1e-9)
ROW, NUMBERS, WORK = "float64[::1]", "int64[::1]", "UniTuple(boolean, 5)"
LANES = "float64[:, :, ::1]"
SURVEY = (  # first what `_run` links
    Kernel("estimates", "fill", f"{ROW}, {WORK}, int64, int64, boolean, float64", seconds=2.5),
    Kernel("lanes", "advance", f"{ROW}, int64, int64", seconds=2.0),
    Kernel("lanes", "sample", f"{ROW}, int64, int64", seconds=1.0),
    Kernel("lanes", "begin_exact", f"{ROW},", seconds=1.0),
    *(
        Kernel("lanes", name, f"{ROW},", seconds=0.2)
        for name in ("_exact_samples", "guess", "log_sample", "begin", "watch_invariants", "begin_recurrence")
    ),
    *(Kernel("lanes", name, f"{ROW},", seconds=0.1) for name in ("begin_invariants", "certify", "begin_reduction")),
    Kernel("survey", "_keep", f"{ROW}, {NUMBERS}, float64[:, ::1]", seconds=0.1),
    Kernel("survey", "_gather", f"{ROW}, {ROW}, {NUMBERS}, int64", seconds=0.2),
    Kernel("lanes", "follow", f"{ROW}, int64, int64, int64, {WORK}, int64", seconds=1.0, stage=1),
    Kernel(
        "survey",
        "_run",
        f"{ROW}, {NUMBERS}, UniTuple({NUMBERS}, 2), Tuple((float64, int64, float64, boolean, boolean)), {WORK}, "
        f"Tuple(({NUMBERS}, {LANES}, uint32[::1]))",
        seconds=1.5,
        stage=2,
    ),
    Kernel("survey", "theory", example=(A_POINT,), seconds=1.0),
    Kernel("survey", "_choose", f"{ROW}, int64, float64, {NUMBERS}", seconds=0.5),
    Kernel("survey", "_lay_out", f"{ROW}, UniTuple({ROW}, 6)", seconds=0.5),
    Kernel("blocks", "cut", f"{NUMBERS}, int64", seconds=0.4),
    Kernel("survey", "_plan", f"{ROW}, {NUMBERS}, float64, int64, {NUMBERS}", seconds=0.3),
    *(
        Kernel("survey", "_sort_back", f"int64, {ROW}, uint32[::1], int64, int64, {kind}[:, ::1]", seconds=0.1)
        for kind in ("float64", "int32", "int8")
    ),
)
FLIPS = Kernel("survey", "flipped", "", (A_POINT,), 4.0, 0, lambda sweep: sweep.integration.flips)
COLLAPSED = Kernel("survey", "collapsed", "", (A_POINT, *RUN), 1.0, 3, lambda sweep: sweep.integration.collapse)
IN_SPACE = Kernel("in_space", "survey", "", (A_POINT, *RUN), 6.0, 0, lambda sweep: sweep.integration.attitude)
KERNELS = (*SURVEY, FLIPS, IN_SPACE, COLLAPSED)
