"""Touchstone: simulated vision-based tactile sensors, their true forces, and estimators, over NumPy arrays.

    import touchstone as ts
    sensor = ts.Sensor("gelsight-flat")
    touch = sensor.press("ball-8mm", force_N=2.0)
    touch.frame, touch.height_mm, touch.force_N, touch.force_error_N

Lengths are in mm, forces in N, pressures in MPa, times in s, angles in degrees where a name says so. The gel frame has
its origin in the middle of the gel's undeformed outer surface and z out of the gel; a wrench is the one on the object,
so pressing gives a positive z. Pictures are BGR, as OpenCV's. See docs/python.md.
"""

import resource as _resource
import warnings as _warnings

from ._errors import Error


def _require_address_space():
    # The module and NumPy map 380 MB; with less, OpenBLAS waits for ever for a buffer, at the latest when Python ends.
    least = 500_000_000
    limit, _ = _resource.getrlimit(_resource.RLIMIT_AS)
    if limit != _resource.RLIM_INFINITY and limit < least:
        raise Error("to import touchstone takes 500 MB of address space; the limit of it (ulimit -v) is lower")


_require_address_space()
from . import _core
from ._core import (
    BeadTracker,
    ColourMarkerReader,
    ColourMarkerReading,
    ColourModel,
    DarknessEstimator,
    DarknessModel,
    DarknessResult,
    EventForceModel,
    EventForceReader,
    EventMaterialModel,
    ExploreForce,
    ExploreModel,
    ExploreReading,
    ExploreTracker,
    ForceEstimate,
    GelForceModel,
    HeightEstimator,
    HeightModel,
    HeightResult,
    HueEstimator,
    HueField,
    HueModel,
    MarkerTracker,
    Object,
    Reading,
    ReflexModel,
    ReflexReader,
    ReflexReading,
    Registration,
    Sensor,
    Session,
    SkinMark,
    SoftnessModel,
    StiffnessForceModel,
    TactileMap,
    TextureMatch,
    TextureModel,
    Touch,
    TouchReader,
    TouchReading,
    TrackedBeads,
    TrackedMarkers,
    calibrate_colour,
    calibrate_darkness,
    calibrate_explore,
    calibrate_height,
    calibrate_hue,
    calibrate_reflex,
    calibrate_softness,
    fit_touch_forces,
    force_spectrogram,
    frames,
    read_events,
    read_image,
    scenes_folder,
    skin_marks,
    train_event_force,
    train_event_material,
    train_stiffness,
    write_png,
)
from ._core import __version__
from .dataset import Dataset

# OpenBLAS's names of x86 processors without AVX2: what it says of one that it doesn't know (apps/blas_kind.cpp).
_OLD_CORES = {"Generic", "Katmai", "Coppermine", "Northwood", "Prescott", "Banias", "Core2", "Penryn", "Dunnington",
              "Atom", "Nehalem", "Athlon", "Opteron", "Nano", "Opteron_SSE3", "Barcelona", "Bobcat", "Unknown",
              "Sandybridge"}


def _warn_of_slow_blas():
    instructions = _core.vector_instructions()
    if instructions == "baseline" or _core.blas_core() not in _OLD_CORES:
        return
    wanted = "SkylakeX" if instructions == "avx512" else "Haswell"
    _warnings.warn(f"OpenBLAS takes this processor for '{_core.blas_core()}' and will be slow; start Python with "
                   f"OPENBLAS_CORETYPE={wanted}", RuntimeWarning, stacklevel=3)


_warn_of_slow_blas()


def generate(job, out, *, threads=0, timings=True, cache=None, shard=None, progress=None):
    """Makes the data set of a job file in folder `out`, or goes on with one that was broken off.

    The same as `touchstone generate`: the same job gives the same bytes. Ctrl-C breaks it off; the same call goes on.
    Jobs with `scenes` and jobs that draw (docs/datasets.md) are both taken; Dataset reads both.

    threads: at most so many; 0: as many as the machine has.
    timings: put wall times in dataset.json; without them the whole folder is the same in every run. Sets that are
      drawn have no wall times in them.
    cache: folder of set-up results; None: $TOUCHSTONE_CACHE or ~/.cache/touchstone.
    shard: of a job that draws, "I/N": only the I-th of N parts, I from 1 to N; merge() then puts them together.
    progress: called as progress(stage, done, total), also from other threads; what it raises ends the run.

    Returns a dict: was_finished, samples (of the job or the shard), made (by this call), kept (of earlier ones),
    warning (of a damaged cache and of objects' sizes; empty), damaged_blocks (files of a drawn set made again) and
    drawn_again (touches that couldn't be pressed).
    Raises Error for a mistake in the job, a folder with anything else in it, a full disk.
    """
    return _core.generate(job, out, threads=threads, timings=timings, cache="" if cache is None else cache,
                          shard=shard or "", progress=progress)


def merge(job, out, *, progress=None):
    """Checks that all shards of a drawn data set are in folder `out`, and writes its card and manifest.

    progress: as for generate. Returns a dict as generate does.
    Raises Error that names the files that are missing, or if the job isn't one that draws.
    """
    return _core.merge(job, out, progress=progress)


__all__ = [
    "BeadTracker", "ColourMarkerReader", "ColourMarkerReading", "ColourModel", "DarknessEstimator", "DarknessModel",
    "DarknessResult", "Dataset", "Error", "EventForceModel", "EventForceReader", "EventMaterialModel", "ExploreForce",
    "ExploreModel", "ExploreReading", "ExploreTracker", "ForceEstimate", "GelForceModel", "HeightEstimator",
    "HeightModel", "HeightResult", "HueEstimator", "HueField", "HueModel", "MarkerTracker", "Object", "Reading",
    "ReflexModel", "ReflexReader", "ReflexReading", "Registration", "Sensor", "Session", "SkinMark", "SoftnessModel",
    "StiffnessForceModel", "TactileMap", "TextureMatch", "TextureModel", "Touch", "TouchReader", "TouchReading",
    "TrackedBeads", "TrackedMarkers", "calibrate_colour", "calibrate_darkness", "calibrate_explore", "calibrate_height",
    "calibrate_hue", "calibrate_reflex", "calibrate_softness", "fit_touch_forces", "force_spectrogram", "frames",
    "generate", "merge", "read_events", "read_image", "scenes_folder", "skin_marks", "train_event_force",
    "train_event_material", "train_stiffness", "write_png",
]
