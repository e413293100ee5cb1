#include "sim/relief/relief.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "sim/files/image_file.h"
#include "sim/plan/plan.h"
#include "sim/scene/object.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sim {
namespace {

using ::testing::HasSubstr;

const std::string kProbe =
    "name: a\nshape: {type: rounded_cylinder, radius_mm: 3, edge_radius_mm: 0.3, height_mm: 6}\nrelief: ";

ObjectSpec object_with(const std::string& relief) {
  return parse_yaml<ObjectSpec>(kProbe + relief + "\n", "object.yaml");
}

std::string error_of(const std::string& relief) {
  try {
    contact_shape(object_with(relief));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

double height(const std::string& relief, double x, double y) {
  return relief_map(*object_with(relief).relief).at(x, y);
}

TEST(Relief, WavesRunAlongXFromTroughToCrest) {
  const std::string waves = "{type: waves, amplitude_um: 40, pitch_mm: 0.5}";
  EXPECT_NEAR(height(waves, 0.0, 0.3), 0.0, 1e-9);
  EXPECT_NEAR(height(waves, 0.25, -7.0), 0.04, 1e-8);
  EXPECT_NEAR(height(waves, 10.25, 1.0), 0.04, 1e-8);
}

TEST(Relief, AGridHasItsCrestsWhereBothWavesHave) {
  const std::string grid = "{type: grid, amplitude_um: 40, pitch_mm: 0.5}";
  EXPECT_NEAR(height(grid, 0.25, 0.25), 0.04, 1e-8);
  EXPECT_NEAR(height(grid, 0.25, 0.0), 0.02, 1e-8);
  EXPECT_NEAR(height(grid, 0.5, 1.0), 0.0, 1e-8);
}

TEST(Relief, AHairIsRoundAndAlone) {
  const std::string hair = "{type: hair, amplitude_um: 100}";
  EXPECT_NEAR(height(hair, 0.0, 0.3), 0.1, 2e-5);
  EXPECT_NEAR(height(hair, 0.03, 0.3), 0.05 + 0.04, 2e-4);
  EXPECT_EQ(height(hair, 0.06, 0.3), 0.0);
  EXPECT_EQ(height(hair, 1.0, 0.3), 0.0);
  const std::string cloth = "{type: hair, amplitude_um: 100, pitch_mm: 0.4}";
  EXPECT_NEAR(height(cloth, 1.2, 0.3), 0.1, 2e-4);
  EXPECT_EQ(height(cloth, 0.2, 0.3), 0.0);
}

TEST(Relief, APictureLiesAsItIsSeenThroughTheObject) {
  const test::TemporaryFolder folder;
  cv::Mat picture(4, 8, CV_16U, cv::Scalar(0));
  picture.at<std::uint16_t>(0, 7) = 65535;  // top right
  write_png(folder.path() / "r.png", picture);
  const auto file = folder.write("o.yaml", kProbe + "{type: image, amplitude_um: 50, file: r.png, size_mm: [4, 2]}\n");
  const fem::ReliefMap map = relief_map(*read_object(file).relief);
  EXPECT_NEAR(map.at(1.75, 0.75), 0.05, 1e-8);
  EXPECT_EQ(map.at(1.75, -0.75), 0.0);
  EXPECT_EQ(map.at(-1.75, 0.75), 0.0);
  EXPECT_EQ(map.at(5.0, 0.75), 0.0);
  EXPECT_NEAR(finest_detail(*read_object(file).relief), 1.0, 1e-12);
}

TEST(Relief, TakesOnlyItsOwnFieldsAndNamesWhatIsWrong) {
  EXPECT_EQ(error_of("{type: waves, amplitude_um: 40, pitch_mm: 0.5}"), "");
  EXPECT_THAT(error_of("{type: wave, amplitude_um: 40}"), HasSubstr("did you mean 'waves'"));
  EXPECT_THAT(error_of("{type: waves, amplitude_um: 40, file: a.png}"), HasSubstr("pitch_mm"));
  EXPECT_THAT(error_of("{type: waves, amplitude_um: -1, pitch_mm: 0.5}"), HasSubstr("-1 is not allowed"));
  EXPECT_THAT(error_of("{type: waves, amplitude_um: .nan, pitch_mm: 0.5}"), HasSubstr("amplitude_um"));
  EXPECT_THAT(error_of("{type: hair, amplitude_um: 100, pitch_mm: 0.05}"), HasSubstr("0.05 is not allowed"));
  const std::string missing = error_of("{type: image, amplitude_um: 40, size_mm: [1, 1], file: none.png}");
  EXPECT_THAT(missing, HasSubstr("object.yaml:3: relief.file: "));
  EXPECT_THAT(missing, HasSubstr("none.png"));
}

TEST(Relief, TheCoarseShapeHasItsMean) {
  const ObjectSpec object = object_with("{type: waves, amplitude_um: 40, pitch_mm: 0.1}");
  const fem::ContactShape coarse = coarse_contact_shape(object, 0.5);
  for (const double x : {0.0, 0.02, 0.05}) {
    EXPECT_NEAR(*fem::first_entry(coarse, {x, 0.2, -1.0}, Eigen::Vector3d::UnitZ()), 1.0 - 0.02, 1e-4);
  }
  const fem::ContactShape whole = contact_shape(object);
  EXPECT_NEAR(*fem::first_entry(whole, {0.05, 0.2, -1.0}, Eigen::Vector3d::UnitZ()), 1.0 - 0.04, 1e-7);
}

SceneSpec shipped_with(const std::string& relief) {
  SceneSpec scene = read_scene(std::filesystem::path(TOUCHSTONE_SOURCE_DIR) / "scenes/vhs/ball-press.yaml");
  scene.object.relief = object_with(relief).relief;
  return scene;
}

const Effect& effect(const Plan& plan, const std::string& name) {
  for (const Effect& one : plan.effects) {
    if (one.name == name) return one;
  }
  throw std::runtime_error("no effect " + name);
}

const char* const kFine = "{type: waves, amplitude_um: 40, pitch_mm: 0.3}";

TEST(Plan, FineDetailAndAPictureCallForFineRelief) {
  EXPECT_TRUE(make_plan(shipped_with(kFine)).fine_relief);
  SceneSpec smooth = shipped_with(kFine);
  smooth.object.relief.reset();
  EXPECT_FALSE(make_plan(smooth).fine_relief);
  EXPECT_FALSE(make_plan(shipped_with("{type: waves, amplitude_um: 40, pitch_mm: 4}")).fine_relief)
      << "the mesh can do that by itself";
}

TEST(Plan, TruthAloneCallsForNoFineReliefAndAHeightMapDoes) {
  SceneSpec scene = shipped_with(kFine);
  scene.outputs = {.frames = false};
  const Plan plan = make_plan(scene);
  EXPECT_FALSE(plan.fine_relief);
  EXPECT_EQ(effect(plan, "fine relief").cost, "nothing");
  scene.outputs.height = true;
  EXPECT_TRUE(make_plan(scene).fine_relief);
  EXPECT_FALSE(make_plan(scene).camera);
}

TEST(Plan, FineReliefIsSwitchedByTheScene) {
  SceneSpec scene = shipped_with(kFine);
  scene.effects.fine_relief = Switch::off;
  EXPECT_FALSE(make_plan(scene).fine_relief);
  EXPECT_THAT(effect(make_plan(scene), "fine relief").why, HasSubstr("switches it off"));
  scene.object.relief.reset();
  scene.effects.fine_relief = Switch::on;
  EXPECT_TRUE(make_plan(scene).fine_relief);
}

TEST(Plan, PixelsTooWideForTheReliefAreRefused) {
  SceneSpec scene = shipped_with("{type: waves, amplitude_um: 5, pitch_mm: 0.03}");
  try {
    make_plan(scene);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("membrane.pixel_um: 20 is too wide"));
  }
}

TEST(Relief, PrintIsAsHighAsItsInkAndReadsAlongX) {
  // A pen of 0.2 mm draws an L of 2 x 3 mm: its stem is on the left.
  const std::string print = "{type: print, amplitude_um: 60, text: L, letter_mm: 3, stroke_mm: 0.2}";
  EXPECT_NEAR(height(print, -1.0, 0.3), 0.06, 1e-7);
  EXPECT_NEAR(height(print, 0.5, 1.5), 0.06, 1e-7);
  EXPECT_EQ(height(print, 1.0, 0.3), 0.0);
  EXPECT_NEAR(height(print, -1.0 + 0.1 * (1.0 - 1.0 / 6.0), 0.3), 0.03, 0.004);  // half of the soft edge
  EXPECT_EQ(height(print, -0.88, 0.3), 0.0);
}

TEST(Relief, EveryLetterLeavesInkWithinItsCell) {
  for (const char letter : std::string("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-$")) {
    const PrintRelief print{50.0, std::string(1, letter), 2.0, 0.2, {}};
    const fem::ReliefMap map = relief_map(print);
    EXPECT_NEAR(map.highest(), 0.05, 1e-6) << letter;
    for (double y = -1.5; y < 1.5; y += 0.05) {
      EXPECT_EQ(map.at(0.9, y), 0.0) << letter;
      EXPECT_EQ(map.at(-0.9, y), 0.0) << letter;
    }
  }
}

TEST(Relief, PrintRefusesLettersThatThereArent) {
  EXPECT_THAT(error_of("{type: print, amplitude_um: 60, text: a}"), HasSubstr("there's no letter 'a'"));
  EXPECT_THAT(error_of("{type: print, amplitude_um: 60, text: ''}"), HasSubstr("has 0 letters"));
}

TEST(Relief, FingerprintsRidgesAreAsFarApartAsSaid) {
  // Without minutiae: along x from the core the phase grows by 2 pi a ridge.
  const FingerprintRelief print{80.0, 0.45, {12, 15}, 0, 1};
  const fem::ReliefMap map = relief_map(print);
  EXPECT_LE(map.highest(), 0.08 + 1e-7);
  for (int ridge = 2; ridge < 8; ++ridge) {
    EXPECT_NEAR(map.at(0.45 * ridge, 0.0), 0.08, 0.002) << ridge;
    EXPECT_NEAR(map.at(0.45 * (ridge + 0.5), 0.0), 0.0, 0.002) << ridge;
  }
  EXPECT_EQ(map.at(6.2, 0.0), 0.0) << "it fades out";
  EXPECT_EQ(map.at(0.0, 7.6), 0.0);
}

TEST(Relief, MinutiaeChangeThePrintAndLieWhereTheSeedSays) {
  const auto difference = [](const FingerprintRelief& one, const FingerprintRelief& other) {
    const fem::ReliefMap a = relief_map(one);
    const fem::ReliefMap b = relief_map(other);
    double sum = 0.0;
    for (double x = -4.0; x < 4.0; x += 0.1) sum += std::abs(a.at(x, 2.0) - b.at(x, 2.0));
    return sum / 80.0;
  };
  const FingerprintRelief whole{80.0, 0.45, {12, 15}, 0, 1};
  const FingerprintRelief broken{80.0, 0.45, {12, 15}, 1, 1};
  const FingerprintRelief elsewhere{80.0, 0.45, {12, 15}, 1, 2};
  EXPECT_GT(difference(whole, broken), 0.01);
  EXPECT_GT(difference(broken, elsewhere), 0.01);
  EXPECT_EQ(difference(broken, broken), 0.0);
}

}  // namespace
}  // namespace touchstone::sim
