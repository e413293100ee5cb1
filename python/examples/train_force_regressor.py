#!/usr/bin/python3
"""Makes a small data set, trains a regressor of scikit-learn from frames to forces, and tries it on other places.

    train_force_regressor.py [FOLDER]     FOLDER: of the data set; made if it isn't there

Ends with 77, which ctest takes for "skipped", where scikit-learn (Debian: python3-sklearn) isn't installed.
"""

import pathlib
import sys
import tempfile

import numpy as np
import touchstone as ts

try:
    from sklearn.decomposition import PCA
    from sklearn.linear_model import RidgeCV
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import PolynomialFeatures, StandardScaler
except ImportError:
    print("scikit-learn isn't installed: skipped")
    sys.exit(77)

here = pathlib.Path(__file__).parent


def features(data):
    """How much of each frame has changed by how much against the first of its press, wherever in the picture."""
    frames = data.array("frame").astype(np.float32)
    scene = data.groups()
    first = np.array([frames[scene == number][0] for number in scene])
    change = frames - first
    n, height, width, channels = change.shape
    blocks = abs(change.reshape(n, height // 4, 4, width // 4, 4, channels).mean(axis=(2, 4))).reshape(n, -1, channels)
    shares = [np.sqrt((blocks > level).mean(axis=1)) for level in (1.5, 3, 6, 12, 24)]
    return np.concatenate(shares + [blocks.mean(axis=1), np.sqrt((blocks**2).mean(axis=1))], axis=1)


def main(folder):
    made = ts.generate(here / "quick-job.yaml", folder)
    print(f"{made['samples']} samples, {made['made']} of them made now")
    train = ts.Dataset(folder, "train")
    test = ts.Dataset(folder, "test")
    model = make_pipeline(StandardScaler(), PCA(6, random_state=0), PolynomialFeatures(2),
                          RidgeCV(np.logspace(-3, 3, 13)))
    model.fit(features(train), train.array("wrench")[:, 2])
    truth = test.array("wrench")[:, 2]
    error = model.predict(features(test)) - truth
    bar = test.array("error/force_N")[:, 2]
    rms = np.sqrt((error**2).mean())
    print(f"normal force on {len(test)} frames at places not learnt from: off by {rms:.3f} N (RMS) of "
          f"{truth.max():.2f} N at most; the truth's own error bar is {bar.max():.4f} N")
    assert rms < 0.25 * truth.std(), "worse than a quarter of the forces' own spread"


if len(sys.argv) > 1:
    main(sys.argv[1])
else:
    with tempfile.TemporaryDirectory() as temporary:
        main(pathlib.Path(temporary) / "set")
