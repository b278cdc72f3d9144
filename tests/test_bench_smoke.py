"""The benchmarks measure what they say: all implementations compute the same, the clocks count, every section runs."""

import subprocess
import sys

import numpy as np
import pytest
from bench import __main__ as runner
from bench import device, directions, forward, gradient, growth, methods, overhead, pipeline, pyramid, threads
from bench.harness import agreement, clock, goals, package, reference, table, work
from bench.harness.options import ROOT, Options, child
from bench.harness.twins import convention, numpy_twin

import gtao

import drjit as dr  # isort: skip

COUNTS = [(1, 4), (3, 2)]
SIZE = (96, 54)
# All compute in float32, in another order: an arc cosine near 1 turns a last digit of a cosine into 3e-4.
CLOSE = 3e-4
# A sample on the edge of two texels may fall on either side; few pixels have one.
RARE = 0.005


@pytest.fixture(params=COUNTS, ids=work.label)
def task(request):
    """A work, its frame, and the NumPy twin's image of it."""
    small = work.Work(*SIZE, *request.param)
    scene = work.frame(small)
    return small, scene, numpy_twin.build(scene, small, rows=10)()


def assert_same(image, expected):
    assert image.shape == expected.shape
    assert np.mean(abs(image - expected) > CLOSE) < RARE


def test_the_frame_is_what_its_camera_sees():
    """Depth and normals belong together: neighbours on a surface lie in each other's tangent planes."""
    small = work.Work(192, 108, 1, 1)
    scene = work.frame(small)
    P = scene.gbuffer(small).position_v.numpy()
    step = P[:, 1:] - P[:, :-1]
    away = abs((step * scene.normal_v[:, :-1]).sum(-1)) / np.linalg.norm(step, axis=-1)
    # But at silhouettes, which are few, and on spheres by their curvature.
    assert np.median(away) < 1e-3
    assert np.mean(away < 0.2) > 0.9
    assert np.allclose(np.linalg.norm(scene.normal_v, axis=-1), 1, atol=1e-4)


def test_the_package_computes_what_the_numpy_twin_does(task):
    small, scene, expected = task
    assert 0.5 < expected.mean() < 0.99
    assert_same(package.image(scene.gbuffer(small), small.method()), expected)


def test_the_numba_twin_does(task):
    pytest.importorskip("numba", reason="Numba is not installed")
    from bench.harness.twins import numba_twin

    small, scene, expected = task
    assert_same(numba_twin.build(scene, small)(), expected)
    other = (twin.build(scene, small, convention.REFERENCE)() for twin in (numba_twin, numpy_twin))
    # A sample held at the border may be the shaded point itself, which has no direction.
    inside = slice(8, -8), slice(8, -8)
    assert_same(*(image[inside] for image in other))


def test_the_conventions_are_two(task):
    small, scene, expected = task
    other = numpy_twin.build(scene, small, convention.REFERENCE)()
    assert np.mean(abs(other - expected) > CLOSE) > 0.1


def test_the_pytorch_twin_does_and_has_the_same_gradients(task):
    pytest.importorskip("torch", reason="PyTorch is not installed")
    from bench.harness.twins import torch_twin

    small, scene, expected = task
    assert_same(torch_twin.Twin(scene, small).value(), expected)
    # Both sum float32 numbers of either sign in another order; a tie that falls otherwise moves a whole term.
    assert max(gradient.agreement(torch_twin).values()) < 1e-3


def test_a_step_gives_the_loss_and_its_gradients():
    small = work.Work(*SIZE, 1, 4)
    g, method = work.frame(small).gbuffer(small), small.method()
    loss, d_z, d_n = package.gradient_step(g.view_z, g.normal_v, g.camera, method)
    visibility = package.image(g, method).astype(np.float64)
    assert loss[0] == pytest.approx(np.mean((visibility - 0.5) ** 2), rel=1e-5)
    assert d_z.shape == g.view_z.shape
    assert np.any(d_n.numpy())
    found = package.fused(g, method)()
    assert found.value[0] == pytest.approx(loss[0], rel=1e-5)
    # The same terms, scattered in another order.
    for ours, theirs in ((found.view_z, d_z), (found.normal_v, d_n)):
        assert abs(ours - theirs).numpy().sum() < 1e-5 * abs(theirs).numpy().sum()


@pytest.mark.parametrize("name", clock.CLOCKS)
def test_a_clock_counts_work_and_nothing_else(name):
    Float = gtao.backend.default_float()
    assert clock.seconds(lambda: dr.eval(dr.arange(Float, 1 << 20) + 1), name) > 0


def test_kernels_launched_before_are_not_counted():
    Float = gtao.backend.default_float()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.eval(dr.arange(Float, 1 << 20) + 1)
    assert clock.seconds(lambda: None, "kernels") == 0


def test_rounds_run_in_turns_and_ratios_pair_them():
    order = []
    runs = {name: lambda name=name: order.append(name) for name in "ab"}
    assert {len(times) for times in clock.interleave(runs, "wall", 4, 60.0).values()} == {4}
    assert "".join(order) == "ab" * 6  # two rounds of which settle
    rows = clock.summary({"a": [1.0, 2.0, 4.0], "b": [3.0, 4.0, 6.0]}, "a")
    assert rows["b"]["ratio"] == {"best": 3.0, "median": 2.0, "low": 1.5, "high": 3.0}
    assert (rows["b"]["best_s"], rows["b"]["median_s"], rows["b"]["rounds"]) == (3.0, 4.0, 3)


def test_a_missing_reference_is_a_sentence(tmp_path):
    with pytest.raises(reference.Unavailable, match="--reference"):
        reference.load(None)
    with pytest.raises(reference.Unavailable, match="missing"):
        reference.load(tmp_path)
    (tmp_path / reference.SOURCES[0]).write_text("def lib():\n    raise OSError('no compiler')\n")
    with pytest.raises(reference.Unavailable, match="no compiler"):
        reference.load(tmp_path)


def test_goals_are_compared_with_what_was_measured():
    rows = {
        "gtao": (2.0, 2.2),
        "C++, scalar loads": (1.7, 2.0),
        "C++, vector gathers": (2.0, 1.0),
        "Numba": (14.0, 18.0),
    }
    rows = {name: {"best_s": best, "median_s": median} for name, (best, median) in rows.items()}
    numbers = {"forward": {"entries": [{"size": "1080p", "counts": "1x8", "taps": 16, "rows": rows}]}}
    found = {goal["what"]: goal for goal in goals.check(numbers)}
    assert set(found) == {"1x8 over C++", "times as fast as Numba"}
    met = {what: (goal["best"], goal["median"], goal["met"]) for what, goal in found.items()}
    # Over the faster of the two kinds of C++, by best and by median.
    assert met["1x8 over C++"] == (pytest.approx(2 / 1.7), pytest.approx(2.2), True)
    assert met["times as fast as Numba"] == (pytest.approx(7), pytest.approx(18 / 2.2), False)
    assert len(goals.rows(found.values())) == 2


def test_every_section_is_there():
    for name in runner.SECTIONS + runner.STUDIES:
        assert (runner.HERE / f"{name}.py").is_file()


@pytest.mark.slow
def test_sections_that_start_processes_report():
    assert child("memory", "estimate", "64", "1x8", "")["dr"] >= 4 * 64 * 64
    times = child("startup", "1x8", "estimate")
    assert min(times["first_s"], times["second_s"]) > 0
    assert times["compiled"] + times["from_disk"] == 2


@pytest.mark.slow
def test_the_runner_writes_a_record(tmp_path):
    command = [sys.executable, "-m", "tests.bench", "overhead", "--quick", "-o", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    record = gtao.io.read_record(tmp_path / "record.json")
    assert record["kind"] == "performance"
    assert set(record["numbers"]) == {"overhead", "goals"}
    assert [goal["what"] for goal in record["numbers"]["goals"]] == ["call, ms"]
    wrong = subprocess.run([*command[:3], "no_such_section"], cwd=ROOT, capture_output=True, text=True)
    assert wrong.returncode == 2
    assert "no benchmark no_such_section" in wrong.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    "section", [forward, gradient, methods, directions, pyramid, pipeline, growth, threads, overhead, device]
)
@pytest.mark.parametrize("name", ["cpu", "kernels"])
def test_a_section_runs(section, name, monkeypatch):
    """On frames of a few pixels, by either clock: that it measures and tells, not how long anything takes."""
    for size in work.SIZES:
        monkeypatch.setitem(work.SIZES, size, (64, 36))
    monkeypatch.setattr(agreement, "_margin", lambda small: 2)
    monkeypatch.setattr(growth, "SIDES_QUICK", (1,))
    monkeypatch.setattr(device, "STREAMED", 1 << 16)
    n_threads = dr.thread_count()
    options = Options(quick=True, reference=None, clock=name, rounds=3, budget_s=0.0, bandwidth=None)
    try:
        numbers = section.measure(options)
    finally:
        dr.set_thread_count(n_threads)
    for title, head, rows in section.tables(numbers):
        table.show(title, head, rows)
        assert all(len(row) == len(head) for row in rows)
