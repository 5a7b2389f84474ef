import hashlib
import json
import os
import stat
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import llvmlite.binding as llvm
import numba
import pytest

import sweeps
from kernels import fingerprint as fp


@pytest.fixture(autouse=True)
def afresh(monkeypatch):
    """Let every call compute its hash, and none leave it, or what it found of the processor, behind."""
    monkeypatch.setattr(fp, "fingerprint", fp.fingerprint.__wrapped__)
    monkeypatch.setattr(fp, "_write_note", lambda note, told: None)


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A checkout of our own to edit: two source files beside one that is none."""
    folder = tmp_path / "checkout" / "kernels"
    folder.mkdir(parents=True)
    (folder / "fingerprint.py").write_bytes(b"ours")
    (folder / "step.py").write_bytes(b"a = 1\n")
    (folder / "notes.txt").write_bytes(b"no source")
    monkeypatch.setattr(fp, "__file__", str(folder / "fingerprint.py"))
    return folder


@pytest.fixture
def cache_home(tmp_path, monkeypatch):
    """A user's cache folder of our own, and a folder for temporary files beside it."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(fp.tempfile, "tempdir", str(tmp_path))
    return tmp_path / "cache"


def test_it_is_a_sha256_and_stays():
    told = fp.fingerprint()
    assert len(told) == 64
    assert set(told) <= set("0123456789abcdef")
    assert fp.fingerprint() == told


def test_another_process_tells_the_same():
    told = subprocess.run(
        [sys.executable, "-c", "from kernels.fingerprint import fingerprint; print(fingerprint())"],
        cwd=Path(fp.__file__).parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    assert told.stdout.strip() == fp.fingerprint()


def test_every_byte_of_every_source_counts(checkout):
    told = {fp.fingerprint()}
    for content in (b"a = 2\n", b"a = 1", b"a = 1\n\n", b"A = 1\n", b"\xff"):
        (checkout / "step.py").write_bytes(content)
        told.add(fp.fingerprint())
    assert len(told) == 6
    (checkout / "step.py").write_bytes(b"a = 1\n")
    before = fp.fingerprint()
    assert before in told
    (checkout / "fingerprint.py").write_bytes(b"ourS")
    assert fp.fingerprint() not in told


def test_a_new_a_lost_and_a_renamed_source_count(checkout):
    before = fp.fingerprint()
    (checkout / "step.py").rename(checkout / "stride.py")
    renamed = fp.fingerprint()
    (checkout / "empty.py").touch()
    more = fp.fingerprint()
    (checkout / "stride.py").unlink()
    assert len({before, renamed, more, fp.fingerprint()}) == 4


def test_what_is_no_source_does_not_count(checkout):
    before = fp.fingerprint()
    (checkout / "notes.txt").write_bytes(b"changed")
    (checkout / "__pycache__").mkdir()
    (checkout / "__pycache__" / "step.cpython-311.pyc").write_bytes(b"compiled")
    assert fp.fingerprint() == before


def test_where_the_checkout_lies_does_not_count(checkout, tmp_path, monkeypatch):
    before = fp.fingerprint()
    checkout.parent.rename(tmp_path / "elsewhere")
    monkeypatch.setattr(fp, "__file__", str(tmp_path / "elsewhere" / "kernels" / "fingerprint.py"))
    assert fp.fingerprint() == before


@pytest.mark.parametrize("package", ["numba", "llvmlite", "numpy"])
def test_versions_count(package, monkeypatch):
    before, known = fp.fingerprint(), fp._version
    monkeypatch.setattr(fp, "_version", lambda name: "0.0" if name == package else known(name))
    assert fp.fingerprint() != before


@pytest.mark.parametrize("package", ["numba", "llvmlite", "numpy"])
def test_a_version_is_what_the_packages_metadata_say(package, tmp_path, monkeypatch):
    assert fp._version(package) == metadata.version(package)
    found = SimpleNamespace(origin=str(tmp_path / package / "__init__.py"))
    monkeypatch.setattr(fp.PathFinder, "find_spec", lambda name: found)
    monkeypatch.setattr(metadata, "version", lambda name: "of the metadata")
    assert fp._version(package) == "of the metadata"  # nothing lies beside it
    (tmp_path / f"{package}-1.2rc3.dist-info").mkdir()
    (tmp_path / f"{package}-extras-9.dist-info").mkdir()  # of another
    assert fp._version(package) == "1.2rc3"
    (tmp_path / f"{package}-1.1.dist-info").mkdir()  # left by an installer that failed
    assert fp._version(package) == "of the metadata"


def test_the_processor_counts(monkeypatch):
    told = [fp.fingerprint()]
    features = dict(llvm.get_host_cpu_features())
    some = next(name for name, has in features.items() if has)
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features | {some: False})
    told.append(fp.fingerprint())
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: dict(reversed(features.items())))
    assert fp.fingerprint() == told[0]
    monkeypatch.setattr(llvm, "get_host_cpu_name", lambda: "abacus")
    told.append(fp.fingerprint())
    assert len(set(told)) == 3


@pytest.mark.parametrize("name", fp.CODE_SETTINGS)
def test_settings_of_the_compiler_count(name, monkeypatch):
    monkeypatch.delenv(name, raising=False)
    before = fp.fingerprint()
    monkeypatch.setenv(name, "1")
    assert fp.fingerprint() != before
    monkeypatch.setenv(name, "")
    assert fp.fingerprint() == before


def test_settings_in_numbas_own_file_count(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    before = fp.fingerprint()
    Path(".numba_config.yaml").write_text("opt: 0\n")
    assert fp.fingerprint() != before


OTHERS = {"NUMBA_NUM_THREADS": "1", "NUMBA_THREADING_LAYER": "workqueue", "NUMBA_FUNCTION_CACHE_SIZE": "1"}


@pytest.mark.slow
def test_other_settings_change_no_bit():
    code = "import sweeps; print(sweeps.survey('tiny').attrs['content_hash'])"
    told = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(fp.__file__).parents[1],
        env={**os.environ, **OTHERS},
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert told.strip() == sweeps.survey("tiny").attrs["content_hash"]


def test_the_cache_folder_is_named_by_the_fingerprint_and_the_checkout(cache_home, checkout, tmp_path, monkeypatch):
    folder = fp.cache_folder()
    place = hashlib.sha256(str(checkout.resolve()).encode()).hexdigest()[:8]
    assert folder == cache_home / "polhode" / f"{fp.fingerprint()[:16]}-{place}"
    assert folder.is_dir()
    assert fp.cache_folder() == folder
    (checkout / "step.py").write_bytes(b"a = 2\n")
    edited = fp.cache_folder()
    checkout.parent.rename(tmp_path / "elsewhere")
    monkeypatch.setattr(fp, "__file__", str(tmp_path / "elsewhere" / "kernels" / "fingerprint.py"))
    moved = fp.cache_folder()
    assert len({folder, edited, moved}) == 3
    # the same kernels in two checkouts: one fingerprint, two folders
    assert edited.name.split("-")[0] == moved.name.split("-")[0]


def test_without_a_named_cache_it_is_the_home_folders(tmp_path, cache_home, monkeypatch):
    for given in (None, ""):
        if given is None:
            monkeypatch.delenv("XDG_CACHE_HOME")
        else:
            monkeypatch.setenv("XDG_CACHE_HOME", given)
        monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
        assert fp.cache_folder().parent == tmp_path / "home" / ".cache" / "polhode"


def test_a_cache_that_cannot_be_made_gives_way_to_the_temporary_folder(cache_home, tmp_path):
    cache_home.write_text("a file stands where the folder should")
    assert fp.cache_folder().parent == tmp_path / "polhode"


def test_a_cache_of_somebody_elses_is_not_used(cache_home, tmp_path, monkeypatch):
    ours, uid = fp.cache_folder(), os.getuid()
    assert fp._is_safe(ours)
    monkeypatch.setattr(fp.os, "getuid", lambda: uid + 1)
    folder = fp.cache_folder()
    assert folder.parent.parent == tmp_path
    assert folder.parent.name.startswith("polhode-")
    assert folder.name == ours.name
    assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700


def test_a_folder_that_cannot_be_written_is_not_safe(tmp_path, monkeypatch):
    assert fp._is_safe(tmp_path)
    monkeypatch.setattr(fp.os, "access", lambda path, mode: mode != os.W_OK)
    assert not fp._is_safe(tmp_path)


@pytest.fixture
def pointed(cache_home, monkeypatch):
    """Points Numba anew, with a folder given or none: where it then keeps what it compiles."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", "before")

    def point(given):
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(given))
        fp.use_cache()
        assert os.environ["NUMBA_CACHE_DIR"] == numba.config.CACHE_DIR == str(fp.cache_folder())
        return Path(numba.config.CACHE_DIR)

    return point


def test_numba_is_pointed_below_the_folder_that_somebody_chose(pointed, cache_home, checkout, tmp_path):
    name = fp.cache_folder().name
    assert pointed("") == cache_home / "polhode" / name
    assert pointed(tmp_path / "chosen") == tmp_path / "chosen" / name
    (checkout / "step.py").write_bytes(b"a = 2\n")
    edited = pointed(tmp_path / "chosen")
    assert edited.parent == tmp_path / "chosen"
    assert edited.name != name


def test_a_chosen_folder_is_any_that_can_be_written(pointed, cache_home, tmp_path):
    assert pointed(os.path.relpath(tmp_path / "chosen")).parent == tmp_path / "chosen"
    (tmp_path / "file").write_text("a file stands where the folder should")
    assert pointed(tmp_path / "file").parent == cache_home / "polhode"


def test_what_a_parent_process_left_is_neither_kept_nor_nested(pointed, cache_home, checkout, tmp_path):
    for base in (tmp_path / "chosen", cache_home / "polhode"):
        inherited = pointed(base)
        assert pointed(inherited) == inherited
        (checkout / "step.py").write_bytes(b"a = 3\n" if base.name == "chosen" else b"a = 4\n")
        assert pointed(inherited).parent == inherited.parent
        assert pointed(inherited) != inherited


def test_a_child_process_keeps_to_its_parents_place(tmp_path):
    asked = (
        "from kernels.fingerprint import cache_folder; from importlib.util import find_spec; find_spec('numba')\n"
        "import os; print(cache_folder(), os.environ['NUMBA_CACHE_DIR'])"
    )
    nested = f"import kernels, numba, subprocess, sys; subprocess.run([sys.executable, '-c', {asked!r}], check=True)"
    told = subprocess.run(
        [sys.executable, "-c", nested],
        cwd=Path(fp.__file__).parents[1],
        env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "chosen")},
        capture_output=True,
        text=True,
        check=True,
    )
    folder, pointed = told.stdout.split()
    assert folder == pointed
    assert Path(folder).parent == tmp_path / "chosen"


# What a map's own kernels import


KERNELS = {
    "__init__": "from kernels.fingerprint import use_cache\n",
    "fingerprint": "import ast\nfrom numpy import linear\n",
    "statuses": "OK = 0\n",
    "step": "import math\nfrom kernels.statuses import OK\n",
    "spin": "from kernels import OPTIONS, step\n",
    "top": "import kernels.step as s\n",
    "late": "def f():\n    if True:\n        from . import top\n        from .spin import OK\n",
    "terse": "if True: import kernels.spin; from .alone import *\nfrom kernels import \\\n    late\n",
    "wordy": '"""It comes\nfrom kernels, so to speak.\n"""\nfrom kernels import (\n    top,  # :)\n    alone,\n)\n',
    "linear": "from kernelsmith import step\nimport kernelsmith.top\n",
    "alone": "",
}


@pytest.fixture
def sweeping(checkout):
    """Kernels that import one another in every way there is."""
    for name, text in KERNELS.items():
        (checkout / f"{name}.py").write_text(text)
    return checkout


@pytest.mark.parametrize(
    ("modules", "imported"),
    [
        ("step", "statuses"),
        ("spin", "step statuses"),
        ("top", "step statuses"),
        ("late", "top spin step statuses"),
        ("terse", "alone late top spin step statuses"),
        ("wordy", "alone top step statuses"),
        ("linear", ""),
        ("alone linear step", "statuses"),
    ],
)
def test_modules_count_with_all_that_they_import(sweeping, modules, imported):
    expected = {"__init__", "fingerprint", *modules.split(), *imported.split()}
    found = fp.sources(*modules.split())
    assert [path.stem for path in found] == sorted(expected)
    before = fp.fingerprint(*modules.split())
    for name in KERNELS:
        kernel = sweeping / f"{name}.py"
        kernel.write_text(KERNELS[name] + "# another comment\n")
        assert (fp.fingerprint(*modules.split()) != before) == (name in expected), name
        kernel.write_text(KERNELS[name])
    assert fp.fingerprint(*modules.split()) == before


def test_without_modules_every_file_counts(sweeping):
    assert fp.sources() == sorted(sweeping.glob("*.py"))
    before = fp.fingerprint()
    (sweeping / "alone.py").write_text("# another comment\n")
    assert fp.fingerprint() != before


def test_a_module_that_is_not_there_is_no_fingerprint(sweeping):
    with pytest.raises(FileNotFoundError, match=r"nowhere\.py"):
        fp.fingerprint("nowhere")


@pytest.mark.slow
def test_what_is_read_is_what_is_imported():
    for module in ("survey", "symmetric_top", "oscillations"):
        code = f"import sys, kernels.{module}; print(*(sys.modules[n].__file__ for n in sys.modules if 'kernels' in n))"
        root = Path(fp.__file__).parents[1]
        told = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True, check=True)
        loaded = {Path(file) for file in told.stdout.split() if Path(file).parent == root / "kernels"}
        assert set(fp.sources(module)) == loaded, module


@pytest.fixture
def host(monkeypatch):
    """Has the processor be of one name, with Numba imported and begun, or not; says the features that hold then."""

    def vectors(name, begun=False, inherited=None, **features):
        monkeypatch.setattr(llvm, "get_host_cpu_name", lambda: name)
        monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: {"avx512f": True} | features)
        monkeypatch.setattr(fp, "_has_begun", lambda: begun)
        monkeypatch.setattr(numba.config, "CPU_FEATURES", None)
        monkeypatch.delenv("NUMBA_CPU_FEATURES", raising=False)
        for setting in ("NUMBA_CPU_NAME", "NUMBA_ENABLE_AVX"):
            monkeypatch.delenv(setting, raising=False)
        if inherited:
            monkeypatch.setenv("NUMBA_CPU_FEATURES", inherited)
        fp.use_whole_vectors()
        return os.environ.get("NUMBA_CPU_FEATURES"), numba.config.CPU_FEATURES

    return vectors


def test_whole_vectors_where_llvm_takes_half_of_them_and_the_clock_stays(host):
    assert host("sapphirerapids") == ("+avx512f,-prefer-256-bit",) * 2
    for other in ("skylake-avx512", "znver4", "apple-m1"):
        assert host(other) == (None, None)
    assert host("sapphirerapids", avx512f=False) == (None, None)


def test_whole_vectors_are_left_to_a_user_who_has_settings_of_the_processor(host, monkeypatch):
    monkeypatch.setattr(fp, "_settings_of_the_processor", lambda: True)
    assert host("sapphirerapids") == (None, None)


def test_features_of_a_parent_process_are_formed_anew_and_a_users_own_hold(host):
    assert (
        host("icelake-server", inherited="of another,-prefer-256-bit", fma=True)[0] == "+avx512f,+fma,-prefer-256-bit"
    )
    assert host("skylake-avx512", inherited="of another,-prefer-256-bit") == (None, None)
    assert host("icelake-server", inherited="+avx2") == ("+avx2", None)


def test_numba_that_has_begun_keeps_its_vectors_and_says_so(host):
    with pytest.warns(RuntimeWarning, match="Import Polhode first"):
        assert host("rocketlake", begun=True) == ("+avx512f,+prefer-256-bit", None)
    assert host("rocketlake", begun=True, inherited="x,+prefer-256-bit") == ("x,+prefer-256-bit", None)
    assert host("rocketlake", inherited="x,+prefer-256-bit")[0] == "+avx512f,+prefer-256-bit"


HOST = (
    "import sys; from kernels import fingerprint as fp; fp.fingerprint(); print(*fp._host()); "
    "print('llvmlite.binding' in sys.modules)"
)


def asked(cache, code=HOST):
    """What another process says of the processor, and whether it has loaded LLVM for that."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache)}
    words, root = [sys.executable, "-c", code], Path(fp.__file__).parents[1]
    told = subprocess.run(words, cwd=root, env=environment, capture_output=True, text=True, check=True)
    return told.stdout.splitlines()


def test_llvm_is_asked_of_a_processor_once(tmp_path):
    name, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
    assert asked(tmp_path) == [f"{name} {features}", "True"]
    assert not any(tmp_path.iterdir())  # no folder is made for a note
    (folder := tmp_path / "polhode").mkdir()
    assert asked(tmp_path) == [f"{name} {features}", "True"]
    assert asked(tmp_path) == [f"{name} {features}", "False"]
    (note,) = folder.glob("processor.*.json")
    right = json.loads(note.read_text())
    for wrong in ({**right, "basis": "another", "name": "abacus"}, {"basis": right["basis"]}, [], None):
        note.write_text(json.dumps(wrong) if wrong is not None else "{")
        assert asked(tmp_path) == [f"{name} {features}", "True"]
        assert json.loads(note.read_text()) == right
    assert list(folder.iterdir()) == [note]


def test_where_code_is_compiled_the_note_is_not_believed(tmp_path):
    (tmp_path / "polhode").mkdir()
    asked(tmp_path)
    (note,) = (tmp_path / "polhode").glob("processor.*.json")
    right = json.loads(note.read_text())
    note.write_text(json.dumps({**right, "name": "abacus"}))
    assert asked(tmp_path)[0].startswith("abacus ")
    asked(tmp_path, "import kernels, numba")
    assert json.loads(note.read_text()) == right
