"""CasADi's CVODES with its (experimental) zero-crossing events: the whole stop is one compiled call.

The mode is a constant state that the transition function raises by one, so are the times of the events; states are in
units of their typical sizes, as CasADi has one absolute tolerance for all. Its events come to about 1e-9 s whatever the
tolerance of their search.
"""

import numpy as np

from benchmarks.scenes import Answer, Case, Cycles, Stop

NAME, PACKAGES, PIP, AGREES = "CasADi", ("casadi",), "casadi", 1e-6


def methods(case: Case) -> dict[str, str | None]:
    if isinstance(case.plain, Cycles):
        missing = "its events fire once each: a sequence that repeats is not written"
        return dict.fromkeys(("CasADi CVODES BDF", "CasADi CVODES Adams"), missing)
    if not isinstance(case.plain, Stop):
        lost = "tried with its events: their search ended with CV_ILL_INPUT at every tolerance"
        return dict.fromkeys(("CasADi CVODES BDF", "CasADi CVODES Adams"), lost)
    # seen at every tolerance, with steps limited too
    early = "its event search finds the band sticking 2.5e-7 s after full slip, in the first steps of the stiff layer"
    why = early if case.stiff else None
    return {"CasADi CVODES BDF": why, "CasADi CVODES Adams": why}


def _stop(p: Stop):
    """States (ω, φ, x, T…), their sizes, right-hand sides and guards of the modes, and which of them is the first."""
    import casadi as ca

    k = 0 if p.rates is None else len(p.rates)
    X = ca.SX.sym("X", 3 + k)  # pyright: ignore
    w, x, T = X[0], X[2], X[3:]
    grip = p.T_0 * (p.Pi - 1)
    heating, v = ca.SX(k, 1), p.R * w
    cooling = ca.SX(k, 1)
    if p.rates is not None and p.into is not None:
        fz = p.f * p.z * (1 - p.fade * T[0])
        T_n = p.T_0 * ((1 + fz) / (1 - fz)) ** p.n
        grip = T_n - p.T_0
        slope = -2 * p.n * p.f * p.z * p.fade * T_n / (1 - fz * fz)
        cooling = ca.mtimes(ca.SX(ca.sparsify(ca.DM(p.rates))), T)
        v = (p.R * w - slope * cooling[0] / p.C) / (1 + slope * float(p.into[0]) * grip / p.C)
        heating = ca.DM(p.into) * (grip * v)
        slip = ca.vertcat(-p.R * grip / p.J, w, p.R * w - v, cooling + heating)
    else:
        slip = ca.vertcat(-p.R * grip / p.J, w, 0.0)
    elastic = ca.vertcat(-p.R * (p.C * x - p.T_0) / p.J, w, p.R * w, cooling)
    modes = [
        (ca.vertcat(0.0, w, p.R * w, cooling), p.T_0 - p.C * x),
        (elastic, grip + p.T_0 - p.C * x),
        (slip, v),
        (elastic, w),
        (ca.vertcat(0.0, 0.0, 0.0, cooling), None),
    ]
    if p.rates is None:
        del modes[3]  # without heat the band stops sliding as the pulley stops
    start = np.concatenate([[p.w_0, 0.0, p.x_0], np.zeros(k)])
    sizes = np.array([20.0, 10.0, 0.3] + [10.0] * k)
    return X, modes, start, sizes, (1 if p.x_0 else 0)


def prepare(case: Case, method: str, tolerance: float):
    import casadi as ca

    p = case.plain
    X, modes, start, sizes, first = _stop(p)
    n, events = X.numel(), len(modes) - 1
    Y = ca.SX.sym("Y", n + 1 + events)  # pyright: ignore
    mode = Y[n]
    rhs = modes[-1][0]
    for i in range(len(modes) - 2, -1, -1):
        rhs = ca.if_else(mode < i + 0.5, modes[i][0], rhs)
    # one indicator per event, negative for good once it has fired; that of the stop falls through 0 only once anyway
    guards = [ca.if_else(mode < i - 0.5, 1.0, ca.if_else(mode < i + 0.5, modes[i][1], -1.0)) for i in range(events - 1)]
    guards = ca.vertcat(*guards, X[0])
    rhs, guards = (ca.substitute(e, X, Y[:n] * sizes) for e in (rhs, guards))
    dae = {"x": Y, "ode": ca.vertcat(rhs / sizes, ca.SX.zeros(1 + events)), "zero": guards}  # pyright: ignore
    index, t = ca.SX.sym("index"), ca.SX.sym("t")  # pyright: ignore
    none = [ca.SX.sym(name, 0) for name in "zpu"]  # pyright: ignore
    # an event raises the mode and notes its time
    noted = [ca.if_else(ca.fabs(mode - i) < 0.5, t, Y[n + 1 + i]) for i in range(events)]
    after = ca.vertcat(Y[:n], mode + 1, *noted)
    transition = ca.Function("transition", [index, t, Y, *none], [after, none[0]], ca.event_in(), ca.event_out())
    options = {
        "transition": transition,
        "reltol": tolerance,
        "abstol": tolerance,
        "max_num_steps": 1_000_000,
        "linear_multistep_method": "adams" if method.endswith("Adams") else "bdf",
        "nonlinear_solver_iteration": "newton",
        "event_tol": 1e-15,
    }
    with _quiet():
        integrator = ca.integrator("integrator", "cvodes", dae, 0.0, p.end, options)
    logged = [i for i in (0, 1, events - 1) if i >= first]
    y_0 = np.concatenate([start / sizes, [first], np.zeros(events)])

    def run() -> Answer:
        end = np.asarray(integrator(x0=y_0)["xf"]).ravel()
        # its count of steps begins anew with every event: not told
        times = end[n + 1 :][logged]
        return Answer(times, (end[:n] * sizes)[1:], int(integrator.stats()["n_call_daeF"]), -1)

    return run


def _quiet():
    """Its warning that events are experimental is said in the docstring above."""
    import contextlib
    import os

    @contextlib.contextmanager
    def silenced():
        kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            os.close(nothing)

    return silenced()
