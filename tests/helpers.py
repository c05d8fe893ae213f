"""What several tests need: quick solves, event lists, Jacobians both ways."""

import contextlib
import functools

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import simbrake as sb
from simbrake.__main__ import main as main
from simbrake.hybrid import LANDED, STOPPED

all_near = np.testing.assert_allclose
all_equal = np.testing.assert_array_equal


def near(found, wanted, rel=None, abs=None):
    """`pytest.approx`, of what NumPy and JAX give as well."""
    __tracebackhide__ = True
    found, wanted = (
        np.asarray(x)[()] if hasattr(x, "__array__") else x for x in (found, wanted)
    )
    wanted = pytest.approx(wanted, rel=rel, abs=abs)
    assert found == wanted, f"{found} is not {wanted}"


#: a context in which an input error comes
input_error = functools.partial(pytest.raises, sb.InputError)


def faults_of(call, *arguments, **options):
    """The faults in the input error of a call."""
    with input_error() as caught:
        call(*arguments, **options)
    return caught.value.faults


def paths_of(call, *arguments, **options):
    return [fault.path for fault in faults_of(call, *arguments, **options)]


def names_of(result):
    """Names of the events of a run."""
    return [event.name for event in result.events]


def changes_of(result):
    """Names of the events of a run, without those of single linings at their limit."""
    return [name for name in names_of(result) if name != "lining_limit"]


def closes(result, within):
    """The energy balance of a run closes."""
    __tracebackhide__ = True
    assert float(result.energy["closure"]) <= within


DOPRI8 = sb.hybrid.ExplicitRungeKutta(diffrax.Dopri8())
TSIT5 = sb.hybrid.ExplicitRungeKutta(diffrax.Tsit5())


def settings(rtol=1e-12, max_events=100_000, **kwargs):
    return sb.hybrid.Settings(
        rtol=jnp.asarray(rtol), max_events=jnp.asarray(max_events), **kwargs
    )


@functools.partial(eqx.filter_jit)
def solve(system, y0, mode0, t0, t1, settings, method=DOPRI8):
    return sb.hybrid.hybridsolve(system, y0, mode0, t0, t1, method, settings)


def jacobians(f):
    """`x → f(x), its Jacobian forwards, its Jacobian backwards` of a vector, as one
    program: the run in `f` is traced and compiled once."""

    @jax.jit
    def found(x):
        value, slope = jax.linearize(f, x)
        back = jax.linear_transpose(slope, x)
        rows = jnp.eye(value.size).reshape(value.size, *value.shape)
        backwards = jax.vmap(lambda row: back(row)[0])(rows).reshape(
            *value.shape, x.size
        )
        return value, jax.vmap(slope, out_axes=-1)(jnp.eye(x.size)), backwards

    return found


@contextlib.contextmanager
def nothing_compiled(caplog):
    """Nothing is traced or compiled meanwhile."""
    caplog.clear()
    with jax.log_compiles():
        yield
    assert [
        record.message for record in caplog.records if record.name.startswith("jax")
    ] == []


def _rows_of_guards(record):
    """Rows of a record that end with an event of a guard."""
    kind = np.asarray(record.rows.kind)[: int(record.count)]
    return np.flatnonzero((kind >= LANDED) & (kind != STOPPED))


def event_times(record):
    """Times of events that a guard made."""
    return np.asarray(record.rows.t)[_rows_of_guards(record) + 1]


def event_guards(record):
    return np.asarray(record.rows.guard)[_rows_of_guards(record)].tolist()


def assert_one_sided(f, numbers, ways):
    """Derivatives of `f` forwards and backwards are the same, and that of one side by
    each of the numbers.

    `ways` has `+` at a number that can only rise, `-` at one that can only fall.
    """
    program = jax.jit(lambda x: (f(x), jax.jacfwd(f)(x), jax.jacrev(f)(x)))
    x = np.asarray(numbers, float)
    known, slope, back = map(np.asarray, program(x))
    assert np.all(np.isfinite(slope))
    np.testing.assert_allclose(slope, back, rtol=1e-12, atol=1e-14)
    size = np.maximum(np.abs(x), 0.1)
    for i in range(x.size):
        away = []
        sides = {"+": (1,), "-": (-1,)}.get(ways[i : i + 1], (-1, 1))
        for side in sides:
            h = side * 1e-4 * size[i]
            far, near = (
                np.asarray(program(x + share * h * np.eye(x.size)[i])[0])
                for share in (1.0, 0.5)
            )
            difference = (4 * near - far - 3 * known) / h
            away.append(np.abs(slope[..., i] - difference) * size[i])
        assert np.all(np.min(away, axis=0) <= 1e-6 * max(1.0, np.max(np.abs(known)))), (
            i,
            away,
        )
