from importlib import metadata
from pathlib import Path

import llvmlite.binding as llvm
import pytest
from calls import ROOT, python

from kernels.compile import fingerprint as fp


@pytest.fixture(autouse=True)
def afresh(monkeypatch):
    """Let every call compute its hash, and none leave it behind."""
    monkeypatch.setattr(fp, "fingerprint", fp.fingerprint.__wrapped__)
    monkeypatch.setattr(fp, "machine", fp.machine.__wrapped__)


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """Make a checkout to edit: two source files and a file that is no source."""
    folder = tmp_path / "checkout" / "kernels"
    (folder / "compile").mkdir(parents=True)
    (folder / "compile" / "fingerprint.py").write_bytes(b"ours")
    (folder / "step.py").write_bytes(b"a = 1\n")
    (folder / "notes.txt").write_bytes(b"no source")
    monkeypatch.setattr(fp, "__file__", str(folder / "compile" / "fingerprint.py"))
    return folder


def test_every_byte_and_every_name_of_a_source_counts(checkout):
    fingerprints = [fp.fingerprint()]
    for content in (b"a = 2\n", b"a = 1", b"a = 1\n\n", b"A = 1\n", "# é".encode()):
        (checkout / "step.py").write_bytes(content)
        fingerprints.append(fp.fingerprint())
    for change in (
        lambda: (checkout / "compile" / "fingerprint.py").write_bytes(b"ourS"),
        lambda: (checkout / "step.py").rename(checkout / "stride.py"),
        lambda: (checkout / "empty.py").touch(),
        lambda: (checkout / "stride.py").unlink(),
    ):
        change()
        fingerprints.append(fp.fingerprint())
    assert len(set(fingerprints)) == 10


def test_neither_what_is_no_source_nor_where_the_checkout_lies_counts(checkout, tmp_path, monkeypatch):
    before = fp.fingerprint()
    (checkout / "notes.txt").write_bytes(b"changed")
    (checkout / "__pycache__").mkdir()
    (checkout / "__pycache__" / "step.cpython-311.pyc").write_bytes(b"compiled")
    checkout.parent.rename(tmp_path / "elsewhere")
    monkeypatch.setattr(fp, "__file__", str(tmp_path / "elsewhere" / "kernels" / "compile" / "fingerprint.py"))
    assert fp.fingerprint() == before


@pytest.mark.parametrize("package", ["numba", "llvmlite", "numpy"])
def test_versions_count(package, monkeypatch):
    before, version = fp.fingerprint(), metadata.version
    monkeypatch.setattr(metadata, "version", lambda name: "0.0" if name == package else version(name))
    assert fp.fingerprint() != before


def test_the_processor_counts(monkeypatch):
    fingerprints = [fp.fingerprint()]
    features = dict(llvm.get_host_cpu_features())
    feature = next(name for name, has in features.items() if has)
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: features | {feature: False})
    fingerprints.append(fp.fingerprint())
    monkeypatch.setattr(llvm, "get_host_cpu_features", lambda: dict(reversed(features.items())))
    assert fp.fingerprint() == fingerprints[0]
    monkeypatch.setattr(llvm, "get_host_cpu_name", lambda: "abacus")
    fingerprints.append(fp.fingerprint())
    assert len(set(fingerprints)) == 3


@pytest.mark.parametrize("name", fp.CODE_SETTINGS)
def test_settings_of_the_compiler_count(name, monkeypatch):
    monkeypatch.delenv(name, raising=False)
    before = fp.fingerprint()
    monkeypatch.setenv(name, "1")
    assert fp.fingerprint() != before
    monkeypatch.setenv(name, "")
    assert fp.fingerprint() == before


OTHER_SETTINGS = {"NUMBA_NUM_THREADS": "1", "NUMBA_THREADING_LAYER": "workqueue", "NUMBA_FUNCTION_CACHE_SIZE": "1"}


@pytest.mark.slow
def test_other_settings_change_no_bit():
    code = "from kernels.free import exact; print(exact.attitude((0.7, 1.0, 1.25), (0.3, 0.9, 0.2), [9.0]).tolist())"
    assert python(code, **OTHER_SETTINGS) == python(code)


# Imports of a map's own kernels


KERNELS = {
    "__init__": "from kernels.compile.fingerprint import stamp\n",
    "compile/__init__": "",
    "compile/fingerprint": "import ast\nfrom numpy import linear\n",
    "statuses": "OK = 0\n",
    "step": "import math\nfrom kernels.statuses import OK\n",
    "spin": "from kernels import OPTIONS, step\n",
    "top": "import kernels.step as s\n",
    "late": "def f():\n    if True:\n        from . import top\n        from .spin import OK\n",
    "terse": "if True: import kernels.spin; from .alone import *\nfrom kernels import \\\n    late\n",
    "wordy": '"""It comes\nfrom kernels, so to speak.\n"""\nfrom kernels import (\n    top,  # :)\n    alone,\n)\n',
    "free/__init__": "from kernels import statuses\n",
    "free/exact": "from . import elliptic\nfrom ..spin import OK\n",
    "free/elliptic": "from kernels.compile import fingerprint\n",
    "body": "from kernels.free import exact\n",
    "linear": "from kernelsmith import step\nimport kernelsmith.top\n",
    "alone": "",
}


@pytest.fixture
def kernel_folder(checkout):
    """Kernels that import one another in every way there is."""
    (checkout / "free").mkdir()
    for name, text in KERNELS.items():
        (checkout / f"{name}.py").write_text(text)
    return checkout


@pytest.mark.parametrize(
    ("modules", "imports"),
    [
        ("terse", "alone late top spin step statuses"),
        ("wordy", "alone top step statuses"),
        ("linear", ""),
        ("alone linear step", "statuses"),
        ("body", "free/__init__ free/exact free/elliptic spin step statuses"),
    ],
)
def test_modules_count_with_all_that_they_import(kernel_folder, modules, imports):
    stems = modules.replace(".", "/").split()
    expected = {"__init__", "compile/__init__", "compile/fingerprint", *stems, *imports.split()}
    sources = fp.sources(*modules.split())
    assert {str(path.relative_to(kernel_folder).with_suffix("")) for path in sources} == expected
    assert [path.name for path in sources] == sorted(path.name for path in sources)
    before = fp.fingerprint(*modules.split())
    for name in KERNELS:
        kernel = kernel_folder / f"{name}.py"
        kernel.write_text(KERNELS[name] + "# another comment\n")
        assert (fp.fingerprint(*modules.split()) != before) == (name in expected), name
        kernel.write_text(KERNELS[name])
    assert fp.fingerprint(*modules.split()) == before


def test_a_module_that_is_not_there_is_no_fingerprint(kernel_folder):
    with pytest.raises(FileNotFoundError, match=r"nowhere\.py"):
        fp.fingerprint("nowhere")


@pytest.mark.slow
def test_what_is_read_is_what_is_imported():
    for module in ("near_axis.survey", "events.symmetric_top", "flow.oscillations"):
        code = f"from kernels.compile import jit; jit.leave_out_compiler(); import sys, kernels.{module}; "
        code += "print(*(sys.modules[name].__file__ for name in sys.modules if 'kernels' in name))"
        files = {Path(file) for file in python(code).split() if ROOT / "kernels" in Path(file).parents}
        assert set(fp.sources(module)) == files, module
