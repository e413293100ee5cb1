#include "lab/dvs/dvs_row_recordings.h"

#include <array>
#include <map>
#include <mutex>
#include <string>

#include "core/locked_work.h"
#include "sim/sensor/membrane_camera.h"

namespace touchstone::lab {
namespace {

constexpr std::uint64_t kSeed = 4801;  // choices were made on the grasps of 4701
constexpr int kQuickGrasps = 4;

std::vector<DvsGraspParameters> grasps_of(const DvsGraspSetup& setup, bool quick, const DvsSpread& spread = {}) {
  std::vector<DvsGraspParameters> chosen;
  std::array<int, 4> of_each{};
  for (DvsGraspParameters grasp : setup.draw(kSeed, spread)) {
    if (quick && ++of_each.at(static_cast<std::size_t>(grasp.material)) > kQuickGrasps) continue;
    grasp.motion.rest_s = kDvsWatched_s;
    chosen.push_back(grasp);
  }
  return chosen;
}

/// made() once for each name.
DvsRecordings kept(const std::string& name, const auto& made) {
  static std::mutex mutex;
  static std::map<std::string, DvsRecordings> all;
  return locked_work(mutex, [&] {
    DvsRecordings& recordings = all[name];
    if (!recordings) recordings = std::make_shared<const std::vector<DvsRecording>>(made());
    return recordings;
  });
}

}  // namespace

DvsRecordings dvs_row_recordings(const ValidateOptions& options) {
  return kept((options.quick ? "quick " : "all ") + options.scenes.string(), [&] {
    const DvsGraspSetup setup(options.scenes, options.cache);
    const sim::MembraneCamera camera(setup.device());
    DvsRecordSettings settings = own_pixels(setup.device());
    const render::EventPixelSettings own = settings.pixels.front();
    settings.pixels.clear();
    for (const DvsPixelKind& kind : kDvsPixelKinds) {
      render::EventPixelSettings& pixels = settings.pixels.emplace_back(own);
      pixels.leak_rate_hz *= kind.noise;
      pixels.shot_rate_hz *= kind.noise;
      pixels.on_threshold *= kind.thresholds;
      pixels.off_threshold *= kind.thresholds;
      if (options.quick) break;
    }
    return record_dvs_grasps(setup, camera, grasps_of(setup, options.quick), settings, options.progress);
  });
}

DvsRecordings dvs_alike_recordings(const ValidateOptions& options, const std::string& name, const DvsSpread& spread) {
  return kept(name + " " + options.scenes.string(), [&] {
    const DvsGraspSetup setup(options.scenes, options.cache);
    const sim::MembraneCamera camera(setup.device());
    return record_dvs_grasps(setup, camera, grasps_of(setup, false, spread), own_pixels(setup.device()),
                             options.progress);
  });
}

}  // namespace touchstone::lab
