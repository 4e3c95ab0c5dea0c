"""The package as its users see it, and against the command line: same text, same bytes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import orograph

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = Path(os.environ.get("OROGRAPH", ROOT / "target/debug/orograph"))

SMALL = """(
    world: (size: (3200, 1600), cells: (64, 32), seed: 7, boundary: inland),
    inputs: { "land": "sum.a" },
    parameters: { "height": "base.amplitude" },
    nodes: {
        "base": Ridged(wavelength: "800 m", amplitude: "120 m"),
        "cover": Slope(height: "base"),
        "sum": Combine(mode: add, a: "base", b: "base"),
        "tint": Hillshade(version: 3, height: "sum"),
        "report": Metrics(height: "sum"),
    },
    outputs: { "height": "sum", "slope": "cover", "picture": "tint.colour", "measures": "report" },
)
"""

SLOW = """(
    world: (size: 20000, cells: 1024),
    nodes: { %s },
    outputs: { %s },
)
""" % (
    "".join(f'"n{n}": Perlin(octaves: 16, seed: {n}),' for n in range(60)),
    "".join(f'"n{n}": "n{n}",' for n in range(60)),
)


def command(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = dict(os.environ, OROGRAPH_CACHE="", NO_COLOR="1")
    return subprocess.run([PROGRAM, *arguments], cwd=folder, env=environment, capture_output=True, text=True)


def test_bytes_are_those_of_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "g.ron").write_text(SMALL)
    ran = command("run", "g.ron", "-q", "--format", "r32", "--set", "height=300 m", "--cells", "128", folder=tmp_path)
    assert ran.returncode == 0, ran.stderr
    graph = orograph.load(tmp_path / "g.ron")
    graph.set("height", 300)
    assert 'amplitude: 300' in graph.text
    result = graph.run(cells=128)
    for name in ("height", "slope"):
        assert result[name].array.astype("<f4").tobytes() == (tmp_path / f"out/{name}.r32").read_bytes(), name
    assert result["measures"] == json.loads((tmp_path / "out/measures.json").read_text())
    part = graph.run("height", cells=128, window="800 m,400 m,800 m x 800 m")["height"]
    assert np.array_equal(part.array, result["height"].array[16:48, 32:64])
    assert (part.x[0], part.y[0]) == (812.5, 412.5)
    assert not np.array_equal(graph.run("height", cells=128, seed=8)["height"].array, result["height"].array)


def test_outputs_are_not_copied() -> None:
    graph = orograph.parse(SMALL)
    for name, raster in graph.run(["height", "slope", "picture"]).items():
        again = graph.run(name)[name]
        for array in (raster.array, again.array, np.asarray(raster), raster.to_xarray().values):
            assert array.__array_interface__["data"][0] == raster.address, name
        assert not raster.array.flags.writeable
        with pytest.raises(ValueError):
            raster.array[0] = 1
    kept = graph.run("height")["height"].array
    del graph, raster, again
    orograph.configure()
    assert np.isfinite(kept).all(), "the array keeps its samples alive"


def test_kinds_and_shapes() -> None:
    result = orograph.parse(SMALL).run()
    assert [result[name].array.shape for name in ("height", "slope", "picture")] == [(32, 64), (32, 64), (3, 32, 64)]
    assert [(result[name].kind, result[name].unit) for name in ("height", "slope", "picture")] == [
        ("height", "m"),
        ("scalar", "°"),
        ("colour", ""),
    ]
    assert {timing.node for timing in result.timings} == {"base", "cover", "sum", "tint", "report"}
    with pytest.raises(KeyError, match="there is no output `heigth`"):
        result["heigth"]


def test_arrays_in_any_layout_give_the_same() -> None:
    graph = orograph.parse(SMALL)
    wide = np.random.default_rng(1).integers(0, 500, (64, 128)).astype(np.float64)
    plain = np.ascontiguousarray(wide[::2, ::2], dtype=np.float32)
    expected = graph.run("height", inputs={"base": plain})["height"].array
    assert np.array_equal(expected, 2 * plain)
    layouts = [wide[::2, ::2], np.asfortranarray(plain), plain.astype(np.int32), plain[:, ::-1][:, ::-1], plain.tolist()]
    for array in [*layouts, plain.astype(">f4")]:
        assert np.array_equal(graph.run("height", inputs={"base": array})["height"].array, expected)
    assert plain.flags.writeable, "the array stays with its owner"
    plain[0, 0] += 1
    assert graph.run("height", inputs={"base": plain})["height"].array[0, 0] == expected[0, 0] + 2
    land = graph.run("height", inputs={"land": np.zeros((32, 64))})["height"].array
    assert np.array_equal(land, graph.run("height", inputs={"sum": land})["height"].array)
    finer = graph.run("height", inputs={"base": np.full((64, 128), 3.0)})["height"].array
    assert finer.shape == (32, 64) and np.all(finer == 6)


def test_arrays_that_do_not_fit_are_refused() -> None:
    graph = orograph.parse(SMALL)
    holed = np.zeros((32, 64))
    holed[3, 5] = np.nan
    for array, error, text in [
        (holed, orograph.GraphError, "the array for `base` has NaN in row 3, column 5"),
        (np.full((32, 64), 1e300), orograph.GraphError, "has inf in row 0, column 0"),
        (np.zeros((64, 32)), orograph.GraphError, "has the shape 64 x 32; it needs rows and columns in the ratio of"),
        (np.zeros(2048), ValueError, "has 1 dimensions"),
        (np.zeros((3, 32, 64)), orograph.GraphError, "has 3 planes"),
        (np.zeros((32, 64), complex), TypeError, "has the type complex128"),
        (np.array([["a"]]), TypeError, "has the type"),
        (np.ma.masked_less(np.zeros((32, 64)), 1), ValueError, "masked cells"),
    ]:
        with pytest.raises(error, match=text):
            graph.run("height", inputs={"base": array})
    with pytest.raises(orograph.GraphError, match="there is no node `bass`; did you mean `base`"):
        graph.run(inputs={"bass": holed})


def test_problems_have_the_text_and_place_of_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "g.ron").write_text(SMALL.replace("Slope(", "Slop(").replace("120 m", "120 kg"))
    os.chdir(tmp_path)
    with pytest.raises(orograph.GraphError) as raised:
        orograph.load("g.ron")
    error = raised.value
    assert str(error) == command("check", "g.ron", folder=tmp_path).stderr.strip()
    assert (error.file, error.line, error.column, error.code) == ("g.ron", 6, 56, "unit")
    assert [(problem.line, problem.code) for problem in error.problems] == [(6, "unit"), (7, "unknown-node")]
    assert error.problems[1].help == "did you mean `Slope`?"
    with pytest.raises(orograph.GraphError, match="no parameter|no input or parameter|has no"):
        orograph.parse(SMALL).set("base.hight", 3)
    with pytest.raises(orograph.Error, match="none.ron"):
        orograph.load("none.ron")


def test_failures_of_a_run_have_the_text_and_place_of_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "land.tif").write_text("no raster")
    (tmp_path / "g.ron").write_text(SMALL.replace("Slope(height: \"base\")", 'Import(version: 2, file: "land.tif")'))
    os.chdir(tmp_path)
    with pytest.raises(orograph.GraphError) as raised:
        orograph.load("g.ron").run("slope")
    error = raised.value
    assert str(error) == command("run", "g.ron", "--only", "slope", folder=tmp_path).stderr.strip().split("\n", 1)[1]
    assert (error.node, error.file, error.line, error.column) == ("cover", "g.ron", 7, 9)
    assert error.code == "node-failed"


def test_progress_is_told_and_can_stop_a_run() -> None:
    graph = orograph.parse(SLOW)
    heard: list[tuple[str, float]] = []
    graph.run(["n0", "n1"], progress=lambda node, fraction: heard.append((node, fraction)))
    assert {node for node, _ in heard} == {"n0", "n1"} and all(0 <= fraction <= 1 for _, fraction in heard)

    def stop(node: str, fraction: float) -> None:
        raise RuntimeError(f"enough of {node}")

    start = time.perf_counter()
    with pytest.raises(RuntimeError, match="enough of n"):
        graph.run(progress=stop)
    assert time.perf_counter() - start < 2


def test_other_threads_run_meanwhile() -> None:
    graph = orograph.parse(SLOW)
    counted = 0
    done = threading.Event()

    def count() -> None:
        nonlocal counted
        while not done.wait(0.001):
            counted += 1

    thread = threading.Thread(target=count)
    thread.start()
    # A run of about a second: even on a busy machine the thread has its turn many times meanwhile. While a run held the
    # interpreter's lock, it would have one or two.
    most = 0
    for cells in range(512, 517):
        before = counted
        graph.run(cells=cells)
        most = max(most, counted - before)
        if most > 10:
            break
    done.set()
    thread.join()
    assert most > 10


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_is_a_keyboard_interrupt(tmp_path: Path) -> None:
    script = tmp_path / "slow.py"
    script.write_text(
        "import orograph\n"
        f"graph = orograph.parse({SLOW!r})\n"
        "try:\n"
        "    graph.run(progress=lambda node, fraction: print('runs', flush=True))\n"
        "except KeyboardInterrupt:\n"
        "    print('stopped', flush=True)\n"
    )
    process = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "runs\n"
    start = time.perf_counter()
    process.send_signal(signal.SIGINT)
    rest = process.communicate(timeout=60)[0]
    assert rest.endswith("stopped\n") and time.perf_counter() - start < 5


def test_coordinates_of_xarray() -> None:
    pytest.importorskip("xarray")
    placed = SMALL.replace("seed: 7", 'seed: 7, place: (epsg: 32611, corner: ("378 km", "3812 km"))')
    data = orograph.parse(placed).run().to_xarray()
    assert (float(data.x[0]), float(data.y[0])) == (378_025.0, 3_811_975.0)
    assert data["height"].attrs == {"long_name": "height", "kind": "height", "units": "m", "crs": "EPSG:32611"}
    assert data["height"].dims == ("y", "x") and data["picture"].dims == ("picture_plane", "y", "x")
    here = orograph.parse(SMALL).run("height").to_xarray()
    assert (float(here.x[-1]), float(here.y[-1])) == (3175.0, 1575.0)


def test_the_schema_describes_every_example() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    schema = orograph.schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    files = sorted((ROOT / "graphs").glob("*.ron"))
    assert len(files) > 20
    for file in files:
        text = command("schema", str(file), folder=ROOT).stdout
        faults = [f"{list(fault.absolute_path)}: {fault.message[:200]}" for fault in validator.iter_errors(json.loads(text))]
        assert not faults, (file.name, faults)
    small = orograph.parse(SMALL).json
    validator.validate(small)
    for change in (
        lambda nodes: nodes["base"]["Ridged"].update(wavelength="800 kg"),
        lambda nodes: nodes["base"]["Ridged"].update(wavelenght=800),
        lambda nodes: nodes["base"]["Ridged"].update(octaves=3.5),
        lambda nodes: nodes["sum"]["Combine"].update(mode="ad"),
        lambda nodes: nodes["sum"]["Combine"].update(a="no wire!"),
        lambda nodes: nodes.update(base={"Rigded": {}}),
    ):
        wrong = json.loads(json.dumps(small))
        change(wrong["nodes"])
        assert not validator.is_valid(wrong), wrong["nodes"]


def test_declarations_are_those_of_the_program() -> None:
    declared = orograph.nodes()
    assert declared["StreamPower"]["parameters"] and "Hillshade" in declared
    assert list(declared) == [node["id"] for node in json.loads(command("nodes", "--format", "json", folder=ROOT).stdout)]
    graph = orograph.parse(SMALL)
    assert graph.nodes["sum"] == "Combine" and graph.outputs == ["height", "slope", "picture", "measures"]
    assert graph.description["parameters"][0]["name"] == "height"


def test_the_demo_writes_a_picture(tmp_path: Path) -> None:
    ran = subprocess.run([sys.executable, "-m", "orograph.demo"], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert "hypsometric_integral" in ran.stdout and (tmp_path / "orograph_demo.png").stat().st_size > 10_000


def test_a_run_costs_little_more_than_its_nodes(capsys: pytest.CaptureFixture[str]) -> None:
    """With every result in memory, what is left of a run is what the package adds."""
    graph = orograph.parse(SMALL)
    graph.run(cells=1024)
    times = []
    for _ in range(100):
        start = time.perf_counter()
        graph.run(cells=1024)
        times.append(time.perf_counter() - start)
    with capsys.disabled():
        print(f"\nPython adds {1e3 * min(times):.2f} ms to a run (the least of {len(times)})")
    assert min(times) < 5e-3
