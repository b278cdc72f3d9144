"""The two ground truths of a depth buffer: against an independent marcher, closed forms, and each other."""

import numpy as np
import pytest
from analytic import _tables
from analytic._frames import frame
from oracles import closed_forms, fields, heightfield
from scipy import ndimage

import gtao
from gtao.evaluate.statistics import z_test_image

MARCH = {"n_directions": 24, "rays_per_direction": 16}
HORIZON = {"n_slices": 48, "n_nodes": 128}

#: What pieces of surface between two looks and directions between two nodes cost the dense slices in the mean:
#: against 4096 rays per pixel the bias is 1e-4 on twelve scenes of 96², and 5e-5 with twice the slices and nodes.
DISCRETISATION = 2e-4


def march(field, dtype=np.float32, **options):
    ao = gtao.ambient_occlusion(frame(field, dtype), gtao.HeightfieldRayMarch(**(MARCH | options)))
    return ao.visibility.numpy().astype(np.float64), ao.variance.numpy().astype(np.float64)


def horizon(field, dtype=np.float32, **options):
    ao = gtao.ambient_occlusion(frame(field, dtype), gtao.HeightfieldHorizon(**(HORIZON | options)))
    return ao.visibility.numpy().astype(np.float64)


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("radius", [np.inf, 0.5, 0.15], ids=["unlimited", "radius", "few pixels"])
@pytest.mark.parametrize("fetch", ["linear", "nearest"])
@pytest.mark.parametrize("name", _tables.MARCHED)
def test_both_agree_with_the_oracle(name, fetch, radius, weighting):
    """In the mean within four standard errors, and no more spread than the noise of both sides explains.

    The oracle does not know edges: on these fields there are none. Its fetch "nearest" is the same blocks.
    """
    field = _tables.MARCHED[name]()
    pixels = np.random.default_rng(5).integers(0, field.view_z.shape[0], (200, 2))
    options = {"radius": radius, "weighting": weighting}
    truth = heightfield.visibility(field, pixels, n_rays=1024, surface=fetch, seed=6, **options)
    row, column = pixels.T
    noise = np.mean(truth.standard_error**2)
    assert truth.visibility.mean() < 0.999

    got, variance = march(field, fetch=fetch, **options)
    error, noise_of_both = got[row, column] - truth.visibility, noise + variance[row, column].mean()
    assert abs(error.mean()) < 4 * np.sqrt(noise_of_both / 200)
    assert _excess(error, noise_of_both) < 5

    first, second = (horizon(field, fetch=fetch, seed=s, **options)[row, column] for s in (0, 1))
    noise_of_both = noise + np.mean((first - second) ** 2) / 2
    error = first - truth.visibility
    assert abs(error.mean()) < 4 * np.sqrt(noise_of_both / 200) + DISCRETISATION
    assert _excess(error, noise_of_both + DISCRETISATION**2) < 5


def _excess(error, noise):
    """How many of its own standard errors the mean square lies above the noise."""
    squares = error**2
    return (squares.mean() - noise) / (squares.std(ddof=1) / np.sqrt(squares.size))


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
@pytest.mark.parametrize("tilt", _tables.TILTS)
def test_an_open_plane_is_open(tilt, weighting):
    """At any tilt and anywhere in the frame. Depth is rounded: neighbours tilt the plane by 2^-24 f / cos² at most,
    that is 2.4e-5 towards the viewer and more along the tilt, where fewer directions graze."""
    for field in _tables.open_planes(tilt):
        values, variance = march(field, weighting=weighting)
        assert values.mean() > 1 - 5e-5
        assert variance.mean() < 5e-7
        assert horizon(field, weighting=weighting).min() > 1 - 2e-3
        assert horizon(field, weighting=weighting).mean() > 1 - 5e-5


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_a_trench_has_its_closed_form(weighting):
    """Walls on texel borders, known exactly to the nearest fetch; what is beyond their ends hides nothing.

    It would, to first order in the angle d/L under which it is seen: per wall of height k at distance d,
    k² d / (3π L³) (cosine) and k d / (2π L²) (uniform), half the trench's length being L.
    """
    field = fields.walls(0.5, 1.0, 1.0, 1.5, n_px=30, pixel=0.1, length_px=240)
    x = field.plane_coordinates()[0][0]
    floor = (x > -0.5) & (x < 1.0)
    left, right = x[floor] + 0.5, 1.0 - x[floor]
    form = closed_forms.walls if weighting == "cosine" else closed_forms.walls_uniform
    want = form(left, right, 1.0, 1.5)
    # The rows about the middle see the same: together they average the noise.
    rows, half_length = slice(110, 130), 11
    if weighting == "cosine":
        ends = (left + 1.5**2 * right) / (3 * np.pi * half_length**3)
    else:
        ends = (left + 1.5 * right) / (2 * np.pi * half_length**2)
    values, variance = march(field, fetch="nearest", weighting=weighting)
    error, variance = values[rows, floor] - want, variance[rows, floor]
    assert (np.abs(error.mean(axis=0)) < 5 * np.sqrt(variance.mean(axis=0) / 20) + ends).all()
    assert abs(error.mean()) < 4 * np.sqrt(variance.mean() / error.size) + np.mean(ends)
    dense = horizon(field, fetch="nearest", weighting=weighting)[rows, floor] - want
    spread = dense.std(axis=0, ddof=1) / np.sqrt(20)
    assert (np.abs(dense.mean(axis=0)) < 5 * spread + ends + DISCRETISATION).all()


@pytest.mark.parametrize("weighting", ["cosine", "uniform"])
def test_the_centre_of_a_pit_has_its_closed_form(weighting):
    """A disc of texels: between the discs half a texel's diagonal smaller and larger."""
    radius, depth, n_px = 1.0, 2.0, 61
    pixel = 3.0 / n_px
    field = fields.pit(radius, depth, n_px=n_px, pixel=pixel)
    form = closed_forms.pit if weighting == "cosine" else closed_forms.pit_uniform
    low, high = (form(radius + side * pixel / np.sqrt(2), depth) for side in (-1, 1))
    values, variance = march(field, n_directions=128, rays_per_direction=64, fetch="nearest", weighting=weighting)
    centre = n_px // 2
    sigma = np.sqrt(variance[centre, centre])
    assert low - 4 * sigma < values[centre, centre] < high + 4 * sigma
    assert sigma < 0.002
    dense = horizon(field, fetch="nearest", n_slices=256, n_nodes=256, weighting=weighting)[centre, centre]
    assert low < dense < high
    assert abs(dense - values[centre, centre]) < 4 * sigma + DISCRETISATION


def test_the_inner_wall_of_a_sphere_is_equally_open_everywhere():
    """Only matter within a reach blocks, all of it in view: 1 - (reach / 2R)², at every point (cosine)."""
    field = fields.inside_sphere(1.0, (0.3, -0.2, -0.4), size=48)
    want = closed_forms.inside_sphere_within(1.0, 0.6)
    # Where the border of the frame cuts what is within reach, less is blocked. Points are 0.6 apart at most 31 pixels.
    inner = np.s_[22:26, 22:26]
    values, variance = march(field, radius=0.6)
    assert values[inner].mean() == pytest.approx(want, abs=4 * np.sqrt(variance[inner].mean() / 16) + 1e-3)
    assert horizon(field, radius=0.6)[inner].mean() == pytest.approx(want, abs=1e-3)


def test_silhouettes_and_background_agree():
    """Broken surfaces, holes and shading normals that face away: no oracle, but two computations."""
    field = fields.in_perspective(fields.waves(0.3, 5.0), size=40, slope=(0.5, 0.2))
    view_z = field.view_z.copy()
    view_z[10:22, 8:20] *= 0.6
    view_z[25:, 28:] = np.inf
    rng = np.random.default_rng(1)
    normal = field.normal_v + 0.6 * rng.normal(size=field.normal_v.shape)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    broken = fields.Field(view_z, normal, field.camera, orthographic=False)
    assert np.mean(np.sum(normal * field.view_dirs(), axis=-1) < 0) > 0.02
    for radius in (np.inf, 0.7):
        _agree(broken, np.isfinite(view_z), radius=radius)


def _agree(g, mask, *, radius=np.inf, weighting="cosine", fetch="linear"):
    """Ray march and dense slices tell the same: in the mean of the frame, in blocks of pixels, and in spread."""
    g = frame(g) if isinstance(g, fields.Field) else g
    options = {"radius": radius, "weighting": weighting, "fetch": fetch}

    def run(method):
        ao = gtao.ambient_occlusion(g, method)
        variance = np.zeros(g.shape) if ao.variance is None else ao.variance.numpy()
        return ao.visibility.numpy().astype(np.float64), variance.astype(np.float64)

    b, variance = run(gtao.HeightfieldRayMarch(**MARCH, **options))
    c, other = (run(gtao.HeightfieldHorizon(n_slices=32, seed=s, **options))[0] for s in (0, 1))
    assert (b[~mask] == 1).all()
    assert (c[~mask] == 1).all()
    assert np.isfinite(b).all()
    assert np.isfinite(c).all()
    n = mask.sum()
    own = (c - other) ** 2 / 2
    noise = (variance + own)[mask].mean()
    error = (b - c)[mask]
    assert abs(error.mean()) < 4 * np.sqrt(noise / n) + DISCRETISATION
    # The ray march knows its own noise. Where nothing is in sight there is none.
    if noise > 1e-7:
        assert -5 < _excess(error, noise) < 5

    # Blocks of pixels are many rays each, so their means are normal; a tenth of a permille of them fails by chance.
    size = 8
    labels = (np.indices(b.shape) // size).transpose(1, 2, 0) @ np.array([1000, 1])
    blocks = np.unique(labels[mask])
    counts = ndimage.sum(mask, labels, blocks)
    means, of_variance, of_own = (
        ndimage.mean(np.where(mask, image, 0), labels, blocks) * size**2 / counts for image in (b - c, variance, own)
    )
    slack = np.sign(means) * np.minimum(np.abs(means), 2 * DISCRETISATION)
    # Within one block few pixels may hold all the noise; the frame's mean steadies the estimate.
    block_noise = (of_variance + of_own + noise) / counts
    assert z_test_image(means - slack, block_noise, np.zeros_like(means), significance=1e-4).ok


@pytest.fixture(scope="module")
def rendered():
    from gtao import render

    cache = {}

    def get(name, sensor):
        if name not in cache:
            cache.clear()
            cache[name] = render.load_scene(name, resolution=48)
        return render.gbuffer(cache[name], sensor)

    return get


def _scene_names():
    from gtao.render import scenes

    return scenes.names()


@pytest.mark.slow
@pytest.mark.parametrize("name", _scene_names())
def test_both_agree_on_every_embedded_scene(rendered, name):
    from gtao.render import scenes

    info = scenes.get(name)
    for sensor in range(len(info.views)):
        g = rendered(name, sensor)
        mask = np.array(g.mask).astype(bool)
        for radius, weighting in ((info.radius, "cosine"), (np.inf, "cosine"), (info.radius, "uniform")):
            _agree(g, mask, radius=radius, weighting=weighting)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["city", "foliage"])
def test_both_agree_on_blocks(rendered, name):
    g = rendered(name, 0)
    _agree(g, np.array(g.mask).astype(bool), radius=1.0, fetch="nearest")
