"""Strange files: a table of damages, done to a small map of each system, and every command over such a file."""

import contextlib
import hashlib
import io
import json
import multiprocessing
import os
import random
import resource
import shutil
import sys
import traceback
import warnings
from functools import cache, partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from maps import BODIES, DEFINITION, TOP

OSCILLATOR = {"system": "pendulum", "grid": {"length": [0.5, 1.0, 2.0], "gravity": [1.0, 9.8]}}
FOUCAULT = {"system": "foucault", "grid": {"length": [0.5, 2.0], "drag": [0.0, 0.1], "spin_rate": [0.5, 1.0, 3.0]}}
THROWN = {"system": "twist", "grid": {"I1": [0.1, 0.5], "I2": 1.0, "I3": [1.2, 1.5], "chi": [1e-3, 0.1, 0.5]}}
TUMBLING = {
    "system": "tumbling",
    "bodies": [{"name": "A", "ratios": {"I1": 0.36, "I2": 0.96, "I3": 1.0}, "omega0": 2.6e-5}],
    "grid": {"energy": [1.01, 1.02, 1.5, 2.0]},
}
UNCERTAIN = {
    "bodies": [
        {"name": "A", "I1": 1.0, "I2": 1.9, "I3": 2.0, "uncertainty": "5 %"},
        {"name": "B", "I1": 1, "I2": 2, "I3": 3},
    ],
    "uncertainty": {"moments": [0.1, 0.2, 0.1], "epsilon": 0.1},
    "draws": 64,
    "keep": True,
    "grid": {"omega0": [0.1, 1.0]},
}
SAMPLED = {
    "sample": {"method": "sobol", "num": 16, "seed": 1},
    "grid": {"I1": {"start": 0.5, "stop": 1.5}, "I2": {"start": 0.5, "stop": 1.5}, "I3": 1.0, "omega0": 1.0},
}
RATE_COLUMNS = ["omega_squared_theory", "omega_squared", "growth_rate", "regime", "status", "energy_drift"]
PICTURE_COLUMNS = [*RATE_COLUMNS, "omega_squared_stderr", "omega_squared_error", "triangle_margin", "propagation_error"]
BASES = {
    "rigid": DEFINITION | {"axes": [2], "integration": {"variables": PICTURE_COLUMNS}},
    "bodies": BODIES | {"axes": [2]},
    "top": TOP,
    "pendulum": OSCILLATOR,
    "foucault": FOUCAULT,
    "twist": THROWN,
    "tumbling": TUMBLING,
    "uncertain": UNCERTAIN,
    "attitude": DEFINITION | {"axes": [2], "integration": {"attitude": True}},
    "sampled": SAMPLED,
    "double": {"system": "double_pendulum", "grid": {"mass2": [0.5, 1.0, 2.0], "length2": [0.5, 1.0]}},
}
QUICK = ("rigid", "bodies", "top", "pendulum")
NASTY = "\x1b[31mred\x1b[0m"
TEXTS = {
    "control": NASTY,
    "bell": "a\x07b",
    "bidi": "safe\u202egnp.exe",
    "markup": "[bold red]x[/bold red] [/] [link=http://x]y[/link]",
    "script": "</script><script>owned=1</script><img src=x onerror=owned=1>",
    "mathtext": r"$\frac{$ and $x^{$",
    "template": "{{ 7*7 }} {% for %} %s {0}",
    "long": "x" * 900_000,
    "longer": "y" * 3_000_000,
    "lines": "a\n" * 5000,
    "empty": "",
    "nul": "a\0b",
    "wide": "\U0001f3be" * 50,
}
ODD = {
    **TEXTS,
    "number": 7.5,
    "nan": np.nan,
    "zero": 0.0,
    "whole": np.int64(3),
    "array": np.arange(5.0),
    "large": np.zeros(200_000),
    "bytes": np.bytes_(b"\xff\xfe\x80"),
    "compound": np.array([(1, 2.0)], dtype=[("a", "i4"), ("b", "f8")]),
    "opaque": np.void(b"\x00\x01\x02"),
    "bool": np.True_,
    "complex": np.complex128(1 + 2j),
    "null": h5py.Empty("f8"),
    "texts": np.array(["a", "b"], dtype=h5py.string_dtype()),
}
GLOBAL = ("title", "source", "history", "system", "definition", "contract_version", "content_hash", "inputs", "own")
LOCAL = (
    *("scale_factor", "add_offset", "_FillValue", "missing_value", "valid_range", "coordinates", "bounds", "units"),
    *("long_name", "flag_values", "flag_meanings", "_Encoding", "calendar", "sha256", "CLASS", "NAME", "own"),
    *("_Netcdf4Coordinates", "_Netcdf4Dimid", "_Unsigned", "dtype", "_ChunkSizes", "comment"),
)
PATIENCE = 10.0  # s of processor time that a command may take
MAX_EXTRA_BYTES = 2**30  # bytes that a command may add to the memory of the process
COMMANDS = ("show", "show --json", "point", "point --trajectory", "slice", "figures", "report", "verify")
SLOW = ("figures", "report")  # seconds each, of a map that is let in
LOCAL_WORDS = ("control", "script", "number", "array", "compound", "long", "zero", "bytes")


def set_attribute(path, holder, name, value):
    """Set an attribute of the file ("") or of a variable to any value."""
    with h5py.File(path, "r+", track_order=True) as file:
        attributes = (file if holder == "" else file[holder]).attrs
        if name in attributes:
            del attributes[name]
        attributes.create(name, value)


def in_file(change):
    """A damage that changes an open file."""

    def damage(path):
        with h5py.File(path, "r+") as file:
            change(file)

    return damage


def replace_variable(path, name, make):
    """Replace a variable by the result of `make(file, name, old values)`, with the old attributes."""
    with h5py.File(path, "r+") as file:
        old = file[name]
        values, attributes = old[()], {k: v for k, v in old.attrs.items() if not k.endswith("_LIST")}
        shape = old.shape
        del file[name]
        variable = make(file, name, values)
        if isinstance(variable, h5py.Dataset):
            for key, value in attributes.items():
                if key != "_FillValue":
                    variable.attrs[key] = value
            if (key := attributes.get("_Netcdf4Coordinates")) is not None:
                assert len(shape) == np.size(key)


def of(function):
    """A damage that changes a variable's values."""
    return lambda file, name, old: file.create_dataset(name, data=function(np.asarray(old)))


def as_type(dtype):
    return lambda file, name, old: file.create_dataset(name, data=np.zeros(np.shape(old), dtype=dtype))


def declare(shape, chunks, dtype="f8", **options):
    """Return a function that makes a variable of a large shape without data."""
    return lambda file, name, old: file.create_dataset(name, shape, dtype, chunks=chunks, **options)


def bomb(file, name, old):
    """Make chunks that inflate to a thousand times their size."""
    import zlib

    shape = np.shape(old) or (1,)
    variable = file.create_dataset(name, shape, "f8", chunks=shape, compression="gzip")
    variable.id.write_direct_chunk((0,) * len(shape), zlib.compress(bytes(2**26), 9))
    return variable


def zeros_chunk(file, name, old):
    """A large chunk of zeros, deflated well."""
    shape = (2**27, *(1 for _ in np.shape(old)[1:]))
    return file.create_dataset(name, shape, "f8", chunks=shape, compression="gzip")


def with_filter(**options):
    return lambda file, name, old: file.create_dataset(name, data=old, chunks=np.shape(old) or None, **options)


def noise(file, name, old):
    shape = np.shape(old)
    variable = file.create_dataset(name, shape, np.asarray(old).dtype, chunks=shape, compression="gzip")
    variable.id.write_direct_chunk((0,) * len(shape), b"\x78\x01 no deflated bytes")
    return variable


def unknown_filter(file, name, old):
    shape = np.shape(old)
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_chunk(shape)
    properties.set_filter(32001, h5py.h5z.FLAG_OPTIONAL, (1, 2))
    space, kind = h5py.h5s.create_simple(shape), h5py.h5t.py_create(np.asarray(old).dtype)
    variable = h5py.Dataset(h5py.h5d.create(file.id, name.encode(), kind, space, properties))
    variable.id.write_direct_chunk((0,) * len(shape), bytes(old.nbytes))
    return variable


def link(target):
    return lambda file, name, old: file.__setitem__(name, target)


REPLACED = {
    "nan": of(lambda v: np.full(v.shape, np.nan)),
    "infinite": of(lambda v: np.full(v.shape, np.inf)),
    "negative": of(lambda v: -np.abs(v.astype("f8")) - 1 if v.dtype.kind in "fiu" else np.zeros(v.shape)),
    "zeros": of(lambda v: np.zeros(v.shape, v.dtype if v.dtype.kind in "fiu" else "f8")),
    "flags": of(lambda v: np.full(v.shape, 77, v.dtype if v.dtype.kind in "iu" else "i1")),
    "huge numbers": of(lambda v: np.full(v.shape, 1.7e308)),
    "tiny numbers": of(lambda v: np.full(v.shape, 5e-324)),
    "reversed": of(lambda v: np.ascontiguousarray(v[::-1]) if v.dtype.kind in "fiu" else np.zeros(v.shape)),
    "shuffled": of(lambda v: np.roll(v, 1, axis=0) if v.dtype.kind in "fiu" else np.zeros(v.shape)),
    "cut": of(lambda v: v[: len(v) - 1] if v.dtype.kind in "fiu" else np.zeros(len(v) - 1)),
    "longer": of(lambda v: np.zeros((len(v) + 1, *v.shape[1:]))),
    "empty": of(lambda v: np.zeros((0, *v.shape[1:]))),
    "scalar": of(lambda v: np.float64(1.0)),
    "another rank": of(lambda v: np.zeros((*v.shape, 2))),
    "transposed": of(lambda v: np.zeros(v.shape[::-1])),
    **{f"as {t}": as_type(t) for t in ("f4", "f2", ">f8", "i8", "u1", "S1", "S7", "?", "c16", "V5", "f8,i4")},
    "as text": lambda f, n, v: f.create_dataset(n, data=np.full(np.shape(v), NASTY, object), dtype=h5py.string_dtype()),
    "as enum": lambda f, n, v: f.create_dataset(n, np.shape(v), h5py.enum_dtype({"a": 1, "b": 2})),
    "as lists": lambda f, n, v: f.create_dataset(n, np.shape(v), h5py.vlen_dtype("f8")),
    "as references": lambda f, n, v: f.create_dataset(n, np.shape(v), h5py.ref_dtype),
    "2^40 long": declare((2**40,), (2**16,)),
    "2^40 in one chunk": declare((2**40,), (2**28,)),
    "2^60 long": declare((2**60,), (2**16,)),
    "2^20 by 2^20": declare((2**20, 2**20), (1, 2**16), "i1", compression="gzip"),
    "unlimited": lambda f, n, v: f.create_dataset(n, (10**11,), "f8", maxshape=(None,), chunks=(2**16,)),
    "1e10 texts": declare((10**10,), (2**16,), h5py.string_dtype()),
    "1e10 characters": declare((10**10,), (2**16,), "S1"),
    "long texts": declare((10,), (10,), "S100000000"),
    "never written": lambda f, n, v: f.create_dataset(n, np.shape(v), "f8"),
    "bomb": bomb,
    "swollen": zeros_chunk,
    "noise": noise,
    "fletcher": with_filter(fletcher32=True),
    "lzf": with_filter(compression="lzf"),
    "scale offset": lambda f, n, v: f.create_dataset(n, np.shape(v), "i4", chunks=np.shape(v), scaleoffset=0),
    "unknown filter": unknown_filter,
    "soft link": link(h5py.SoftLink("/status")),
    "dangling link": link(h5py.SoftLink("/nowhere")),
    "loop": lambda f, n, v: f.__setitem__(n, h5py.SoftLink(f"/{n}")),
    "group": lambda f, n, v: f.create_group(n),
    "null space": lambda f, n, v: f.create_dataset(n, data=h5py.Empty("f8")),
}


def bytes_of(function):
    def damage(path):
        path.write_bytes(function(path.read_bytes()))

    return damage


def noisy(content, seed):
    rng = random.Random(seed)
    content = bytearray(content)
    for _ in range(rng.choice([1, 1, 2, 8, 64])):
        at, size = rng.randrange(len(content)), rng.choice([1, 1, 2, 4, 8])
        content[at : at + size] = rng.choice([bytes(size), b"\xff" * size, rng.randbytes(size)])[: len(content) - at]
    return bytes(content)


def heaps(content, value):
    """Damage each collection of texts and lists by false sizes of items, which the library trusts."""
    content, at = bytearray(content), 0
    while (at := content.find(b"GCOL", at)) >= 0:
        content[at + 16 : at + 40] = value * 24
        at += 4
    return bytes(content)


def overwrite(content, place, value):
    return content[:place] + value + content[place + len(value) :]


def classic(path, form):
    import netCDF4

    path.unlink()
    with netCDF4.Dataset(path, "w", format=form) as file:
        file.createDimension("x", 3)
        file.createVariable("x", "f8", ("x",))[:] = 1.0
        file.contract_version = "3.0"


def plain_hdf(path):
    with h5py.File(path, "w") as file:
        file["status"] = np.zeros(3)
        file.attrs["contract_version"] = "3.0"


def table(base):
    """Name → damage, a function of the file's path, for the map of one system."""
    with h5py.File(base) as file:
        names = list(file)
        coordinate = next(
            name for name in names if file[name].ndim == 1 and file[name].attrs.get("CLASS") == b"DIMENSION_SCALE"
        )
        coordinates = [n for n in names if file[n].attrs.get("CLASS") == b"DIMENSION_SCALE"]
        rank = max(file[name].ndim for name in names)
        full = [name for name in names if file[name].ndim == rank and name not in coordinates]
        flag_name = next((n for n in ("regime", "sense") if n in names), None)
        flag_name = flag_name or next(n for n in full if file[n].dtype == "i1")
        first = next((n for n in ("omega_squared", "precession_rate") if n in names), None)
        first = first or next(n for n in full if file[n].dtype == "f8")
        size = base.stat().st_size
    damages = {}
    for name in GLOBAL:
        for word, value in ODD.items():
            damages[f"{name} = {word}"] = partial(set_attribute, holder="", name=name, value=value)
        damages[f"without {name}"] = in_file(lambda file, name=name: file.attrs.pop(name, None))
    for holder in (first, flag_name, coordinate):
        for name in LOCAL:
            for word in LOCAL_WORDS:
                damages[f"{holder}:{name} = {word}"] = partial(set_attribute, holder=holder, name=name, value=ODD[word])
    for holder in dict.fromkeys((first, flag_name, *coordinates)):
        for word, make in REPLACED.items():
            damages[f"{holder} {word}"] = partial(replace_variable, name=holder, make=make)
    for name in names:
        damages[f"without variable {name}"] = in_file(lambda file, name=name: file.__delitem__(name))
    for word, make in REPLACED.items():
        if word not in ("reversed", "shuffled", "cut", "another rank", "transposed"):
            damages[f"beside: {word}"] = in_file(lambda file, make=make: make(file, "beside", np.zeros(3)))
    for word in ("control", "bidi", "markup", "script", "mathtext"):
        name = TEXTS[word].replace("/", "|")
        damages[f"a variable named {word}"] = in_file(
            lambda file, name=name: file.create_dataset(name, data=np.zeros(3))
        )
    for k in range(1, 40):
        damages[f"cut at {k}/40"] = bytes_of(lambda content, k=k: content[: len(content) * k // 40])
    for k in (0, 1, 7, 8, 9, 40, 47, 48, 95, size - 1):
        damages[f"cut to {k} bytes"] = bytes_of(lambda content, k=k: content[:k])
    for seed in range(150):
        damages[f"noise {seed}"] = bytes_of(lambda content, seed=seed: noisy(content, seed))
    for k, value in enumerate((b"\0", b"\xff", b"\x01")):
        damages[f"heaps {k}"] = bytes_of(lambda content, value=value: heaps(content, value))
    for place in (8, 9, 10, 11, 12, 20, 28, 36, 44):
        for value in (b"\0", b"\xff" * 4, b"\x01"):
            damages[f"superblock {place} {value.hex()}"] = bytes_of(partial(overwrite, place=place, value=value))
    damages["longer by zeros"] = bytes_of(lambda content: content + bytes(5000))
    damages["512 bytes in front"] = bytes_of(lambda content: bytes(512) + content)
    for form in ("NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4"):
        damages[form] = partial(classic, form=form)
    damages["plain HDF5"] = plain_hdf
    damages["20,000 groups"] = in_file(lambda file: [file.create_group(f"g{k}") for k in range(20_000)])
    damages["5,000 attributes"] = in_file(lambda file: file.attrs.update({f"a{k}": k for k in range(5000)}))
    return damages


# ---------------------------------------------------------------------------------------------------------
# Every command over a file


def commands(base):
    """The commands that open a map, with a place in it."""
    with h5py.File(base) as file:
        scales = [n for n in file if file[n].attrs.get("CLASS") == b"DIMENSION_SCALE" and file[n].shape != (1,)]
        at = {n: str(file[n][0].decode() if file[n].dtype.kind == "O" else file[n][0]) for n in scales}
    at = {name: value for name, value in at.items() if name not in ("quantile", "input", "draw")}
    place = [word for name, value in at.items() for word in (f"--{name}", value)]
    plane = [word for name, value in list(at.items())[: max(len(at) - 2, 0)] for word in (f"--{name}", value)]
    return {
        "show": ["show", "map.nc"],
        "show --json": ["show", "map.nc", "--json"],
        "point": ["point", "map.nc", *place],
        "point --trajectory": ["point", "map.nc", *place, "--trajectory", "t.nc"],
        "slice": ["slice", "map.nc", *plane, "-o", "s.nc"],
        "figures": ["figures", "map.nc", "-o", "figures"],
        "report": ["report", "map.nc", "-o", "report.html"],
        "verify": ["verify", "map.nc", "--points", "3"],
    }


def run(words):
    """Run a command in this process and return (exit status, output, messages or traceback)."""
    from sweeps.__main__ import main

    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # which a person would see
        try:
            status = main(words)
        except SystemExit as end:
            status = end.code
        except BaseException:
            status = 1
            traceback.print_exc()
    return status, out.getvalue(), err.getvalue()


def run_in_room(function, extra_bytes):
    """Call a function in a forked process with a limit of its address space. Return the exit status."""
    process = multiprocessing.get_context("fork").Process(target=_call_in_room, args=(function, extra_bytes))
    process.start()
    process.join(300)
    return process.exitcode


def _call_in_room(function, extra_bytes):
    room = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + extra_bytes
    resource.setrlimit(resource.RLIMIT_AS, (room, room))
    resource.setrlimit(resource.RLIMIT_CPU, (60, 60))  # s
    sys.exit(function())


def describe_fault(name, status, out, err):
    """Return a description of the fault of a command's end; "" for a correct end."""
    output = out + err
    if "Traceback" in output or "Error:" in output:
        return "traceback: " + " | ".join(output.strip().splitlines()[-1:])[-200:]
    if any(not (c.isprintable() or c in "\n\t") for c in output):
        return "a control character"
    if "owned=1" in out and name == "report":
        return "script"
    if status == 2:
        lines = err.strip().splitlines()
        return (
            ""
            if len(lines) == 1 and "allowed" in err and not (out and name != "verify")
            else f"{len(lines)} lines: {err[:200]!r}"
        )
    if status == 1 and name == "verify" and "differs" in out:
        return ""
    if status != 0:
        return f"status {status}: {output[-200:]!r}"
    if err:
        return f"beside its work it says {err[:200]!r}"
    if name.endswith("--json"):
        json.loads(out)
    if name == "report" and "<script>owned" in Path("report.html").read_text(encoding="utf-8"):
        return "script in the page"
    return ""


def hash_of_content(path):
    """Return the hash of all values and attributes that the reader accepts of a file; None if it refuses the file."""
    import sweeps
    from sweeps.schema.refusals import RefusedError
    from sweeps.shards import content_hash

    try:
        with sweeps.open_map(path) as ds:
            attributes = [(n, k, str(w)) for n, v in ds.variables.items() for k, w in v.attrs.items()]
            inside = sorted(ds.attrs.items()), sorted(attributes), ds.encoding["ignored"], content_hash.content_hash(ds)
            return hashlib.sha256(repr(inside).encode()).hexdigest()
    except RefusedError:
        return None


def try_damage(folder, base, damage, number):
    """Return command → fault at a damaged copy of a map, in this process.

    Quick commands alternate, and `show` is also run if the file is accepted.
    """
    path = folder / "map.nc"
    shutil.copy(base, path)
    try:
        damage(path)
    except (ValueError, TypeError, OSError, KeyError, RuntimeError):
        return {}  # HDF5 itself has no such thing
    os.chdir(folder)
    words_of = commands(base)
    quick = [name for name in words_of if name not in SLOW]
    names = {quick[number % len(quick)], *(["show"] if hash_of_content(path) else [])}
    return one_by_one({name: words_of[name] for name in names})


def one_by_one(words_of):
    """Run commands in this process. Return each one's fault: how it ended, or that it took too long or too much."""
    faults = {}
    for name, words in words_of.items():
        begin = processor_seconds()
        with contextlib.suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")  # forgets the peak
        resident = peak_bytes()
        status, out, err = run(words)
        seconds, size = processor_seconds() - begin, peak_bytes() - resident
        what = describe_fault(name, status, out, err)
        what = what or (f"took {seconds:.0f} s" if seconds > PATIENCE else "")
        what = what or (f"took {size / 2**30:.2f} GiB" if size > MAX_EXTRA_BYTES else "")
        if what:
            faults[name] = what
    return faults


def processor_seconds():
    """Of this process and of the children that it has waited for."""
    return sum(os.times()[:4])


def peak_bytes():
    """Return the largest resident size of this process; child processes that read files are limited."""
    return 1024 * int(Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0])


@contextlib.contextmanager
def light():
    """Make complete pictures of few dots and few frames, and build the commands' parser once."""
    from sweeps.commands import program
    from sweeps.figure import sheets
    from sweeps.systems.rigid_body.presentation import figure_flip
    from sweeps.views import drawing

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(drawing, "start_worker", contextlib.nullcontext)  # pictures are drawn in this process
        patch.setattr(program, "build", cache(program.build))
        patch.setattr(sheets, "DPI", 40)
        for key in ("figure.dpi", "savefig.dpi"):
            patch.setitem(sheets.STYLE, key, 40)
        patch.setattr(figure_flip, "FRAMES", 8)
        patch.setattr(figure_flip, "DOTS", 40)
        yield
