"""Presets whose lengths all follow from one radius: its gradient is that of every number made from it."""

from dataclasses import replace

import numpy as np
import pytest
from gradients._attached import DEPTH, NORMALS, attach, camera, check_numbers, image, tensor

import gtao
from gtao.config import engines


def preset(make):
    """``build`` for a preset made from its radius, without its filter."""

    def build(values):
        method = make(values["radius"])
        return gtao.GBuffer(tensor(DEPTH), tensor(NORMALS), camera("perspective")), getattr(method, "occlusion", method)

    return build


#: Presets of other methods count sectors, which has no gradient.
PRESETS = {
    "as published": gtao.GTAO.as_published,
    "as published, linear fetch": lambda r: gtao.GTAO.as_published(r, fetch="linear"),
    "as published, faded": lambda r: gtao.GTAO.as_published(r, small_radius_fade=True),
    "one number for radius and falloff": lambda r: gtao.GTAO(radius=r, falloff=gtao.QuadraticFalloff(end=r)),
    # A square root made of bits is a staircase to differences.
    "XeGTAO": lambda r: replace(gtao.GTAO.xegtao("high", r), arccosine="two_term"),
    "XeGTAO, one slice": lambda r: replace(gtao.GTAO.xegtao("low", r), arccosine="two_term"),
    "HDRP": engines.hdrp,
    "HDRP, temporal": lambda r: engines.hdrp(r, temporal=True),
    "Filament": engines.filament,
    "three.js node": lambda r: engines.threejs("node", r),
    "three.js WebGL": lambda r: engines.threejs("webgl", r),
}


@pytest.mark.parametrize("name", PRESETS)
def test_both_modes_are_the_derivative(name):
    found = check_numbers(preset(PRESETS[name]), {"radius": 0.9})["radius"]
    assert np.any(np.abs(found.value) > 1e3 * found.noise)


@pytest.mark.parametrize("name", PRESETS)
def test_an_attached_radius_is_the_same_number(name):
    build = preset(PRESETS[name])
    attached = gtao.ambient_occlusion(*build(attach({"radius": 0.9}))).visibility.numpy()
    # Another kernel, with another order of operations, makes the same image.
    np.testing.assert_allclose(attached, image(build, {"radius": 0.9}), rtol=0, atol=1e-12)


def test_two_numbers_are_not_one():
    """A radius of its own beside a falloff moves nothing, and must not pass for its end."""
    values = attach({"radius": 0.9, "end": 0.9})
    method = gtao.GTAO(radius=values["radius"], falloff=gtao.QuadraticFalloff(end=values["end"]))
    with pytest.raises(gtao.ConfigError, match="radius of this method has no derivative"):
        gtao.ambient_occlusion(preset(lambda _: method)({"radius": None})[0], method)


def test_a_cut_by_one_number_is_still_refused():
    radius = attach({"radius": 0.9})["radius"]
    method = gtao.GTAO(radius=radius, falloff=gtao.SampleCut(end=radius))
    with pytest.raises(gtao.ConfigError, match=r"falloff\.end and radius of this method have no derivative"):
        gtao.ambient_occlusion(preset(lambda _: method)({"radius": None})[0], method)
