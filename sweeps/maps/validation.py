"""A file held against the one description of its system's maps; what is admitted may be trusted."""

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.core import indexing

from sweeps import systems
from sweeps.reading.definitions import definition_of
from sweeps.reading.files import FileBytes
from sweeps.reading.hdf5 import ALLOWED, MAX_TEXT, StoredVariable, Structure, read_structure
from sweeps.reading.limits import MAX_FILE_BYTES
from sweeps.reading.stored_values import StoredValues
from sweeps.schema.iteration import runs
from sweeps.schema.refusals import MapError, cut_text, display
from sweeps.schema.variables import (
    CONTRACT_VERSION,
    POINT,
    POINT_NAME,
    Layout,
    Variable,
    allowed_values,
    extremes,
    is_readable,
)

MAP = "stability_map.nc"  # a sweep's map in its folder results/<sweep>
WHOLE = ("definition", "inputs", "outlines")  # attributes that are compared or drawn, and never cut
DESCRIBING = ("long_name", "units", "comment")  # of what only its own system's description knows
MOST_WORDS = 200  # characters of these, and of a name
MOST_SWOLLEN = 100  # how many times its own size on disk a column of digits may have
MOST_WHOLE = 2**20  # values of a coordinate beside the dimensions' own that are read at once
PACKING = ("scale_factor", "add_offset", "_FillValue", "missing_value")  # of them netCDF makes other numbers
SMALL = 2**26  # bytes that may be swollen as they like


class _UnlikeError(Exception):
    """In what a file is unlike a map: the message but for the file's name."""


def map_of(path: str | Path) -> Path:
    """Return the file that a user means: the path itself, or the map in a sweep's folder results/<sweep>."""
    if not isinstance(path, str | os.PathLike):
        raise MapError(f"path: {display(path)} is no path; allowed: {ALLOWED}")
    path = Path(path)
    if not path.is_dir():
        return path
    if not (path / MAP).exists():
        raise MapError(f"{path}: this folder holds no {MAP}; allowed: a map, or the folder results/<sweep> of one")
    return path / MAP


def read(path: str | Path, any_flags: bool = False) -> xr.Dataset:
    """Return the content of a file that is a map, complete or not; see `admitted`."""
    try:
        file = FileBytes(path)
    except (OSError, ValueError) as error:
        is_there = isinstance(error, PermissionError)
        wrong = f"cannot be opened ({error.strerror})" if is_there else "there is no such file"
        raise MapError(f"{path}: {wrong}; allowed: {ALLOWED}") from None
    return admitted(path, file, read_structure(file), any_flags)


def admitted(path: str | Path, file: FileBytes, structure: Structure, any_flags: bool = False) -> xr.Dataset:
    """Return the content of a file that is a map; numbers are read on their first use.

    With `any_flags`, flags without a meaning are read as they are, else refused as they are read.
    """
    try:
        attributes = _global(structure.attributes)
        parts = _Parts(_layout(attributes, structure.variables), structure.variables)
        _check(parts)
        return _dataset(parts, file, attributes, any_flags)
    except _UnlikeError as unlike:
        raise MapError(f"{path}: {unlike}") from None


def whole(path: str | Path, ds: xr.Dataset) -> xr.Dataset:
    """Return a map; close and refuse one without a variable that its definition chose, or that its system names."""
    missing = sorted((_promised(ds.attrs) or set(systems.of_map(ds).layout().needed)) - set(ds.variables))
    if missing:
        ds.close()
        wrong = f"{_shown(missing[0])}: is missing ({len(missing)} in all)"
        raise MapError(f"{path}: {wrong}; allowed: every variable of a map")
    return ds


def _promised(attributes: Mapping[str, Any]) -> set[str]:
    """Return variables that a map's own definition chose; none where it chose none."""
    text = str(attributes.get("definition", ""))
    if "variables" not in text and "\\" not in text:  # nor does an escape spell it: there is no need to parse
        return set()
    integration = definition_of(attributes).get("integration")
    chosen = integration.get("variables") if isinstance(integration, dict) else None
    return set(map(str, chosen)) if isinstance(chosen, tuple) else set()


# -- attributes


def _said(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def _global(attributes: Mapping[str, Any]) -> dict[str, str]:
    """Return attributes of the whole file as text of bounded length, of a contract that is known."""
    texts = {}
    for name, value in attributes.items():
        text = _printable(name, name, "") and _printable(name, _said(value), "\n\t" if name != "definition" else None)
        if not name.startswith("_"):  # the netCDF library's own
            texts[name] = cut_text(text, MAX_FILE_BYTES if name in WHOLE else MAX_TEXT)
    version = texts.get("contract_version", "")
    if not is_readable(version):
        stated = _shown(version) or "missing"
        raise _UnlikeError(f"contract_version: is {stated}; allowed: {CONTRACT_VERSION}, the version of Polhode's maps")
    return texts


def _printable(where: str, text: str, beside: str | None) -> str:
    """Return a text if its characters are printable or in `beside` (None: any character is allowed); else raise."""
    if beside is not None and not all(c.isprintable() or c in beside for c in text):
        where = "".join(c if c.isprintable() else "?" for c in where[:60])
        raise _UnlikeError(f"{where}: holds control characters; allowed: printable text")
    return text


def _layout(attributes: Mapping[str, str], variables: Mapping[str, StoredVariable]) -> Layout:
    """Return the description of the maps of a file's system, from its attributes and its variables' names."""
    try:
        layout = systems.of_contents(attributes, variables).layout()
    except KeyError:
        name = cut_text(repr(attributes["system"]))
        raise _UnlikeError(f"system: {name} is not available; allowed: {', '.join(systems.system_names())}") from None
    has_names = POINT_NAME.name in variables and variables[POINT_NAME.name].dims[:1] == (POINT.name,)
    ours = (POINT, POINT_NAME) if has_names else (POINT,)
    return replace(layout, coordinates={one.name: one for one in ours} | layout.coordinates)


# -- variables and coordinates


class _Parts:
    """A file's variables, told apart."""

    def __init__(self, layout: Layout, held: Mapping[str, StoredVariable]):
        self.layout = layout  #: what they are held against
        #: name → coordinate, in the layout's order
        self.coordinates = {name: held[name] for name in layout.coordinates if name in held}
        #: name → variable, in the layout's order
        self.variables = {name: held[name] for name in layout.variables if name in held}
        self.specs = {**layout.coordinates, **layout.variables}  #: name → what each of both should be
        if layout.is_open:
            self._take_own(held)
        parts = {*self.coordinates, *self.variables}
        characters = {one.dims[-1] for one in self.coordinates.values() if one.dtype == "|S1" and one.dims}
        #: names of what is no part of a map, and is not read
        self.others = tuple(
            name for name, one in held.items() if name not in parts and (one.dtype or name not in characters)
        )
        known = ((one.dims, self.specs[n].over) for n, one in self.variables.items() if n in layout.variables)
        points = (dims[: len(dims) - len(over)] for dims, over in known)
        self.dims = max(points, key=len, default=())  #: the dimensions of the map's points, in storage order
        #: those that variables have beside them
        self.further = tuple(dict.fromkeys(dim for name in self.variables for dim in self.specs[name].over))

    def _take_own(self, held: Mapping[str, StoredVariable]) -> None:
        """Take the parameters and places that only the description of the system has: they are doubles."""
        doubles = {}
        for name, one in held.items():
            if name in self.specs or one.dtype not in ("<f8", ">f8"):
                continue
            words = {key: _printable(f"{name}:{key}", _said(one.attributes.get(key, "")), "") for key in DESCRIBING}
            words = {key: text[:MOST_WORDS] for key, text in words.items()}
            units, meaning = words["units"] or "1", words["long_name"] or name
            self.specs[name] = Variable(name, units, meaning, comment=words["comment"])
            if one.dims in ((), (name,), (POINT.name,)):
                doubles[name] = one
            else:
                self.variables[name] = one
        self.coordinates = doubles | self.coordinates


def _check(parts: _Parts) -> None:
    if not parts.variables:
        raise _UnlikeError("(variables): none; allowed: every variable of a map")
    for name, held in parts.coordinates.items():
        _check_coordinate(parts, name, held)
    _check_dimensions(parts)
    for name, held in parts.variables.items():
        _check_variable(parts, name, held)


def _check_dimensions(parts: _Parts) -> None:
    dims = parts.dims
    order = [dim for dim in parts.layout.coordinates if dim in dims]
    if [dim for dim in dims if dim in order] != order or len(set(dims)) != len(dims):
        raise _UnlikeError(f"dimensions: are ({', '.join(dims)}); allowed: each once, {', '.join(order)} in this order")
    for dim in (*dims, *parts.further):
        if dim not in parts.coordinates or _own_dims(parts, dim) != (dim,):
            value = cut_text(repr(dim)) if dim else "(one without a name)"
            value += " has no coordinate" + (" of type float64" if parts.layout.is_open else "")
            raise _UnlikeError(f"dimensions: {value}; allowed: those of this system's maps")
    for name in parts.coordinates:
        along = _own_dims(parts, name)
        if not set(along) <= {*dims, *parts.further, parts.layout.along} - ({POINT.name} - {*dims}):
            raise _UnlikeError(f"{name}: lies along {', '.join(along)}; allowed: a dimension of the map")
    if missing := sorted(parts.layout.required(parts.coordinates) - {*parts.coordinates}):
        raise _UnlikeError(f"{missing[0]}: is missing; allowed: every coordinate of a map")


def _own_dims(parts: _Parts, name: str) -> tuple[str, ...]:
    """Return dimensions of a coordinate, without that of its characters."""
    held = parts.coordinates[name]
    return held.dims[:-1] if held.dtype == "|S1" and held.dims else held.dims


def _check_coordinate(parts: _Parts, name: str, held: StoredVariable) -> None:
    spec, dims = parts.specs[name], _own_dims(parts, name)
    over = tuple(dim for dim in parts.layout.over.get(name, ()) if dim in dims)
    if dims not in ((), (name,), (parts.layout.along,), (POINT.name,), over):
        value = _shown(" × ".join(dim or "?" for dim in dims))
        raise _UnlikeError(f"{name}: lies along {value}; allowed: its own dimension alone")
    if spec.dtype == "str":
        if held.dtype != "str" and not held.dtype.startswith("|S"):
            raise _UnlikeError(f"{name}: is of type {held.dtype or 'unknown'}; allowed: text")
    else:
        _check_type(name, held, spec)
    shape = tuple(n for dim in over if dim in parts.coordinates for n in parts.coordinates[dim].shape)
    if dims == over and over and held.shape != shape:
        raise _UnlikeError(f"{name}: is of shape {held.shape}; allowed: {shape}, as its dimensions' coordinates")
    if 0 in held.shape:
        raise _UnlikeError(f"{name}: has no values; allowed: one value or more")


def _check_type(name: str, held: StoredVariable, spec: Variable) -> None:
    if not held.dtype or held.dtype == "str" or np.dtype(held.dtype).newbyteorder("=") != np.dtype(spec.dtype):
        value = {"": "unknown", "str": "text"}.get(held.dtype, held.dtype)
        raise _UnlikeError(f"{name}: is of type {value}; allowed: {np.dtype(spec.dtype)}")
    attributes = held.attributes
    for key in PACKING if np.dtype(spec.dtype).kind == "f" else ():
        if isinstance(number := attributes.get(key), list) and np.isfinite(number).any():
            raise _UnlikeError(f"{name}: has the {key} {_shown(number)}; allowed: numbers as they are, NaN for missing")
    if spec.flags:
        same = attributes.get("flag_values", _flag_values(spec)) == _flag_values(spec)
        if not same or _said(attributes.get("flag_meanings", " ".join(spec.flags))) != " ".join(spec.flags):
            raise _UnlikeError(f"{name}: has flags of other meanings; allowed: {', '.join(spec.flags)}")
    elif _said(attributes.get("units", spec.units)) != spec.units:
        raise _UnlikeError(f"{name}: is in {_shown(attributes['units'])}; allowed: {spec.units}")


def _shown(value: Any) -> str:
    return cut_text("".join(c if c.isprintable() else "?" for c in _said(value)[:200]))


def _flag_values(spec: Variable) -> list[int]:
    return list(range(spec.first_flag, spec.first_flag + len(spec.flags)))


def _check_variable(parts: _Parts, name: str, held: StoredVariable) -> None:
    spec = parts.specs[name]
    dims = (*parts.dims, *spec.over)
    if held.dims != dims:
        value = _shown(", ".join(dim or "?" for dim in held.dims)) or "no dimension"
        raise _UnlikeError(f"{name}: lies along {value}; allowed: {', '.join(dims)}")
    shape = tuple(parts.coordinates[dim].shape[0] for dim in dims)
    if held.shape != shape:
        raise _UnlikeError(f"{name}: is of shape {held.shape}; allowed: {shape}, as its coordinates")
    _check_type(name, held, spec)
    size = math.prod(held.shape) * np.dtype(spec.dtype).itemsize
    if not spec.deflated and size > max(SMALL, MOST_SWOLLEN * int(held.places[:, -1].sum())):
        raise _UnlikeError(f"{name}: declares {size:,} bytes, {MOST_SWOLLEN} times what it holds; allowed: a whole map")


# -- the map


class _FileArray(xr.backends.BackendArray):
    """Values of a file for `xarray`, read on their first use."""

    def __init__(self, values: StoredValues):
        self._values, self.shape, self.dtype = values, values.shape, values.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer):
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._values.read)


def _lazy(values: StoredValues) -> indexing.LazilyIndexedArray:
    return indexing.LazilyIndexedArray(_FileArray(values))


def _dataset(parts: _Parts, file: FileBytes, attributes: dict[str, str], any_flags: bool) -> xr.Dataset:
    """Return the map; its `encoding["ignored"]` names the file's variables that are no part of it."""
    coordinates = {name: _coordinate(parts, file, name, held) for name, held in parts.coordinates.items()}
    variables = {}
    for name, held in parts.variables.items():
        spec = parts.specs[name]
        ends = (spec.first_flag, spec.first_flag + len(spec.flags) - 1) if spec.flags and not any_flags else None
        values = StoredValues(file, name, held, ends)
        attrs = spec.attributes_among(parts.variables)
        variables[name] = xr.Variable(held.dims, _lazy(values), attrs, _encoding(name, held))
    ds = xr.Dataset(variables, coordinates, attributes)
    ds.encoding["ignored"] = parts.others
    ds.set_close(file.close)
    return ds


def _coordinate(parts: _Parts, file: FileBytes, name: str, held: StoredVariable) -> xr.Variable:
    """Return a checked coordinate: read at once, or one of many values read on demand and checked a part at a time."""
    raw, dims = StoredValues(file, name, held), _own_dims(parts, name)
    attributes, encoding = parts.specs[name].attributes, _encoding(name, held)
    if dims != (name,) and held.dtype != "str" and math.prod(held.shape) > MOST_WHOLE:
        for box in runs(held.shape, MOST_WHOLE):
            _check_values(parts, name, raw.read(box))
        return xr.Variable(dims, _lazy(raw), attributes, encoding)
    values = _texts(file, name, held) if parts.specs[name].dtype == "str" else raw.read_all()
    _check_values(parts, name, values)
    return xr.Variable(dims, values, attributes, encoding)


def _encoding(name: str, held: StoredVariable) -> dict[str, str]:
    """Return the hash that the file states for a variable's values; what is computed from these has another."""
    if "sha256" not in held.attributes:
        return {}
    return {"sha256": _printable(f"{name}:sha256", _said(held.attributes["sha256"])[:MOST_WORDS], "")}


def _texts(file: FileBytes, name: str, held: StoredVariable) -> np.ndarray:
    """Return a coordinate's text, however it is stored: of any length, of one length, or character by character."""
    items, shape = held.texts, held.shape
    if held.dtype != "str":
        values = np.ascontiguousarray(StoredValues(file, name, held).read_all())
        if held.dtype == "|S1" and held.dims:
            values = values.view(f"S{shape[-1]}")[..., 0]
        items, shape = [item.decode("utf-8", "replace") for item in values.ravel().tolist()], values.shape
    texts = np.empty(shape, dtype=object)
    texts.reshape(-1)[:] = items
    return texts


def _check_values(parts: _Parts, name: str, values: np.ndarray) -> None:
    """Check that a coordinate's values are allowed, and differ where they stand along a dimension."""
    values = np.atleast_1d(values)
    along = bool(parts.coordinates[name].shape) and _own_dims(parts, name) == (name,)
    if values.dtype == object:
        for text in values.tolist():
            if len(_printable(name, text, "")) > MOST_WORDS:
                raise _UnlikeError(f"{name}: holds a text of {len(text):,} characters; allowed: at most {MOST_WORDS}")
        if along and len(set(values.tolist())) != values.size:
            raise _UnlikeError(f"{name}: holds a name twice; allowed: names that all differ")
        return
    if not np.isfinite(values).all():
        raise _UnlikeError(f"{name}: holds a value that is not finite; allowed: finite numbers")
    for value in extremes(values):
        if allowed := allowed_values(parts.layout.values.get(name), value):
            raise _UnlikeError(f"{name}: holds {value!r}; allowed: {allowed}")
    spec = parts.specs[name]
    if spec.flags and not {*np.unique(values).tolist()} <= {*_flag_values(spec)}:
        raise _UnlikeError(f"{name}: holds flags without a meaning; allowed: {', '.join(spec.flags)}")
    steps = values[1:] > values[:-1], values[1:] < values[:-1]
    if along and not (steps[0].all() or steps[1].all()):
        raise _UnlikeError(f"{name}: goes up and down, or stands; allowed: values that ascend, or descend")
