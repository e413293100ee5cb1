"""What a clear gel touches, by painted pictures; the estimators' own tests are in tests/sensors/skin."""

import numpy as np
import pytest

import touchstone as ts

ROWS, COLUMNS = np.mgrid[:120, :160]
BEAD = np.hypot(COLUMNS - 80, ROWS - 60) < 6


def seen(albedo):
    """Under warm light that falls to the rim; albedo: (R, G, B), of each pixel or of all."""
    light = 220 - 0.6 * np.hypot(COLUMNS - 80, ROWS - 60)
    picture = light[..., None] * np.array([1, 0.9, 0.7]) * np.broadcast_to(albedo, (120, 160, 3))
    picture[BEAD] = 5
    return np.round(picture[..., ::-1]).astype(np.uint8)


def lab(albedo):
    """CIE L*a*b* of a part of sRGB's light, D65."""
    xyz = np.array([[0.4123908, 0.3575843, 0.1804808], [0.212639, 0.7151687, 0.0721923],
                    [0.0193308, 0.1191948, 0.9505322]]) @ albedo / [0.95047, 1, 1.08883]
    f = np.cbrt(xyz)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


COLOURS = np.array([(0.7, 0.2, 0.2), (0.2, 0.6, 0.2), (0.15, 0.2, 0.7), (0.3, 0.3, 0.3), (0.7, 0.6, 0.2)])


def test_colours_are_learnt_and_read(tmp_path):
    box = np.zeros((120, 160), bool)
    box[20:50, 20:50] = True
    patches = [(seen(colour), (20, 20, 30, 30) if k % 2 else box, lab(colour)) for k, colour in enumerate(COLOURS)]
    model, report = ts.calibrate_colour([seen((1, 1, 1))], patches, smooth_px=2)
    assert report["largest_error_de2000"] == model.largest_error_de2000 < 1 and len(report["left_out_de2000"]) == 5
    assert model.picture_shape == (120, 160) and model.patches == 5
    assert not model.trusted[60, 80] and model.trusted[60, 120]
    model.save(tmp_path / "m.colour")
    again = ts.ColourModel.load(tmp_path / "m.colour")
    colour = np.array([0.5, 0.35, 0.25])
    assert np.abs(again.lab(seen(colour), (60, 40, 40, 40)) - lab(colour)).max() < 1, "without the bead within"
    assert np.array_equal(again.lab(seen(colour), box), model.lab(seen(colour), (20, 20, 30, 30)))
    with pytest.raises(ts.Error, match="isn't within the picture's"):
        model.lab(seen(colour), (150, 0, 11, 5))
    with pytest.raises(ts.Error, match="no pixel of the mask"):
        model.lab(seen(colour), (79, 59, 3, 3))
    with pytest.raises(ts.Error, match="region: a mask of 159 x 120"):
        model.lab(seen(colour), box[:, 1:])
    with pytest.raises(ts.Error, match="three or more"):
        ts.calibrate_colour([seen((1, 1, 1))], patches[:2])
    with pytest.raises(ts.Error, match="smooth_px: -1 is not allowed"):
        ts.calibrate_colour([seen((1, 1, 1))], patches, smooth_px=-1)


def skin(left, right, brightness, seed):
    rows, columns = np.mgrid[:240, :320]
    picture = np.broadcast_to((60.0, 75, 120), (240, 320, 3)).copy()
    for centre, colour in ((90, left), (230, right)):
        cover = np.clip((35 + 6 - np.hypot(columns - centre, rows - 120)) / 12, 0, 1)[..., None]
        picture = (1 - cover) * picture + cover * np.array(colour)
    picture *= brightness * (1 - 0.002 * np.hypot(columns - 160, rows - 120))[..., None]
    picture += np.random.default_rng(seed).normal(0, 4, picture.shape)
    return np.clip(np.round(picture), 0, 255).astype(np.uint8)


SKIN, RED, PURPLE = (60, 75, 120), (50, 52, 128), (35, 28, 66)


def test_marks_that_fade_are_distinguished_from_those_that_stay():
    marks = ts.skin_marks(skin(RED, PURPLE, 1.0, 1), skin(SKIN, PURPLE, 0.7, 2))
    assert {("left" if m.centre_px[0] < 160 else "right"): m.kind for m in marks} == {"left": "erythema", "right": "purpura"}
    left = min(marks, key=lambda m: m.centre_px[0])
    assert left.blanched == pytest.approx(1, abs=0.15) and left.darkened < 0.8
    assert left.index_before > 8 > left.index_pressed and left.area_px > 2000
    assert ts.skin_marks(skin(SKIN, SKIN, 1, 3), skin(SKIN, SKIN, 0.7, 4)) == []
    assert {m.kind for m in ts.skin_marks(skin(RED, PURPLE, 1, 1), skin(RED, PURPLE, 1, 2))} == {"unknown"}
    assert {m.kind for m in ts.skin_marks(skin(RED, PURPLE, 1, 1), skin(RED, PURPLE, 1, 2), wetted_part=0)} == {"purpura"}
    with pytest.raises(ts.Error, match="blanched_share is 0"):
        ts.skin_marks(skin(RED, PURPLE, 1, 1), skin(RED, PURPLE, 1, 2), blanched_share=0)


def test_a_spectrogram_has_a_sinusoids_amplitude():
    t_s = np.arange(2000) / 1000
    force = np.where(t_s < 0.1, 0, 2 + 0.5 * np.sin(2 * np.pi * 62.5 * t_s))
    frequencies, picture = ts.force_spectrogram(force, 1000)
    assert frequencies[4] == pytest.approx(62.5) and picture.shape == (len(frequencies), 23)
    assert 10**picture[4, 10] == pytest.approx(0.5, rel=0.02) and 10**picture[0, 10] == pytest.approx(2, rel=0.01)
    with pytest.raises(ts.Error, match="nothing was touched"):
        ts.force_spectrogram(np.zeros(2000), 1000)


def press(level, number, rate_Hz=250):
    """A force that rises faster and rings higher the harder what is pressed is."""
    rng = np.random.default_rng([level, number])
    since = np.arange(int(1.2 * rate_Hz)) / rate_Hz - 0.2
    rise, ring = 0.3 / (1 + level) * rng.uniform(0.9, 1.1), 20 + 25 * level * rng.uniform(0.95, 1.05)
    late = np.maximum(since, 0)
    force = 2.2 * (1 - np.exp(-late / rise)) + 0.15 * np.exp(-late / 0.15) * np.sin(2 * np.pi * ring * late)
    return np.where(since > 0, force, 0) + rng.normal(0, 0.01, len(since))


def test_softness_is_learnt_and_named(tmp_path):
    names = ["soft", "firm", "hard"]
    levels = names * 8
    presses = [press(names.index(level), number) for number, level in enumerate(levels)]
    model, report = ts.calibrate_softness(presses, levels, 250, networks=2, highest_Hz=60)
    assert report["left_out_right"] > 0.9 and model.levels == names and model.rate_Hz == 250
    model.save(tmp_path / "softness.json")
    model = ts.SoftnessModel.load(tmp_path / "softness.json")
    right = [model.classify(press(level, 100 + number)).argmax() == level for number in range(5) for level in range(3)]
    assert sum(right) >= 14
    with pytest.raises(ts.Error, match="nothing was touched"):
        model.classify(np.zeros(300))
    with pytest.raises(ts.Error, match="2 presses of 'soft'; at least 3"):
        ts.calibrate_softness(presses[:6], levels[:6], 250)
    with pytest.raises(ts.Error, match="levels: 23 are given, there are more presses"):
        ts.calibrate_softness(presses, levels[:-1], 250)
