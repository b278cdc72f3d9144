"""Every notebook runs from top to bottom, shows pictures, and is committed without outputs."""

import ast
import os
from pathlib import Path

import nbclient
import nbformat
import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))

#: What a reader may have to know: the package's public rooms, its dependencies, the standard library.
PUBLIC = {"gtao", "drjit", "mitsuba", "numpy", "scipy", "matplotlib", "dataclasses", "math", "pathlib", "time"}


def _read(path):
    return nbformat.read(path, as_version=4)


def _code(notebook):
    """Source of the code cells, without IPython's own lines."""
    cells = (cell.source for cell in notebook.cells if cell.cell_type == "code")
    return ["\n".join(line for line in source.splitlines() if not line.startswith("%")) for source in cells]


def test_all_notebooks_are_here():
    names = {path.name for path in NOTEBOOKS}
    assert names >= {
        "first_ao.ipynb",
        "multibounce_refit.ipynb",
        "against_ray_tracing.ipynb",
        "height_from_visibility.ipynb",
        "albedo_from_light.ipynb",
        "camera_from_visibility.ipynb",
        "scene_from_photograph.ipynb",
        "directional_occlusion.ipynb",
        "specular_occlusion.ipynb",
        "temporal_pipeline.ipynb",
    }


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_is_committed_without_outputs(path):
    notebook = _read(path)
    nbformat.validate(notebook)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_uses_public_names_only(path):
    for source in _code(_read(path)):
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                modules = [node.module or "."]
            else:
                modules = []
            assert {module.partition(".")[0] for module in modules} <= PUBLIC
            assert not any(module.startswith("gtao.") for module in modules)
            if isinstance(node, ast.Attribute):
                assert not node.attr.startswith("_")


@pytest.mark.notebook
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_runs_and_shows_pictures(path, tmp_path, monkeypatch):
    # Jupyter and IPython keep their settings and history in the home directory; the test's own is empty.
    for variable in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(variable, str(tmp_path / variable.lower()))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    os.makedirs(tmp_path / "jupyter_runtime_dir", mode=0o700)
    notebook = _read(path)
    client = nbclient.NotebookClient(
        notebook, timeout=300, kernel_name="python3", resources={"metadata": {"path": str(path.parent)}}
    )
    client.execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in outputs if output.get("name") == "stderr"]
    pictures = [output for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) >= 4
    # A result that only prints its address does not show itself.
    for output in outputs:
        assert "object at 0x" not in output.get("data", {}).get("text/plain", "")
        if output.output_type == "execute_result":
            assert {"image/png", "text/html"} & set(output.data), output.data.get("text/plain")
