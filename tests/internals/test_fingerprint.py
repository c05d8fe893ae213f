"""Fingerprints of studies: what a later process must notice, in functions of every kind, settings and versions."""

import dataclasses
import json
import os
import subprocess
import sys

import diffrax
import numpy as np
import pytest
from stop_scenes import closed_form, stop_scene

import simbrake as sb
from simbrake._base._fingerprint import FingerprintError, fingerprint
from simbrake.studies import _ensemble

SPEED = "initial.omega"

CONSTANTS = """
import os
K = float(os.environ["K"])  # changes without a line of code
def scaled(x):
    return K * x
"""

#: callables that depend on K, on LITERAL in the code, or on both
CALLABLES = """
import collections, dataclasses, enum, functools, logging, operator, random, sys, threading, time
import os
from typing import Any, NamedTuple

import equinox as eqx
import jax
import diffrax
import numpy as np

import constants_of_test
import simbrake as sb
from constants_of_test import K, scaled

LITERAL = 3.0
ARRAY, TABLE, SET = np.array([K, 2.0]), {"k": [1, {"deep": K}]}, {"a", "b", K}
QUEUE, COUNTS, DEFAULTS = collections.deque([K]), collections.Counter(a=int(K)), collections.defaultdict(lambda: K)
log = logging.getLogger(__name__)

def reads_global(r): return K * r.stopping_time
def reads_array(r): return jnp.interp(r.stopping_time, ARRAY, ARRAY)
def reads_table(r): return TABLE["k"][1]["deep"]
def reads_set(r): return ("a" in {"x", "y", "z"}) * len(SET)
def reads_collections(r): return QUEUE[0] + COUNTS["a"] + DEFAULTS["a"]
def reads_module(r): return constants_of_test.K
def reads_module_by_another_name(r):
    module = constants_of_test
    return module.K
def reads_module_imported_inside(r):
    import constants_of_test as inside
    return inside.K
def reads_name_imported_inside(r):
    from constants_of_test import scaled as inside
    return inside(1.0)
def hands_on_module(r): return reads_any(constants_of_test)
def reads_any(module): return module.K
def reads_by_text(r): return getattr(constants_of_test, "K")
def helper(x): return scaled(x)
def calls_helper(r): return helper(r.stopping_time)
def calls_itself(r, n=3): return calls_itself(r, n - 1) if n else helper(1.0)
def calls_other(r): return other(r)
def other(r): return calls_other(r) if r is None else K
def inner_function(r): return (lambda x: [K * y for y in [x]][0])(1.0)
def inner_class(r):
    class Inner:
        k = K
    return Inner.k
def logs(r):
    log.info("called")
    return K
def default(r, k=K): return k
def keyword_default(r, *, k=K): return k
def attribute(r): return attribute.k
attribute.k = K
def closure(k):
    return lambda r: k * r.stopping_time
closure_of_number, closure_of_function = closure(K), closure(helper)
partial = functools.partial(lambda r, k: k, k=K)
partial_of_partial = functools.partial(functools.partial(lambda r, a, b: a, b=1), a=K)

class Metric:
    base = K
    def __init__(self): self.k = K
    def __call__(self, r): return self.k
    def method(self, r): return self.k
    @classmethod
    def of_class(cls, r): return cls.base
    @staticmethod
    def static(r): return K
    @property
    def value(self): return K
class Derived(Metric):
    pass
class Slotted:
    __slots__ = ("k",)
    def __init__(self): self.k = K
    def __call__(self, r): return self.k
@dataclasses.dataclass
class Data:
    k: list = dataclasses.field(default_factory=lambda: [K])
    def __call__(self, r): return self.k[0]
class Module(eqx.Module):
    k: Any = K
    def __call__(self, r): return self.k
    def method(self, r): return self.k
class Named(NamedTuple):
    k: float
    def __call__(self, r): return self.k
class OwnList(list):
    def __call__(self, r): return self[0]
class Choice(enum.Enum):
    A = K
instance, bound, of_class, static, derived = Metric(), Metric().method, Metric.of_class, Metric.static, Derived()
bound_of_derived, slotted, data, module = Derived().method, Slotted(), Data(), Module()
bound_of_module, kind = Module().method, Derived
named, own_list, bound_of_dictionary = Named(K), OwnList([K]), {1: K}.get
def reads_instance(r): return instance.k
def reads_property(r): return instance.value
def reads_enumeration(r): return Choice.A.value

def decorated(function):
    @functools.wraps(function)
    def wrapper(r): return K * function(r)
    return wrapper
@decorated
def with_decorator(r): return 1.0
@functools.lru_cache
def cached(x): return K * x
def calls_cached(r): return cached(1.0)
jitted, differentiated, mapped = jax.jit(reads_global), jax.grad(reads_global), jax.vmap(reads_global)
filtered, custom, vectorized = eqx.filter_jit(reads_global), jax.custom_jvp(reads_global), np.vectorize(reads_global)
method_caller = operator.methodcaller("series", K)
class Law(sb.ConstantFriction):
    def kinetic(self, contact): return self.coefficient * K
law, profile = Law(0.3), sb.profiles.FunctionProfile(lambda t, p: K * t)

def literal(r): return LITERAL * r.stopping_time
def calls_literal(r): return literal(r)
def literal_default(r, *, k=LITERAL): return k
class Literal:
    def __call__(self, r): return LITERAL
literal_instance, literal_partial = Literal(), functools.partial(literal)

FILE, LOCK, GENERATOR = open(__file__), threading.Lock(), (x for x in [1.0])
def outside_file(r): return float(open("limit.txt").read())
def outside_handle(r): return FILE.read()
def outside_environment(r): return float(os.environ["LIMIT"])
def outside_variable(r): return float(os.getenv("LIMIT"))
def outside_array(r): return np.load("limit.npy")[0]
def outside_import(r):
    from numpy import loadtxt
    return loadtxt("limit.txt")
def outside_clock(r): return time.time()
def outside_random(r): return np.random.rand() + random.random()
def outside_code(r): return eval("K")
def outside_modules(r): return sys.modules[__name__].K
def outside_lock(r): return LOCK
def outside_generator(r): return next(GENERATOR)
def outside_helper(r): return outside_file(r)
outside_partial = functools.partial(outside_environment)
"""

PRINT = """
import json, types
import callables_of_test
from simbrake._base._fingerprint import FingerprintError, fingerprint
found = {}
for name, part in vars(callables_of_test).items():
    try:
        found[name] = fingerprint(part)
    except FingerprintError as error:
        found[name] = f"refused: {error}"
print(json.dumps(found))
"""

NOT_METRICS = {"helper", "reads_any", "scaled", "other", "closure", "decorated", "cached", "log"}


def names(text=CALLABLES):
    """Callables of the module: those that depend on K or LITERAL, and those that depend on what cannot be seen."""
    made = {}
    for line in text.splitlines():
        if line.startswith("def "):
            made[line[4:].partition("(")[0]] = line
        elif " = " in line and not line.startswith((" ", "@")) and line[0].islower():
            made |= dict.fromkeys(
                (name.strip() for name in line.partition(" = ")[0].split(",") if "." not in name), line
            )
    wanted = [name for name in made if name not in NOT_METRICS]
    outside = {name for name in wanted if name.startswith("outside")}
    return set(wanted) - outside, outside


def in_a_process(folder, text, k, seed):
    (folder / "constants_of_test.py").write_text(CONSTANTS, "utf-8")
    (folder / "callables_of_test.py").write_text(text, "utf-8")
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    variables = {**os.environ, "PYTHONPATH": path, "K": k, "PYTHONHASHSEED": seed, "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", PRINT], env=variables, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_changes_seen_by_another_process(tmp_path):
    first, again = (in_a_process(tmp_path, CALLABLES, "2", seed) for seed in ("1", "2"))
    changed = in_a_process(tmp_path, CALLABLES.replace("LITERAL = 3.0", "LITERAL = 6.0"), "4", "1")
    recognised, outside = names()
    assert len(recognised) > 50
    assert {name for name in recognised | outside if first[name] != again[name]} == set()
    assert {name for name in recognised if first[name].startswith("refused")} == set()
    assert {name for name in recognised if first[name] == changed[name]} == set()
    assert {name for name in outside if not first[name].startswith("refused: ")} == set()


def test_fingerprints_differ_as_values_do():
    def function(constant=1.0, default=2.0, inner=3.0):
        made = {}
        text = f"def f(x, y={default}):\n    return x + {constant} + (lambda z: z * {inner})(y)\n"
        exec(text, {"__name__": "own"}, made)
        return made["f"]

    @dataclasses.dataclass
    class Law:
        a: float
        b: float

    def closed(k):
        return lambda x: k * x

    different = [
        *(1, 2.0, 2, np.array([2.0]), np.array([[2.0]]), np.array([2.0, 3.0]), np.float32(2.0)),
        *("a", "b", b"a", None, (), [1, 2], [[1], 2], [1, [2]], {"a": 1}, {"a": 2}, {"b": 1}),
        *(function(), function(1.5), function(default=2.5), function(inner=3.5), closed(1.0), closed(2.0)),
        *(Law(1.0, 2.0), Law(2.0, 1.0), Law, sb.hybrid.Rodas5P, len, sum),
        *(lambda x: np.sin(x), lambda x: np.cos(x)),
        *(1j, 2j, 10**30, 10**31, {1, 2}, {1, 3}, np.array([1, "a"], object), np.array([2, "a"], object)),
    ]
    marks = [fingerprint(one) for one in different]
    assert len(set(marks)) == len(marks)
    assert fingerprint(function()) == fingerprint(function())
    assert fingerprint(closed(1.0)) == fingerprint(closed(1.0))
    assert fingerprint((1, 2)) == fingerprint([1, 2])
    assert fingerprint(Law(1.0, 2.0)) == fingerprint(Law(1.0, 2.0))
    ring = [1.0]
    ring.append(ring)
    with pytest.raises(FingerprintError, match="contains itself"):
        fingerprint(ring)


# --- studies ----------------------------------------------------------------------------------------------------------

SETTINGS = {"rtol": 1e-10, "solver": None, "max_steps": None, "chunk": None}


def plan(scene=None, speed=10.0, metrics=("stopping_time",), **changes):
    return _ensemble.plan_of(scene or stop_scene(), {SPEED: [speed, 20.0]}, metrics, **SETTINGS | changes)


LIMIT = 2.0


def measured(result):
    return LIMIT * result.stopping_time


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"speed": 11.0}, "the values"),
        ({"scene": stop_scene(R=0.7)}, "the scene"),
        ({"rtol": 1e-9}, "rtol: 1e-10 there, 1e-09 here"),
        ({"max_steps": 500}, "max_steps: None there, 500 here"),
        ({"solver": sb.hybrid.Rodas5P()}, "solver: None there"),
        ({"metrics": ["full_slip_time"]}, "metrics"),
    ],
)
def test_study_of_other_settings_not_resumed(tmp_path, change, words):
    store = _ensemble.store_of(plan(), tmp_path)
    assert _ensemble.store_of(plan(), tmp_path).key == store.key
    with pytest.raises(sb.InputError, match="holds another ensemble") as caught:
        _ensemble.store_of(plan(**change), tmp_path)
    assert words in str(caught.value)


def test_solver_settings_change_fingerprint(tmp_path):
    one, other = sb.hybrid.ExplicitRungeKutta(diffrax.Dopri8()), sb.hybrid.ExplicitRungeKutta(diffrax.Tsit5())
    _ensemble.store_of(plan(solver=one), tmp_path)
    with pytest.raises(sb.InputError, match="the solver"):
        _ensemble.store_of(plan(solver=other), tmp_path)


@pytest.mark.parametrize("name", ["simbrake", "jax", "source of simbrake", "Python"])
def test_folder_of_other_version_names_both(tmp_path, name):
    _ensemble.store_of(plan(), tmp_path)
    file = tmp_path / "manifest.json"
    manifest = json.loads(file.read_text("utf-8"))
    now = manifest["versions"][name]
    manifest["versions"][name] = "0.0.7"
    file.write_text(json.dumps(manifest), "utf-8")
    with pytest.raises(sb.InputError) as caught:
        _ensemble.store_of(plan(), tmp_path)
    assert f"{name}: 0.0.7 there, {now} here" in str(caught.value)
    # a folder as earlier versions wrote it has no versions
    del manifest["versions"]
    file.write_text(json.dumps(manifest | {"format": 1, "simbrake": "0.9"}), "utf-8")
    with pytest.raises(sb.InputError, match=r"simbrake: 0\.9 there"):
        _ensemble.store_of(plan(), tmp_path)


def test_unrecognisable_metric_is_refused(tmp_path):
    with pytest.raises(sb.InputError) as caught:
        sb.ensemble(stop_scene(), {SPEED: [10.0]}, [lambda r: float(os.environ["LIMIT"])], directory=tmp_path / "kept")
    assert "os.environ" in str(caught.value)
    assert not (tmp_path / "kept").exists()


@pytest.mark.slow
def test_changed_global_seen_in_same_process(tmp_path, monkeypatch):
    """Of a metric and of a profile in the scene: JAX would take each for the function that it has compiled."""
    scene = stop_scene(C=None, lever=sb.profiles.FunctionProfile(lambda t, p: 8e3 * LIMIT / 2 * (1 + 0 * t)))
    speeds = {SPEED: [10.0, 20.0]}
    exact = 800.0 * np.array([10.0, 20.0]) / (0.725 * 8e3 * (closed_form()["Pi"] - 1))  # the stop of a rigid band

    def found(folder):
        return sb.ensemble(scene, speeds, [measured], directory=tmp_path / folder, progress=False).measured.values

    np.testing.assert_allclose(found("first"), 2 * exact, rtol=1e-9)
    monkeypatch.setitem(globals(), "LIMIT", 4.0)
    with pytest.raises(sb.InputError, match="the scene, the metric measured differ"):
        found("first")
    np.testing.assert_allclose(found("second"), 4 * exact / 2, rtol=1e-9)
    monkeypatch.setitem(globals(), "LIMIT", 2.0)
    monkeypatch.setattr("simbrake.studies._evaluator.run_chunk", None)  # all is there
    np.testing.assert_allclose(found("first"), 2 * exact, rtol=1e-9)
