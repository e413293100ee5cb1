// Material recognition of [Li2015, sec. 5.3.2, table 5.2]: 40 surfaces, six presses of each, four squares of 200 x 200
// px of each press. The device is calibrated by ball presses as a user would; frames are made with noise; heights are
// estimated from frames. Nothing is tuned on these samples: the operator is the thesis's, the height of a gray level is
// fixed below.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <utility>
#include <vector>

#include "core/seconds_since.h"
#include "lab/gelsight/gelsight_texture_experiment.h"
#include "lab/validation/validation.h"

namespace touchstone::lab {
namespace {

constexpr sensors::TextureOperator kWide{{16, 2.0}, 4};
constexpr sensors::TextureOperator kNarrow{{8, 1.0}, 4};
constexpr double kGrayStep_mm = 0.002;  // chosen before any sample was made: far below every surface's relief
constexpr std::uint64_t kSeed = 1;
constexpr int kSquares = 4;

/// In the quick form: some of each kind, with the ones that are hard to distinguish.
std::vector<sim::ObjectSpec> some_of(const std::vector<sim::ObjectSpec>& objects) {
  std::vector<sim::ObjectSpec> some;
  for (const sim::ObjectSpec& object : objects) {
    for (const char* name :
         {"fabric-denim", "fabric-denim-light", "foam-eva", "sandpaper-p120", "sandpaper-p150", "wood-oak"}) {
      if (object.name == name) some.push_back(object);
    }
  }
  return some;
}

struct Row {
  const char* id;
  sensors::TextureOperator op;
  int training;  // of 24
  TextureSplit split;
  double published;
  bool membrane = false;  // not as the sensor sees them: the true membrane's heights
};

constexpr Row kRows[] = {
    {"gelsight.texture.mlbp_16_2_percent", kWide, 12, TextureSplit::by_sample, 99.79},
    {"gelsight.texture.mlbp_8_1_percent", kNarrow, 12, TextureSplit::by_sample, 98.96},
    {"gelsight.texture.mlbp_16_2_train8_percent", kWide, 8, TextureSplit::by_sample, 99.22},
    {"gelsight.texture.mlbp_8_1_train8_percent", kNarrow, 8, TextureSplit::by_sample, 98.12},
    {"gelsight.texture.mlbp_16_2_train16_percent", kWide, 16, TextureSplit::by_sample, 99.69},
    {"gelsight.texture.mlbp_8_1_train16_percent", kNarrow, 16, TextureSplit::by_sample, 99.38},
    {"gelsight.texture.mlbp_16_2_held_out_percent", kWide, 12, TextureSplit::by_image, 99.79},
    {"gelsight.texture.mlbp_8_1_held_out_percent", kNarrow, 12, TextureSplit::by_image, 98.96},
    {"gelsight.texture.membrane_16_2_percent", kWide, 12, TextureSplit::by_sample, 99.79, true},
    {"gelsight.texture.membrane_8_1_percent", kNarrow, 12, TextureSplit::by_sample, 98.96, true},
};

}  // namespace

std::vector<ValidationRow> validate_gelsight_texture(const ValidateOptions& options) {
  const auto begun = std::chrono::steady_clock::now();
  sim::VirtualSensorSettings how;
  how.seed = kSeed;
  how.deepest_mm = 1.0;
  how.membrane_um = 30.0;  // of the fine contact; a pixel of the camera sees 19 um
  how.edge_side = 1;       // every pixel of a texture differs from the next
  sim::DeviceSpec device = sim::read_device(options.scenes / "devices" / "gelsight-portable.yaml");
  // All samples are cut from the middle of the picture: the imager reads out no more than that.
  device.camera->width = device.camera->height = kTextureView_px;
  const sim::VirtualSensor sensor(std::move(device), options.cache, how);
  const HeightsOf heights = estimated_heights(sensor, calibrate_view(sensor, kSeed), kSeed);

  std::vector<sim::ObjectSpec> objects = texture_objects(options.scenes);
  if (options.quick) objects = some_of(objects);
  TexturePresses presses;
  presses.seed = kSeed;
  if (options.quick) presses.images = 2;
  const TextureSamples samples = texture_samples(sensor, objects, presses, heights, options.progress);
  const int of_a_class = kSquares * presses.images;

  std::vector<ValidationRow> rows;
  for (const Row& row : kRows) {
    constexpr int kSplits = 100;
    constexpr int kFullClass = 24;
    int training = row.training * of_a_class / kFullClass;
    if (row.split == TextureSplit::by_image) training = kSquares * std::max(1, training / kSquares);
    const TextureScore score = score_textures(row.membrane ? samples.membrane : samples.estimated, row.op, kGrayStep_mm,
                                              training, row.split, kSplits, kSeed);
    ValidationRow result;
    result.id = std::string(row.id);
    std::vector<std::string> names;
    for (const sim::ObjectSpec& object : objects) names.push_back(object.name);
    const std::vector<std::string> wrong = worst_confusions(score.confusion, names, 3);
    result.title = fmt::format(
        "{} textures right{}, ({}, {}), {} of {} samples a class train{}, mean of {} splits ({:.2f} to {:.2f}){}{}",
        objects.size(), row.membrane ? " by the membrane's true heights" : "", row.op.circle.neighbours,
        row.op.circle.radius_px, training, of_a_class,
        row.split == TextureSplit::by_image ? ", whole presses held out (stricter than the thesis)" : "", kSplits,
        score.worst, score.best, wrong.empty() ? "" : "; most mistaken: ", fmt::join(wrong, ", "));
    result.unit = std::string("%");
    result.published = row.published;
    result.ours = score.percent;
    result.ci95 = {score.percent - kNormal95 * score.standard_error, score.percent + kNormal95 * score.standard_error};
    result.better = Better::higher;
    result.holds = score.percent >= row.published;
    result.quick = options.quick;
    result.seconds = seconds_since(begun);
    rows.push_back(result);
  }
  return rows;
}

}  // namespace touchstone::lab
