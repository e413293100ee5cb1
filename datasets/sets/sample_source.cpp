#include "datasets/sets/sample_source.h"

#include "core/error.h"
#include "sim/view/membrane.h"

namespace touchstone::datasets {

SampleSource simulator(const std::filesystem::path& cache_folder) {
  SampleSource source;
  source.set_up_gel = [cache_folder](const sim::DeviceSpec& device, const Progress& progress) {
    return sim::set_up_gel(device, cache_folder, progress);
  };
  source.play_motion = [cache_folder](const sim::SceneSpec& scene, const sim::Plan& plan, const fem::Compliance& gel,
                                      const Progress& progress) {
    const auto vibration = sim::set_up_vibration(scene, plan, cache_folder);
    const auto elastic = sim::set_up_elastic_objects(scene, plan, cache_folder);
    return sim::play_motion(scene, plan, gel, progress, vibration.get(), elastic);
  };
  source.set_up_camera = [](const sim::SceneSpec& scene, const sim::Plan& plan,
                            std::shared_ptr<const fem::Compliance> gel, std::span<const sim::Truth> truths) {
    if (!plan.camera) {
      TS_ASSERT(scene.outputs.height);
      auto membrane = std::make_shared<const sim::Membrane>(scene, plan, *gel);
      return SampleSource::Camera([membrane, gel](const sim::Truth& truth) {
        sim::Capture capture;
        capture.height = membrane->height(truth.press, membrane->relief(truth.press));
        return capture;
      });
    }
    auto camera = std::make_shared<const sim::VirtualCamera>(scene, plan, *gel, truths);
    return SampleSource::Camera([camera](const sim::Truth& truth) { return camera->capture(truth); });
  };
  source.watch_events = [cache_folder](const sim::SceneSpec& scene, const sim::Plan& plan, const fem::Compliance& gel,
                                       std::uint64_t noise_seed, const sim::EventSink& sink, const Progress& progress) {
    const auto vibration = sim::set_up_vibration(scene, plan, cache_folder);
    const auto elastic = sim::set_up_elastic_objects(scene, plan, cache_folder);
    return sim::watch_events(scene, plan, gel, noise_seed, sink, progress, vibration.get(), elastic);
  };
  return source;
}

}  // namespace touchstone::datasets
