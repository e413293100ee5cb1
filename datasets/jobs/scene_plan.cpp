#include "datasets/jobs/scene_plan.h"

#include "datasets/jobs/input_files.h"
#include "sim/need/scene_needs.h"

namespace touchstone::datasets {

sim::Plan plan_scene(const sim::SceneSpec& scene, const std::filesystem::path& cache, const Progress& progress) {
  if (!scene.accuracy && !scene.device.accuracy) return sim::make_plan(scene);
  std::string key = fmt::format("seed {}, pictures {}, events {}, height {}, lamps {}\n", scene.seed,
                                scene.outputs.light() || scene.outputs.first_hits(), scene.outputs.events,
                                scene.outputs.height, scene.lamp_level);
  for (const sim::MovedObject& moved : sim::moved_objects(scene)) {
    const Eigen::Vector3d& start = moved.motion.start_mm;
    key += fmt::format("from {} {} {}\n", start.x(), start.y(), start.z());
  }
  for (const InputFile& file : input_files(scene.where.file)) key += fmt::format("{}  {}\n", file.sha256, file.name);
  return sim::plan_by_need(scene, key, cache, progress);
}

void plan_by_need(PreparedJob& job, const std::filesystem::path& cache, const Progress& progress) {
  for (PreparedScene& scene : job.scenes) {
    if (scene.spec.accuracy || scene.spec.device.accuracy) scene.plan = plan_scene(scene.spec, cache, progress);
  }
}

}  // namespace touchstone::datasets
