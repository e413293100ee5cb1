// Devices, objects, motions, scenes, jobs and what palpation asks for: each text is taken for every kind of them.

#include "core/yaml_reader.h"
#include "datasets/jobs/draw.h"
#include "datasets/jobs/job.h"
#include "lab/vhs/palpation_spec.h"
#include "sim/scene/device.h"
#include "sim/scene/motion.h"
#include "sim/scene/object.h"
#include "sim/scene/scene.h"
#include "tests/fuzz/fuzz_target.h"

namespace touchstone::fuzz {
namespace {

/// Where the text is taken to stand: files that it names are found from there.
constexpr const char* kPlace = TOUCHSTONE_SOURCE_DIR "/scenes/vhs/fuzz.yaml";
constexpr const char* kPlaceOfDevices = TOUCHSTONE_SOURCE_DIR "/scenes/devices/fuzz.yaml";

template <typename Spec>
bool parses(const std::string& text, const char* place = kPlace) {
  return gives_result([&] { parse_yaml<Spec>(text, place); });
}

}  // namespace

bool reads(std::string_view bytes) {
  const std::string text(bytes);
  const bool of_a_scene =
      parses<sim::DeviceSpec>(text, kPlaceOfDevices) | parses<sim::ObjectSpec>(text) | parses<sim::SceneSpec>(text);
  const bool motion = gives_result([&] { TS_ASSERT(parse_yaml<sim::MotionSpec>(text, kPlace).frame_count() > 0); });
  return of_a_scene | motion | parses<datasets::Job>(text) | parses<datasets::DrawJob>(text) |
         parses<lab::PalpationSpec>(text);
}

}  // namespace touchstone::fuzz
