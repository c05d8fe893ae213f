"""Operations in C, in shapes of all kinds, beside those of JAX."""

import ctypes

import jax
import jax.numpy as jnp
import numpy as np
from c_compiler import NEEDED, library_of
from commands import python
from helpers import all_near

from simbrake.export._c_code import HELPERS, Program

pytestmark = NEEDED


def test_operations_are_those_of_jax(tmp_path):
    """Operations that few scenes have, in shapes of all kinds."""

    def function(x):
        a = x[:24].reshape(2, 3, 4)
        v = x[24:31]
        k = x[31:].astype(jnp.int32)
        mean, before = jax.lax.scan(lambda c, x: (0.5 * c + x, c), v[0], v)
        loop = jax.lax.while_loop(  # carried arrays change places, one of them in place
            lambda c: c[0] < 5,
            lambda c: (c[0] + 1, c[2], c[1] + c[0], c[3].at[c[0]].add(c[1][0])),
            (0, v, v[::-1], 0 * v),
        )
        branch = jax.lax.cond(
            v[1] > 0, lambda: (a.sum(), v), lambda: (a.prod(), v[::-1])
        )
        moved = (
            a.transpose(2, 0, 1)[::-1],
            a[:, k % 3],
            v[k],
            jnp.pad(v, (2, 1)),
            a[:, 1:, ::2],
            a.reshape(4, 6).T,
        )
        sums = (
            a.sum((0, 2)),
            a.max(1),
            jnp.argmax(a, axis=2),
            jnp.cumsum(a, axis=1),
            a @ a.transpose(0, 2, 1),
        )
        changed = (
            v.at[k].add(1.5),
            v.at[k].set(-1.0, mode="drop"),
            jax.lax.dynamic_update_slice(v, v[:2] * 2, (k[0],)),
        )
        each = (
            v % 1.3,
            jnp.round(v),
            jnp.sign(v),
            k // 2,
            (v > 0) & ~(v > 2),
            jnp.minimum(v, jnp.nan),
            jnp.int32(v),
        )
        looked = (
            jnp.interp(x[31:], v, v**2),
            jnp.searchsorted(v, x[31:]),
            jax.lax.associative_scan(jnp.multiply, v),
        )
        alike = (
            jnp.broadcast_to(jnp.sin(v[1]), (2, 3)) * v[0]
        )  # one number in all entries, also where it is moved
        alike = (
            alike,
            alike[1, ::2],
            alike.T[::-1] + a[:, :, 0].T,
            jnp.where(alike > 0, 1.5, a[..., 1]),
            alike.sum(1),
        )
        again = (
            jnp.sin(v[1]) + v,
            jax.lax.cond(
                v[0] < 0, lambda: jnp.sin(v[1]) * v, lambda: jnp.cos(v[1]) * v
            ),
        )
        every = (
            mean,
            before,
            loop,
            branch,
            moved,
            sums,
            changed,
            each,
            looked,
            alike,
            again,
        )
        return jnp.concatenate(
            [jnp.ravel(leaf).astype(float) for leaf in jax.tree.leaves(every)]
        )

    x = np.concatenate([np.arange(24.0) - 7.3, np.linspace(-2, 3, 7), [2.0, 0.0, 5.0]])
    program = Program("ops", function, x)
    file = tmp_path / "ops.c"
    expected = np.asarray(jax.jit(function)(x))
    call = (
        f"struct ops_frame *frame = calloc(1, sizeof *frame); {program.ins[0]} = x; "
        "ops_main(frame);"
    )
    copy = (
        f"memcpy(out, frame->{program.outs[0].name}, {expected.size} * sizeof "
        "*out); free(frame);"
    )
    file.write_text(
        f"{HELPERS}{program.text}void ops(const double *x, double *out) {{ {call} {copy} }}\n"
    )
    found = np.full(expected.size, 99.0)
    library_of(file).ops(*(a.ctypes.data_as(ctypes.c_void_p) for a in (x, found)))
    all_near(found, expected, 1e-13, 1e-15)


def test_what_was_read_outlives_what_it_was_read_from():
    """In a process of its own: memory of the compiler that is read after it was freed
    ends the process."""
    python("""
import gc
import jax, jax.numpy as jnp, numpy as np
from simbrake.export._c_code import Module
def function(x):
    twice = jax.jit(lambda y: 2.0 * jnp.sort(y))
    return jax.lax.while_loop(lambda c: c[0] < 5.0, lambda c: (c[0] + 1.0, twice(c[1]) + jnp.cumsum(c[1])), (0.0, x))
modules = [Module(function, np.ones(8)) for _ in range(20)]
jax.clear_caches()
gc.collect()
others = [Module(function, np.ones(9)) for _ in range(5)]
for module in modules:
    assert all(str(x) for body in module.functions.values() for op in body.ops for x in op.attributes.values())
""")
