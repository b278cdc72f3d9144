"""Small runs of ``gtao animate``, ways to stop them, and how two of them are compared."""

import pytest

from gtao import io, workflows

SMALL = {"resolution": 32, "spp": 16, "video": "gif"}
PIPELINE = "published-pipeline"
METHODS = (PIPELINE, "gtao,n_slices=1,n_steps=2")
FILES = (PIPELINE, "gtao-n-slices-1-n-steps-2")
N = 4
#: What differs between identical runs.
TIMED = {"record.json", "report.html"}

#: A ball over a floor, seen from above.
BALL = '<shape type="sphere" id="ball"><float name="radius" value="0.4"/></shape>'
SCENE = f"""<scene version="3.0.0">
  {BALL}
  <shape type="rectangle"><transform name="to_world"><scale value="4"/><translate z="-0.4"/></transform></shape>
  <sensor type="perspective">
    <float name="fov" value="60"/>
    <transform name="to_world"><lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="24"/></film>
  </sensor>
</scene>
"""


class Stopped(Exception):
    pass


def config(animation="passing_object", methods=METHODS, frames=N, **options):
    return workflows.AnimateConfig(animation=animation, methods=methods, frames=frames, **SMALL | options)


def stops_after(n_frames):
    """Progress that ends the run when so many frames are done."""

    def progress(task, done, total):
        if task == "frames" and done == n_frames:
            raise Stopped

    return progress


def stop_after(n_frames, output, **options):
    with pytest.raises(Stopped):
        workflows.animate(config(**options), output, progress=stops_after(n_frames))


def files(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def assert_same(one, other):
    """The same files with the same bytes, but for the time in record and report."""
    a, b = files(one), files(other)
    assert a.keys() == b.keys()
    assert [name for name in a if a[name] != b[name] and name not in TIMED] == []
    records = [io.without_timestamps(io.read_record(folder / "record.json")) for folder in (one, other)]
    for record in records:
        # The command names the folder.
        del record["command"], record["git"]
    assert records[0] == records[1]
