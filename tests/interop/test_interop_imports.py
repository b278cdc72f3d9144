"""The frameworks are optional, load when they are asked for, and share a process with Dr.Jit in any order."""

import importlib.util
import subprocess
import sys

import pytest

FRAMEWORKS = ("torch", "jax")


def run(script, *options):
    done = subprocess.run([sys.executable, *options, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", FRAMEWORKS)
def test_without_the_framework_the_error_names_the_extra(name):
    script = f"""
import sys
sys.modules[{name!r}] = None  # as if it were not installed
import gtao
try:
    gtao.interop.{name}
except ImportError as error:
    print(error)
"""
    assert run(script).strip().endswith(f"which is not here; pip install 'gtao[{name}]'")


def test_no_framework_is_loaded_before_it_is_asked_for():
    script = f"import gtao.interop, sys; dir(gtao.interop); print([m for m in {FRAMEWORKS} if m in sys.modules])"
    assert run(script).strip() == "[]"


SUM = {
    "torch": "float(gtao.interop.torch.ambient_occlusion(torch.from_numpy(z), None, camera, method).sum())",
    "jax": "float(gtao.interop.jax.ambient_occlusion(jax.numpy.asarray(z), None, camera, method).sum())",
}


@pytest.mark.slow
@pytest.mark.parametrize("gtao_first", [True, False], ids=["gtao first", "framework first"])
@pytest.mark.parametrize("name", FRAMEWORKS)
def test_frameworks_and_drjit_share_a_process(name, gtao_first):
    """Each brings its own LLVM and threads; they meet in kernels of both, in either order."""
    if importlib.util.find_spec(name) is None:
        pytest.skip(f"{name} is not installed: pip install 'gtao[{name}]'")
    imports = [f"import {name}", "import gtao"]
    script = "\n".join(
        [
            *(reversed(imports) if gtao_first else imports),
            *f"""
import numpy as np
a = np.random.default_rng(0).random((64, 64), dtype=np.float32)
z, camera, method = 4 + a, gtao.PerspectiveCamera(64, 64, 0.9), gtao.GTAO(radius=1.0, n_slices=1)
products = [float((getattr({name}, "numpy", {name}).asarray(a) @ a).sum())]
totals = [{SUM[name]}]
products.append(float((getattr({name}, "numpy", {name}).asarray(a) @ a).sum()))
totals.append(float(gtao.ambient_occlusion(gtao.GBuffer(z, None, camera), method).visibility.numpy().sum()))
assert products[0] == products[1] and abs(products[0] - (a @ a).sum()) < 1e-4 * products[0], products
assert abs(totals[0] - totals[1]) < 1e-5 * totals[1], totals
print("same")
""".strip().splitlines(),
        ]
    )
    assert run(script).strip() == "same"
