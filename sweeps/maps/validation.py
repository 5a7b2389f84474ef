"""Validation of map files against the layout of their system's maps; a map that is returned may be trusted."""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.core import indexing

from sweeps import systems
from sweeps.reading.definitions import definition_of
from sweeps.reading.files import FileBytes
from sweeps.reading.hdf5 import ALLOWED, MAX_TEXT, StoredVariable, read_structure
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
# attributes that are compared or drawn, and therefore never cut
UNCUT = ("definition", "inputs", "input_notes", "outlines")
DESCRIPTIONS = ("long_name", "units", "comment")  # attributes that describe variables of a described system
MAX_LETTERS = 200  # length of a description or a name, so that messages and labels stay readable
MAX_INFLATION = 100  # size in memory over size in the file, up to which a variable that is not deflated is read
MAX_WHOLE_SIZE = 2**20  # values; larger coordinates that are no dimension's own are read on demand
PACKING = ("scale_factor", "add_offset", "_FillValue", "missing_value")  # attributes by which netCDF changes numbers
MIN_LIMITED_SIZE = 2**26  # bytes; MAX_INFLATION applies to larger variables; smaller variables fit into any memory


class _NotMapError(Exception):
    """The file is not a Polhode map; the message is the reason, without the file's name."""


def map_of(path: str | Path) -> Path:
    """Return the path of a map: the given path, or the map in the folder results/<sweep>."""
    if not isinstance(path, str | os.PathLike):
        raise MapError(f"path: {display(path)} is no path; allowed: {ALLOWED}")
    path = Path(path)
    if not path.is_dir():
        return path
    if not (path / MAP).exists():
        raise MapError(f"{path}: this folder holds no {MAP}; allowed: a map, or the folder results/<sweep> of one")
    return path / MAP


def open_file(path: str | Path, any_flags: bool = False) -> xr.Dataset:
    """Return the content of a file that is a map, complete or not; numbers are read on their first use.

    With `any_flags`, flags without a meaning are read as they are; else reading them raises a MapError.
    """
    try:
        file = FileBytes(path)
    except (OSError, ValueError) as error:
        exists = isinstance(error, PermissionError)
        problem = f"cannot be opened ({error.strerror})" if exists else "there is no such file"
        raise MapError(f"{path}: {problem}; allowed: {ALLOWED}") from None
    structure = read_structure(file)
    try:
        attributes = _global_attributes(structure.attributes)
        contents = _Contents(_file_layout(attributes, structure.variables), structure.variables)
        _check_contents(contents)
        return _make_dataset(contents, file, attributes, any_flags)
    except _NotMapError as unlike:
        raise MapError(f"{path}: {unlike}") from None


def require_variables(path: str | Path, ds: xr.Dataset) -> xr.Dataset:
    """Return a map; close it and raise if it lacks a variable that its definition chose or its system requires."""
    missing = sorted((_chosen_variables(ds.attrs) or set(systems.of_map(ds).layout().needed)) - set(ds.variables))
    if missing:
        ds.close()
        problem = f"{_cut(missing[0])}: is missing ({len(missing)} in all)"
        raise MapError(f"{path}: {problem}; allowed: every variable of a map")
    return ds


def _chosen_variables(attributes: Mapping[str, Any]) -> set[str]:
    """Return the variables that a map's own definition chose; an empty set if it chose none."""
    text = str(attributes.get("definition", ""))
    if "variables" not in text and "\\" not in text:  # "\" could begin an escape that spells the word
        return set()
    integration = definition_of(attributes).get("integration")
    names = integration.get("variables") if isinstance(integration, dict) else None
    return set(map(str, names)) if isinstance(names, tuple) else set()


# -- attributes


def _as_text(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def _global_attributes(attributes: Mapping[str, Any]) -> dict[str, str]:
    """Return the global attributes as text of bounded length; raise if the contract's version is unknown."""
    texts = {}
    for name, value in attributes.items():
        allowed = "\n\t" if name != "definition" else None
        text = _check_text(name, name, "") and _check_text(name, _as_text(value), allowed)
        if not name.startswith("_"):  # the netCDF library's own
            texts[name] = cut_text(text, MAX_FILE_BYTES if name in UNCUT else MAX_TEXT)
    version = texts.get("contract_version", "")
    if not is_readable(version):
        version_text = _cut(version) or "missing"
        raise _NotMapError(
            f"contract_version: is {version_text}; allowed: {CONTRACT_VERSION}, the version of Polhode's maps"
        )
    return texts


def _check_text(where: str, text: str, extra: str | None) -> str:
    """Return a text if its characters are printable or in `extra` (None: any character is allowed); else raise."""
    if extra is not None and not all(c.isprintable() or c in extra for c in text):
        where = "".join(c if c.isprintable() else "?" for c in where[:60])
        raise _NotMapError(f"{where}: holds control characters; allowed: printable text")
    return text


def _file_layout(attributes: Mapping[str, str], variables: Mapping[str, StoredVariable]) -> Layout:
    """Return the description of the maps of a file's system, from its attributes and its variables' names."""
    try:
        layout = systems.of_contents(attributes, variables).layout()
    except KeyError:
        name = cut_text(repr(attributes["system"]))
        raise _NotMapError(f"system: {name} is not available; allowed: {', '.join(systems.system_names())}") from None
    has_names = POINT_NAME.name in variables and variables[POINT_NAME.name].dims[:1] == (POINT.name,)
    coordinates = (POINT, POINT_NAME) if has_names else (POINT,)
    return replace(layout, coordinates={coordinate.name: coordinate for coordinate in coordinates} | layout.coordinates)


# -- variables and coordinates


class _Contents:
    """The variables of a file, divided into coordinates, variables, and variables that are not read."""

    def __init__(self, layout: Layout, file_variables: Mapping[str, StoredVariable]):
        self.layout = layout  #: the layout of the system's maps
        #: name → coordinate, in the layout's order
        self.coordinates = {name: file_variables[name] for name in layout.coordinates if name in file_variables}
        #: name → variable, in the layout's order
        self.variables = {name: file_variables[name] for name in layout.variables if name in file_variables}
        self.specs = {**layout.coordinates, **layout.variables}  #: name → description of each coordinate and variable
        if layout.is_open:
            self._take_own(file_variables)
        map_names = {*self.coordinates, *self.variables}
        texts = [variable for variable in self.coordinates.values() if variable.dtype == "|S1" and variable.dims]
        character_dims = {variable.dims[-1] for variable in texts}
        other_names = (name for name in file_variables if name not in map_names)
        #: names of variables that are not part of a map, and are not read
        self.ignored_names = tuple(n for n in other_names if file_variables[n].dtype or n not in character_dims)
        table_variables = {name: variable for name, variable in self.variables.items() if name in layout.variables}
        layout_dims = ((variable.dims, self.specs[name].over) for name, variable in table_variables.items())
        points = (dims[: len(dims) - len(over)] for dims, over in layout_dims)
        self.dims = max(points, key=len, default=())  #: the dimensions of the map's points, in storage order
        #: further dimensions that variables have at each point
        self.extra_dims = tuple(dict.fromkeys(dim for name in self.variables for dim in self.specs[name].over))

    def _take_own(self, file_variables: Mapping[str, StoredVariable]) -> None:
        """Take the parameters and places that only the description of the system has: they are doubles."""
        doubles = {}
        for name, variable in file_variables.items():
            if name in self.specs or variable.dtype not in ("<f8", ">f8"):
                continue
            words = {key: _as_text(variable.attributes.get(key, "")) for key in DESCRIPTIONS}
            words = {key: _check_text(f"{name}:{key}", text, "")[:MAX_LETTERS] for key, text in words.items()}
            units, meaning = words["units"] or "1", words["long_name"] or name
            self.specs[name] = Variable(name, units, meaning, comment=words["comment"])
            if variable.dims in ((), (name,), (POINT.name,)):
                doubles[name] = variable
            else:
                self.variables[name] = variable
        self.coordinates = doubles | self.coordinates


def _check_contents(contents: _Contents) -> None:
    """Refuse contents whose coordinates, dimensions or variables are not those of the system's maps."""
    if not contents.variables:
        raise _NotMapError("(variables): none; allowed: every variable of a map")
    for name, variable in contents.coordinates.items():
        _check_coordinate(contents, name, variable)
    _check_dimensions(contents)
    for name, variable in contents.variables.items():
        _check_variable(contents, name, variable)


def _check_dimensions(contents: _Contents) -> None:
    """Refuse dimensions in another order, without a coordinate, or unknown to the system."""
    dims = contents.dims
    order = [dim for dim in contents.layout.coordinates if dim in dims]
    if [dim for dim in dims if dim in order] != order or len(set(dims)) != len(dims):
        raise _NotMapError(f"dimensions: are ({', '.join(dims)}); allowed: each once, {', '.join(order)} in this order")
    for dim in (*dims, *contents.extra_dims):
        if dim not in contents.coordinates or _own_dims(contents, dim) != (dim,):
            value = cut_text(repr(dim)) if dim else "(one without a name)"
            value += " has no coordinate" + (" of type float64" if contents.layout.is_open else "")
            raise _NotMapError(f"dimensions: {value}; allowed: those of this system's maps")
    for name in contents.coordinates:
        coordinate_dims = _own_dims(contents, name)
        if not set(coordinate_dims) <= {*dims, *contents.extra_dims, contents.layout.along} - ({POINT.name} - {*dims}):
            raise _NotMapError(f"{name}: lies along {', '.join(coordinate_dims)}; allowed: a dimension of the map")
    if missing := sorted(contents.layout.required(contents.coordinates) - {*contents.coordinates}):
        raise _NotMapError(f"{missing[0]}: is missing; allowed: every coordinate of a map")


def _own_dims(contents: _Contents, name: str) -> tuple[str, ...]:
    """Return dimensions of a coordinate, without that of its characters."""
    variable = contents.coordinates[name]
    return variable.dims[:-1] if variable.dtype == "|S1" and variable.dims else variable.dims


def _check_coordinate(contents: _Contents, name: str, variable: StoredVariable) -> None:
    """Refuse a coordinate of the wrong dimensions, type or shape."""
    spec, dims = contents.specs[name], _own_dims(contents, name)
    over = tuple(dim for dim in contents.layout.over.get(name, ()) if dim in dims)
    if dims not in ((), (name,), (contents.layout.along,), (POINT.name,), over):
        value = _cut(" × ".join(dim or "?" for dim in dims))
        raise _NotMapError(f"{name}: lies along {value}; allowed: its own dimension alone")
    if spec.dtype == "str":
        if variable.dtype != "str" and not variable.dtype.startswith("|S"):
            raise _NotMapError(f"{name}: is of type {variable.dtype or 'unknown'}; allowed: text")
    else:
        _check_type(name, variable, spec)
    shape = tuple(n for dim in over if dim in contents.coordinates for n in contents.coordinates[dim].shape)
    if dims == over and over and variable.shape != shape:
        raise _NotMapError(f"{name}: is of shape {variable.shape}; allowed: {shape}, as its dimensions' coordinates")
    if 0 in variable.shape:
        raise _NotMapError(f"{name}: has no values; allowed: one value or more")


def _check_type(name: str, variable: StoredVariable, spec: Variable) -> None:
    """Refuse a variable of another type, packed numbers, and flags of other meanings."""
    if (
        not variable.dtype
        or variable.dtype == "str"
        or np.dtype(variable.dtype).newbyteorder("=") != np.dtype(spec.dtype)
    ):
        value = {"": "unknown", "str": "text"}.get(variable.dtype, variable.dtype)
        raise _NotMapError(f"{name}: is of type {value}; allowed: {np.dtype(spec.dtype)}")
    attributes = variable.attributes
    for key in PACKING if np.dtype(spec.dtype).kind == "f" else ():
        if isinstance(number := attributes.get(key), list) and np.isfinite(number).any():
            raise _NotMapError(f"{name}: has the {key} {_cut(number)}; allowed: numbers as they are, NaN for missing")
    if spec.flags:
        same_values = attributes.get("flag_values", _flag_values(spec)) == _flag_values(spec)
        if not same_values or _as_text(attributes.get("flag_meanings", " ".join(spec.flags))) != " ".join(spec.flags):
            raise _NotMapError(f"{name}: has flags of other meanings; allowed: {', '.join(spec.flags)}")
    elif _as_text(attributes.get("units", spec.units)) != spec.units:
        raise _NotMapError(f"{name}: is in {_cut(attributes['units'])}; allowed: {spec.units}")


def _cut(value: Any) -> str:
    return cut_text("".join(c if c.isprintable() else "?" for c in _as_text(value)[:200]))


def _flag_values(spec: Variable) -> list[int]:
    return list(range(spec.first_flag, spec.first_flag + len(spec.flags)))


def _check_variable(contents: _Contents, name: str, variable: StoredVariable) -> None:
    """Refuse a variable of the wrong dimensions, shape or type, or inflated beyond its stored bytes."""
    spec = contents.specs[name]
    dims = (*contents.dims, *spec.over)
    if variable.dims != dims:
        value = _cut(", ".join(dim or "?" for dim in variable.dims)) or "no dimension"
        raise _NotMapError(f"{name}: lies along {value}; allowed: {', '.join(dims)}")
    shape = tuple(contents.coordinates[dim].shape[0] for dim in dims)
    if variable.shape != shape:
        raise _NotMapError(f"{name}: is of shape {variable.shape}; allowed: {shape}, as its coordinates")
    _check_type(name, variable, spec)
    size = math.prod(variable.shape) * np.dtype(spec.dtype).itemsize
    if not spec.deflated and size > max(MIN_LIMITED_SIZE, MAX_INFLATION * int(variable.places[:, -1].sum())):
        raise _NotMapError(
            f"{name}: declares {size:,} bytes, {MAX_INFLATION} times what it holds; allowed: a whole map"
        )


# -- the map


class _FileArray(xr.backends.BackendArray):
    """Values of a file for `xarray`, read on their first use."""

    def __init__(self, values: StoredValues):
        self._values, self.shape, self.dtype = values, values.shape, values.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer):
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._values.read)


def _lazy_array(values: StoredValues) -> indexing.LazilyIndexedArray:
    return indexing.LazilyIndexedArray(_FileArray(values))


def _make_dataset(contents: _Contents, file: FileBytes, attributes: dict[str, str], any_flags: bool) -> xr.Dataset:
    """Return the map; its `encoding["ignored"]` names the file's variables that are no part of it."""
    in_file = contents.coordinates.items()
    coordinates = {name: _make_coordinate(contents, file, name, variable) for name, variable in in_file}
    variables = {}
    for name, variable in contents.variables.items():
        spec = contents.specs[name]
        ends = (spec.first_flag, spec.first_flag + len(spec.flags) - 1) if spec.flags and not any_flags else None
        values = StoredValues(file, name, variable, ends)
        attrs = spec.attributes_among(contents.variables)
        variables[name] = xr.Variable(variable.dims, _lazy_array(values), attrs, _stored_hash(name, variable))
    ds = xr.Dataset(variables, coordinates, attributes)
    ds.encoding["ignored"] = contents.ignored_names
    ds.set_close(file.close)
    return ds


def _make_coordinate(contents: _Contents, file: FileBytes, name: str, variable: StoredVariable) -> xr.Variable:
    """Return a checked coordinate: read at once, or (if it has many values) checked in blocks and read on demand."""
    raw, dims = StoredValues(file, name, variable), _own_dims(contents, name)
    attributes, encoding = contents.specs[name].attributes, _stored_hash(name, variable)
    if dims != (name,) and variable.dtype != "str" and math.prod(variable.shape) > MAX_WHOLE_SIZE:
        for box in runs(variable.shape, MAX_WHOLE_SIZE):
            _check_values(contents, name, raw.read(box))
        return xr.Variable(dims, _lazy_array(raw), attributes, encoding)
    values = _read_texts(file, name, variable) if contents.specs[name].dtype == "str" else raw.read_all()
    _check_values(contents, name, values)
    return xr.Variable(dims, values, attributes, encoding)


def _stored_hash(name: str, variable: StoredVariable) -> dict[str, str]:
    """Return the encoding of a variable: the hash that the file states for its values."""
    if "sha256" not in variable.attributes:
        return {}
    return {"sha256": _check_text(f"{name}:sha256", _as_text(variable.attributes["sha256"])[:MAX_LETTERS], "")}


def _read_texts(file: FileBytes, name: str, variable: StoredVariable) -> np.ndarray:
    """Return a coordinate's text, however it is stored: of any length, of one length, or character by character."""
    items: Sequence[str] = variable.texts
    shape = variable.shape
    if variable.dtype != "str":
        values = np.ascontiguousarray(StoredValues(file, name, variable).read_all())
        if variable.dtype == "|S1" and variable.dims:
            values = values.view(f"S{shape[-1]}")[..., 0]
        items, shape = [item.decode("utf-8", "replace") for item in values.ravel().tolist()], values.shape
    texts = np.empty(shape, dtype=object)
    texts.reshape(-1)[:] = items
    return texts


def _check_values(contents: _Contents, name: str, values: np.ndarray) -> None:
    """Check that a coordinate's values are allowed, and that the values of a dimension differ."""
    values = np.atleast_1d(values)
    is_dimension = bool(contents.coordinates[name].shape) and _own_dims(contents, name) == (name,)
    if values.dtype == object:
        for text in values.tolist():
            if len(_check_text(name, text, "")) > MAX_LETTERS:
                raise _NotMapError(f"{name}: holds a text of {len(text):,} characters; allowed: at most {MAX_LETTERS}")
        if is_dimension and len(set(values.tolist())) != values.size:
            raise _NotMapError(f"{name}: holds a name twice; allowed: names that all differ")
        return
    if not np.isfinite(values).all():
        raise _NotMapError(f"{name}: holds a value that is not finite; allowed: finite numbers")
    for value in extremes(values):
        if allowed := allowed_values(contents.layout.values.get(name), value):
            raise _NotMapError(f"{name}: holds {value!r}; allowed: {allowed}")
    spec = contents.specs[name]
    if spec.flags and not {*np.unique(values).tolist()} <= {*_flag_values(spec)}:
        raise _NotMapError(f"{name}: holds flags without a meaning; allowed: {', '.join(spec.flags)}")
    steps = values[1:] > values[:-1], values[1:] < values[:-1]
    if is_dimension and not (steps[0].all() or steps[1].all()):
        raise _NotMapError(f"{name}: goes up and down, or stands; allowed: values that ascend, or descend")
