"""A function of JAX as C99 without dependencies: its StableHLO, operation by operation.

Values are read where they are used, as expressions of an index: a variable comes into
being where one is read several times. Blocks longer than `LONGEST` lines become
functions, as C compilers take much longer for long ones; what two of them use lies in
one structure, the `frame`, which also is all memory that a call needs.
"""

import collections
import contextlib
import functools
import itertools
import math
import re
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

#: lines of a function, entries of arrays that are written out one by one, operations of
#: an expression
LONGEST = 150
_FEW = 4
_DEEPEST = 24
#: operations of a function that is repeated wherever it is called; bytes of a variable
#: on the stack
_SHORT = 16
_LARGE = 8192

_KINDS = {
    "f64": "double",
    "f32": "float",
    "i64": "int64_t",
    "i32": "int32_t",
    "i8": "int8_t",
    "i1": "uint8_t",
    "ui64": "uint64_t",
    "ui32": "uint32_t",
    "ui8": "uint8_t",
}
_REAL = ("double", "float")
_BYTES = {
    "double": 8,
    "float": 4,
    "int64_t": 8,
    "uint64_t": 8,
    "int32_t": 4,
    "uint32_t": 4,
}

#: C of operations that act entry by entry: of real numbers, and of whole ones where
#: that differs
_ENTRYWISE = {
    **{
        name: f"{name}({{0}})"
        for name in (
            "acos",
            "asin",
            "atan",
            "sinh",
            "cosh",
            "asinh",
            "acosh",
            "atanh",
            "erf",
            "log",
            "sqrt",
            "cbrt",
            "tan",
            "tanh",
            "floor",
            "ceil",
            "square",
            "sign",
        )
    },
    "add": "({0} + {1})",
    "subtract": "({0} - {1})",
    "multiply": "({0} * {1})",
    "negate": "(-{0})",
    "divide": "({0} / {1})",
    "remainder": "fmod({0}, {1})",
    "power": "pow({0}, {1})",
    "atan2": "atan2({0}, {1})",
    "maximum": "maximum({0}, {1})",
    "minimum": "minimum({0}, {1})",
    "abs": "fabs({0})",
    "and": "({0} & {1})",
    "or": "({0} | {1})",
    "xor": "({0} ^ {1})",
    "is_finite": "(isfinite({0}) != 0)",
    "exponential": "exp({0})",
    "exponential_minus_one": "expm1({0})",
    "log_plus_one": "log1p({0})",
    "rsqrt": "(1.0 / sqrt({0}))",
    "logistic": "(1.0 / (1.0 + exp(-{0})))",
    "sine": "sin({0})",
    "cosine": "cos({0})",
    "round_nearest_even": "rint({0})",
    "round_nearest_afz": "round({0})",
    "select": "({0} ? {1} : {2})",
    "clamp": "minimum(maximum({0}, {1}), {2})",
}
_OF_WHOLE = _ENTRYWISE | {
    "divide": "divided({0}, {1})",
    "remainder": "remains({0}, {1})",
    "abs": "whole_abs({0})",
    "maximum": "whole_maximum({0}, {1})",
    "minimum": "whole_minimum({0}, {1})",
    "sign": "whole_sign({0})",
    "clamp": "whole_minimum(whole_maximum({0}, {1}), {2})",
}
_COMPARED = {"EQ": "==", "NE": "!=", "LT": "<", "LE": "<=", "GT": ">", "GE": ">="}

#: what all programs call
HELPERS = Path(__file__).with_name("operations.c").read_text("utf-8")


class UnknownOperation(Exception):
    """An operation of StableHLO that has no C form here."""


# --- programs as they are read ------------------------------------------------------


Shape = tuple[int, ...]
Type = tuple[Shape, str]


class Operation(NamedTuple):
    name: str
    attributes: dict[str, Any]
    ins: list[int]
    outs: list[int]
    types: list[Type]  # of the results
    regions: "Sequence[Body]" = ()

    def kept(self, users: Container[int]) -> tuple[int, ...]:
        """Which of its results are used, from 0."""
        return tuple(i for i, out in enumerate(self.outs) if out in users)


class Body:
    """Operations in order, the values that they begin with and those that they give,
    all by number."""

    def __init__(self, args: list[int]) -> None:
        self.args = args
        self.ops = list[Operation]()
        self.outs = list[int]()

    @property
    def size(self) -> int:
        return sum(1 + sum(region.size for region in op.regions) for op in self.ops)


def _dimensions(attribute: Any) -> dict[str, list[int]]:
    """Which dimensions do what, by the names in the text of an attribute; those that it
    leaves out are none."""
    found = re.findall(r"(\w+) = \[?([\d, ]*)", str(attribute))
    lists = {
        name: [int(n) for n in numbers.split(",") if n.strip()]
        for name, numbers in found
    }
    return collections.defaultdict(list, lists)


def _type_of(value: Any) -> Type:
    return tuple(value.type.shape), _KINDS[str(value.type.element_type)]


class Module:
    """A lowered program: its functions by name, shapes and C types of all values."""

    def __init__(self, function: Callable, *arguments: Any) -> None:
        self.types: list[Type] = []
        self._numbers: dict[Any, int] = {}
        # results by operation, of the body that is read and of those around it
        self._results: collections.ChainMap[Any, list[int]] = collections.ChainMap()
        self.calls = collections.Counter[str]()
        module = jax.jit(function, keep_unused=True).lower(*arguments).compiler_ir()
        self.functions: dict[str, Body] = {}
        for operation in module.body.operations:  # pyright: ignore
            block = next(
                (block for region in operation.regions for block in region.blocks), None
            )
            if block is None:
                raise UnknownOperation(operation.operation.name)
            self.functions[operation.attributes["sym_name"].value] = self._body(block)
        self._numbers.clear()

    def _new(self, types: Iterable[Type]) -> list[int]:
        """Numbers of new values."""
        first = len(self.types)
        self.types += types
        return [*range(first, len(self.types))]

    def _body(self, block: Any) -> Body:
        args = self._new(map(_type_of, block.arguments))
        self._numbers |= zip(block.arguments, args, strict=True)
        body = Body(args)
        around = self._results
        self._results = around.new_child()
        for operation in block.operations:
            op = operation.operation
            ins = [self._numbers[x] for x in op.operands]
            if op.name in ("func.return", "stablehlo.return"):
                body.outs = ins
                continue
            # (attributes belong to the context; a map of them would be read after the
            # module has gone)
            names = [
                attribute if isinstance(attribute, str) else attribute.name
                for attribute in op.attributes
            ]
            name, attributes = (
                op.name.partition(".")[2],
                {name: op.attributes[name] for name in names},
            )
            types = [_type_of(x) for x in op.results]
            key = name, tuple(attributes.items()), tuple(ins), tuple(types)
            outs = self._results.get(key)
            if outs is None:
                regions = [self._body(region.blocks[0]) for region in op.regions]
                outs = self._new(types)
                body.ops.append(Operation(name, attributes, ins, outs, types, regions))
                if name == "call":
                    self.calls[attributes["callee"].value] += 1
                # (what is the same is computed once)
                if types and not regions and name != "optimization_barrier":
                    self._results[key] = outs
            self._numbers |= zip(op.results, outs, strict=True)
        self._results = around
        return body

    # --- what is needed of it

    def repeated(self, op: Operation) -> bool:
        """Whether a called function stands where it is called."""
        name = op.attributes["callee"].value
        return self.calls[name] == 1 or self.functions[name].size <= _SHORT

    def needed(
        self, body: Body, outs: Iterable[int]
    ) -> tuple[list[Operation], dict[int, list[Body]]]:
        """Operations that the values `outs` come from, in order, and in which bodies
        each value is used."""
        users: dict[int, list[Body]] = collections.defaultdict(list)
        for out in outs:
            users[out].append(body)
        ops: list[Operation] = []
        for op in reversed(body.ops):
            kept = op.kept(users)
            if not kept:
                continue
            ops.append(op)
            for value in self.direct(op, kept):
                users[value].append(body)
            for region, inside in self._inside(op, kept):
                for value in inside:
                    users[value].append(region)
        return ops[::-1], users

    def direct(self, op: Operation, kept: tuple[int, ...]) -> list[int]:
        """Operands that the results numbered `kept` depend on."""
        if op.name == "while":
            return [op.ins[i] for i in self.carried(op, kept)]
        if op.name == "call" and self.repeated(op):
            return [op.ins[i] for i in self._read(op.attributes["callee"].value, kept)]
        return op.ins

    @functools.cache  # noqa: B019
    def _read(self, name: str, kept: tuple[int, ...]) -> list[int]:
        body = self.functions[name]
        _, users = self.needed(body, [body.outs[i] for i in kept])
        return [i for i, arg in enumerate(body.args) if arg in users]

    def carried(self, op: Operation, kept: tuple[int, ...]) -> list[int]:
        """Which of the values that a loop carries its results `kept` depend on."""
        cond, body = op.regions
        _, asked = self.needed(cond, cond.outs)
        wanted = {*kept, *(i for i, arg in enumerate(cond.args) if arg in asked)}
        while True:
            _, users = self.needed(body, [body.outs[i] for i in sorted(wanted)])
            more = wanted | {i for i, arg in enumerate(body.args) if arg in users}
            if more == wanted:
                return sorted(wanted)
            wanted = more

    def _inside(
        self, op: Operation, kept: tuple[int, ...]
    ) -> Iterator[tuple[Body, list[int]]]:
        """Values from outside that the regions of an operation use."""
        for region in op.regions:
            outs = region.outs
            if op.name == "while" and region is op.regions[1]:
                outs = [outs[i] for i in self.carried(op, kept)]
            elif op.name == "case":
                outs = [outs[i] for i in kept]
            ops, users = self.needed(region, outs)
            own = {
                *region.args,
                *itertools.chain.from_iterable(inner.outs for inner in ops),
            }
            yield region, [value for value in users if value not in own]


# --- expressions --------------------------------------------------------------------

Index = Sequence[int | str]


def _sum(*terms: int | str) -> int | str:
    whole = sum(x for x in terms if isinstance(x, int))
    rest = [x for x in terms if isinstance(x, str)]
    if not rest:
        return whole
    return " + ".join([*rest, *([str(whole)] if whole else [])])


def _times(x: int | str, factor: int) -> int | str:
    if isinstance(x, int) or factor == 0:
        return factor * x if isinstance(x, int) else 0
    return (
        x
        if factor == 1
        else f"{x} * {factor}"
        if x.isidentifier()
        else f"({x}) * {factor}"
    )


def _place(index: Index, shape: Shape) -> int | str:
    return _sum(
        *(
            _times(x, math.prod(shape[d + 1 :]))
            for d, x in enumerate(index)
            if shape[d] != 1
        )
    )


def _others(shape: Shape, dims: Container[int]) -> list[int]:
    """The dimensions of an array that are not among `dims`."""
    return [d for d in range(len(shape)) if d not in dims]


def literal(x: Any, kind: str) -> str:
    """A number in C."""
    if kind in _REAL:
        x = float(x)
        words = (
            "NAN" if math.isnan(x) else "INFINITY" if math.isinf(x) else repr(abs(x))
        )
        return f"(-{words})" if math.copysign(1.0, x) < 0 else words
    x = int(x)
    text = f"INT64_C({x})" if abs(x) >= 1 << 31 else str(x)
    return f"({text})" if x < 0 else text


class Value(NamedTuple):
    """An array: C of its entry at an index.

    - `cost`: operations that reading an entry repeats, 0 where it is stored
    - `name`: the variable that it lies in, row by row; `fresh`: no one else reads that
      variable
    """

    shape: Shape
    kind: str
    at: Callable[[Index], str]
    cost: int = 0
    name: str = ""
    fresh: "Body | None" = None

    @property
    def size(self) -> int:
        return math.prod(self.shape)


class Line(NamedTuple):
    """A line of C.

    - `declares`: a variable that begins here
    - `pinned`: it must stay in the loop that it ends
    """

    text: str
    declares: str = ""
    pinned: bool = False


class Block(NamedTuple):
    """Nested lines: each part with its head, and a `}` behind the last. A `whole` one
    is never divided."""

    parts: list[tuple[str, list[Any]]]
    whole: bool = False


_TOKEN = re.compile(r"\bv\d+\b")


class Program:
    """C of one program.

    - `text`: types and functions; the last one, `{name}(frame)`, runs it
    - `ins`, `outs`: C of its arguments (pointers to be set) and results in the frame,
      with shapes and types
    - `bytes`: of the frame
    """

    def __init__(self, name: str, function: Callable, *arguments: Any) -> None:
        self.name = name
        self._module = Module(function, *arguments)
        self._kinds: dict[str, tuple[str, int]] = {}  # of variables; entries of arrays
        self._tables: dict[tuple[str, str], str] = {}
        self._functions: dict[str, list[Any]] = {}
        self._results: dict[str, tuple[list[str], list[Value]]] = {}
        self._pointed: set[str] = set()
        self._indices = itertools.count()
        #: of what is being printed: values by number, lines, operations, and who uses
        #: each value
        self._env = dict[int, Value]()
        self._nodes = list[Any]()
        self._body = Body([])
        self._users = dict[int, list[Body]]()
        pointers, self.outs = self._function("main", self._module.functions["main"])
        self.ins = [f"frame->{pointer}" for pointer in pointers]
        self.text = self._printed()

    # --- variables

    def _new(self, kind: str, size: int = 1) -> str:
        name = f"v{len(self._kinds) + 1}"
        self._kinds[name] = kind, size
        return name

    def _held(
        self, name: str, shape: Shape, kind: str, fresh: Body | None = None
    ) -> Value:
        def at(index: Index) -> str:
            return name if math.prod(shape) <= 1 else f"{name}[{_place(index, shape)}]"

        return Value(shape, kind, at, 0, name, fresh)

    def _variable(self, shape: Shape, kind: str) -> Value:
        name = self._new(kind, math.prod(shape))
        self._nodes.append(Line("", name))
        return self._held(name, shape, kind, self._body)

    def _stored(self, value: Value) -> Value:
        """A value in a variable of its own."""
        if value.size != 1:
            stored = self._variable(value.shape, value.kind)
            self._put(stored, value)
            return stored
        name = self._new(value.kind)
        self._nodes.append(Line(f"{name} = {value.at([0] * len(value.shape))};", name))
        return self._held(name, value.shape, value.kind, self._body)

    def _put(
        self,
        whole: Value,
        part: Value,
        place: Callable[[Index], Index] = lambda index: index,
    ) -> None:
        """Write the entries of a part into an array, each at its place there."""
        self._loop(
            part.shape, lambda index: f"{whole.at(place(index))} = {part.at(index)};"
        )

    def _loop(self, shape: Shape, text: Callable[[Index], str]) -> None:
        if math.prod(shape) <= _FEW:
            self._nodes += [Line(text(index)) for index in np.ndindex(*shape)]
            return
        index: list[int | str] = [f"i{d}" if n > 1 else 0 for d, n in enumerate(shape)]
        heads = (
            f"for (int i{d} = 0; i{d} < {n}; i{d}++) "
            for d, n in enumerate(shape)
            if n > 1
        )
        self._nodes.append(Line("".join(heads) + text(index)))

    def _solid(self, number: int) -> Value:
        """A value whose entries may be read many times."""
        value = self._env[number]
        if value.cost > 0:
            self._env[number] = value = self._stored(value)
        return value

    def _define(self, number: int, value: Value) -> None:
        alone = self._users[number] == [self._body]
        if value.cost > 0 and not (alone and value.cost <= _DEEPEST):
            value = self._stored(value)
        self._env[number] = value

    def _own(self, number: int) -> bool:
        """Whether a value lies in a variable that may be written over: this is its only
        use."""
        return self._env[number].fresh is self._body and self._users[number] == [
            self._body
        ]

    @contextlib.contextmanager
    def _apart(self) -> Iterator[list[Any]]:
        """Collects the lines that are printed inside in a list of their own."""
        kept = self._nodes
        self._nodes = inside = []
        yield inside
        self._nodes = kept

    # --- functions and bodies

    def _function(self, name: str, body: Body) -> tuple[list[str], list[Value]]:
        """Print a function once; the variables of its arguments (pointers for arrays)
        and its results."""
        if name not in self._results:
            kept = self._env
            self._env = {}
            variables = []
            for arg in body.args:
                shape, kind = self._module.types[arg]
                pointed = math.prod(shape) > 1 or name == "main"
                variable = self._new(f"const {kind} *" if pointed else kind)
                variables.append(variable)
                value = self._held(variable, shape, kind)
                if name == "main" and value.size == 1:
                    value = value._replace(
                        at=lambda _, variable=variable: f"{variable}[0]", name=""
                    )
                self._env[arg] = value
            with self._apart() as inside:
                outs = [
                    value if value.name in self._kinds else self._stored(value)
                    for value in self._emit(body, body.outs)
                ]
            self._functions[name] = inside
            self._results[name] = (
                variables,
                [value._replace(fresh=None) for value in outs],
            )
            self._env = kept
        return self._results[name]

    def _emit(self, body: Body, outs: list[int]) -> list[Value]:
        """The operations of a body that `outs` depend on; C of these."""
        kept = self._body, self._users
        ops, users = self._module.needed(body, outs)
        self._body = body
        self._users = users
        for op in ops:
            special = getattr(self, f"_op_{op.name}", None)
            if special is not None:
                special(op)
            elif op.name in _ENTRYWISE:
                self._entrywise(op)
            else:
                raise UnknownOperation(op.name)
        values = [self._env[out] for out in outs]
        self._body, self._users = kept
        return values

    def _nested(self, body: Body, outs: list[int]) -> tuple[list[Any], list[Value]]:
        with self._apart() as inside:
            values = self._emit(body, outs)
        return inside, values

    def _op_call(self, op: Operation) -> None:
        name = op.attributes["callee"].value
        body = self._module.functions[name]
        kept = op.kept(self._users)
        if self._module.repeated(op):
            outs = [body.outs[i] for i in kept]
            _, users = self._module.needed(body, outs)
            env = {}
            for number, arg in zip(op.ins, body.args, strict=True):
                if arg in users:
                    value = (
                        self._env[number]
                        if users[arg] == [body]
                        else self._solid(number)
                    )
                    env[arg] = value._replace(fresh=body if self._own(number) else None)
            env, self._env = self._env, env
            values = self._emit(body, outs)
            self._env = env
            for i, value, out in zip(kept, values, outs, strict=True):
                own = value.fresh is body and len(users[out]) == 1
                self._define(
                    op.outs[i], value._replace(fresh=self._body if own else None)
                )
            return
        variables, values = self._function(name, body)
        for variable, number in zip(variables, op.ins, strict=True):
            value = self._env[number]
            if value.size > 1:
                value = value if value.name else self._stored(value)
                # (the call may be in another part than this line)
                self._pointed.add(value.name)
                self._nodes.append(Line(f"{variable} = {value.name};"))
            elif value.size:
                self._nodes.append(
                    Line(f"{variable} = {value.at([0] * len(value.shape))};")
                )
        self._nodes.append(Line(f"{self.name}_{name}(frame);"))
        for i in kept:
            self._env[op.outs[i]] = self._stored(values[i])

    # --- loops and branches

    def _op_while(self, op: Operation) -> None:
        cond, body = op.regions
        carried = self._module.carried(op, op.kept(self._users))
        slots = dict[int, Value]()
        for i in carried:
            if body.outs[i] == body.args[i]:
                value = self._solid(op.ins[i])._replace(fresh=None)
            else:
                value = self._env[op.ins[i]]
                value = value if self._own(op.ins[i]) else self._stored(value)
                slots[i] = value
            self._env[cond.args[i]] = self._env[op.outs[i]] = value
            self._env[body.args[i]] = value._replace(fresh=body if i in slots else None)
        before, [going] = self._nested(cond, cond.outs)
        wanted = [i for i in carried if i in slots]
        names = {slots[i].name for i in wanted}
        changes = []
        with self._apart() as inside:
            # (operations of the body may write over what it begins with)
            values = self._emit(body, [body.outs[i] for i in wanted])
            for i, value in zip(wanted, values, strict=True):
                if value.name == slots[i].name:
                    continue
                if names & {*_TOKEN.findall(value.at(["i0"] * len(value.shape)))}:
                    value = self._stored(value)
                changes.append((slots[i], value))
            for change in changes:
                self._put(*change)
        stop = Line(f"if (!{going.at([])}) break;", pinned=True)
        self._nodes.append(Block([("for (;;) {", [*before, stop, *inside])]))

    def _op_case(self, op: Operation) -> None:
        kept = op.kept(self._users)
        results = [self._variable(*op.types[i]) for i in kept]
        which = self._solid(op.ins[0]).at([])
        parts = []
        for number, region in enumerate(op.regions):
            with self._apart() as inside:
                values = self._emit(region, [region.outs[i] for i in kept])
                for result, value in zip(results, values, strict=True):
                    self._put(result, value)
            test = (
                f"if ({which} == {number}) {{" if number < len(op.regions) - 1 else "{"
            )
            parts.append((f"}} else {test}" if number else test, inside))
        self._nodes.append(Block(parts))
        for i, result in zip(kept, results, strict=True):
            self._env[op.outs[i]] = result

    # --- entry by entry

    def _entrywise(self, op: Operation) -> None:
        forms = _ENTRYWISE if op.types[0][1] in _REAL else _OF_WHOLE
        self._each(op, forms[op.name])

    def _each(self, op: Operation, form: str) -> None:
        """Results of an operation that acts entry by entry; scalars among its operands
        count for all entries."""
        shape, kind = op.types[0]
        values = [
            self._env[x] if self._env[x].shape == shape else self._solid(x)
            for x in op.ins
        ]

        def at(index: Index) -> str:
            return form.format(
                *(value.at(index if value.shape == shape else []) for value in values)
            )

        self._define(
            op.outs[0], Value(shape, kind, at, 1 + sum(value.cost for value in values))
        )

    def _op_not(self, op: Operation) -> None:
        self._each(op, "(!{0})" if op.types[0][1] == "uint8_t" else "(~{0})")

    def _op_compare(self, op: Operation) -> None:
        sign = _COMPARED[
            re.findall(r"[A-Z]{2}", str(op.attributes["comparison_direction"]))[-1]
        ]
        self._each(op, f"({{0}} {sign} {{1}})")

    def _op_convert(self, op: Operation) -> None:
        kind = op.types[0][1]
        value = self._env[op.ins[0]]
        if kind == value.kind:
            self._env[op.outs[0]] = value._replace(fresh=None)
            return
        forms = (
            {"int32_t": "whole_32({0})", "int64_t": "whole({0})"}
            if value.kind in _REAL
            else {}
        )
        self._each(
            op,
            "({0} != 0)" if kind == "uint8_t" else forms.get(kind, f"(({kind}){{0}})"),
        )

    def _op_optimization_barrier(self, op: Operation) -> None:
        for number, out in zip(op.ins, op.outs, strict=True):
            if out in self._users:
                self._env[out] = self._solid(number)._replace(fresh=None)

    def _op_constant(self, op: Operation) -> None:
        shape, kind = op.types[0]
        attribute = op.attributes["value"]
        numbers = np.ravel(np.asarray(attribute))
        if attribute.is_splat or len({*numbers.tolist()}) == 1:
            text = literal(numbers[0], kind)
            self._env[op.outs[0]] = Value(shape, kind, lambda _: text)
            return
        texts = [literal(x, kind) for x in numbers]
        key = kind, ", ".join(texts)
        table = self._tables.setdefault(key, f"{self.name}_table{len(self._tables)}")

        def at(index: Index) -> str:
            place = _place(index, shape)
            return texts[place] if isinstance(place, int) else f"{table}[{place}]"

        self._env[op.outs[0]] = Value(shape, kind, at, 0, table)

    def _op_iota(self, op: Operation) -> None:
        shape, kind = op.types[0]
        d = op.attributes["iota_dimension"].value

        def at(index: Index) -> str:
            return (
                literal(index[d], kind)
                if isinstance(index[d], int)
                else f"(({kind})({index[d]}))"
            )

        self._env[op.outs[0]] = Value(shape, kind, at)

    # --- the same entries in another order

    def _moved(
        self, op: Operation, value: Value, back: Callable[[Index], Index]
    ) -> None:
        self._define(
            op.outs[0],
            Value(*op.types[0], lambda index: value.at(back(index)), value.cost),
        )

    def _op_broadcast_in_dim(self, op: Operation) -> None:
        dims = [*op.attributes["broadcast_dimensions"]]
        value = self._env[op.ins[0]]
        if value.size < math.prod(op.types[0][0]):
            value = self._solid(op.ins[0])
        self._moved(
            op,
            value,
            lambda index: [
                index[d] if n != 1 else 0
                for d, n in zip(dims, value.shape, strict=True)
            ],
        )

    def _op_reshape(self, op: Operation) -> None:
        value = self._env[op.ins[0]]
        shape, kind = op.types[0]
        long = [d for d, n in enumerate(shape) if n != 1]
        if [shape[d] for d in long] == [n for n in value.shape if n != 1]:

            def back(index: Index) -> Index:
                entries = iter(long)
                return [0 if n == 1 else index[next(entries)] for n in value.shape]

            if value.name:  # it stays what it is
                self._env[op.outs[0]] = value._replace(
                    shape=shape, at=lambda index: value.at(back(index)), fresh=None
                )
            else:
                self._moved(op, value, back)
            return
        if not value.name:
            self._env[op.ins[0]] = value = self._stored(value)
        self._env[op.outs[0]] = self._held(value.name, shape, kind)

    def _op_transpose(self, op: Operation) -> None:
        order = [*op.attributes["permutation"]]
        places = [order.index(d) for d in range(len(order))]
        self._moved(op, self._env[op.ins[0]], lambda index: [index[p] for p in places])

    def _op_reverse(self, op: Operation) -> None:
        dims = [*op.attributes["dimensions"]]
        shape = op.types[0][0]

        def back(index: Index) -> Index:
            turned = [
                shape[d] - 1 - x if isinstance(x, int) else f"{shape[d] - 1} - ({x})"
                for d, x in enumerate(index)
            ]
            return [turned[d] if d in dims else x for d, x in enumerate(index)]

        self._moved(op, self._env[op.ins[0]], back)

    def _op_slice(self, op: Operation) -> None:
        starts = [*op.attributes["start_indices"]]
        steps = [*op.attributes["strides"]]
        value = (
            self._solid(op.ins[0])
            if len(self._users[op.ins[0]]) > 1
            else self._env[op.ins[0]]
        )
        self._moved(
            op, value, lambda index: [*map(_sum, map(_times, index, steps), starts)]
        )

    def _starts(
        self, numbers: Sequence[int], shape: Shape, sizes: Shape
    ) -> list[int | str]:
        """Variables with the first indices of a slice, kept inside of the array."""
        starts: list[int | str] = []
        for number, n, size in zip(numbers, shape, sizes, strict=True):
            if n == size:
                starts.append(0)
                continue
            name = self._new("int64_t")
            self._nodes.append(
                Line(f"{name} = within({self._env[number].at([])}, {n - size});", name)
            )
            starts.append(name)
        return starts

    def _op_dynamic_slice(self, op: Operation) -> None:
        value = self._solid(op.ins[0])
        shape, kind = op.types[0]
        starts = self._starts(op.ins[1:], value.shape, shape)
        sliced = Value(shape, kind, lambda index: value.at([*map(_sum, starts, index)]))
        self._env[op.outs[0]] = (
            self._stored(sliced) if len(self._users[op.outs[0]]) > 1 else sliced
        )

    def _op_dynamic_update_slice(self, op: Operation) -> None:
        whole = self._env[op.ins[0]]
        part = self._env[op.ins[1]]
        starts = self._starts(op.ins[2:], whole.shape, part.shape)
        if not self._own(op.ins[0]):
            whole = self._stored(whole)
        elif whole.name in _TOKEN.findall(part.at(["i0"] * len(part.shape))):
            part = self._stored(part)
        self._put(whole, part, lambda index: [*map(_sum, starts, index)])
        self._env[op.outs[0]] = whole

    def _op_concatenate(self, op: Operation) -> None:
        d = op.attributes["dimension"].value
        whole = self._variable(*op.types[0])
        first = 0
        for number in op.ins:
            part = self._env[number]
            self._put(
                whole,
                part,
                lambda index: [
                    _sum(x, first) if i == d else x for i, x in enumerate(index)
                ],
            )
            first += part.shape[d]
        self._env[op.outs[0]] = whole

    def _op_pad(self, op: Operation) -> None:
        padding = self._env[op.ins[1]]
        apart = [n + 1 for n in op.attributes["interior_padding"]]
        value, low = self._cut(
            op, self._env[op.ins[0]], [*op.attributes["edge_padding_low"]]
        )
        whole = self._stored(Value(*op.types[0], lambda _: padding.at([])))
        self._put(
            whole, value, lambda index: [*map(_sum, map(_times, index, apart), low)]
        )
        self._env[op.outs[0]] = whole

    def _cut(
        self, op: Operation, value: Value, low: list[int]
    ) -> tuple[Value, list[int]]:
        """What remains of a value at whose ends less than nothing is padded, and what
        is padded before it."""
        high = [*op.attributes["edge_padding_high"]]
        apart = [*op.attributes["interior_padding"]]
        if min(*low, *high, 0) >= 0:
            return value, low
        if any(apart):
            raise UnknownOperation("pad that cuts and spreads")
        first = [max(-n, 0) for n in low]
        shape = tuple(
            n - a - max(-b, 0) for n, a, b in zip(value.shape, first, high, strict=True)
        )
        cut = value._replace(
            shape=shape, name="", at=lambda index: value.at([*map(_sum, index, first)])
        )
        return cut, [max(n, 0) for n in low]

    # --- sums and the like

    def _inline(
        self, region: Body, args: Sequence[Value]
    ) -> tuple[list[Any], list[Value]]:
        """A small region, with these values for its arguments."""
        self._env |= zip(region.args, args, strict=True)
        return self._nested(region, region.outs)

    def _counter(self, shape: Shape) -> tuple[list[str], Index]:
        """Heads of loops over all entries, and their indices."""
        names = [f"j{next(self._indices)}" if n > 1 else 0 for n in shape]
        heads = [
            f"for (int {x} = 0; {x} < {n}; {x}++)"
            for x, n in zip(names, shape, strict=True)
            if n > 1
        ]
        return heads, names

    def _nest(self, heads: list[str], inside: list[Any]) -> list[Any]:
        """Loops around lines, not to be divided."""
        return [Block([(" ".join([*heads, "{"]), inside)], True)] if heads else inside

    def _scalar(self, text: str, kind: str) -> Value:
        return Value((), kind, lambda _: text)

    def _op_reduce(self, op: Operation) -> None:
        count = len(op.outs)
        [region] = op.regions
        values = [self._env[x] for x in op.ins[:count]]
        initial = [self._env[x].at([]) for x in op.ins[count:]]
        dims = [*op.attributes["dimensions"]]
        shape = values[0].shape
        kept = _others(shape, dims)
        results = [self._variable(*kind) for kind in op.types]
        outer, over = self._counter(tuple(shape[d] for d in kept))
        inner, inside = self._counter(tuple(shape[d] for d in dims))
        place: dict[int, int | str] = dict(
            zip([*kept, *dims], [*over, *inside], strict=True)
        )
        index = [place[d] for d in range(len(shape))]
        sums = [self._new(value.kind) for value in values]
        entries = [self._scalar(value.at(index), value.kind) for value in values]
        held = [
            self._scalar(name, value.kind)
            for name, value in zip(sums, values, strict=True)
        ]
        lines, after = self._inline(region, [*held, *entries])
        texts = [value.at([]) for value in after]
        if count > 1:  # (one may read what another changes)
            fresh = [self._new(value.kind) for value in values]
            lines += [
                Line(f"{name} = {text};", name)
                for name, text in zip(fresh, texts, strict=True)
            ]
            texts = fresh
        lines += [
            Line(f"{name} = {text};") for name, text in zip(sums, texts, strict=True)
        ]
        begin = [
            Line(f"{name} = {x};", name) for name, x in zip(sums, initial, strict=True)
        ]
        end = [
            Line(f"{result.at(over)} = {name};")
            for result, name in zip(results, sums, strict=True)
        ]
        self._nodes += self._nest(outer, [*begin, *self._nest(inner, lines), *end])
        self._env |= zip(op.outs, results, strict=True)

    def _op_reduce_window(self, op: Operation) -> None:
        value = self._env[op.ins[0]]
        initial = self._env[op.ins[1]].at([])
        [region] = op.regions
        shape, kind = op.types[0]
        attributes = op.attributes
        windows = [*attributes["window_dimensions"]]
        low = np.asarray(attributes["padding"]).reshape(-1, 2)[:, 0].tolist()
        others = ("window_strides", "base_dilations", "window_dilations")
        plain = all({*attributes.get(name, [1])} == {1} for name in others)
        [d] = [d for d, n in enumerate(windows) if n != 1] or [0]
        n = shape[d]
        if (
            not plain
            or shape != value.shape
            or windows[d] != n
            or low[d] not in (0, n - 1)
        ):
            raise UnknownOperation("reduce_window other than a running one")
        result = self._variable(shape, kind)
        total = self._new(kind)
        heads, over = self._counter(tuple(m for e, m in enumerate(shape) if e != d))
        k = f"j{next(self._indices)}"
        along = k if low[d] else f"{n - 1} - {k}"
        index = [*over[:d], along, *over[d:]]
        lines, [after] = self._inline(
            region, [self._scalar(total, kind), self._scalar(value.at(index), kind)]
        )
        lines += [
            Line(f"{total} = {after.at([])};"),
            Line(f"{result.at(index)} = {total};"),
        ]
        loop = self._nest([f"for (int {k} = 0; {k} < {n}; {k}++)"], lines)
        self._nodes += self._nest(heads, [Line(f"{total} = {initial};", total), *loop])
        self._env[op.outs[0]] = result

    def _op_dot_general(self, op: Operation) -> None:
        numbers = _dimensions(op.attributes["dot_dimension_numbers"])
        sides = []
        for number, side in zip(op.ins, ("lhs", "rhs"), strict=True):
            value = self._solid(number)
            batch = numbers[f"{side}_batching_dimensions"]
            summed = numbers[f"{side}_contracting_dimensions"]
            sides.append(
                (value, batch, _others(value.shape, (*batch, *summed)), summed)
            )
        shape, kind = op.types[0]
        total = self._new("double")
        result = self._variable(shape, kind)
        heads, over = self._counter(shape)
        left, batch, free, summed = sides[0]
        loops, along = self._counter(tuple(left.shape[d] for d in summed))
        shared = len(batch)
        split = shared + len(free)
        factors = []
        for (value, batch, free, summed), own in zip(
            sides, (over[shared:split], over[split:]), strict=True
        ):
            place = dict(
                zip(
                    [*batch, *free, *summed],
                    [*over[:shared], *own, *along],
                    strict=True,
                )
            )
            factors.append(value.at([place[d] for d in range(len(value.shape))]))
        begin = Line(f"{total} = 0;", total)
        add = self._nest(loops, [Line(f"{total} += {' * '.join(factors)};")])
        end = Line(f"{result.at(over)} = {total};")
        self._nodes += self._nest(heads, [begin, *add, end])
        self._env[op.outs[0]] = result

    # --- entries by number

    def _op_gather(self, op: Operation) -> None:
        numbers = _dimensions(op.attributes["dimension_numbers"])
        value = self._solid(op.ins[0])
        rows = self._solid(op.ins[1])
        shape, kind = op.types[0]
        sizes = [*op.attributes["slice_sizes"]]
        offsets = numbers["offset_dims"]
        wide = _others(
            value.shape,
            (*numbers["collapsed_slice_dims"], *numbers["operand_batching_dims"]),
        )
        entry, along = self._entry(numbers, rows, _others(shape, offsets))
        pairs = [
            *zip(
                numbers["operand_batching_dims"],
                numbers["start_indices_batching_dims"],
                strict=True,
            )
        ]

        def at(index: Index) -> str:
            place: list[int | str] = [0] * len(value.shape)
            for j, d in enumerate(numbers["start_index_map"]):
                place[d] = (
                    f"within({entry(index, j)}, {value.shape[d] - sizes[d]})"
                    if value.shape[d] > sizes[d]
                    else 0
                )
            for d, r in pairs:
                place[d] = along(index, r)
            for d, o in zip(wide, offsets, strict=True):
                place[d] = _sum(place[d], index[o])
            return value.at(place)

        self._define(op.outs[0], Value(shape, kind, at, 2))

    def _entry(
        self, numbers: dict[str, list[int]], rows: Value, batch: list[int]
    ) -> tuple[Callable, Callable]:
        """C of the number `j` in the vector of indices that belongs to the entry of a
        result, and the index of that entry along the dimension `r` of the vectors."""
        own = _others(rows.shape, numbers["index_vector_dim"] or [0])

        def entry(index: Index, j: int) -> str:
            place: list[int | str] = [j] * len(rows.shape)
            for d, b in zip(own, batch, strict=True):
                place[d] = index[b]
            return rows.at(place)

        return entry, lambda index, r: index[batch[own.index(r)]]

    def _op_scatter(self, op: Operation) -> None:
        numbers = _dimensions(op.attributes["scatter_dimension_numbers"])
        whole = self._env[op.ins[0]]
        rows = self._solid(op.ins[1])
        part = self._solid(op.ins[2])
        [region] = op.regions
        whole = whole if self._own(op.ins[0]) else self._stored(whole)
        windows = numbers["update_window_dims"]
        wide = _others(
            whole.shape,
            (*numbers["inserted_window_dims"], *numbers["input_batching_dims"]),
        )
        entry, along = self._entry(numbers, rows, _others(part.shape, windows))
        heads, index = self._counter(part.shape)
        place: list[int | str] = [0] * len(whole.shape)
        sizes = dict(zip(wide, (part.shape[d] for d in windows), strict=True))
        lines = []
        tests = []
        for j, d in enumerate(numbers["scatter_dims_to_operand_dims"]):
            name = self._new("int64_t")
            lines.append(Line(f"{name} = {entry(index, j)};", name))
            tests.append(f"{name} >= 0 && {name} <= {whole.shape[d] - sizes.get(d, 1)}")
            place[d] = name
        for d, r in zip(
            numbers["input_batching_dims"],
            numbers["scatter_indices_batching_dims"],
            strict=True,
        ):
            place[d] = along(index, r)
        for d, w in zip(wide, windows, strict=True):
            place[d] = _sum(place[d], index[w])
        target = whole.at(place)
        inside, [after] = self._inline(
            region, [self._scalar(x, whole.kind) for x in (target, part.at(index))]
        )
        inside.append(Line(f"{target} = {after.at([])};"))
        lines.append(
            Block([(f"if ({' && '.join(tests)}) {{" if tests else "{", inside)], True)
        )
        self._nodes += self._nest(heads, lines)
        self._env[op.outs[0]] = whole

    # --- text

    def _printed(self) -> str:
        """All functions, none longer than `LONGEST` lines, behind the frame with what
        they share."""
        divided: dict[str, list[Any]] = {}
        for name, nodes in self._functions.items():
            divided |= _divided(f"{self.name}_{name}", nodes)
        homes: dict[str, set[str]] = collections.defaultdict(set)
        for function, nodes in divided.items():
            for token in {*_TOKEN.findall("\n".join(_texts(nodes)))}:
                homes[token].add(function)
        shared = {
            name
            for name in self._kinds
            if len(homes[name]) > 1 or self._bytes(name) > _LARGE
        }
        shared |= self._pointed & {*self._kinds}
        for variables, values in self._results.values():
            shared |= {*variables, *(value.name for value in values)}
        kept = [name for name in self._kinds if name in shared]
        self.bytes = sum(map(self._bytes, kept))
        fields = "\n".join(f"  {self._declared(name)};" for name in kept)
        texts = [f"struct {self.name}_frame {{\n{fields}\n}};"]
        texts += [
            f"static const {kind} {name}[] = {{{text}}};"
            for (kind, text), name in self._tables.items()
        ]
        texts += [
            f"APART static void {name}(struct {self.name}_frame *frame);"
            for name in divided
        ]

        def in_frame(found: re.Match) -> str:
            return f"frame->{found[0]}" if found[0] in shared else found[0]

        def lines(nodes: list[Any], depth: int) -> Iterator[str]:
            margin = "  " * depth
            for node in nodes:
                if isinstance(node, Block):
                    for head, inside in node.parts:
                        yield margin + _TOKEN.sub(in_frame, head)
                        yield from lines(inside, depth + 1)
                    yield margin + "}"
                elif node.declares and node.declares not in shared:
                    if node.text:
                        kind = self._kinds[node.declares][0]
                        yield f"{margin}{kind} {_TOKEN.sub(in_frame, node.text)}"
                    else:
                        yield f"{margin}{self._declared(node.declares)};"
                elif node.text:
                    yield margin + _TOKEN.sub(in_frame, node.text)

        for name, nodes in divided.items():
            texts.append(
                "\n".join(
                    [
                        f"static void {name}(struct {self.name}_frame *frame) {{",
                        *lines(nodes, 1),
                        "}",
                    ]
                )
            )
        return "\n".join(texts) + "\n"

    def _bytes(self, name: str) -> int:
        kind, size = self._kinds[name]
        return size * _BYTES.get(kind, 1)

    def _declared(self, name: str) -> str:
        kind, size = self._kinds[name]
        return f"{kind} {name}[{size}]" if size > 1 else f"{kind} {name}"


def _texts(nodes: list[Any]) -> Iterator[str]:
    for node in nodes:
        if isinstance(node, Block):
            for head, inside in node.parts:
                yield head
                yield from _texts(inside)
        else:
            yield from (node.text, node.declares)


def _length(node: Any) -> int:
    return (
        1
        if not isinstance(node, Block)
        else 1 + sum(_length(inner) for _, inside in node.parts for inner in inside)
    )


def _divided(name: str, nodes: list[Any]) -> dict[str, list[Any]]:
    """The function `name`, and those that its lines are divided into."""
    parts: dict[str, list[Any]] = {}

    def short(nodes: list[Any], most: int) -> list[Any]:
        inner = [
            Block([(head, short(inside, most // 2)) for head, inside in node.parts])
            if isinstance(node, Block) and not node.whole and _length(node) > most // 2
            else node
            for node in nodes
        ]
        while sum(map(_length, inner)) > most:
            groups: list[list[Any]] = [[]]
            for node in inner:
                apart = isinstance(node, Line) and node.pinned
                if groups[-1] and (
                    apart or sum(map(_length, groups[-1])) + _length(node) > LONGEST
                ):
                    groups.append([])
                groups[-1].append(node)
                if apart:
                    groups.append([])
            groups = [group for group in groups if group]
            if len(groups) == len(inner):
                break
            inner = [group[0] if len(group) == 1 else called(group) for group in groups]
        return inner

    def called(group: list[Any]) -> Any:
        part = f"{name}_{len(parts) + 1}"
        parts[part] = group
        return Line(f"{part}(frame);")

    whole = short(nodes, LONGEST)
    return {**parts, name: whole}
