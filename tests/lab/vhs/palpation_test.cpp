// Lumps of five levels of softness, pressed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "core/whole_file.h"
#include "fem/contact/press.h"
#include "lab/vhs/palpation_experiment.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::lab {
namespace {

using test::message_of;
using ::testing::HasSubstr;

const std::filesystem::path kFile = std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/palpation/five-levels.yaml";

/// The file's, without anything that differs from press to press.
PalpationSpec still() {
  PalpationSpec spec = read_palpation(kFile);
  spec.axis.lead_error_um = spec.axis.step_error_um = spec.axis.shake_um = 0.0;
  spec.motion.speed_spread = 0.0;
  return spec;
}

/// A spring of `stiffness` N/mm.
PressedPiece spring(double stiffness) {
  PressedPiece piece;
  piece.law.depth_step_mm = 0.5;
  for (int i = 0; i < 8; ++i) {
    piece.law.force_N.push_back(stiffness * 0.5 * i);
    piece.law.radius_mm.push_back(3.0);
  }
  return piece;
}

/// Frequency of what is left of the force's mean, by its crossings of zero.
double ring_Hz(const std::vector<double>& force, std::size_t first, std::size_t last, double step_s) {
  double mean = 0.0;
  for (std::size_t i = first; i < last; ++i) mean += force[i] / static_cast<double>(last - first);
  std::vector<double> upwards;
  for (std::size_t i = first; i + 1 < last; ++i) {
    if (force[i] < mean && force[i + 1] >= mean) {
      upwards.push_back(static_cast<double>(i) + (mean - force[i]) / (force[i + 1] - force[i]));
    }
  }
  return static_cast<double>(upwards.size() - 1) / ((upwards.back() - upwards.front()) * step_s);
}

TEST(PalpationSpec, HasThirteenMaterialsOfFiveLevelsEachHarderThanTheLast) {
  const PalpationSpec spec = read_palpation(kFile);
  EXPECT_EQ(spec.materials.size(), 13u);
  EXPECT_EQ(spec.lump.skin_mm, 2.0);
  for (std::size_t m = 1; m < spec.materials.size(); ++m) {
    EXPECT_GT(spec.materials[m].youngs_modulus_MPa, spec.materials[m - 1].youngs_modulus_MPa);
    EXPECT_GE(spec.materials[m].level, spec.materials[m - 1].level);
  }
  EXPECT_EQ(softness_names().size(), static_cast<std::size_t>(kSoftnessLevels));
}

TEST(PalpationSpec, AFaultyFileIsRefusedWithItsLine) {
  const test::TemporaryFolder folder;
  const auto message = [&](const std::string& from, const std::string& to) {
    std::string text = read_whole_file(kFile);
    std::size_t at = 0;
    while ((at = text.find(from, at)) != std::string::npos) {
      text.replace(at, from.size(), to);
      at += to.size();
    }
    write_whole_file(folder.path() / "palpation.yaml", text);
    return message_of([&] { read_palpation(folder.path() / "palpation.yaml"); });
  };
  EXPECT_EQ(message("level: soft,", "level: soft,"), "no error");
  EXPECT_THAT(message("level: soft,", "level: elastic soft,"), HasSubstr("materials: none is soft"));
  EXPECT_THAT(message("mass_kg: 0.08", "mass_kg: 0"), HasSubstr("mass_kg"));
  EXPECT_THAT(message("mass_kg: 0.08", "mas_kg: 0.08"), HasSubstr("mass_kg"));
  EXPECT_THAT(message("skin_mm: 2", "skin_mm: -2"), HasSubstr("skin_mm"));
}

TEST(PalpationTable, RisesWithTheCoreAndLiesOnPressesBetweenItsNodes) {
  const test::TemporaryFolder cache;
  PalpationSpec spec = still();
  spec.lump.mesh_mm = 1.5;
  PalpationTableSettings settings;
  settings.ratio_step = 1.2;
  settings.depths = 8;
  settings.friction = 0.0;
  const PalpationTable table(spec, PalpationFace::rigid, {}, {}, settings, cache.path());
  double before = 0.0;
  for (const PalpationMaterial& material : spec.materials) {
    const PalpationLaw law = table.law(spec.skin.youngs_modulus_MPa, material.youngs_modulus_MPa);
    EXPECT_GE(law.force(1.0), before) << material.name;
    before = law.force(1.0);
    // Forces of linear elasticity are of the first degree in the moduli.
    EXPECT_NEAR(law.skin_share + law.core_share, 1.0, 1e-6) << material.name;
    EXPECT_GT(law.skin_share, 0.0);
    EXPECT_GT(law.core_share, -0.02);
  }
  // Shares are derivatives.
  const PalpationLaw soft = table.law(0.15, 0.2), harder = table.law(0.15, 0.2 * 1.02);
  const double half = 0.5 * soft.deepest_mm();
  EXPECT_NEAR(std::log(harder.force(half) / soft.force(half)) / std::log(1.02), soft.core_share, 0.03);
  // A ratio that isn't a node, against a press of it. At a depth where one was pressed, so the smooth law has nothing
  // to add but its own misfit.
  const auto piece = sim::set_up_lump(spec.lump, 2.0, cache.path());
  const auto plate = sim::set_up_plate(spec.lump, cache.path());
  fem::Press press(*plate, std::vector<fem::PressBody>{{fem::SphereShape{spec.lump.sphere_radius_mm}, 0.0,
                                                        sim::as_pressing_body(spec.lump, *piece, 1.0)}});
  fem::PressTarget target;
  target.axis[2] = fem::AxisControl::at(spec.lump.sphere_radius_mm - 2.0);
  const double pressed = 0.15 * press.step(target).wrench[2];
  EXPECT_NEAR(table.law(0.15, 0.3).force(2.0), pressed, 0.03 * pressed);
  EXPECT_THAT(message_of([&] { table.law(0.15, 1e-4); }), HasSubstr("the table has ratios from"));

  // A trial is the same on one thread and on all.
  const std::vector<std::vector<LumpMode>> none(spec.materials.size());
  PalpationTrialSettings trial;
  trial.training_pieces = trial.validation_pieces = trial.test_pieces = 1;
  trial.presses = 2;
  trial.seconds = 0.3;
  const PalpationRecording all = record_reference(spec, table, none, trial);
  tbb::task_arena alone(1);
  const PalpationRecording one = alone.execute([&] { return record_reference(spec, table, none, trial); });
  ASSERT_EQ(all.waveforms.size(), 13u * 3 * 2);
  for (std::size_t i = 0; i < all.waveforms.size(); ++i) EXPECT_EQ(all.waveforms[i].force_N, one.waveforms[i].force_N);
  EXPECT_NE(all.waveforms[0].force_N, all.waveforms[1].force_N) << "two presses of one piece";
  EXPECT_EQ(all.waveforms[1].set, PalpationSet::training);
  EXPECT_EQ(all.waveforms[5].set, PalpationSet::test);
}

TEST(PalpationPress, ComesToTheLawsForceAndStaysThere) {
  const PalpationSpec spec = still();
  const PalpationRun run = play_press(spec, spring(2.0), 1.5, 1, 1);
  // The holder gives way by F / k besides: 2 mm of travel are shared by two springs.
  const double expected = spec.motion.deepest_mm / (1.0 / 2.0 + 1.0 / spec.axis.stiffness_N_mm);
  EXPECT_NEAR(run.force_N.back(), expected, 1e-3 * expected);
  EXPECT_NEAR(run.touch_s, spec.motion.gap_mm / spec.motion.speed_mm_s, 1e-12);
  EXPECT_EQ(run.force_N[static_cast<std::size_t>(0.9 * run.touch_s / run.step_s)], 0.0);
  // A stiff one stops at the force.
  const PalpationRun stiff = play_press(spec, spring(8.0), 1.5, 1, 1);
  EXPECT_NEAR(stiff.force_N.back(), spec.motion.stop_force_N, 0.1 * spec.motion.stop_force_N);
  EXPECT_LT(stiff.depth_mm.back(), 0.75);
}

TEST(PalpationPress, RingsOnHolderAndLumpTogether) {
  PalpationSpec spec = still();
  spec.axis.damping = 0.002;
  for (const double stiffness : {2.0, 8.0}) {
    const PalpationRun run = play_press(spec, spring(stiffness), 0.9, 1, 1);
    const auto after = static_cast<std::size_t>((run.stop_s + 0.05) / run.step_s);
    const double found = ring_Hz(run.force_N, after, run.force_N.size(), run.step_s);
    const double expected = std::sqrt(1e3 * (spec.axis.stiffness_N_mm + stiffness) / spec.axis.mass_kg) / (2.0 * kPi);
    EXPECT_NEAR(found, expected, 0.002 * expected) << stiffness;
  }
}

TEST(PalpationPress, AModeAddsItsMassAndNoEnergy) {
  // A mode that has half of the law's give, undamped, under a face that hardly moves: it swings against the other half,
  // at omega sqrt(1 / (1 - 1/2)), since the force holds it as a spring does.
  PalpationSpec spec = still();
  spec.axis.stiffness_N_mm = 5000.0;
  spec.axis.mass_kg = 50.0;
  spec.axis.damping = 0.3;
  PressedPiece piece = spring(1.0);
  LumpMode mode;
  mode.angular_frequency = 2.0 * kPi * 150.0;
  mode.top.setConstant(mode.angular_frequency * std::sqrt(0.5));  // w^2 / omega^2 = 0.5 mm/N
  piece.modes = {mode};
  const PalpationRun run = play_press(spec, piece, 1.4, 1, 1);
  const auto after = static_cast<std::size_t>((run.stop_s + 0.3) / run.step_s);
  EXPECT_NEAR(ring_Hz(run.force_N, after, run.force_N.size(), run.step_s), 150.0 * std::sqrt(2.0), 2.0);
  const auto swing = [&](std::size_t first, std::size_t last) {
    const auto [low, high] = std::minmax_element(run.force_N.begin() + static_cast<std::ptrdiff_t>(first),
                                                 run.force_N.begin() + static_cast<std::ptrdiff_t>(last));
    return *high - *low;
  };
  const std::size_t middle = (after + run.force_N.size()) / 2;
  EXPECT_LE(swing(middle, run.force_N.size()), 1.05 * swing(after, middle)) << "nothing feeds it";
  // Its static part is in the law already: at rest it makes no difference.
  double mean = 0.0;
  for (std::size_t i = middle; i < run.force_N.size(); ++i) {
    mean += run.force_N[i] / static_cast<double>(run.force_N.size() - middle);
  }
  EXPECT_NEAR(mean, 2.0, 0.01);
}

TEST(PalpationPress, RelaxesByTheSeriesOnceItStands) {
  PalpationSpec spec = still();
  spec.axis.stiffness_N_mm = 5000.0;  // the face stays where it is
  spec.axis.mass_kg = 5.0;
  spec.axis.damping = 0.5;
  PressedPiece piece = spring(1.0);
  piece.relaxation = {{0.3, 0.02}};
  const PalpationRun run = play_press(spec, piece, 1.0, 1, 1);
  EXPECT_NEAR(run.force_N.back(), 0.7 * 2.0, 0.005);
  EXPECT_EQ(palpation_series(0.05).size(), 4u);
  EXPECT_DOUBLE_EQ(fem::lasting_share(palpation_series(0.05)), 0.8);
  EXPECT_TRUE(palpation_series(0.0).empty());
}

TEST(PalpationPress, BeyondItsLawIsRefused) {
  PalpationSpec spec = still();
  spec.motion.deepest_mm = 5.0;
  EXPECT_THAT(message_of([&] { play_press(spec, spring(0.5), 1.0, 1, 1); }), HasSubstr("its law ends at 3.5 mm"));
}

TEST(PalpationPieces, NoTwoAreAlikeAndTheSameSeedGivesTheSame) {
  const PalpationSpec spec = read_palpation(kFile);
  std::set<double> cores;
  double sum = 0.0, squares = 0.0;
  constexpr int kCount = 400;
  for (int i = 0; i < kCount; ++i) {
    const PalpationPiece piece = draw_piece(spec, 4, 1, static_cast<std::uint64_t>(i));
    cores.insert(piece.core_MPa);
    const double off = std::log(piece.core_MPa / spec.materials[4].youngs_modulus_MPa);
    EXPECT_LE(std::abs(off), 3.0 * spec.materials[4].spread);
    sum += off;
    squares += off * off;
  }
  EXPECT_EQ(cores.size(), static_cast<std::size_t>(kCount));
  // Means scatter by 0.1 / 20, standard deviations by 0.1 / 28.
  EXPECT_NEAR(sum / kCount, 0.0, 0.02);
  EXPECT_NEAR(std::sqrt(squares / kCount), spec.materials[4].spread, 0.015);
  EXPECT_EQ(draw_piece(spec, 4, 1, 7).core_MPa, draw_piece(spec, 4, 1, 7).core_MPa);
}

TEST(PalpationSensing, TheForceSensorRoundsToItsDigits) {
  PalpationReference reference;
  reference.noise_digits = 0.0;
  PalpationRun run;
  run.step_s = 5e-5;
  for (int i = 0; i < 4000; ++i) run.force_N.push_back(1e-3 * i);
  const std::vector<double> seen = reference_waveform(reference, run, 1, 1);
  ASSERT_EQ(seen.size(), 200u);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    EXPECT_NEAR(seen[i], 1e-3 * 20.0 * static_cast<double>(i), 0.5 / 328.0 + 1e-12);
    EXPECT_NEAR(seen[i] * 328.0, std::round(seen[i] * 328.0), 1e-9);
  }
}

TEST(PalpationSensing, BeadsAreSeenWhereTheDevicesPageSays) {
  sim::DeviceSpec device = sim::read_device(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/devices/vhs.yaml");
  Eigen::MatrixX3d displacement = Eigen::MatrixX3d::Zero(9, 3);
  const Eigen::VectorXd rest = bead_pixels(device, displacement);
  EXPECT_NEAR(rest[8], 320.0, 1e-9);  // the middle one
  EXPECT_NEAR(rest[9], 240.0, 1e-9);
  EXPECT_NEAR(rest[10] - rest[8], 73.0, 1.0) << "docs/sensors/vhs.md";
  EXPECT_NEAR(rest[15] - rest[9], 73.0, 1.0);
  // Paraxial: h / n through each layer, 5 mm behind the hole, 6.9 um a pixel.
  const double apparent = 15.4 + 2.0 / 1.517 + (5.0 - 0.45) / 1.48;
  EXPECT_NEAR(rest[10] - rest[8], 2.0 * 5.0 / apparent / 6.9e-3, 0.3);
  displacement(5, 2) = -0.5;
  EXPECT_GT(bead_pixels(device, displacement)[10], rest[10] + 0.5) << "nearer to the camera, further out";
  device.camera->optics = sim::LensSpec{};
  EXPECT_THAT(message_of([&] { bead_pixels(device, displacement); }), HasSubstr("palpation needs a pinhole"));
}

/// Beads that move out from the middle by as many pixels as the press is deep in mm, and a model that reads 2 N off it.
struct Spreading {
  VhsChain chain;
  PalpationLaw law = spring(2.0).law;
  Spreading() {
    chain.model.stiffness.assign(4, Eigen::Matrix3d::Zero());
    for (int b = 0; b < 9; ++b) chain.model.rest.emplace_back(320.0 + 73.0 * (b % 3 - 1), 240.0 + 73.0 * (b / 3 - 1));
    for (std::size_t k = 0; k < law.force_N.size(); ++k) {
      Eigen::VectorXd moved(18);
      for (int b = 0; b < 9; ++b) moved.segment<2>(2 * b) = Eigen::Vector2d(b % 3 - 1, b / 3 - 1);
      law.bead_px.push_back(moved * (law.depth_step_mm * static_cast<double>(k)));
    }
    // Each bead's mean distance grows by 1 px a mm, so u_z by 4 in each of four squares: 16 h = 2.
    for (Eigen::Matrix3d& h : chain.model.stiffness) h(2, 2) = 2.0 / 16.0;
  }
};

TEST(PalpationSensing, TheVhsChainReadsTheMeanOverEachExposure) {
  const PalpationSpec spec = still();
  const Spreading sensor;
  VhsChain chain = sensor.chain;
  chain.filtered = false;
  PressedPiece piece = spring(2.0);
  const PalpationRun run = play_press(spec, piece, 0.5, 1, 1);
  const std::vector<double> seen = vhs_waveform(chain, sensor.law, run, 1, 1);
  EXPECT_EQ(seen.size(),
            static_cast<std::size_t>((static_cast<double>(run.force_N.size()) * run.step_s - 1.6e-3) * 601.25) + 1);
  for (std::size_t i = 0; i < seen.size(); i += 7) {
    const double begin = static_cast<double>(i) / 601.25;
    const auto first = static_cast<std::size_t>(std::lround(begin / run.step_s));
    double mean = 0.0;
    for (std::size_t k = first; k < first + 32; ++k) mean += run.force_N[k] / 32.0;
    EXPECT_NEAR(seen[i], mean, 0.02) << i;
  }
  // Noise is the model's times the pixels', and the filter takes some of it.
  const auto scatter = [&](bool filtered) {
    chain.filtered = filtered;
    chain.noise_px = 0.1;
    const std::vector<double> noisy = vhs_waveform(chain, sensor.law, run, 1, 1);
    double squares = 0.0;
    for (std::size_t i = 250; i < noisy.size(); ++i) squares += std::pow(noisy[i] - seen[i], 2);
    return std::sqrt(squares / static_cast<double>(noisy.size() - 250));
  };
  const double raw = scatter(false), smooth = scatter(true);
  EXPECT_GT(raw, 0.01);
  EXPECT_LT(smooth, 0.9 * raw);
  EXPECT_EQ(vhs_waveform(chain, sensor.law, run, 1, 1), vhs_waveform(chain, sensor.law, run, 1, 1));
}

TEST(PalpationPress, SoftCoresSwingSlowlyAndHardOnesNotAtAll) {
  const test::TemporaryFolder cache;
  PalpationSpec spec = still();
  spec.materials = {spec.materials[1], spec.materials[5], spec.materials[12]};
  LumpModeSettings settings;
  settings.mesh_mm = 2.5;
  settings.count = 8;
  const auto modes = lump_modes(spec, 500.0, settings, cache.path());
  ASSERT_EQ(modes.size(), 3u);
  ASSERT_FALSE(modes[0].empty());
  ASSERT_FALSE(modes[1].empty());
  EXPECT_TRUE(modes[2].empty()) << "steel";
  EXPECT_LT(modes[0][0].angular_frequency, 0.8 * modes[1][0].angular_frequency);
  EXPECT_GT(modes[0][0].angular_frequency, 2.0 * kPi * 50.0);
  for (const LumpMode& mode : modes[0]) {
    EXPECT_GT(std::abs(mode.top[0]), std::abs(mode.top[4])) << "the top swings more than the whole of the dome";
  }
}

/// Waveforms that rise to a force of the material's own, no two alike.
PalpationRecording invented(const PalpationSpec& spec, double apart) {
  PalpationRecording recording;
  recording.rate_Hz = 500.0;
  RandomStream random(1, 1, Purpose::kTest);
  for (int m = 0; m < static_cast<int>(spec.materials.size()); ++m) {
    for (int i = 0; i < 9; ++i) {
      PalpationWaveform waveform;
      waveform.material = m;
      waveform.set = i < 5 ? PalpationSet::training : i < 7 ? PalpationSet::validation : PalpationSet::test;
      const double force = 0.5 * std::exp(apart * m + 0.02 * random.normal());
      for (int k = 0; k < 500; ++k) waveform.force_N.push_back(force * std::min(1.0, std::max(0.0, (k - 50) / 100.0)));
      recording.waveforms.push_back(waveform);
    }
  }
  return recording;
}

TEST(PalpationExperiment, TellsWhatDiffersAndOnlyThat) {
  const PalpationSpec spec = read_palpation(kFile);
  const SoftnessScore apart = tell_softness(spec, invented(spec, 0.2), SoftnessSettings::chosen());
  EXPECT_GE(apart.percent(), 95.0);
  EXPECT_EQ(apart.levels.counts.sum(), 26);
  EXPECT_EQ(apart.right_percent.size(), 13u);
  // All alike but for noise: 5 classes, 26 tests; more than 15 right by guessing once in 10,000.
  const SoftnessScore alike = tell_softness(spec, invented(spec, 0.0), SoftnessSettings::chosen());
  EXPECT_LE(alike.levels.counts.trace(), 15);
  SoftnessSettings unseen = SoftnessSettings::chosen();
  unseen.unseen_material = 7;
  EXPECT_EQ(tell_softness(spec, invented(spec, 0.2), unseen).levels.counts.sum(), 2);
  const PalpationRecording slower = downsampled(invented(spec, 0.2), 2);
  EXPECT_EQ(slower.rate_Hz, 250.0);
  EXPECT_EQ(slower.waveforms.front().force_N.size(), 250u);
}

}  // namespace
}  // namespace touchstone::lab
