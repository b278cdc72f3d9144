"""The error budget adds up, sees through noise, and knows how certain it is."""

import itertools
import json
import math

import numpy as np
import pytest

from gtao import evaluate
from gtao.errors import ConfigError, ShapeError

H, W = 24, 32
NAMES = ("truth", "one layer", "samples", "heuristic")


def ladder(seed=0):
    """Exact rungs: steps with known means and products, the last of which undoes much of the first."""
    generator = np.random.default_rng(seed)
    first, second, own = generator.standard_normal((3, H, W)) * 0.1
    truth = generator.random((H, W))
    rungs = np.cumsum([truth, first + 0.05, second, 0.5 * own - 0.7 * first], axis=0)
    return dict(zip(NAMES, rungs, strict=True))


def by_definition(rungs, keep):
    values = [image[keep] for image in rungs.values()]
    steps = [b - a for a, b in itertools.pairwise(values)]
    return np.array([[np.mean(p * q) for q in steps] for p in steps]), [p.mean() for p in steps]


def test_values_by_definition():
    rungs = ladder()
    mask = np.random.default_rng(1).random((H, W)) < 0.8
    gram, biases = by_definition(rungs, mask)
    budget = evaluate.error_budget(rungs, mask=mask)
    assert (budget.reference, budget.names, budget.n_pixels) == ("truth", NAMES[1:], mask.sum())
    # Rounding of sums of some hundred numbers.
    assert budget.gram == pytest.approx(gram, rel=1e-12)
    assert budget.biases == pytest.approx(np.array(biases), rel=1e-12)
    assert budget.mean_squares == pytest.approx(np.diag(gram), rel=1e-12)
    assert budget.cross_terms == pytest.approx(gram.sum() - np.trace(gram), rel=1e-10)
    assert budget.cross_terms < 0
    assert budget.shares.sum() == pytest.approx(budget.total, rel=1e-12)
    norm = np.sqrt(np.diag(gram))
    assert budget.correlations == pytest.approx(gram / np.outer(norm, norm), rel=1e-12)
    assert budget.noise == 0
    for image, (a, b) in zip(budget.images, itertools.pairwise(NAMES), strict=True):
        assert np.array_equal(np.isnan(image), ~mask)
        assert image[mask] == pytest.approx((rungs[b] - rungs[a])[mask], abs=1e-7)


@pytest.mark.parametrize("masked", [False, True])
def test_the_entries_sum_to_the_corrected_error(masked):
    generator = np.random.default_rng(2)
    rungs = {name: image + 0.1 * generator.standard_normal((H, W)) for name, image in ladder().items()}
    variances = {name: 0.02 * generator.random((H, W)) for name in NAMES}
    mask = generator.random((H, W)) < 0.5 if masked else np.ones((H, W), bool)
    budget = evaluate.error_budget(rungs, variances=variances, mask=mask)
    raw = evaluate.mse(rungs["heuristic"], rungs["truth"], mask=mask)
    noise = (variances["truth"] + variances["heuristic"])[mask].mean()
    assert budget.noise == pytest.approx(noise, rel=1e-12)
    assert budget.total == pytest.approx(raw - noise, rel=1e-12)
    assert budget.gram.sum() == pytest.approx(raw - noise, rel=1e-12)
    assert budget.mean_squares.sum() + budget.cross_terms == pytest.approx(raw - noise, rel=1e-12)


def noisy_budgets(repeats, known):
    """Budgets of the same ladder with fresh noise; the third rung has none."""
    generator = np.random.default_rng(3)
    exact = ladder()
    sigma = {"truth": 0.05 + 0.1 * generator.random((H, W)), "one layer": np.full((H, W), 0.1), "heuristic": 0.03}
    for _ in range(repeats):
        noisy = {n: v + sigma.get(n, 0.0) * generator.standard_normal((H, W)) for n, v in exact.items()}
        variances = {n: np.square(s) for n, s in sigma.items()} if known else None
        yield evaluate.error_budget(noisy, variances=variances, n_bootstrap=0)


def test_noise_is_taken_out_without_bias():
    gram, biases = by_definition(ladder(), np.ones((H, W), bool))
    budgets = list(noisy_budgets(400, known=True))
    found = np.array([b.gram for b in budgets])
    error = found.std(axis=0, ddof=1) / math.sqrt(len(found))
    # Nine entries; four standard errors of their means.
    assert np.all(np.abs(found.mean(axis=0) - gram) < 4 * error)
    means = np.array([b.biases for b in budgets])
    assert np.all(np.abs(means.mean(axis=0) - biases) < 4 * means.std(axis=0, ddof=1) / math.sqrt(len(means)))
    # The same noise left in: the two steps beside a noisy rung grow, their product shrinks.
    raw = np.mean([b.gram for b in noisy_budgets(50, known=False)], axis=0)
    assert raw[1, 1] - gram[1, 1] == pytest.approx(0.01, rel=0.1)
    assert raw[0, 1] - gram[0, 1] == pytest.approx(-0.01, rel=0.1)
    assert raw[0, 2] - gram[0, 2] == pytest.approx(0, abs=1e-3)


def test_standard_errors_are_the_spread():
    """Pixels drawn afresh each time, independent of each other: the spread between images is the error of one."""
    images = [ladder(seed) for seed in range(300)]
    budgets = [evaluate.error_budget(rungs, block=4, n_bootstrap=400) for rungs in images]
    for name, error in (("gram", "gram_error"), ("biases", "bias_error"), ("total", "total_error")):
        spread = np.std([getattr(b, name) for b in budgets], axis=0, ddof=1)
        typical = np.sqrt(np.mean(np.square([getattr(b, error) for b in budgets]), axis=0))
        # 300 images give a standard deviation to 1/sqrt(600) = 4 %; four of these.
        assert typical == pytest.approx(spread, rel=0.16)


def test_a_bootstrap_needs_more_than_one_block():
    one = evaluate.error_budget(ladder(), block=64)
    none = evaluate.error_budget(ladder(), n_bootstrap=0)
    for budget in (one, none):
        assert budget.gram_error is budget.bias_error is budget.total_error is None
        assert "–" in repr(budget)
    first, again, other = (evaluate.error_budget(ladder(), seed=seed).total_error for seed in (1, 1, 2))
    assert first == again != other


def test_it_becomes_a_dictionary_and_a_table():
    budget = evaluate.error_budget(ladder(), variances={"truth": 0.001})
    data = json.loads(json.dumps(budget.to_dict(), allow_nan=False))
    assert data["reference"] == "truth"
    assert np.sum(data["gram"]) == pytest.approx(data["total"], rel=1e-12)
    assert np.array(data["gram_error"]).shape == (3, 3)
    assert data["noise"] == pytest.approx(0.001)
    lines = repr(budget).splitlines()
    assert [line.split("  ")[1].strip() for line in lines[2:]] == [*NAMES[1:], "cross terms", "total"]
    assert f"{budget.total:.3e}" in lines[-1]
    assert f"{budget.mean_squares[1]:.3e}" in lines[3]


def test_a_step_without_error_has_no_correlation():
    truth = ladder()["truth"]
    budget = evaluate.error_budget({"truth": truth, "same": truth, "worse": truth + 0.1})
    assert np.isnan(budget.correlations[0]).all()
    assert budget.correlations[1, 1] == pytest.approx(1)


def test_tensors_are_accepted():
    from gtao import backend

    tensor = backend.types_of(backend.default_float()).Tensor
    rungs = {name: tensor(image.astype(np.float32)) for name, image in ladder().items()}
    # float32 images.
    assert evaluate.error_budget(rungs).total == pytest.approx(evaluate.error_budget(ladder()).total, rel=1e-5)


def broken(name, value):
    rungs = ladder()
    rungs[name] = rungs[name].copy()
    rungs[name][2, 3] = value
    return rungs


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: evaluate.error_budget({"truth": np.ones((2, 2))}), ConfigError, r"two rungs, got \['truth'\]"),
        (lambda: evaluate.error_budget(ladder(), variances={"x": 0.1}), ConfigError, r"\['x'\], which are not among"),
        (lambda: evaluate.error_budget(ladder(), block=0), ConfigError, "block"),
        (lambda: evaluate.error_budget(ladder(), n_bootstrap=1), ConfigError, "n_bootstrap"),
        (lambda: evaluate.error_budget(ladder() | {"more": np.ones((2, 2))}), ShapeError, r"'more' has shape \(2, 2\)"),
        (lambda: evaluate.error_budget({"a": np.ones(3), "b": np.ones(3)}), ShapeError, r"same \(H, W\)"),
        (lambda: evaluate.error_budget(ladder(), mask=np.zeros((H, W))), ShapeError, "no pixel"),
        (lambda: evaluate.error_budget(ladder(), mask=np.ones(3)), ShapeError, r"mask has shape \(3,\)"),
        (lambda: evaluate.error_budget(broken("samples", np.nan)), ShapeError, "1 of 768 values of rung 'samples'"),
        (lambda: evaluate.error_budget(broken("truth", np.inf)), ShapeError, "rung 'truth'"),
        (lambda: evaluate.error_budget(ladder(), variances={"truth": -1.0}), ShapeError, "not negative"),
        (lambda: evaluate.error_budget(ladder(), variances={"truth": np.nan}), ShapeError, "finite"),
        (lambda: evaluate.error_budget(ladder(), variances={"truth": np.ones(3)}), ShapeError, r"shape \(3,\)"),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()


def test_what_is_masked_may_be_broken():
    mask = np.ones((H, W), bool)
    mask[2, 3] = False
    assert np.isfinite(evaluate.error_budget(broken("samples", np.nan), mask=mask).total)
