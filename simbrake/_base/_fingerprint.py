"""Fingerprints: hashes of values, structures and code that are the same in every process.

A study that goes on with the numbers of another process needs to know that this process would find the same ones. So
the fingerprint of a function covers its code, defaults, closure and attributes, the global values that it reads, and
the functions and classes that it uses, and theirs; that of an object its class and its state. Code of installed
libraries is known by their versions. What depends on anything else (files, the environment, clocks, random numbers),
and objects whose state is hidden, have no fingerprint: `FingerprintError`.

(`cloudpickle` and `dask.tokenize` name functions of importable modules and do not look into them; `joblib.hash` takes
their source without what it reads.)
"""

import collections
import dataclasses
import dis
import enum
import functools
import hashlib
import importlib
import importlib.metadata
import re
import site
import sys
import sysconfig
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

#: libraries that simbrake computes with
LIBRARIES = ("jax", "jaxlib", "numpy", "equinox", "diffrax", "optimistix", "lineax")
#: modules whose functions and objects depend on more than their arguments
_OUTSIDE = ("os", "posix", "nt", "io", "_io", "pathlib", "time", "datetime", "random", "secrets", "uuid", "socket")
_OUTSIDE += ("subprocess", "tempfile", "shutil", "glob", "importlib", "urllib", "http", "requests", "numpy.random")
#: functions that do, of the language and, by their names, of libraries
_OUTSIDE_BUILTINS = {"open", "eval", "exec", "compile", "globals", "__import__", "input"}
_READS_FILES = re.compile(r"(load|loadtxt|load_.*|read_.*|open_.*|genfromtxt|fromfile|memmap|imread|urlopen)")
#: operations of bytecode that read a global name, an attribute, or a module
_GLOBALS = {"LOAD_GLOBAL", "LOAD_NAME", "LOAD_FROM_DICT_OR_GLOBALS"}
_ATTRIBUTES = {"LOAD_ATTR", "LOAD_METHOD", "LOAD_SUPER_ATTR", "IMPORT_FROM"}
_LOCALS = {"LOAD_FAST", "LOAD_FAST_BORROW", "LOAD_FAST_CHECK", "LOAD_DEREF", "LOAD_CLASSDEREF"}
_BETWEEN = {"EXTENDED_ARG", "CACHE", "PUSH_NULL", "PRECALL"}
_JOINED = re.compile(r"(?:LOAD|STORE)_FAST(?:_BORROW)?")
#: entries of a class that say nothing about what it does
_OF_EVERY_CLASS = {"__doc__", "__module__", "__dict__", "__weakref__", "__annotations__", "__qualname__", "_abc_impl"}
_OF_EVERY_CLASS |= {"__dataclass_fields__", "__dataclass_params__", "__parameters__", "__orig_bases__", "__slots__"}
_OF_EVERY_CLASS |= {"__firstlineno__", "__static_attributes__", "__annotate_func__", "__annotations_cache__"}
_OF_EVERY_CLASS |= {"__abstractmethods__", "__match_args__", "__abstractvars__", "__abstractclassvars__"}
#: parts of one fingerprint; more are a program as a whole, as in `sys.modules`
_MOST = 2_000_000

_OWN = __name__.partition(".")[0]
_NOTHING: Any = object()
_PLAIN = jax.Array | np.ndarray | np.generic | float | int | str | bytes | complex | tuple | list | dict


class FingerprintError(ValueError):
    """Something that has no fingerprint, and where it was found."""


def fingerprint(*parts: object) -> str:
    """Return a hash of values, structures and code (64 hexadecimal digits), the same in every process.

    Raises `FingerprintError` for what depends on more than can be seen.
    """
    return _Walk().digest(parts)


def library_of(module: str) -> str | None:
    """Name and version of the installed library that a module belongs to; `None` for code that may change without."""
    root = module.partition(".")[0]
    if root == _OWN:
        return f"{root} {_source()}"
    if root == "builtins":
        return _python()
    there = sys.modules.get(root)
    places = [getattr(there, "__file__", None), *getattr(there, "__path__", ())]
    place = next((Path(path) for path in places if isinstance(path, str)), None)
    if place is None:
        return _python() if there is not None and root in sys.stdlib_module_names else None
    libraries, language = _folders()
    if any(folder in place.parents for folder in libraries):
        number = _version(root)
        return None if number is None else f"{root} {number}"
    return _python() if any(folder in place.parents for folder in language) else None


@functools.cache
def _source() -> str:
    """A hash of simbrake's source: in a working copy it changes without the version."""
    folder, digest = Path(__file__).parents[1], hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(f"{file.relative_to(folder).as_posix()}\n".encode() + file.read_bytes())
    return digest.hexdigest()[:16]


def versions() -> dict[str, str]:
    """Versions of everything that the numbers of a run depend on."""
    libraries = {name: importlib.metadata.version(name) for name in (_OWN, *LIBRARIES)}
    return libraries | {"source of simbrake": _source(), "Python": _python().partition(" ")[2]}


def _python() -> str:
    return f"Python {sys.version_info.major}.{sys.version_info.minor}"


@functools.cache
def _folders() -> tuple[list[Path], list[Path]]:
    """Folders of installed libraries, and of the language's own."""
    paths = sysconfig.get_paths()
    libraries = {paths["purelib"], paths["platlib"], *site.getsitepackages(), site.getusersitepackages()}
    return [Path(folder) for folder in libraries], [Path(paths["stdlib"]), Path(paths["platstdlib"])]


@functools.cache
def _version(root: str) -> str | None:
    names = [root]
    try:
        return importlib.metadata.version(root)
    except importlib.metadata.PackageNotFoundError:
        names = importlib.metadata.packages_distributions().get(root, [])
    return ", ".join(importlib.metadata.version(name) for name in names) or None


def _attribute(part: object, name: str) -> Any:
    try:
        return getattr(part, name, _NOTHING)
    except Exception:  # a property of a foreign object
        return _NOTHING


def _known_as(part: object) -> str | None:
    """Library, module and name under which a class or function of an installed library is found there."""
    module, name = _attribute(part, "__module__"), _attribute(part, "__qualname__")
    if isinstance(part, np.ufunc):  # has no module
        module, name = ("numpy" if getattr(np, part.__name__, None) is part else "scipy.special"), part.__name__
    if isinstance(part, types.BuiltinFunctionType) and isinstance(part.__self__, types.ModuleType):
        module = part.__self__.__name__
    if not isinstance(module, str) or not isinstance(name, str) or (library := library_of(module)) is None:
        return None
    there: Any = sys.modules.get(module)
    for step in name.split("."):
        there = _attribute(there, step)
    return f"{library} {module}.{name}" if there is part else None


def _looks_outside(module: str, name: str) -> bool:
    """Whether a function, class or object of a library depends on more than its arguments."""
    inside = any(module == outside or module.startswith(f"{outside}.") for outside in _OUTSIDE)
    return inside or _READS_FILES.fullmatch(name) is not None or (module, name) in (("sys", "modules"), ("sys", "argv"))


class _Reads(NamedTuple):
    """What the code of a function reads by names."""

    chains: list[tuple[str, ...]]  # as `np.linalg.norm`, from a global or an imported name
    modules: list[tuple[str, int]]  # imported ones: name, and the level of a relative import
    imported: dict[str, tuple[int, tuple[str, ...]]]  # variable → which of these, and attributes
    attributes: list[str]  # all of them, of whatever object


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    """A code and all inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield from _codes(constant)


def _steps(code: types.CodeType) -> Iterator[tuple[str, Any]]:
    """Operations and what they are about; those that Python joins (`LOAD_FAST_LOAD_FAST`) one after the other."""
    for step in dis.get_instructions(code):
        parts = _JOINED.findall(step.opname)
        if len(parts) > 1 and isinstance(step.argval, tuple):
            yield from zip(parts, step.argval, strict=True)
        elif step.opname not in _BETWEEN:
            yield step.opname, step.argval


def _reads(code: types.CodeType) -> _Reads:
    reads = _Reads([], [], {}, [])
    for body in _codes(code):
        chain: list[str] = []
        module: tuple[int, tuple[str, ...]] | None = None
        earlier: list[tuple[str, Any]] = [("", None)] * 2
        for operation, name in _steps(body):
            goes_on = operation in _ATTRIBUTES
            if chain and not goes_on:
                reads.chains.append(tuple(chain))
                chain = []
            if goes_on:
                reads.attributes.append(name)
                chain += [name] if chain else []
            if operation == "IMPORT_FROM" and module is not None:
                module = module[0], (name,)
            elif operation in _GLOBALS or (operation in _LOCALS and name in reads.imported):
                chain = [name]
            elif operation == "IMPORT_NAME":
                (_, level), (_, wanted) = earlier
                whole = name if wanted else name.partition(".")[0]  # `import a.b` binds a
                reads.modules.extend((part, level) for part in dict.fromkeys([name, whole]))
                module = len(reads.modules) - 1, ()
            elif operation.startswith("STORE_") and module is not None:
                reads.imported[name] = module
            elif operation == "POP_TOP" and earlier[1][0] != "SWAP":
                module = None
            if (
                operation in ("STORE_FAST", "STORE_DEREF", "STORE_NAME", "STORE_GLOBAL")
                and earlier[1][0] == "IMPORT_NAME"
            ):
                module = None
            earlier = [earlier[1], (operation, name)]
        if chain:
            reads.chains.append(tuple(chain))
    return reads._replace(attributes=[*dict.fromkeys(reads.attributes)], chains=[*dict.fromkeys(reads.chains)])


class _Walk:
    """One walk over values and code, all of which goes into one hash."""

    def __init__(self, trail: tuple[str, ...] = ()) -> None:
        self._hash = hashlib.sha256()
        self._seen: dict[int, tuple[int, object]] = {}  # keeps them alive, or their ids would be used again
        self._within, self._modules = set[int](), set[tuple[str, ...]]()
        self._trail, self._count = [*trail], 0

    def digest(self, part: object) -> str:
        try:
            self._feed(part)
        except RecursionError:
            raise self._refused("is nested too deeply") from None
        return self._hash.hexdigest()

    def _refused(self, words: str) -> FingerprintError:
        return FingerprintError(f"{' → '.join(self._trail) or 'it'} {words}")

    def _mark(self, *texts: object) -> None:
        self._hash.update("\0".join(map(str, texts)).encode("utf-8", "surrogatepass"))

    def _named(self, name: str, part: object) -> None:
        """A part under a name."""
        self._mark(name)
        self._trail.append(name)
        self._feed(part)
        self._trail.pop()

    def _feed(self, part: Any) -> None:
        self._count += 1
        if self._count > _MOST:
            raise self._refused("leads to too many values")
        if isinstance(part, enum.Enum):
            self._mark(type(part).__module__, type(part).__qualname__, part.name)
            self._feed(part.value)
        elif isinstance(part, jax.Array | np.ndarray | np.generic | float | int):
            self._numbers(part)
        elif part is None or type(part) in (str, bytes, complex, type(...), type(NotImplemented), slice, range):
            self._mark(repr(part))
        elif isinstance(part, str | bytes):
            self._mark(repr(part[:]))
        elif isinstance(part, bytearray):
            self._mark(repr(bytes(part)))
        elif type(part) in (tuple, list, dict, set, frozenset, types.MappingProxyType):
            self._content(part)
        elif id(part) in self._seen:
            self._mark("again", self._seen[id(part)][0])
        else:
            self._seen[id(part)] = len(self._seen), part
            self._look_into(part)

    def _numbers(self, part: Any) -> None:
        if isinstance(part, jax.Array) and jax.dtypes.issubdtype(part.dtype, jax.dtypes.prng_key):
            part = jax.random.key_data(part)
        try:
            array = np.asarray(part)
        except jax.errors.TracerArrayConversionError:
            raise self._refused("is a traced value") from None
        if array.dtype.hasobject:
            self._mark(array.dtype.str, array.shape)
            self._feed(repr(part) if isinstance(part, int) else array.ravel().tolist())
        else:
            self._hash.update(f"{array.dtype.str}{array.shape}".encode() + array.tobytes())

    def _content(self, part: Any) -> None:
        """Of a container. Two equal ones are alike, whether or not they are one object."""
        if id(part) in self._within:
            raise self._refused("contains itself")
        self._within.add(id(part))
        if isinstance(part, set | frozenset):  # their order differs from process to process
            self._mark("{", *sorted(_Walk(tuple(self._trail)).digest(entry) for entry in part))
        else:
            entries = [*part.items()] if isinstance(part, dict | types.MappingProxyType) else part
            self._mark(f"({len(entries)}")
            for entry in entries:
                self._feed(entry)
        self._within.discard(id(part))

    # --- objects

    def _look_into(self, part: Any) -> None:
        if isinstance(part, types.ModuleType):
            self._module(part, None)
        elif isinstance(part, types.FunctionType):
            self._function(part)
        elif isinstance(part, types.CodeType):
            self._code(part)
        elif isinstance(part, type):
            self._class(part)
        elif isinstance(part, types.MethodType):
            self._feed((part.__func__, part.__self__))
        elif isinstance(part, types.CellType):
            self._feed(_cell(part))
        elif isinstance(part, property):
            self._feed((part.fget, part.fset))
        elif isinstance(part, staticmethod | classmethod):
            self._feed((type(part).__name__, part.__func__))
        elif isinstance(part, functools.cached_property):  # has a lock besides
            self._feed(part.func)
        elif isinstance(part, functools.partial):
            self._feed((type(part), part.func, part.args, part.keywords))
        elif isinstance(part, np.dtype | jax.ShapeDtypeStruct | jax.tree_util.PyTreeDef):
            self._mark(type(part).__name__, part)
        elif (entry := _known_as(part)) is not None:
            self._library_entry(entry)
        elif isinstance(part, types.BuiltinFunctionType):  # a method of an object
            self._mark(part.__name__)
            self._feed(part.__self__)
        elif dataclasses.is_dataclass(part):
            self._feed(type(part))
            names = [field.name for field in dataclasses.fields(part)]
            self._state(names, part)
        elif callable(wrapped := _attribute(part, "__wrapped__")) and library_of(type(part).__module__):
            self._mark(type(part).__module__, type(part).__qualname__)  # of jax.jit, functools.cache
            self._feed(wrapped)
        else:
            self._object(part)

    def _library_entry(self, entry: str) -> None:
        module, _, name = entry.rpartition(" ")[2].rpartition(".")
        if _looks_outside(module, name) or (module == "builtins" and name in _OUTSIDE_BUILTINS):
            raise self._refused(f"uses {module}.{name}, which may depend on more than the code")
        self._mark(entry)

    def _state(self, names: list[str], part: Any) -> None:
        """Values by name, and the others that an object has."""
        more = getattr(part, "__dict__", {})
        for name in [*names, *(name for name in more if name not in names)]:
            self._named(name, _attribute(part, name) if name in names else more[name])

    def _object(self, part: Any) -> None:
        """An instance of a class: the class and all values that it has."""
        kind = type(part)
        if _looks_outside(kind.__module__, ""):
            raise self._refused(f"is a {kind.__module__}.{kind.__qualname__}, whose content may change")
        self._feed(kind)
        if isinstance(part, tuple | list | dict | set | frozenset):
            plain = next(base for base in (tuple, list, dict, set, frozenset) if isinstance(part, base))
            self._content(plain(part))
            self._state(["default_factory"] if isinstance(part, collections.defaultdict) else [], part)
        elif library_of(kind.__module__) is None:
            slots = [name for base in kind.__mro__ for name in _slots(base) if hasattr(part, name)]
            self._state(slots, part)
            if any(
                base is not object and isinstance(vars(base).get("__new__"), types.BuiltinFunctionType)
                for base in kind.__mro__
            ):  # a base class written in C may have a state besides
                self._pickled(part)
        else:
            self._pickled(part)

    def _pickled(self, part: Any) -> None:
        """What an object of a library hands out for a copy."""
        try:
            parts = part.__reduce_ex__(4)
        except Exception as error:
            kind = type(part)
            raise self._refused(f"is a {kind.__module__}.{kind.__qualname__}, whose content is hidden") from error
        if isinstance(parts, str):
            self._mark(parts)
        else:
            maker, arguments, *state = parts
            lists = [item if k == 0 or item is None else [*item] for k, item in enumerate(state)]
            self._feed((maker, arguments, lists))

    # --- code

    def _class(self, kind: type) -> None:
        if (entry := _known_as(kind)) is not None:
            self._library_entry(entry)
            return
        self._mark(kind.__module__, kind.__qualname__)
        if library_of(kind.__module__) is not None:  # made by a function of the library
            return
        self._trail.append(kind.__name__)
        self._feed((type(kind), kind.__bases__))
        if issubclass(kind, enum.Enum):
            self._feed({name: member.value for name, member in kind.__members__.items()})
        if dataclasses.is_dataclass(kind):
            self._feed([(field.name, field.default, field.default_factory) for field in dataclasses.fields(kind)])
        for name, value in _members(kind):
            self._named(name, value)
        self._trail.pop()

    def _module(self, module: types.ModuleType, attributes: list[str] | None) -> None:
        """A module: of a library its version, else its source and what it has, of these names or in all."""
        library = library_of(module.__name__)
        self._mark(module.__name__, library)
        if library is not None:
            return
        file = getattr(module, "__file__", None)
        if isinstance(file, str) and Path(file).is_file():
            self._mark(hashlib.sha256(Path(file).read_bytes()).hexdigest())
        content = vars(module)
        names = [name for name in content if name[:2] != "__"] if attributes is None else [*attributes, "__getattr__"]
        for name in names:
            value = content.get(name, _NOTHING)
            if isinstance(value, types.ModuleType):
                self._mark(name)
                self._within_module(value, attributes)
            elif value is not _NOTHING:
                self._named(name, value)

    def _within_module(self, module: types.ModuleType, attributes: list[str] | None) -> None:
        """A module, once for these names."""
        key = module.__name__, *(attributes or ["*"])
        if key not in self._modules:
            self._modules.add(key)
            self._module(module, attributes)

    def _function(self, function: types.FunctionType) -> None:
        home = function.__globals__.get("__name__", "")  # wrappers take over `__module__`
        library = library_of(home) if isinstance(home, str) else None
        if library is not None and (entry := _known_as(function)) is not None:
            self._library_entry(entry)
            return
        self._trail.append(function.__name__)
        self._mark(home, function.__code__.co_qualname, library)
        cells = [_cell(cell) for cell in function.__closure__ or ()]
        self._feed((function.__defaults__, function.__kwdefaults__, vars(function)))
        for name, value in zip(function.__code__.co_freevars, cells, strict=True):
            self._named(name, value)
        if library is None:
            self._code(function.__code__)
            self._names(_reads(function.__code__), function.__globals__)
        self._trail.pop()

    def _code(self, code: types.CodeType) -> None:
        self._mark(code.co_name, code.co_flags, code.co_argcount, code.co_kwonlyargcount, code.co_posonlyargcount)
        self._hash.update(code.co_code + code.co_exceptiontable)
        self._feed((code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars))
        self._mark(len(code.co_consts))
        for constant in code.co_consts:
            self._code(constant) if isinstance(constant, types.CodeType) else self._feed(constant)

    def _names(self, reads: _Reads, names: dict[str, Any]) -> None:
        """The values that code reads by names."""
        modules = []
        for module, level in reads.modules:
            try:
                modules.append(importlib.import_module("." * level + module, names.get("__package__")))
            except Exception as error:
                raise self._refused(f"imports {module}, which fails") from error
            self._within_module(modules[-1], reads.attributes)
        builtins = names.get("__builtins__", {})
        builtins = builtins if isinstance(builtins, dict) else vars(builtins)
        for name, *rest in reads.chains:
            value: Any = names.get(name, builtins.get(name, _NOTHING))
            if name in reads.imported:
                which, inside = reads.imported[name]
                value, rest = modules[which], [*inside, *rest]
            self._mark(name)
            self._trail.append(name)
            if isinstance(value, types.ModuleType):
                self._within_module(value, reads.attributes if rest else None)  # a bare name may be handed on
                self._chain(value, rest)
            elif value is not _NOTHING:
                self._feed(value)
            self._trail.pop()

    def _chain(self, module: types.ModuleType, names: list[str]) -> None:
        """The value of `module.a.b`, as far as it is one of a module of a library."""
        for name in names:
            if library_of(module.__name__) is None:
                return  # its attributes are known
            if _looks_outside(module.__name__, name):
                raise self._refused(f"uses {module.__name__}.{name}, which may depend on more than the code")
            value = _attribute(module, name)
            if not isinstance(value, types.ModuleType):
                # what else a library has under a name is known by its version
                return self._named(name, value) if isinstance(value, _PLAIN | types.FunctionType | type) else None
            module = value
        return None


def _cell(cell: types.CellType) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not yet filled
        return "empty"


def _slots(kind: type) -> list[str]:
    slots = vars(kind).get("__slots__", ())
    names = [slots] if isinstance(slots, str) else [*slots]
    return [name for name in names if name not in ("__dict__", "__weakref__")]


def _members(kind: type) -> Iterator[tuple[str, Any]]:
    """What a class has of its own; of an enumeration, which has its members besides, the functions."""
    skipped = (types.MemberDescriptorType, types.GetSetDescriptorType)
    functions = (types.FunctionType, property, staticmethod, classmethod)
    for name, value in vars(kind).items():
        is_skipped = name in _OF_EVERY_CLASS or isinstance(value, skipped)
        if not is_skipped and (not issubclass(kind, enum.Enum) or isinstance(value, functions)):
            yield name, value
