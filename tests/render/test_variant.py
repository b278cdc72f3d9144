"""Which Mitsuba variant is used; each choice in a process of its own, as it is made once."""

import subprocess
import sys
import textwrap


def run(body):
    script = "from gtao import render\nimport mitsuba as mi\n" + textwrap.dedent(body)
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=120)
    assert result.returncode == 0, result.stderr
    return result.stdout.strip()


def test_import_sets_no_variant_and_the_first_call_does():
    out = run(
        """
        assert mi.variant() is None
        render.load_scene({"type": "scene"})
        print(mi.variant())
        """
    )
    assert out in ("llvm_ad_rgb", "cuda_ad_rgb")


def test_the_users_variant_stays_and_works():
    out = run(
        """
        mi.set_variant("llvm_ad_mono")
        scene = render.load_scene("stairs", resolution=16)
        g = render.gbuffer(scene)
        t = render.transport(scene, g, n_bounces=2, spp=16)
        print(mi.variant(), g.albedo.shape == (16, 16, 3), float(g.albedo.numpy().max()), 0 < t.visibility.mean() < 1)
        """
    )
    # Mitsuba itself remarks on the film's pixel format before.
    assert out.endswith("llvm_ad_mono True 0.5 True")


def test_spectral_variants_have_no_albedo():
    out = run(
        """
        import gtao
        mi.set_variant("llvm_ad_spectral")
        scene = render.load_scene("stairs", resolution=16)
        try:
            render.gbuffer(scene)
        except gtao.SceneError as error:
            print(error)
        print(render.gbuffer(scene, albedo=False))
        """
    )
    assert out == (
        "albedo needs an rgb or mono variant, not llvm_ad_spectral; pass albedo=False\n"
        "GBuffer(16x16, perspective, view_to_world)"
    )


def test_light_has_three_colours():
    out = run(
        """
        import gtao
        mi.set_variant("llvm_ad_mono")
        scene = render.load_scene("stairs", resolution=16)
        for request in (render.environment, render.irradiance):
            try:
                request(scene)
            except gtao.SceneError as error:
                print(error)
        print(render.directional(scene, spp=16))
        """
    )
    refusal = "light in linear RGB needs an rgb variant of Mitsuba, not llvm_ad_mono\n"
    assert out.endswith(2 * refusal + "DirectionalVisibility(16x16, order 2, 16 rays per pixel)")


def test_a_scalar_variant_is_refused():
    out = run(
        """
        import gtao
        mi.set_variant("scalar_rgb")
        try:
            render.load_scene("stairs")
        except gtao.BackendError as error:
            print(error)
        """
    )
    assert out.startswith("the Mitsuba variant scalar_rgb cannot trace arrays of rays; call mitsuba.set_variant('llvm")
