"""Errors by circumstance: the bins are right, and so are the circumstances."""

import json

import numpy as np
import pytest

from gtao import evaluate
from gtao.errors import ConfigError, ShapeError

H, W, FOCAL = 40, 60, 50.0


def rays():
    """Through pixel centres of a pinhole camera, (H, W, 3), z = -1."""
    y, x = np.mgrid[:H, :W] + 0.5
    return np.stack([(x - W / 2) / FOCAL, -(y - H / 2) / FOCAL, -np.ones((H, W))], axis=-1)


def plane(normal, distance):
    """Points and normals of the plane <normal, x> = -distance; behind the camera NaN."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    along = rays() @ normal
    t = np.where(along < 0, -distance / along, np.nan)
    return rays() * t[..., None], np.broadcast_to(normal, (H, W, 3)).copy()


def nearest(*surfaces):
    """The surface in front, pixel by pixel."""
    P, N = surfaces[0]
    P, N = P.copy(), N.copy()
    for Q, M in surfaces[1:]:
        front = np.isfinite(Q[..., 2]) & ~(Q[..., 2] <= P[..., 2])
        P[front], N[front] = Q[front], M[front]
    return P, N


def sphere(centre, radius):
    d = rays() / np.linalg.norm(rays(), axis=-1, keepdims=True)
    b = d @ np.asarray(centre)
    disc = b**2 - np.dot(centre, centre) + radius**2
    P = d * np.where(disc >= 0, b - np.sqrt(np.maximum(disc, 0)), np.nan)[..., None]
    return P, (P - centre) / radius


def test_bins_by_hand():
    image = np.array([[0.1, 0.5, 0.9, 0.4], [0.2, 0.3, 0.8, 0.7]])
    reference = np.array([[0.0, 0.5, 0.5, 0.5], [0.5, 0.5, 0.5, 0.5]])
    quantity = np.array([[0.0, 1.0, 1.5, 2.0], [np.nan, -1.0, 2.5, 0.5]])
    variance = np.array([[0.001, 0.002, 0.003, 0.5], [1.0, 1.0, 1.0, 0.003]])
    mask = np.array([[True, True, True, True], [True, True, True, True]])
    mask[0, 0] = False
    table = evaluate.stratify(
        image, reference, by={"q": quantity}, edges={"q": (0, 1, 2, 2.2)}, mask=mask, variance=variance
    )["q"]
    # First bin: the pixel at 0.5. Second: those at 1 and 1.5. Third: the one at 2. The rest is outside or masked.
    assert table.name == "q"
    assert table.count.tolist() == [1, 2, 1]
    assert table.rmse == pytest.approx([0.2, np.sqrt(0.16 / 2), 0.1])
    assert table.bias == pytest.approx([0.2, 0.2, -0.1])
    assert table.mae == pytest.approx([0.2, 0.2, 0.1])
    assert table.noise == pytest.approx(np.sqrt([0.003, 0.0025, 0.5]))
    assert table.corrected_rmse == pytest.approx([np.sqrt(0.04 - 0.003), np.sqrt(0.08 - 0.0025), 0.0])


def test_the_last_edge_belongs_to_the_last_bin():
    values = np.array([[0.0, 1.0, 2.0]])
    counts = [
        evaluate.stratify(values, values, by={"q": values}, edges={"q": edges})["q"].count.tolist()
        for edges in ((0, 1, 2), (0, 1, np.inf), (0.5, 0.9))
    ]
    assert counts == [[1, 2], [1, 2], [0]]


def test_bins_without_pixels_and_the_dictionary():
    values = np.array([[0.5, 3.0]])
    table = evaluate.stratify(values + 0.1, values, by={"q": values}, edges={"q": (0, 1, 2, np.inf)})["q"]
    assert np.isnan(table.rmse[1])
    data = json.loads(json.dumps(table.to_dict(), allow_nan=False))
    assert data["edges"] == [0, 1, 2, "inf"]
    assert data["count"] == [1, 0, 1]
    assert data["rmse"][1] is None
    assert data["rmse"][0] == data["corrected_rmse"][0] == pytest.approx(0.1)
    assert data["noise"] == [0, None, 0]
    lines = repr(table).splitlines()
    assert len(lines) == 5
    assert lines[2].split() == ["0", "1", "1", "0.1000", "0.1000", "+0.1000", "0.0000"]


def test_strata_add_up_to_the_whole():
    generator = np.random.default_rng(0)
    P, N = plane((0, 1, 0.1), 1.0)
    reference = generator.random((H, W))
    image = reference + 0.1 * generator.standard_normal((H, W))
    mask = P[..., 2] > -20
    variance = 0.001 * generator.random((H, W))
    tables = evaluate.stratify(image, reference, by=evaluate.strata_of(P, N, reference), mask=mask, variance=variance)
    assert list(tables) == list(evaluate.STRATA_EDGES)
    for table in tables.values():
        used = table.count > 0
        assert table.count.sum() == mask.sum()
        share = table.count[used] / mask.sum()
        assert share @ table.rmse[used] ** 2 == pytest.approx(evaluate.mse(image, reference, mask=mask))
        assert share @ table.bias[used] == pytest.approx(evaluate.bias(image, reference, mask=mask))
        assert share @ table.noise[used] ** 2 == pytest.approx(evaluate.noise_floor(variance, mask=mask) ** 2)


def test_tilt_is_the_angle_to_the_camera():
    P, N = plane((0, 0, 1), 2.0)
    tilt = evaluate.strata_of(P, N, np.ones((H, W)))["tilt"]
    assert tilt == pytest.approx(np.arccos(1 / np.linalg.norm(rays(), axis=-1)))
    parallel = evaluate.strata_of(P, N, np.ones((H, W)), view_dir=(0, 0, 1))["tilt"]
    assert np.all(parallel == 0)
    away = evaluate.strata_of(P, -N, np.ones((H, W)), view_dir=np.broadcast_to((0, 0, 1), P.shape))["tilt"]
    assert away == pytest.approx(np.full((H, W), np.pi))


def test_image_radius_and_visibility():
    P, N = plane((0, 0, 1), 2.0)
    found = evaluate.strata_of(P, N, np.full((H, W), 1.25))
    radius = found["image radius"]
    assert radius[0, 0] == pytest.approx(np.hypot(29.5, 19.5) / np.hypot(30, 20))
    assert radius.min() == radius[H // 2, W // 2] == pytest.approx(np.hypot(0.5, 0.5) / np.hypot(30, 20))
    assert np.all(found["visibility"] == 1)


def test_no_plane_and_no_crease_is_a_depth_edge():
    floor, wall = plane((0, 1, 0), 1.0), plane((0, 0, 1), 6.0)
    # Neighbouring rows of the floor lie up to a third of their depth apart.
    for P, N in (floor, nearest(floor, wall)):
        seen = np.isfinite(P[..., 2])
        below = np.s_[:-1] if seen.all() else np.s_[H // 2 + 1 :]
        assert np.all(evaluate.strata_of(P[below], N[below], np.ones(P[below].shape[:2]))["depth edge"] == np.inf)
    step = np.abs(np.diff(floor[0][H // 2 + 1 :, 0, 2])) / -floor[0][H // 2 + 1 : -1, 0, 2]
    assert step.max() > 0.3


@pytest.mark.parametrize("background", [np.nan, 0.0])
def test_a_round_silhouette_is_a_depth_edge(background):
    ball = sphere(np.array([0.0, 0.0, -4.0]), 1.0)
    inside = np.isfinite(ball[0][..., 2])
    rim = inside & ~(np.roll(inside, 1, 0) & np.roll(inside, -1, 0) & np.roll(inside, 1, 1) & np.roll(inside, -1, 1))
    outer = ~inside & (np.roll(inside, 1, 0) | np.roll(inside, -1, 0) | np.roll(inside, 1, 1) | np.roll(inside, -1, 1))
    alone = np.where(inside[..., None], ball[0], background), np.where(inside[..., None], ball[1], background)
    for P, N in (nearest(plane((0, 0, 1), 6.0), ball), alone):
        found = evaluate.strata_of(P, N, np.ones((H, W)))
        assert np.array_equal(found["depth edge"] == 0, rim | outer)
        # Distances are Euclidean, between pixel centres.
        corner = np.argwhere(rim | outer) - (0, 0)
        assert found["depth edge"][0, 0] == pytest.approx(np.sqrt((corner**2).sum(axis=1).min()))
        assert np.array_equal(np.isnan(found["tilt"]), P[..., 2] >= 0) or np.isnan(background)
    assert np.array_equal(np.isnan(found["tilt"]), ~inside)


def test_the_step_decides_what_an_edge_is():
    P, N = nearest(plane((0, 0, 1), 4.0), sphere(np.array([0.0, 0.0, -4.0]), 0.5))
    # The silhouette stands 1/16 of 4 - … in front of the wall: at its rim at most 0.125 of the depth.
    fine, coarse = (evaluate.strata_of(P, N, np.ones((H, W)), edge_step=s)["depth edge"] for s in (0.001, 0.5))
    assert np.any(fine == 0)
    assert np.all(coarse == np.inf)


def test_strata_accept_a_g_buffer():
    import gtao

    view_z = np.full((H, W), 2.0, np.float32)
    view_z[:, :5] = np.inf
    g = gtao.GBuffer(view_z, None, gtao.PerspectiveCamera(W, H, 0.8))
    found = evaluate.strata_of(g.position_v, g.normal_v, np.ones((H, W)))
    assert np.isnan(found["tilt"][:, :5]).all()
    assert np.isfinite(found["tilt"][:, 5:]).all()
    assert np.array_equal(found["depth edge"][0, :9], [4, 3, 2, 1, 0, 0, 1, 2, 3])


Z = np.zeros((2, 3))


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: evaluate.stratify(Z, Z, by={"q": Z}), ConfigError, "no edges for 'q'"),
        (lambda: evaluate.stratify(Z, Z, by={"q": Z}, edges={"q": (0, 0)}), ConfigError, "ascending"),
        (lambda: evaluate.stratify(Z, Z, by={"q": Z}, edges={"q": (1,)}), ConfigError, "at least two"),
        (lambda: evaluate.stratify(Z, Z[:1], by={}), ShapeError, r"\(2, 3\) and reference \(1, 3\)"),
        (lambda: evaluate.stratify(Z, Z, by={"tilt": Z[0]}), ShapeError, r"by\['tilt'\] \(3,\)"),
        (lambda: evaluate.stratify(Z, Z, by={}, mask=Z[0]), ShapeError, r"mask \(3,\)"),
        (lambda: evaluate.stratify(Z, Z, by={}, variance=0.1), ShapeError, r"variance \(\)"),
        (lambda: evaluate.stratify(Z + np.nan, Z, by={"tilt": Z}), ShapeError, "NaN"),
        (lambda: evaluate.stratify(Z, Z, by={"tilt": Z}, variance=Z - 1), ShapeError, "negative"),
        (lambda: evaluate.strata_of(Z, Z, Z), ShapeError, r"position_v \(2, 3\)"),
        (
            lambda: evaluate.strata_of(np.zeros((2, 3, 3)), np.zeros((2, 3, 3)), Z, edge_step=0),
            ConfigError,
            "edge_step",
        ),
    ],
)
def test_refusals(call, error, message):
    with pytest.raises(error, match=message):
        call()
