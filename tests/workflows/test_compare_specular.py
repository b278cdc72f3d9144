"""The comparison of specular occlusion, small."""

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

import gtao
from gtao import cli, evaluate, io, lighting, render, tables, workflows
from gtao.workflows.lighting import lights
from gtao.workflows.specular import composites, cone_shaped, frames, measuring
from gtao.workflows.specular import tables as rows

SMALL = {"resolution": 24, "spp": 64, "lit_spp": 64}
METHODS = ("cone-brdf", "brdf-4d", "brdf-4d-published", "cone-cone-published", "lagarde", "unoccluded")
TRACED, DENSE = "ray-traced visibility", "dense slices"
SOURCES = (TRACED, DENSE, "few slices, filtered", "recommended pipeline")
SPLITS = ("two splits", "three splits", "S traced, light pre-filtered", "S traced, light traced")
SPLITS += ("no occlusion, light traced",)
SEEN = {"n_batches": 2}


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    folder = tmp_path_factory.mktemp("specular") / "out"
    config = workflows.CompareSpecularConfig(
        scenes=("corner_boxes", "trench"),
        roughness=(0.3, 0.6),
        environments=("gradient", "vmf:4"),
        lit_roughness=(0.6,),
        methods=METHODS,
        turn=120,
        **SMALL,
    )
    return workflows.compare_specular(config, folder), folder


@pytest.fixture(scope="module")
def frame():
    config = workflows.CompareSpecularConfig(scenes=("corner_boxes",), roughness=(0.3,), **SMALL)
    (one,) = frames.glossy_frames("corner_boxes", "corner_boxes", config, lambda _: lambda *_: None)
    return one


def view():
    """Scene, frame, mask and radius of the first frame."""
    scene = render.load_scene("corner_boxes", resolution=24)
    g = render.gbuffer(scene)
    return scene, g, g.mask.numpy(), render.scenes.get("corner_boxes").radius


def errors(table, source, frame=0):
    return {m.name: m.metrics for m in table.scenes[frame].methods if m.group == source}


def dense(g, radius, weighting):
    method = gtao.GTAO(radius=radius, n_slices=32, n_steps=32, weighting=weighting, bent_normal=True)
    return gtao.ambient_occlusion(g, method)


def test_everything_is_written_and_listed(outcome):
    result, folder = outcome
    record = io.read_record(folder / "record.json")
    assert {k: v for k, v in record.items() if k != "schema"} == json.loads(json.dumps(result.record))
    listed = {entry["path"] for entry in record["outputs"]}
    assert {p.name for p in folder.iterdir()} == listed | {"record.json", "report.html"}
    domes = {f"{name}_{source}.png" for name in ("corner_boxes_0.3", "trench_0.6")
             for source in ("dense-slices", "ray-traced-visibility")}  # fmt: skip
    # The first frame under every light, the second under one of them.
    lit = {"corner_boxes_gradient-roughness-0.6.png", "corner_boxes_vmf-4-roughness-0.6.png"}
    lit |= {"trench_vmf-4-roughness-0.6.png"}
    texts = {"specular.csv", "specular.md", "lit.csv"}
    assert listed == domes | lit | texts | {"methods.png", "steps.png", "lit.png"}
    page = (folder / "report.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert all(word in page for word in ("vmf:4", *METHODS, *SOURCES, *SPLITS, "light alone", cone_shaped.CLOSURE))
    assert [entry["turn"] for entry in record["inputs"]] == [0, 120]
    assert all(0 < entry["tilt"] < 60 for entry in record["inputs"])
    found = list(csv.DictReader((folder / "specular.csv").read_text().splitlines()))
    keys = {(r["frame"], r["roughness"], r["source"], r["method"]) for r in found}
    assert keys == {
        (f, r, s, m) for f in ("corner_boxes", "trench") for r in ("0.3", "0.6") for s in SOURCES for m in METHODS
    }
    assert len(list(csv.DictReader((folder / "lit.csv").read_text().splitlines()))) == 2 * 2 * (
        4 * len(METHODS) + len(SPLITS) + 1
    )


@pytest.mark.parametrize("roughness", ["0.3", "0.6"])
def test_the_numbers_are_those_of_the_images(outcome, roughness):
    """Errors from the definition, with everything estimated anew."""
    result, _ = outcome
    scene, g, mask, radius = view()
    given = (scene, g, float(roughness), 0.04, radius, 32)
    a, b = (render.specular(*given, seed, **SEEN).occlusion.mean.numpy().astype(float) for seed in (0, 1))
    truth, variance = (a + b) / 2, (a - b) ** 2 / 4
    cosine, uniform = dense(g, radius, "cosine"), dense(g, radius, "uniform")
    for name, ao, method in (
        ("cone-brdf", uniform, gtao.ConeBRDF(aperture="seed")),
        ("brdf-4d", uniform, gtao.ConeTable(aperture="seed")),
        ("brdf-4d-published", cosine, gtao.ConeTable(aperture="seed")),
        ("cone-cone-published", cosine, gtao.ConeCone(aperture="seed")),
        ("lagarde", cosine, gtao.Lagarde2014()),
    ):
        image = gtao.specular_occlusion(ao, g, float(roughness), 0.04, method).numpy().astype(float)
        error = (image - truth)[mask]
        expected = math.sqrt(np.mean(error**2) - variance[mask].mean())
        found = errors(result.comparison.tables[roughness], DENSE)[name]
        assert found["rmse"] == pytest.approx(expected, rel=1e-5), name
        assert found["bias"] == pytest.approx(error.mean(), abs=1e-6), name
    images = []
    for seed in (2, 4):
        seen = render.visibility(scene, g, radius, 32, seed, **SEEN)
        ao = gtao.AmbientOcclusion(visibility=seen.mean)
        images.append(gtao.specular_occlusion(ao, g, float(roughness), 0.04, gtao.Lagarde2014()).numpy().astype(float))
    error, noise = (sum(images) / 2 - truth)[mask], ((images[0] - images[1]) ** 2 / 4 + variance)[mask]
    found = errors(result.comparison.tables[roughness], TRACED)["lagarde"]
    assert found["rmse"] == pytest.approx(math.sqrt(np.mean(error**2) - noise.mean()), rel=1e-5)
    open_ = errors(result.comparison.tables[roughness], DENSE)["unoccluded"]
    assert open_["bias"] == pytest.approx(1 - truth[mask].mean())


def test_steps_are_differences_of_images(outcome):
    result, _ = outcome
    scene, g, mask, radius = view()
    truths = [
        render.specular(scene, g, 0.3, 0.04, radius, 32, seed, **SEEN).occlusion.mean.numpy().astype(float)
        for seed in (0, 1)
    ]

    def occlusion(ao, method):
        return gtao.specular_occlusion(ao, g, 0.3, 0.04, method).numpy().astype(float)

    exact, table = gtao.ConeBRDF(aperture="seed"), gtao.ConeTable(aperture="seed")
    traced, looked_up = [], []
    for seed in (3, 5):
        seen = render.visibility(scene, g, radius, 32, seed, weighting="uniform", **SEEN)
        given = {"visibility": seen.mean, "mean_direction": seen.mean_direction, "normal_v": g.normal_v}
        ao = gtao.AmbientOcclusion(**given, config=gtao.GTAO(weighting="uniform"))
        traced.append(occlusion(ao, exact))
        looked_up.append(occlusion(ao, table))
    slices = occlusion(dense(g, radius, "uniform"), exact)
    pairs = {
        "visibility is a cone": (truths, traced),
        "no azimuth, table": (traced, looked_up),
        "depth buffer": (traced, [slices, slices]),
    }
    found = result.record["numbers"]["steps"]["0.3"]["corner_boxes"]
    assert set(found) == {*pairs, "few slices, filter", "published aperture"}
    for name, (before, after) in pairs.items():
        a, b = (y - x for x, y in zip(before, after, strict=True))
        square = ((a + b) / 2) ** 2 - ((a - b) / 2) ** 2
        assert found[name] == pytest.approx(math.sqrt(square[mask].mean()), rel=1e-4), name
    both = result.record["numbers"]["steps"]["0.3"]
    assert result.comparison.steps["0.3"]["depth buffer"] == pytest.approx(
        (both["corner_boxes"]["depth buffer"] + both["trench"]["depth buffer"]) / 2
    )


def test_composites_are_products_of_public_factors(outcome):
    """Under a lobe of light, put together by the functions that a user would call."""
    result, _ = outcome
    scene, g, mask, radius = view()
    (light,) = lights.lights(["vmf:4"])
    environment = lights.placed(light, "z", 0)
    given = {"environment": environment}
    traced = render.specular(scene, g, 0.6, 0.04, radius, 64, 6, **given)
    other = render.specular(scene, g, 0.6, 0.04, radius, 64, 7, **given)
    split = render.split_integrals(scene, g, 0.6, radius, 64, 8, **given)
    truth = traced.radiance.mean.numpy()[mask].astype(float)
    L = lighting.prefilter(environment, (0.6,)).lookup(
        gtao.reflected_directions(g, render.view_to_world(scene)).numpy(), 0.6
    )
    L = L.astype(np.float32)
    ao = dense(g, radius, "cosine")
    lagarde = gtao.specular_occlusion(ao, g, 0.6, 0.04, gtao.Lagarde2014())
    above = split.above.mean.numpy()
    images = {
        ("traced factors", "two splits"): (1.0, split.radiance.mean.numpy() / np.maximum(above, 1e-6)[..., None]),
        ("traced factors", "three splits"): (split.visibility.mean.numpy() / np.maximum(above, 1e-6), L),
        ("traced factors", "S traced, light pre-filtered"): (other.occlusion.mean, L),
        (DENSE, "lagarde"): (lagarde, L),
        (DENSE, "unoccluded"): (1.0, L),
    }
    table = result.comparison.lit["vmf:4"]["0.6"]
    for (source, name), (s, light_) in images.items():
        image = gtao.specular_radiance(s, light_, g, 0.6, 0.04).numpy()[mask].astype(float)
        found = errors(table, source)[name]
        assert found["bias"] == pytest.approx((image - truth).mean() / truth.mean(), abs=2e-4), name
        if source == DENSE:  # no noise of its own
            square = np.mean((image - truth) ** 2) - traced.radiance.variance.numpy()[mask].mean()
            assert found["rmse"] == pytest.approx(math.sqrt(square) / truth.mean(), rel=2e-3), name
    free = other.unoccluded.mean.numpy()[mask]
    found = errors(table, "traced factors")["no occlusion, light traced"]["bias"]
    assert found == pytest.approx((free - truth).mean() / truth.mean(), abs=1e-5)


def test_the_light_turns_from_frame_to_frame(outcome):
    result, _ = outcome
    scene = render.load_scene("trench", resolution=24)
    g = render.gbuffer(scene)
    (light,) = lights.lights(["vmf:4"])
    environment = lights.placed(light, "z", 120)
    radius = render.scenes.get("trench").radius
    traced = render.specular(scene, g, 0.6, 0.04, radius, 64, 6, environment=environment)
    truth = traced.radiance.mean.numpy()[g.mask.numpy()].astype(float)
    L = lighting.prefilter(environment, (0.6,)).lookup(
        gtao.reflected_directions(g, render.view_to_world(scene)).numpy(), 0.6
    )
    image = gtao.specular_radiance(1.0, L.astype(np.float32), g, 0.6, 0.04).numpy()[g.mask.numpy()]
    found = errors(result.comparison.lit["vmf:4"]["0.6"], DENSE, 1)["unoccluded"]
    assert found["bias"] == pytest.approx((image - truth).mean() / truth.mean(), abs=2e-4)


def test_under_a_white_dome_composites_are_exact_with_the_true_occlusion(frame):
    """White-dome exactness: what is left is noise, and what methods miss is their error of S times F."""
    config = workflows.CompareSpecularConfig(methods=("lagarde", "unoccluded"), **SMALL)
    white = lights.Light("white", lighting.EnvironmentMap(np.ones((16, 32, 3), np.float32)), {})
    found = measuring.Occlusions(frame, config.f0)
    pair = composites.measure_lit(found, *composites.Probe(white, (0.3,)).placed("z", 0), 0.3, config)
    assert pair is not None
    comparison, lit = pair
    factors = errors_of(comparison, "traced factors")
    # Mean squares of a few hundred pixels are known to some ten per cent of their noise.
    for name in ("S traced, light pre-filtered", "S traced, light traced"):
        assert factors[name]["rmse"] < 0.6 * comparison.noise, name
        assert abs(factors[name]["bias"]) < 0.01
    # The environment BRDF from a table, A and B right to 1e-3, against rays: noise of a mean of some hundred pixels.
    assert abs(errors_of(comparison, "light alone")["light alone"]["bias"]) < 5e-3
    F = gtao.environment_brdf(frame.view.g, 0.3).numpy() @ [config.f0, 1]
    mask = frame.view.mask
    image, _ = lit.images[DENSE]["lagarde"]
    occlusion, _ = found.image(DENSE, "lagarde", 0.3)
    assert image[mask] == pytest.approx((occlusion * F)[mask][:, None].repeat(3, 1), rel=1e-5)


def errors_of(scene, source):
    return {m.name: m.metrics for m in scene.methods if m.group == source}


def test_a_probe_turns_with_its_light():
    (light,) = lights.lights(["vmf:20"])
    probe = composites.Probe(light, (0.5, 0.2))
    directions = np.random.default_rng(0).normal(size=(50, 3))
    for up, turn in (("y", 0), ("z", 77)):
        environment, levels = probe.placed(up, turn)
        assert environment.lookup(directions) == pytest.approx(lights.placed(light, up, turn).lookup(directions))
        anew = lighting.prefilter(environment, (0.2, 0.5))
        for roughness in (0.2, 0.5):
            assert levels.lookup(directions, roughness) == pytest.approx(anew.lookup(directions, roughness))


class TestConeShaped:
    def test_the_reference_is_the_quadrature_of_the_tables(self):
        given = cone_shaped.Cones(math.radians(50), seed=3)
        some = (slice(0, 4), slice(0, 5))
        wo, n = np.array([0.0, 0.0, 1.0]), given.n[some]
        reflected = 2 * n[..., 2:] * n - wo
        cos_b = (given.axis[some] * reflected).sum(-1)
        inward = n - (n * reflected).sum(-1, keepdims=True) * reflected
        inward /= np.linalg.norm(inward, axis=-1, keepdims=True)
        aside = np.cross(reflected, inward)
        axis = given.axis[some]
        chi = np.arctan2(np.abs((axis * aside).sum(-1)), (axis * inward).sum(-1))
        alpha_v, beta, theta_o = np.arccos(given.cos_v[some]), np.arccos(cos_b), np.arccos(n[..., 2])
        for azimuth, angle in ((True, chi), (False, 0 * chi)):
            found = tables.cone_terms(alpha_v, beta, given.alpha[some], theta_o, angle).values
            whole = tables.hemisphere_terms(given.alpha[some], theta_o).values
            for f0 in (0.04, 1.0):
                expected = (found @ [f0, 1]) / (whole @ [f0, 1])
                assert given.occlusion(f0, azimuth=azimuth)[some] == pytest.approx(expected, abs=2e-4)

    def test_methods_are_told_the_true_cone(self):
        given = cone_shaped.Cones(math.radians(90), seed=3)
        for f0 in (0.04, 1.0):
            method = gtao.ConeBRDF(aperture="matched", n_nodes=48)
            image = gtao.specular_occlusion(given.ao, given.g, given.roughness, f0, method).numpy()
            # Single precision: matched apertures near the hemisphere are right to the root of its steps.
            assert evaluate.rmse(image, given.occlusion(f0)) < 1e-3

    def test_visibility_is_that_of_the_cut_cones(self):
        given = cone_shaped.Cones(math.radians(90), seed=3)
        k = np.arange(4096) + 0.5
        z, turn = 1 - k / 4096, 2.399963229728653 * k
        w = np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=-1)
        for at in ((0, 0), (3, 7), (20, 40), (63, 63)):
            n = given.n[at]
            # Spiral of directions about the normal: half a turn about the bisector takes z to it.
            half = n + np.array([0, 0, 1])
            half /= np.linalg.norm(half)
            seen = (2 * (w @ half)[:, None] * half - w) @ given.axis[at] > given.cos_v[at]
            assert given.ao.visibility.numpy()[at] == pytest.approx(seen.mean(), abs=5e-3)
            assert given.ao.cosine_visibility.numpy()[at] == pytest.approx(2 * (seen * z).mean(), abs=5e-3)

    def test_tables_gain_what_theory_says(self):
        """Where bent normals lie within 50 degrees of the normal, and F0 = 1, quadrature of other code says 0.034."""
        found = cone_shaped.cone_shaped(("brdf-4d", "brdf-4d-tilted", "cone-lobe", "lagarde", "unoccluded"), 0)
        assert set(found["1"]["50"]) == {cone_shaped.CLOSURE, "brdf-4d", "cone-lobe", "lagarde"}
        assert found["1"]["50"][cone_shaped.CLOSURE] == pytest.approx(0.034, abs=0.002)
        assert found["1"]["50"]["brdf-4d"] == pytest.approx(0.034, abs=0.004)
        for tilts in found.values():
            closures = [tilts[str(tilt)][cone_shaped.CLOSURE] for tilt in cone_shaped.TILTS]
            assert closures == sorted(closures)
            assert tilts["50"]["lagarde"] > 4 * tilts["50"]["brdf-4d"]


def test_means_over_frames_and_light(outcome):
    result, _ = outcome
    comparison = result.comparison
    for roughness, table in comparison.tables.items():
        both = [errors(table, DENSE, i)["lagarde"]["rmse"] for i in (0, 1)]
        assert comparison.means[DENSE][roughness]["lagarde"] == pytest.approx(np.mean(both))
    all_ = [
        errors(comparison.lit[n]["0.6"], DENSE, i)["lagarde"]["rmse"] for n in ("gradient", "vmf:4") for i in (0, 1)
    ]
    assert comparison.lit_means["0.6"][DENSE]["lagarde"] == pytest.approx(np.mean(all_))
    text = rows.markdown_text(comparison.means)
    assert f"{comparison.means[DENSE]['0.3']['lagarde']:.4f}" in text


def test_an_open_plane_is_right_for_all(tmp_path):
    config = workflows.CompareSpecularConfig(scenes=("open_plane",), roughness=(0.4,), environments=("none",), **SMALL)
    result = workflows.compare_specular(config, tmp_path / "out")
    assert result.comparison.lit == {}
    assert not (tmp_path / "out" / "lit.csv").exists()
    found = errors(result.comparison.tables["0.4"], DENSE)
    assert set(found) == set(workflows.SPECULAR_METHODS)
    for name, row in found.items():
        # A lobe about the reflection reaches below the plane, which covers that part.
        if not name.startswith(("cone-lobe", "cone-cone")):
            assert row["rmse"] < 0.02, name
    assert result.record["command"][-1] == "0"
    assert [w for w in result.record["command"] if w in ("--environment", "none")] == ["--environment", "none"]


def test_the_truth_and_what_methods_are_given_share_no_rays(frame):
    a, b = frame.truths[0.3]
    assert np.abs(a - b).max() > 1e-3
    first, second = frame.given[TRACED]
    for weighting in ("cosine", "uniform"):
        assert np.abs(first[weighting].visibility.numpy() - second[weighting].visibility.numpy()).max() > 1e-3


def test_the_refitted_cone_is_that_of_the_record():
    fit = io.read_record(Path(__file__).parents[2] / "fits" / "aperture" / "2026-11" / "record.json")
    best = fit["numbers"]["uniform"]["best"]["u"]
    assert workflows.SPECULAR_METHODS["cone-cone-refit"] == gtao.ConeCone(u=float(f"{best:.2g}"), aperture="seed")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"methods": ("magic",)}, "method must be one of"),
        ({"methods": ("lagarde", "lagarde")}, "methods given more than once"),
        ({"roughness": (1.5,)}, "roughness must lie"),
        ({"roughness": ()}, "roughness must lie"),
        ({"lit_roughness": (-0.5,)}, "lit_roughness must lie"),
        ({"roughness": (0.5, 0.5)}, "more than once"),
        ({"f0": 2.0}, "f0 must lie"),
        ({"environments": ("none", "gradient")}, "goes with no other"),
        ({"radius": {"stairs": -1.0}}, "radius must be positive"),
        ({"up": "w"}, "up must be one of"),
        ({"turn": 400.0}, "turn must be"),
        ({"spp": 40}, "spp must be a multiple of 16"),
        ({"lit_spp": 16}, "lit_spp must be a multiple of 16"),
        ({"resolution": 8}, "at least 16"),
        ({"seed": -1}, "seed must lie"),
    ],
)
def test_wrong_settings_are_told(options, words):
    with pytest.raises(gtao.ConfigError, match=words):
        workflows.CompareSpecularConfig(**options)


def test_the_command(tmp_path, monkeypatch, capsys):
    folder = tmp_path / "out"
    options = ["--quick", "--resolution", "16", "--roughness", "0.5", "--environment", "none", "--method", "lagarde"]
    monkeypatch.setattr("sys.argv", ["gtao", "compare-specular", "trench", "-o", str(folder), *options])
    with pytest.raises(SystemExit) as ending:
        cli.main()
    assert ending.value.code == 0
    assert "lagarde" in capsys.readouterr().out
    record = io.read_record(folder / "record.json")
    assert record["config"]["methods"] == ["lagarde"]
    assert record["config"]["environments"] == ["none"]
    monkeypatch.setattr("sys.argv", ["gtao", "compare-specular", "trench", "-o", str(folder), "--method", "magic"])
    with pytest.raises(SystemExit) as ending:
        cli.main()
    assert ending.value.code == 2
    assert "method must be one of" in capsys.readouterr().err
