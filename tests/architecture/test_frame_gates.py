"""Noise-free gates on a frame's way into the kernels: launches and recompilation, never seconds."""

import json
import os
import subprocess
import sys

import drjit as dr
import numpy as np
import pytest
from drjit.auto.ad import TensorXf

import gtao

HEIGHT, WIDTH = 48, 64
CAMERA = gtao.PerspectiveCamera(WIDTH, HEIGHT, 1.0)
RNG = np.random.default_rng(1)
Z = (3 + 0.1 * RNG.random((HEIGHT, WIDTH))).astype(np.float32)
N = np.zeros((HEIGHT, WIDTH, 3), np.float32)
N[..., 2] = 1
ALBEDO = np.full((HEIGHT, WIDTH, 3), 0.5, np.float32)
METHOD = gtao.GTAO(radius=0.5, n_slices=1, falloff=gtao.LinearFalloff(start=0.3, end=0.5))


def launches(work):
    """Kernels that are compiled for what ``work`` does; what it returns is evaluated."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(work())
        dr.sync_thread()
        return [k for k in dr.kernel_history() if k["type"] is dr.KernelType.JIT]


def attached(array):
    tensor = TensorXf(array)
    dr.enable_grad(tensor)
    return tensor


class TestLaunches:
    @pytest.mark.parametrize("albedo", [None, ALBEDO], ids=["", "albedo"])
    @pytest.mark.parametrize("normal_v", [N, None], ids=["normals", "derived"])
    def test_one_look_at_a_frame(self, normal_v, albedo):
        def frame():
            g = gtao.GBuffer(Z, normal_v, CAMERA, albedo)
            return g.normal_v if g.normals_derived else None

        assert len(launches(frame)) == 1

    def test_one_look_at_depth_layers_and_one_at_the_frame(self):
        front = np.stack([Z, Z + 1])

        def frame():
            gtao.GBuffer(Z, N, CAMERA, layers=gtao.DepthLayers(front, front + 0.5))

        assert len(launches(frame)) == 2

    def test_no_look_at_all(self):
        front = np.stack([Z, Z + 1])
        layers = gtao.DepthLayers(front, front, validate=False)

        def frame():
            gtao.GBuffer(Z, N, CAMERA, ALBEDO, layers=layers, validate=False)

        assert launches(frame) == []

    @pytest.mark.parametrize(
        ("normal_v", "validate", "expected"),
        [(N, False, 1), (N, True, 2), (None, False, 2), (None, True, 2)],
        ids=["normals", "normals, looked at", "derived", "derived, looked at"],
    )
    @pytest.mark.parametrize(
        "method", [METHOD, gtao.VisibilityBitmask(radius=0.5, n_slices=1)], ids=["GTAO", "bitmask"]
    )
    def test_a_frame_and_its_occlusion(self, normal_v, validate, expected, method):
        """Normals are normalised where they are used; derived ones are kept."""

        def frame():
            g = gtao.GBuffer(Z, normal_v, CAMERA, validate=validate)
            return gtao.ambient_occlusion(g, method).visibility

        assert len(launches(frame)) == expected

    def test_the_adjoint_of_derived_normals_is_one_pass_over_the_pixels(self):
        """What pixels and their neighbours are given comes from one kernel, and a small one adds the two up."""

        def passes():
            z = attached(Z)
            flat = gtao.GBuffer(z, None, CAMERA).normal_v.array
            dr.backward(dr.dot(flat, dr.square(dr.detach(flat))))
            return dr.grad(z)

        sizes = [k["operation_count"] for k in launches(passes)]
        assert sum(size > 100 for size in sizes) == 2, sizes

    def test_the_adjoint_of_the_interpolated_field_is_elementwise(self):
        """Edges are found without derivatives, so that nothing scatters to the texels that were compared."""
        z = attached(Z)
        field = gtao.GBuffer(z, N, CAMERA).affine_field()
        total = dr.dot(field, field)

        def backward():
            dr.backward(total)
            return dr.grad(z)

        (kernel,) = launches(backward)
        # A reciprocal, its square and two signs; with the texels that are compared it would be ten times as much.
        assert kernel["operation_count"] <= 30


class TestRecompilation:
    def other(self):
        return gtao.PerspectiveCamera(WIDTH, HEIGHT, fx=50.0, fy=71.0, cx=3.0, cy=40.0)

    @pytest.mark.parametrize("what", ["normal_v", "position_v", "affine_field"])
    def test_another_camera_is_not_another_kernel(self, what):
        for camera, known in ((CAMERA, False), (self.other(), True)):

            def work(camera=camera):
                value = getattr(gtao.GBuffer(Z, None, camera), what)
                return value() if callable(value) else value

            kernels = launches(work)
            assert kernels
            assert all(k["cache_hit"] for k in kernels) or not known

    def test_normals_that_come_and_normals_that_are_derived_go_into_one_kernel(self):
        """Looked at or not, before anyone asked for them and after."""
        frames = [gtao.GBuffer(Z, n, CAMERA, validate=validate) for n in (N, None) for validate in (True, False)]

        def estimates():
            return {launches(lambda g=g: gtao.ambient_occlusion(g, METHOD).visibility)[-1]["hash"] for g in frames}

        before = estimates()
        dr.eval([g.normal_v for g in frames])
        assert len(before | estimates()) == 1

    def test_arrays_of_any_alignment_are_the_same_kernel(self):
        hashes = {
            tuple(k["hash"] for k in launches(lambda z=z, n=n: gtao.GBuffer(z, n, CAMERA).normal_v))
            for shift in (0, 1, 3, 8)
            for z, n in [(shifted(Z, shift), shifted(N, shift + 2))]
        }
        assert len(hashes) == 1

    def test_tensors_that_the_caller_vouches_for_are_not_copied(self):
        view_z, normal_v = dr.opaque(TensorXf(Z)), dr.opaque(TensorXf(N))
        g = gtao.GBuffer(view_z, normal_v, CAMERA, validate=False)
        assert g.view_z.array.index == view_z.array.index
        assert g.attached_inputs()[1].array.index == normal_v.array.index
        assert gtao.GBuffer(view_z, normal_v, CAMERA).view_z.array.index != view_z.array.index

    def test_attached_arrays_of_any_alignment_are_the_same_kernel(self):
        hashes = set()
        for shift in (0, 1, 3, 8):
            z, n = attached(shifted(Z, shift)), attached(shifted(N, shift + 2))
            g = gtao.GBuffer(z, n, CAMERA)
            hashes.add(tuple(k["hash"] for k in launches(lambda g=g: gtao.ambient_occlusion(g, METHOD).visibility)))
        assert len(hashes) == 1


def shifted(array, floats):
    """The same array, ``floats`` numbers beyond a multiple of 64 bytes."""
    room = np.empty(array.size + 64, np.float32)
    start = -room.ctypes.data // 4 % 16 + floats
    result = room[start : start + array.size].reshape(array.shape)
    result[:] = array
    return result


CHILD = """
import json, sys
import numpy as np
import gtao
import drjit as dr
from architecture.test_frame_gates import METHOD, N, Z, CAMERA, launches, shifted

def frame():
    z, n = shifted(Z, int(sys.argv[1])), shifted(N, int(sys.argv[2]))
    return gtao.ambient_occlusion(gtao.GBuffer(z, n, CAMERA), METHOD).visibility

print(json.dumps([bool(k["cache_disk"]) for k in launches(frame)]))
"""


def test_a_new_process_compiles_nothing_whatever_the_alignment(tmp_path):
    """Of the arrays that come in: NumPy's lie anywhere, and where they lie would be part of the kernels."""
    path = [os.path.dirname(os.path.dirname(__file__)), *sys.path]
    environment = os.environ | {"DRJIT_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(path)}

    def process(*shifts):
        command = [sys.executable, "-c", CHILD, *map(str, shifts)]
        run = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
        return json.loads(run.stdout)

    assert process(0, 1) == [False, False]
    for shifts in ((0, 1), (5, 0), (2, 7)):
        assert process(*shifts) == [True, True]
