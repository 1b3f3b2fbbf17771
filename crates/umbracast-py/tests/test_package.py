"""The stubs agree with the module, the examples run, the package is light, and other threads run beside a step."""

import ast
import doctest
import inspect
import re
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import umbracast
from umbracast import _umbracast

PACKAGE = Path(umbracast.__file__).parent
STUB = PACKAGE / "_umbracast.pyi"
DOCS = Path(__file__).resolve().parents[3] / "docs"


def test_the_stub_has_the_names_and_signatures_of_the_module():
    stub = ast.parse(STUB.read_text())
    said = {node.name: node for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    there = {name: value for name, value in vars(_umbracast).items() if callable(value) and not name.startswith("_")}
    helpers = {"Columns"}
    assert set(said) - helpers == set(there)
    for name, value in there.items():
        node = said[name]
        if isinstance(node, ast.FunctionDef):
            assert parameters(node) == signature(value), name
            continue
        methods = {part.name: part for part in node.body if isinstance(part, ast.FunctionDef)}
        own = {of for of, part in vars(value).items() if not of.startswith("_") or of.startswith("__arrow")}
        assert {of for of in methods if not of.startswith("_") or of.startswith("__arrow")} == own, name
        for of in own:
            part = vars(value)[of]
            if callable(part) or isinstance(part, staticmethod):
                drop = [] if isinstance(part, staticmethod) else ["self"]
                assert parameters(methods[of], drop) == signature(getattr(value, of), drop), f"{name}.{of}"
        if "__new__" in methods:
            assert parameters(methods["__new__"], ["cls"]) == signature(value), name


def parameters(node, drop=()):
    arguments = node.args
    defaults = [None] * (len(arguments.posonlyargs + arguments.args) - len(arguments.defaults)) + arguments.defaults
    plain = zip(arguments.posonlyargs + arguments.args, defaults)
    named = [(a.arg, value(d), False) for a, d in plain]
    named += [(a.arg, value(d), True) for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults)]
    return [part for part in named if part[0] not in drop]


def value(default):
    return inspect.Parameter.empty if default is None else ast.literal_eval(default)


def signature(of, drop=()):
    found = inspect.signature(of).parameters.values()
    named = [(p.name, p.default, p.kind is inspect.Parameter.KEYWORD_ONLY) for p in found]
    return [part for part in named if part[0] not in drop]


def test_types_are_strict(tmp_path):
    pytest.importorskip("mypy")
    # An installed package is found by itself; a folder of installed packages would be looked through whole.
    installed = PACKAGE.parent.name in ("site-packages", "dist-packages")
    told = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "-p", "umbracast"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env={**os.environ, **({} if installed else {"MYPYPATH": str(PACKAGE.parent)})},
    )
    assert told.returncode == 0, told.stdout


@pytest.mark.parametrize("name", ["umbracast", *umbracast.__all__])
def test_examples(name):
    of = umbracast if name == "umbracast" else getattr(umbracast, name)
    if isinstance(of, str):
        return
    assert of.__doc__, "every name says what it is"
    test = doctest.DocTestParser().get_doctest(of.__doc__, {}, name, None, None)
    assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test).failed == 0


def test_blocks_of_the_page(tmp_path, monkeypatch, capsys):
    page = DOCS / "PYTHON.md"
    if not page.exists():
        pytest.skip("the pages are in the repository alone")
    pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    names = {}
    for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL):
        needs = [word for word in ["polars", "pandas", "torch"] if f"import {word}" in block]
        try:
            for word in needs:
                __import__(word)
        except ImportError:
            print(f"skipped, for {needs} is not installed:\n{block}")
            continue
        exec(compile(block, str(page), "exec"), names)


def test_import_is_light():
    code = "import time; t = time.perf_counter(); import umbracast, sys; print(time.perf_counter() - t, 'numpy' in sys.modules)"
    seconds, numpy = subprocess.check_output([sys.executable, "-c", code], text=True).split()
    print(f"import umbracast: {1e3 * float(seconds):.0f} ms")
    assert numpy == "False", "NumPy is imported when it is used"


def test_other_threads_run_beside_a_step(scene):
    pipeline = umbracast.Pipeline(scene.site)
    longest, stop = [0.0], threading.Event()

    def watch():
        last = time.perf_counter()
        while not stop.is_set():
            time.sleep(0)
            now = time.perf_counter()
            longest[0], last = max(longest[0], now - last), now

    # A lock that is held for all of a cast of many people would stop the watcher for as long.
    tracks = {"id": list(range(40)) * 20, "time_s": [0.1 * (1 + k // 40) for k in range(800)]}
    tracks |= {axis: [(7 * k) % 20 - 10.0 for k in range(800)] for axis in ["x", "y"]} | {axis: [0.5] * 800 for axis in ["vx", "vy"]}
    thread = threading.Thread(target=watch)
    thread.start()
    began = time.perf_counter()
    umbracast.cast(tracks)
    pipeline.run(scene.frames[:5])
    took = time.perf_counter() - began
    stop.set()
    thread.join()
    print(f"{took:.2f} s of work, the watcher waited {longest[0]:.3f} s at most")
    assert longest[0] < 0.5 * took
