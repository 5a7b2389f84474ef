"""Structure of HDF5 files, read in a child process of bounded time and memory.

The library that reads HDF5 was not made for hostile or damaged files: these crash it, or keep it busy for ever. If the
child process dies, the file is refused. The child returns names, types, shapes, attributes as bounded text, and the
addresses of values in the file; the values are then read from these addresses (see `sweeps.reading.stored_values`), and
the library never opens the file in this process.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import h5py
import numpy as np

from sweeps.reading import sandbox
from sweeps.reading.files import FileBytes
from sweeps.reading.limits import MAX_FILE_BYTES
from sweeps.schema.refusals import MapError

ALLOWED = "a netCDF-4 file that Polhode wrote"
SIGNATURE = b"\x89HDF\r\n\x1a\n"
MAX_OBJECTS = 1000  # number of objects in a file
MAX_ATTRIBUTES = 200  # number of attributes of an object
MAX_TEXT = 10_000  # characters of an attribute other than the definition
MAX_NAMES = 100_000  # items of text along one dimension
MAX_NAMES_BYTES = 2**24
MAX_CHUNK_BYTES = 2**26
DEFLATE, SHUFFLE, FLETCHER = h5py.h5z.FILTER_DEFLATE, h5py.h5z.FILTER_SHUFFLE, h5py.h5z.FILTER_FLETCHER32
KEPT: tuple[str, ...] = ("CLASS", "NAME", "_Netcdf4Dimid", "_Netcdf4Coordinates", "long_name", "units", "comment")
KEPT += ("flag_values", "flag_meanings", "sha256")  # attributes of variables that are read, and of a table's columns:
KEPT += ("_FillValue", "missing_value", "scale_factor", "add_offset")
KEPT += ("_Unsigned", "valid_min", "valid_max", "valid_range", "ancillary_variables", "standard_name")
MAX_DEFLATE_RATIO = 1040  # inflated over deflated bytes: DEFLATE codes at most 258 bytes in two bits
SUPERBLOCK_END = {0: (13, 40), 1: (13, 44), 2: (9, 28), 3: (9, 28)}  # version → places of a size's length, and the end


@dataclass(frozen=True)
class StoredVariable:
    """One variable of a file."""

    dims: tuple[str, ...]  #: names of its dimensions
    shape: tuple[int, ...]  #: their lengths
    dtype: str  #: NumPy's name of its type; "str" for text whose values are in `texts`; "" for what is no plain type
    attributes: dict[str, Any]  #: name → text, or a list of numbers
    chunk: tuple[int, ...] | None  #: shape of its chunks; None where it is in one piece
    filters: tuple[int, ...]  #: codes of the filters that its chunks went through, in that order
    #: chunks as (index of its first value …, mask of filters left out, address, bytes), or the only piece.
    places: np.ndarray
    texts: tuple[str, ...] = ()  #: its values, where they are text


@dataclass(frozen=True)
class Structure:
    """Contents of a file: attributes, and name → variable."""

    attributes: dict[str, Any]
    variables: dict[str, StoredVariable]


def read_structure(file: FileBytes) -> Structure:
    """Return the structure of a file, without the values of its numbers, as a child process reads it.

    Raises:
        MapError: if the child refuses the file, takes too long, or fails.
    """
    _check_superblock(file)
    try:
        answer = sandbox.run_in_child(partial(_structure, file), file.size)
    except sandbox.ChildError as error:
        damage = f"it is damaged: {error if str(error) else 'reading it took too long or failed'}"
        problem = error if error.is_refusal else f"cannot be read as netCDF ({damage}); allowed: {ALLOWED}"
        raise MapError(f"{file.name}: {problem}") from None
    variables = {name: _to_variable(file, name, facts) for name, facts in answer["variables"].items()}
    return Structure(answer["attributes"], variables)


def _to_variable(file: FileBytes, name: str, facts: dict) -> StoredVariable:
    """Return the variable from the child's facts about it; refuse places outside the file."""
    facts = {key: tuple(value) if isinstance(value, list) else value for key, value in facts.items()}
    try:
        facts["places"] = np.array(facts["places"], dtype=np.int64)
    except OverflowError:
        problem = f"variable {name!r} lies where no file reaches (it is damaged)"
        raise MapError(f"{file.name}: {problem}; allowed: {ALLOWED}") from None
    variable = StoredVariable(**facts)
    _check_places(file.name, name, variable, file.size)
    return variable


def _check_superblock(file: FileBytes) -> None:
    """Refuse a file that does not begin as HDF5, or is shorter than its superblock states."""
    head = file.read_at(0, min(64, file.size))
    unreadable = f"{file.name}: cannot be read as netCDF"
    if head[:3] == b"CDF":
        raise MapError(f"{unreadable}-4 (it is netCDF-3, the classic format); allowed: {ALLOWED}")
    if head[:8] != SIGNATURE or len(head) < 64 or head[8] not in SUPERBLOCK_END:
        raise MapError(f"{unreadable} (its first bytes are not those of netCDF-4); allowed: {ALLOWED}")
    width, end = SUPERBLOCK_END[head[8]]
    file_end = int.from_bytes(head[end : end + head[width]], "little")
    if head[width] != 8 or file_end > file.size:
        raise MapError(f"{unreadable} (cut short: {file.size:,} of {file_end:,} bytes); allowed: {ALLOWED}")


def _check_places(path: str, name: str, variable: StoredVariable, size: int) -> None:
    """Check that every value of a variable is there, inside the file, in chunks of the stated size."""
    where = f"{path}: {name}"
    if not variable.dtype or variable.dtype == "str":
        return
    points, width = math.prod(variable.shape), np.dtype(variable.dtype).itemsize
    shape, chunk = variable.shape, variable.shape if variable.chunk is None else variable.chunk
    chunk_bytes = math.prod(chunk) * width
    num_chunks = 1 if variable.chunk is None else math.prod(-(-n // m) for n, m in zip(shape, chunk, strict=True))
    if points and len(variable.places) != num_chunks:
        raise MapError(f"{where}: declares {points:,} values and holds fewer; allowed: a whole map")
    if not points:
        return
    address, length, mask = variable.places[:, -2], variable.places[:, -1], variable.places[:, -3]
    if (address <= 0).any() or (length <= 0).any() or (length > size).any() or (address > size - length).any():
        raise MapError(f"{where}: lies outside of the file; allowed: {ALLOWED}")
    if mask.any():
        raise MapError(f"{where}: has chunks that went past its filters; allowed: {ALLOWED}")
    is_deflated = DEFLATE in variable.filters
    extra = 4 * (FLETCHER in variable.filters)
    is_wrong_size = length > chunk_bytes + chunk_bytes // 100 + 1024 if is_deflated else length != chunk_bytes + extra
    if is_wrong_size.any() or (is_deflated and (length * MAX_DEFLATE_RATIO < chunk_bytes).any()):
        raise MapError(f"{where}: has chunks of another size than it declares; allowed: {ALLOWED}")


# -- the child


def _structure(open_file: FileBytes) -> dict:
    """Return attributes and variables of an HDF5 file as plain values."""
    with h5py.File(open_file, "r") as file:
        return {"attributes": _attributes(file, ""), "variables": _variables(file)}


def _variables(file: h5py.File) -> dict[str, dict]:
    """Return name → facts of each dataset of the root group; refuse links, groups and too many objects."""
    links = file.id.links
    if len(file.id) > MAX_OBJECTS:
        raise MapError(f"holds {len(file.id):,} objects; allowed: at most {MAX_OBJECTS:,}")
    datasets = {}
    for link in file.id:
        name = _text(link)
        if not (name.isprintable() and 0 < len(name) <= 256):
            raise MapError(f"{name[:60]!r}: is no name; allowed: printable text")
        if links.get_info(link).type != h5py.h5l.TYPE_HARD:
            raise MapError(f"{name}: is a link to somewhere else; allowed: variables inside the file")
        entry = h5py.h5o.open(file.id, link)
        if isinstance(entry, h5py.h5d.DatasetID):
            datasets[name] = h5py.Dataset(entry)
    attributes = {name: _attributes(dataset, f"{name}:") for name, dataset in datasets.items()}
    names = _dimensions(datasets, attributes)
    return {name: _variable_facts(name, datasets[name], names, attributes[name]) for name in datasets}


def _dimensions(datasets, attributes) -> dict[int, tuple[str, int]]:
    """Return number of each dimension, as netCDF counts them → its name and length."""
    dimensions: dict[int, tuple[str, int]] = {}
    for name, of_dataset in attributes.items():
        if of_dataset.get("CLASS") == "DIMENSION_SCALE" and datasets[name].shape:
            number = of_dataset.get("_Netcdf4Dimid", len(datasets) + len(dimensions))
            number = number[0] if isinstance(number, list) and number else number
            dimensions[number if isinstance(number, int) else -1] = name, datasets[name].shape[0]
    return dimensions


def _variable_facts(name: str, dataset: h5py.Dataset, dim_numbers: dict, attributes: dict) -> dict:
    """Return shape, type, dimensions, texts and places in the file of one dataset."""
    shape = dataset.shape
    if shape is None or dataset.id.rank > 32:
        raise MapError(f"{name}: has no shape; allowed: {ALLOWED}")
    dtype = _type(dataset)
    facts = {"shape": shape, "dtype": dtype, "attributes": attributes, "texts": [], "places": []}
    facts |= {"dims": _dims(dataset, dim_numbers, attributes), "chunk": None, "filters": []}
    if str(attributes.get("NAME", "")).startswith("This is a netCDF dimension but not a netCDF variable"):
        return facts | {"dtype": ""}
    if dtype:
        layout = (properties := dataset.id.get_create_plist()).get_layout()
        if layout == h5py.h5d.VIRTUAL or (layout == h5py.h5d.CONTIGUOUS and properties.get_external_count()):
            raise MapError(f"{name}: lies in other files; allowed: values inside the file")
    if dtype == "str":
        return facts | {"texts": _texts(name, dataset)}
    return facts | (_places(name, dataset) if dtype else {})


def _type(dataset: h5py.Dataset) -> str:
    """Return NumPy's name of a plain type, "str" for text of any length, "" for further types."""
    kind = dataset.id.get_type()
    if isinstance(kind, h5py.h5t.TypeStringID):
        return "str" if kind.is_variable_str() else f"|S{kind.get_size()}"
    if not isinstance(kind, h5py.h5t.TypeIntegerID | h5py.h5t.TypeFloatID):
        return ""
    dtype = kind.dtype
    return dtype.str if kind.get_size() == dtype.itemsize <= 8 and kind.get_offset() == 0 else ""


def _dims(dataset: h5py.Dataset, dim_numbers: dict, attributes: dict) -> list[str]:
    """Return names of a dataset's dimensions; "" for a dimension without a name."""
    name = _text(dataset.name.encode("utf-8", "replace")).rpartition("/")[2]
    numbers = attributes.get("_Netcdf4Coordinates")
    if isinstance(numbers, list) and len(numbers) == len(dataset.shape):
        return [dim_numbers.get(number, ("", 0))[0] for number in numbers]
    if attributes.get("CLASS") == "DIMENSION_SCALE" and len(dataset.shape) == 1:
        return [name]
    names = [""] * len(dataset.shape)
    for k in range(len(names)):  # the only dimension that is attached to each, as libraries but netCDF's do
        if h5py.h5ds.get_num_scales(dataset.id, k) == 1:
            scale = h5py.h5ds.iterate(dataset.id, k, lambda scale: h5py.h5i.get_name(scale))
            names[k] = _text(scale).rpartition("/")[2]
    return names


def _texts(name: str, dataset: h5py.Dataset) -> list[str]:
    """Return the texts of a dataset; refuse too many or too long ones."""
    size = math.prod(dataset.shape)
    if size > MAX_NAMES:
        raise MapError(f"{name}: declares {size:,} texts; allowed: at most {MAX_NAMES:,}")
    values = [_text(value) for value in np.asarray(dataset[()], dtype=object).reshape(-1).tolist()]
    if sum(map(len, values)) > MAX_NAMES_BYTES:
        raise MapError(f"{name}: holds too much text; allowed: at most {MAX_NAMES_BYTES:,} characters")
    return values


def _places(name: str, dataset: h5py.Dataset) -> dict:
    """Return the pieces (first index, address, bytes) of a dataset in the file, with its chunks and filters."""
    properties = dataset.id.get_create_plist()
    layout = properties.get_layout()
    if layout == h5py.h5d.CONTIGUOUS:
        address, size = dataset.id.get_offset(), dataset.id.get_storage_size()
        return {"places": [[0, address, size]] if address is not None else []}
    if layout != h5py.h5d.CHUNKED:
        raise MapError(f"{name}: is stored in an unknown way; allowed: {ALLOWED}")
    filters = [properties.get_filter(k)[0] for k in range(properties.get_nfilters())]
    if len(set(filters)) < len(filters) or not {DEFLATE, SHUFFLE, FLETCHER}.issuperset(filters):
        raise MapError(f"{name}: is stored by filters {filters}; allowed: shuffle, deflate, fletcher32, once each")
    chunk = properties.get_chunk()
    if math.prod(chunk) * dataset.dtype.itemsize > MAX_CHUNK_BYTES:
        raise MapError(f"{name}: has chunks of {math.prod(chunk):,} values; allowed: {MAX_CHUNK_BYTES:,} bytes")
    places = []
    dataset.id.chunk_iter(lambda c: places.append([*c.chunk_offset, c.filter_mask, c.byte_offset, c.size]))
    return {"places": places, "chunk": chunk, "filters": filters}


# -- attributes, as text and numbers of bounded length


def _attributes(holder: Any, where: str) -> dict[str, Any]:
    """Return name → value of the attributes of a file or a dataset that readers need."""
    number = h5py.h5a.get_num_attrs(holder.id)
    if number > MAX_ATTRIBUTES:
        raise MapError(f"{where}: has {number:,} attributes; allowed: at most {MAX_ATTRIBUTES}")
    values = {}
    for k in range(number):
        attribute = h5py.h5a.open(holder.id, index=k)
        name = _text(attribute.name)
        if where and name not in KEPT:
            continue
        values[name] = _attribute(attribute, where + name)
    return values


def _attribute(attribute: h5py.h5a.AttrID, where: str) -> Any:
    """Return an attribute's text; numbers as a list; "" for further types."""
    size = attribute.get_storage_size()
    if size > MAX_FILE_BYTES:
        raise MapError(f"{where}: takes {size:,} bytes; allowed: at most {MAX_FILE_BYTES:,}")
    kind = attribute.get_type()
    shape, dtype = attribute.shape, getattr(kind, "dtype", None)
    if isinstance(kind, h5py.h5t.TypeStringID):
        values = np.empty(shape, dtype=dtype)
        attribute.read(values)
        return " ".join(_text(value) for value in values.reshape(-1).tolist())
    if not isinstance(kind, h5py.h5t.TypeIntegerID | h5py.h5t.TypeFloatID) or math.prod(shape) > MAX_TEXT:
        return ""
    values = np.empty(shape, dtype=dtype)
    attribute.read(values)
    return values.reshape(-1).tolist()


def _text(value: Any) -> str:
    """Return bytes or text as text, without what follows a zero byte."""
    if isinstance(value, str):
        value = value.encode("utf-8", "surrogateescape")
    return value.decode("utf-8", "replace").partition("\0")[0] if isinstance(value, bytes) else str(value)
